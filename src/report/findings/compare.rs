//! Sentences for what `compare` finds.

use crate::screening::Finding;

/// The sentence of a finding of this room.
pub(crate) fn sentence(_finding: &Finding) -> Option<String> {
    None
}
