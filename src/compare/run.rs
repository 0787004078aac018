//! How a block is run.

/// How a block was run; words in the JSON.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RunMode {
    /// From the first row of each stretch without a hole.
    Free,
    /// Anew in windows of so many seconds, from the measured state.
    Windows(f64),
    /// Sample by sample: it has no memory.
    EachSample,
    /// Measured and modelled smoothed over the same rows.
    Smoothed,
}
