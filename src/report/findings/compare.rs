//! Sentences for what `compare` finds.

use crate::screening::Finding;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    let sentence = match finding.code {
        "related_on_part" => format!(
            "a long log: what an error depends on was looked for in {} of its {} rows, scattered over all of it, and what it follows in \
             time in {} stretches of as many; the errors themselves are of all rows",
            finding.count("rows_related"),
            finding.count("rows_scored"),
            finding.count("stretches")
        ),
        _ => return None,
    };
    Some(sentence)
}
