//! What a voltage that is read in steps is made of.

use crate::estimation::hats::hats;

/// Hats over time, and the load.
pub(crate) struct VoltageColumns<'a> {
    /// [s]
    pub time: &'a [f64],
    /// [-] what draws on the battery, over its mean, where it moves.
    pub load: Option<Vec<f64>>,
    /// Hats over all of the time, less one.
    pub bends: usize,
}

impl VoltageColumns<'_> {
    pub fn count(&self) -> usize {
        self.bends + 1 + usize::from(self.load.is_some())
    }

    /// [s] all of the log.
    pub fn span(&self) -> f64 {
        self.time[self.time.len() - 1] - self.time[0]
    }

    /// The columns that are not zero.
    pub fn at(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let place = (self.time[row] - self.time[0]) / self.span() * self.bends as f64;
        let load = self.load.as_ref().map(|load| (self.bends + 1, load[row]));
        hats(place, self.bends).into_iter().chain(load)
    }
}
