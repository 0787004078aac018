//! Sentences for cells that are no measurements.

use super::super::numbers::digits;
use crate::screening::Finding;
use crate::unit::short;

/// Cells that are no measurements.
pub(super) fn sentence(finding: &Finding) -> Option<String> {
    let (name, rows) = (&finding.subject, finding.rows);
    let number = |name: &str| finding.number(name);
    let said = match finding.code {
        "rate_dropout" => format!(
            "`{name}` reads exactly 0 in {rows} rows in which the rotor was commanded to turn, first at {:.2} s: a dropout of the \
             telemetry, or a rotor that stood; taken as missing",
            number("first_s")
        ),
        "rate_frozen" => format!(
            "`{name}` reads exactly {} rad/s from {:.1} to {:.1} s while the command changes (from {} to {}){}: it was not \
             measured there (a sensor or a recorder that froze, a wrong column, a rotor at its limit); {rows} samples are left \
             out",
            short(number("value")),
            number("from_s"),
            number("to_s"),
            short(number("least_command")),
            short(number("greatest_command")),
            more_places(finding)
        ),
        "battery_dropout" => format!(
            "`{name}`: {rows} readings below {} V or over {} V (the middle one is {} V), which no battery has that turns a rotor: \
             they count as missing",
            short(number("least_v")),
            digits(number("most_v"), 4),
            digits(number("middle_v"), 4)
        ),
        "sample_and_hold" => {
            let (least, most) = (finding.count("least_rows"), finding.count("most_rows"));
            let stands = if least == most {
                format!("every reading stands in {most} rows")
            } else {
                format!("readings stand in {least} to {most} rows")
            };
            format!(
                "`{name}`: {stands} (sample-and-hold), fresh ones come at {} Hz in a log of {} Hz; the {rows} cells that repeat \
                 one are no measurements, and what fits a model takes them as missing",
                digits(number("interval_s").recip(), 3),
                digits(number("log_interval_s").recip(), 3)
            )
        }
        "saturated" => format!(
            "`{name}` is saturated at {}: {rows} of {} readings stand there, and how far it really went is not known; what fits \
             a model takes them as missing, and the reading on either side of each stay there; record with a wider range, or \
             drive less",
            ends(finding),
            finding.count("readings")
        ),
        "gyro_frozen" => format!(
            "`{name}` is frozen from {:.1} to {:.1} s at {}{}: it was not measured there, and what fits a model takes the {rows} \
             readings as missing",
            number("from_s"),
            number("to_s"),
            digits(number("value"), 4),
            more_places(finding)
        ),
        "outliers" => format!(
            "`{name}`: {} far from the neighbours, the first at {:.2} s ({}): no measurements, and what fits a model takes them \
             as missing",
            if rows == 1 { "1 outlier lies".to_owned() } else { format!("{rows} outliers lie") },
            number("first_s"),
            digits(number("first"), 4)
        ),
        "too_many_outliers" => format!(
            "`{name}`: {rows} of {} readings lie far from their neighbours, the first at {:.2} s ({}): too many for single \
             outliers, and they are left in",
            finding.count("readings"),
            number("first_s"),
            digits(number("first"), 4)
        ),
        _ => return None,
    };
    Some(said)
}

pub(super) fn more_places(finding: &Finding) -> String {
    match finding.count("places") {
        0 | 1 => String::new(),
        places => format!(", and in {} more places", places - 1),
    }
}

/// The ends of a range at which a channel is saturated.
fn ends(finding: &Finding) -> String {
    finding.numbers("at").iter().map(|at| digits(*at, 4)).collect::<Vec<_>>().join(" and ")
}
