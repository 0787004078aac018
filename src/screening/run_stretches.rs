//! Where a simulation of a rotor starts anew, which is another question than which rows count: also a row that does not count
//! has a command, and is simulated.

use std::ops::Range;

use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::median_step;

impl RotorLog {
    /// The stretches of known commands, joined across holes over which the command is known, too: it is the same on both
    /// sides, and the hole is short beside the time for which commands are held. For who fits where a stretch starts: each
    /// start that is not needed takes away of what the data say.
    pub(crate) fn run_stretches(&self) -> Vec<Range<usize>> {
        let changes: Vec<f64> = (1..self.time.len())
            .filter(|row| {
                let pair = [self.command[row - 1], self.command[*row]];
                pair[0] != pair[1] && pair.iter().all(|command| command.is_finite())
            })
            .map(|row| self.time[row])
            .collect();
        let held = median_step(changes).unwrap_or(0.0);
        let short = THRESHOLDS.short_hole * held;
        let is_known = |before: usize, after: usize| {
            self.is_hole(before)
                && self.command[before] == self.command[after]
                && self.time[after] - self.time[before] < short
        };
        let mut joined: Vec<Range<usize>> = Vec::new();
        for rows in &self.stretches {
            match joined
                .last_mut()
                .filter(|last| last.end == rows.start && is_known(last.end - 1, rows.start))
            {
                Some(last) => last.end = rows.end,
                None => joined.push(rows.clone()),
            }
        }
        joined
    }

    /// The runs, and the rows with a rate of those that are none: too few rows, or readings, for a run whose start has to be found
    /// from them, too. The rotor's model goes on through them; `measured` [rad/s] are the rates as they were measured.
    pub(crate) fn split_runs(&self, measured: &[f64]) -> (Vec<Range<usize>>, Vec<usize>) {
        let is_long = |rows: &Range<usize>| {
            let readings = measured.get(rows.clone()).unwrap_or_default().iter();
            readings.filter(|rate| rate.is_finite()).count() >= THRESHOLDS.fewest_in_run
        };
        let (runs, short): (Vec<_>, Vec<_>) = self.run_stretches().into_iter().partition(is_long);
        (runs, short.into_iter().flatten().filter(|row| self.rate[*row].is_finite()).collect())
    }
}

#[cfg(test)]
mod tests {
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::log_with_hole as log;

    #[test]
    fn of_a_run_of_four_readings_none_is_scored() {
        let found = |rows: usize| {
            let mut log = log(900, &[100, 300, 500, 700], 2000);
            let mut commands = log.column("command_1").expect("there").to_vec();
            // Between two places at which commands are missing.
            commands[300..304].fill(f64::NAN);
            commands[304 + rows..520].fill(f64::NAN);
            log.replace("command_1", commands).expect("fits");
            let rotor = ScreenedLog::of(&log).rotor(1).expect("a rotor").clone();
            (rotor.runs().len(), rotor.is_scored(305), rotor.reason(305))
        };
        // The row behind the last command of the run still answers to it.
        assert_eq!(found(3), (2, false, Some("short_run")));
        assert_eq!(found(4), (3, true, None));
    }

    #[test]
    fn a_run_goes_on_across_a_hole_only_where_the_command_is_known() {
        let steps = [100, 300, 500, 700];
        let rows = |log: Dataset| ScreenedLog::of(&log).rotor(1).expect("a rotor").data().run_stretches();
        // Levels of 2 s: a hole of 90 ms inside one is bridged.
        assert_eq!(rows(log(900, &steps, 350)), std::slice::from_ref(&(0..900)));
        // The command changed in the hole, nobody knows when: the first reading behind it may be from before.
        assert_eq!(rows(log(900, &steps, 299)), [0..300, 301..900]);
        // Levels of 50 ms: in a hole of 90 ms the command may have gone and come back.
        let often: Vec<usize> = (0..180).map(|index| 5 * index).collect();
        assert_eq!(rows(log(900, &often, 352)), [0..353, 353..900]);
    }
}
