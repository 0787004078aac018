//! Sentences for what a log looks like.

use super::super::numbers::counted;
use crate::screening::Finding;
use crate::unit::short;

/// What a log looks like.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let (name, count) = (&finding.subject, finding.count("count"));
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "holes" => format!(
            "{} in time (rows are {:.1} ms apart, the longest hole is {:.0} ms): {} at up-steps of a command, {} at down-steps",
            counted(count, "hole"),
            1e3 * number("interval_s"),
            1e3 * number("longest_s"),
            finding.count("at_up_steps"),
            finding.count("at_down_steps")
        ),
        "starts_from_standstill" => format!(
            "{} from standstill, the first at {:.3} s: what happens there is not in the model's range",
            counted(count, "start"),
            number("first_s")
        ),
        "constant" => format!("`{name}` is {} throughout", short(number("value"))),
        "perhaps_frozen" => format!(
            "`{name}` is frozen {}, longest for {:.3} s from {:.3} s at {}",
            counted(count, "time"),
            number("longest_s"),
            number("from_s"),
            short(number("value"))
        ),
        "perhaps_saturated" => format!(
            "`{name}` is saturated at {}: {} samples stand there",
            short(number("at")),
            finding.count("samples")
        ),
        "dropouts" => format!(
            "`{name}` drops out {}, longest for {:.3} s from {:.3} s",
            counted(count, "time"),
            number("longest_s"),
            number("from_s")
        ),
        _ => return None,
    };
    Some(said)
}
