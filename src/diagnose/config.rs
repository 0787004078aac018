//! Settings of a diagnosis.

use super::thresholds::THRESHOLDS;

/// Settings of a diagnosis.
///
/// ```
/// use rotorbench::diagnose::DiagnoseConfig;
///
/// let config = DiagnoseConfig { horizon: 0.2, ..DiagnoseConfig::default() }; // [s] an unstable body
/// assert!(config.horizon < DiagnoseConfig::default().horizon);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnoseConfig {
    /// [s] length of the windows over which the body runs freely.
    pub horizon: f64,
    /// Rows that a search goes over at least; of logs with more than twice as many it sees stretches, and all rows decide in the end.
    pub searched_rows: usize,
}

impl DiagnoseConfig {
    /// The same where it is asked of so many rotors, each by itself: a search of each goes over its share of the rows.
    #[must_use]
    pub(crate) fn of_each(&self, rotors: usize) -> Self {
        let share = self.searched_rows / rotors.max(1);
        let rows = share.max(THRESHOLDS.searched_rows_of_each).min(self.searched_rows);
        Self { searched_rows: rows, ..self.clone() }
    }
}

impl Default for DiagnoseConfig {
    fn default() -> Self {
        // Long enough for weak torques to add up, short enough for an unstable body: facts of real benches.
        Self { horizon: 0.4, searched_rows: THRESHOLDS.searched_rows }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotors_share_the_rows_of_a_search_and_each_keeps_enough() {
        let rows = |searched_rows, rotors| {
            DiagnoseConfig { searched_rows, ..DiagnoseConfig::default() }.of_each(rotors).searched_rows
        };
        let least = THRESHOLDS.searched_rows_of_each;
        assert_eq!(rows(3 * least, 1), 3 * least);
        assert_eq!(rows(4 * least, 2), 2 * least);
        assert_eq!(rows(3 * least, 8), least);
        assert_eq!(rows(least / 2, 8), least / 2, "fewer were asked for");
    }
}
