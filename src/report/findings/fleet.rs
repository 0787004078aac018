//! Sentences for what `fleet` finds.

use crate::screening::Finding;
use crate::unit::short;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    let subject = &finding.subject;
    let sentence = match finding.code {
        "lacks_usual_effect" => format!(
            "`{subject}` is not named here, as it is in {} of {} benches",
            finding.count("benches"),
            finding.count("of")
        ),
        "has_rare_effect" => {
            format!(
                "`{subject}` is named here, and in {} of {} benches",
                finding.count("benches"),
                finding.count("of")
            )
        }
        "parameter_unlike_others" => format!(
            "`{subject}` is {} {unit}, the median of the benches {} {unit}",
            short(finding.number("value")),
            short(finding.number("median")),
            unit = finding.text("unit")
        ),
        "answers_not_of_the_plan" => format!(
            "left out, as they are of other inputs than the plan's, or of a bench that it does not name: {}",
            finding.texts("files").join(", ")
        ),
        "answers_of_one_bench" => format!(
            "{subject} has {} answers, of different inputs; give `--plan` to merge those of today's inputs only",
            finding.count("answers")
        ),
        _ => return None,
    };
    Some(sentence)
}
