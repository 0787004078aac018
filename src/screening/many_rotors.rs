//! Logs of a machine with more rotors than an attitude bench has, as a quadrotor: each rotor is a model of its own, and the
//! body that all of them turn is none of ours.

use super::{Finding, ScreenedLog};
use crate::log::Dataset;
use crate::log::signals::MOST_ROTORS;
use crate::signal::ROTORS;
use crate::signal::columns::BODY_RATE;

/// The rotors that turn, from 1, where one of them is no rotor of an attitude bench; else none. One whose rate nobody measured
/// turns, too: a log of a quadrotor without telemetry of its ESCs is no attitude bench's.
#[must_use]
pub fn beyond_bench(logs: &[ScreenedLog]) -> Vec<usize> {
    let turns = |number: &usize| {
        logs.iter().filter_map(|log| log.commanded(*number)).any(super::ScreenedRotor::turns)
    };
    let turning: Vec<usize> = (1..=MOST_ROTORS).filter(turns).collect();
    if turning.last().is_some_and(|last| *last > ROTORS) { turning } else { Vec::new() }
}

/// The logs with these rotors alone, under their own numbers: no other, and no body.
#[must_use]
pub fn of_rotors(logs: &[ScreenedLog], rotors: &[usize]) -> Vec<ScreenedLog> {
    logs.iter().map(|log| log.of_rotors(rotors)).collect()
}

/// Says that the body of such a log is left out; `None` where none was measured.
#[must_use]
pub fn body_left_out(logs: &[ScreenedLog], rotors: &[usize]) -> Option<Finding> {
    let is_measured = |log: &Dataset| log.column(BODY_RATE).is_some();
    logs.iter()
        .map(ScreenedLog::dataset)
        .any(is_measured)
        .then(|| Finding::new("body_of_many_rotors", "body").with("rotors", rotors.len()))
}

#[cfg(test)]
mod tests {
    use super::super::tests::log_with_hole;
    use super::*;

    #[test]
    fn a_third_rotor_that_turns_makes_it_no_attitude_bench() {
        let mut log = log_with_hole(300, &[100, 200], 900);
        let third = |log: &mut Dataset, command: f64, rate: f64| {
            log.replace("command_3", vec![command; 300]).expect("fits");
            log.replace("propeller_rate_3_rad_s", vec![rate; 300]).expect("fits");
        };
        assert!(beyond_bench(&[log.clone().into()]).is_empty());
        third(&mut log, 0.0, 0.0);
        assert!(beyond_bench(&[log.clone().into()]).is_empty(), "it stands");
        third(&mut log, 0.5, 650.0);
        log.insert("body_rate_rad_s", (0..300).map(|row| 0.01 * f64::from(row % 7)).collect()).expect("fits");
        let logs = [ScreenedLog::from(log)];
        assert_eq!(beyond_bench(&logs), [1, 3]);
        let unmeasured = logs[0].raw().with_columns(|name| !name.starts_with("propeller_rate"));
        assert_eq!(beyond_bench(&[unmeasured.into()]), [1, 3], "no telemetry of the ESCs");
        assert!(body_left_out(&logs, &[1, 3]).is_some());
        let own = &of_rotors(&logs, &[3])[0];
        let names: Vec<&str> = own.raw().names().collect();
        assert_eq!(names, ["command_3", "propeller_rate_3_rad_s"]);
        assert_eq!(own.rotors().map(super::super::ScreenedRotor::number).collect::<Vec<_>>(), [3]);
    }
}
