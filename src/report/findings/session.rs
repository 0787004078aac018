//! Sentences for what `session` finds.

use crate::screening::Finding;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    match finding.code {
        "refitted_above_noise_floor" => Some(format!(
            "other numbers leave {:.1} times what noise alone would: they make up for something that is missing; `rotorbench \
             diagnose` looks for it",
            finding.number("error_over_noise_floor")
        )),
        _ => None,
    }
}
