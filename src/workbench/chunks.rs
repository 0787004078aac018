//! What of a curve need not be looked at again: of each run of so many samples its extremes and where they are, how many there
//! are, and their sums. Taken once; a picture of millions of samples is then made of thousands of these, and of the samples at
//! the edges of its columns of pixels.

use std::ops::Range;

use super::thresholds::THRESHOLDS;

/// What a run of samples holds, of those that are numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ChunkSummary {
    pub samples: usize,
    /// The least value and the number of its sample, the first of several; the same of the greatest.
    pub least: (f64, usize),
    pub greatest: (f64, usize),
    /// The first value, and the last one.
    pub ends: (f64, f64),
    pub sum: f64,
    pub squares: f64,
}

impl ChunkSummary {
    pub fn take(&mut self, sample: usize, value: f64) {
        if value.is_finite() {
            let here = (value, sample);
            let ends = (value, value);
            let (sum, squares) = (value, value * value);
            self.join(&Self { samples: 1, least: here, greatest: here, ends, sum, squares });
        }
    }

    /// With the run of samples behind it.
    pub fn join(&mut self, behind: &Self) {
        if self.samples == 0 || behind.samples == 0 {
            if self.samples == 0 {
                *self = *behind;
            }
            return;
        }
        self.samples += behind.samples;
        if behind.least.0 < self.least.0 {
            self.least = behind.least;
        }
        if behind.greatest.0 > self.greatest.0 {
            self.greatest = behind.greatest;
        }
        self.ends.1 = behind.ends.1;
        self.sum += behind.sum;
        self.squares += behind.squares;
    }
}

/// Every run of a curve, whole.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Chunks(Vec<ChunkSummary>);

impl Chunks {
    /// Of all samples of a curve, in their order.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut chunks = Vec::new();
        for (sample, value) in values.enumerate() {
            if sample.is_multiple_of(THRESHOLDS.chunk) {
                chunks.push(ChunkSummary::default());
            }
            if let Some(last) = chunks.last_mut() {
                last.take(sample, value);
            }
        }
        Self(chunks)
    }

    /// What lies in a run that begins and ends where it does; `None` where it is not whole.
    pub fn whole(&self, samples: &Range<usize>) -> Option<&ChunkSummary> {
        let is_whole = samples.start.is_multiple_of(THRESHOLDS.chunk) && samples.len() == THRESHOLDS.chunk;
        self.0.get(samples.start / THRESHOLDS.chunk).filter(|_| is_whole)
    }
}

/// Samples parted where chunks begin.
pub(super) fn parted(samples: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let mut from = samples.start;
    std::iter::from_fn(move || {
        let to = ((from / THRESHOLDS.chunk + 1) * THRESHOLDS.chunk).min(samples.end);
        let part = (from < samples.end).then_some(from..to);
        from = to;
        part
    })
}
