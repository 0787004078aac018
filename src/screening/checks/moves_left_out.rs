//! Most of what a command does is in rows that are left out: what a model says of the others may not hold there.

use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog};
use crate::screening::thresholds::THRESHOLDS;

/// Finds out how much of what the command moves is in rows at which the rotor stands or starts.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let (left_out, whole) = ways(&rotor.data, &rotor.at_rest);
    // What flickers is no move.
    let is_most = left_out > THRESHOLDS.least_way && left_out > THRESHOLDS.moves_left_out * whole;
    let finding = rotor.data.finding("moves_left_out").with("share", left_out / whole);
    (rotor.is_measured() && is_most).then(|| Judgement::new(finding, Vec::new()))
}

/// \[-\] the way that the command goes up and down between commands that turn the rotor: in these rows, and in all.
fn ways(data: &RotorLog, at_rest: &[usize]) -> (f64, f64) {
    let turns = |row: usize| data.command[row] >= LEAST_COMMAND;
    let moved = |row: usize| {
        let is_known = row > 0 && turns(row) && turns(row - 1);
        if is_known { (data.command[row] - data.command[row - 1]).abs() } else { 0.0 }
    };
    let way = |rows: &mut dyn Iterator<Item = usize>| rows.map(moved).sum::<f64>();
    (way(&mut at_rest.iter().copied()), way(&mut (0..data.command.len())))
}

#[cfg(test)]
mod tests {
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Codes found in 4 s of a log at 100 Hz, whose rotor is commanded `command` [-] at a time [s], and turns by it.
    fn found(command: impl Fn(f64) -> f64) -> Vec<&'static str> {
        let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
        let commands: Vec<f64> = time.iter().map(|time| command(*time)).collect();
        let rates =
            commands.iter().map(|command| if *command < 0.05 { 0.0 } else { 900.0 * command }).collect();
        let log = Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)]);
        let log = ScreenedLog::from(log);
        log.rotor(1).expect("measured").findings().map(|finding| finding.code).collect()
    }

    #[test]
    fn a_log_that_comes_to_rest_while_its_rotor_starts_says_so() {
        let starts = |time: f64| match time {
            ..0.5 => 0.0,
            ..0.6 => 0.5,
            ..0.7 => 0.2,
            ..3.0 => 0.4,
            _ => 0.45,
        };
        // Of 0.3 + 0.2 + 0.05 the first two are within half a second of the start.
        assert!(found(starts).contains(&"moves_left_out"), "{:?}", found(starts));
        let goes_on = |time: f64| if time > 2.0 && time < 3.0 { 0.7 } else { starts(time) };
        assert!(!found(goes_on).contains(&"moves_left_out"), "0.5 of 1.05 is no more than half");
        let once = |time: f64| if time < 0.5 { 0.0 } else { 0.5 };
        assert!(!found(once).contains(&"moves_left_out"), "the start itself does not count");
        let flickers = |time: f64| {
            if time < 0.5 { 0.0 } else { 0.5 + if time < 0.9 { 0.001 * (900.0 * time).sin() } else { 0.0 } }
        };
        assert!(!found(flickers).contains(&"moves_left_out"), "nor does a flicker");
    }
}
