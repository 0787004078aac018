//! Which way the scored transients go: a log that shows rotors slowing down only says nothing of how they speed up.

use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use crate::effect::step_response;

/// Scored rows on the way to a new level, by the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Directions {
    /// Rows on the way up.
    pub(crate) rising: usize,
    /// Rows on the way down.
    pub(crate) falling: usize,
    /// Rows that are not at rest, however near the level is.
    pub(crate) moving: usize,
    /// All of them.
    pub(crate) scored: usize,
}

impl Directions {
    /// Of runs of rotors whose pole is about `pole` [rad/s]: a row is on its way where the command, and the command as that lag
    /// follows it, are apart.
    pub(crate) fn of(runs: &[RotorRun], pole: f64) -> Self {
        let mut found = Self::default();
        for run in runs {
            let mut followed = run.command.first().copied().unwrap_or(0.0);
            for row in 1..run.time.len() {
                let span = run.time[row] - run.time[row - 1];
                followed += (run.command[row - 1] - followed) * step_response(pole, span);
                let way = run.command[row] - followed;
                if run.counts[row] && run.measured[row].is_finite() {
                    found.scored += 1;
                    found.rising += usize::from(way > THRESHOLDS.transient_way);
                    found.falling += usize::from(way < -THRESHOLDS.transient_way);
                    found.moving += usize::from(way.abs() > THRESHOLDS.resting_way);
                }
            }
        }
        found
    }

    /// Whether the rotors are at rest throughout: such rows say nothing of how a rotor follows its command. Of too few rows that is not
    /// asked.
    pub(crate) fn are_at_rest(self) -> bool {
        self.scored >= THRESHOLDS.fewest_samples && self.moving < THRESHOLDS.fewest_moving_rows
    }

    /// Whether nearly all go one way.
    pub(crate) fn is_one_way(self) -> bool {
        let (less, more) = (self.rising.min(self.falling), self.rising.max(self.falling));
        more >= THRESHOLDS.fewest_transient_rows
            && (less as f64) < THRESHOLDS.least_direction_share * (less + more) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::log::Dataset;

    /// Steps between two levels, each held for a second; the logger stalls behind those up where it `stalls`.
    fn directions(stalls: bool) -> Directions {
        let level = |row: usize| 0.4 + 0.2 * (row / 100 % 2) as f64;
        let hidden = |row: usize| stalls && row % 200 >= 100 && row % 200 < 130;
        let rows: Vec<usize> = (0..2000).filter(|row| !hidden(*row)).collect();
        let mut log =
            Dataset::new("here", "", rows.iter().map(|row| 0.01 * *row as f64).collect()).expect("rises");
        log.insert("command_1", rows.iter().map(|row| level(*row)).collect()).expect("fits");
        let rates = rows.iter().map(|row| 1200.0 * level(*row)).collect();
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
        Directions::of(&rotor_runs(&[log.into()]), 16.0)
    }

    #[test]
    fn up_steps_that_the_logger_missed_leave_one_way() {
        let both = directions(false);
        assert!(
            both.rising.abs_diff(both.falling) <= 20 && both.rising > 100 && !both.is_one_way(),
            "{both:?}"
        );
        let down = directions(true);
        assert!(down.rising == 0 && down.falling > 100 && down.is_one_way(), "{down:?}");
    }

    /// A logger that stalls at every step leaves levels; commands that move a little all the time do not rest.
    #[test]
    fn levels_at_rest_are_no_transients() {
        let at_rest = |command: &dyn Fn(usize) -> f64, is_logged: &dyn Fn(usize) -> bool| {
            let rows: Vec<usize> = (0..2000).filter(|row| is_logged(*row)).collect();
            let mut log =
                Dataset::new("here", "", rows.iter().map(|row| 0.01 * *row as f64).collect()).expect("rises");
            log.insert("command_1", rows.iter().map(|row| command(*row)).collect()).expect("fits");
            let rates = rows.iter().map(|row| 1200.0 * command(*row)).collect();
            log.insert("propeller_rate_1_rad_s", rates).expect("fits");
            Directions::of(&rotor_runs(&[log.into()]), 16.0).are_at_rest()
        };
        let levels = |row: usize| 0.4 + 0.2 * (row / 100 % 2) as f64;
        assert!(!at_rest(&levels, &|_| true));
        assert!(at_rest(&levels, &|row| row % 100 >= 30), "each step is in a hole");
        assert!(!at_rest(&levels, &|row| row % 100 >= 30 || row < 120), "but for one");
        assert!(!at_rest(&|row| 0.45 + 0.006 * (0.05 * row as f64).sin(), &|_| true));
    }

    #[test]
    fn few_rows_or_a_twentieth_of_the_other_way_are_no_reason() {
        let is_one_way =
            |rising, falling| Directions { rising, falling, ..Directions::default() }.is_one_way();
        assert!(is_one_way(4, 96) && is_one_way(96, 4) && !is_one_way(5, 95));
        assert!(!is_one_way(0, THRESHOLDS.fewest_transient_rows - 1) && !is_one_way(0, 0));
    }
}
