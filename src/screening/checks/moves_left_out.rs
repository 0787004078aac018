//! Most of what a command does is in rows that are left out: what a model says of the others may not hold there.

use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog};
use crate::screening::thresholds::THRESHOLDS;

/// Finds out how much of what the command moves is in rows at which the rotor stands or starts.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let share = share_left_out(&rotor.data, &rotor.at_rest);
    let finding = rotor.data.finding("moves_left_out").with("share", share);
    (rotor.is_measured() && share > THRESHOLDS.moves_left_out).then(|| Judgement::new(finding, Vec::new()))
}

/// \[-\] of the way that the command goes up and down, between commands that turn the rotor, the part that it goes in these rows,
/// which ascend.
fn share_left_out(data: &RotorLog, at_rest: &[usize]) -> f64 {
    let turns = |row: usize| data.command[row] >= LEAST_COMMAND;
    let moved = |row: usize| {
        let is_known = row > 0 && turns(row) && turns(row - 1);
        if is_known { (data.command[row] - data.command[row - 1]).abs() } else { 0.0 }
    };
    let whole: f64 = (0..data.command.len()).map(moved).sum();
    let left_out: f64 = at_rest.iter().map(|row| moved(*row)).sum();
    if whole > 0.0 { left_out / whole } else { 0.0 }
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
    }
}
