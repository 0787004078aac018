//! What a search tells of its progress.

/// Something that a search has come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event<'a> {
    /// One more candidate was fitted.
    Fitted,
    /// These effects are the best set so far.
    Leading(&'a [String]),
}
