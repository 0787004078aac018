//! What a search tells of its progress.

/// Something that a search has come to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SearchEvent<'a> {
    /// One more candidate was fitted.
    Fitted,
    /// These effects, fitted to the end, leave so much.
    Tried {
        /// Ids.
        effects: &'a [String],
        /// [-] rms of the held-out residual over the noise's.
        over_noise: f64,
    },
    /// These effects are the best set so far.
    Leading(&'a [String]),
}
