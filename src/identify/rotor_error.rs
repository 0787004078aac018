//! How far the rotors of the logs are from a model that was fitted to them: what the guard's speed check may allow.

use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::extremes;
use crate::model::{Equations, Model, RotorError, RotorInput, RotorStart, RotorTrace};
use crate::screening::rotor_data::RotorLog;
use crate::screening::{ScreenedLog, ScreenedRotor};
use crate::signal::side;

/// Errors of free runs of `model` over each stretch of the logs' rotors; `None` where nothing of a turning rotor was measured.
#[must_use]
pub fn rotor_error(model: &Model, logs: &[&[ScreenedLog]]) -> Option<RotorError> {
    let equations = model.equations().ok()?;
    let (mut errors, mut commands) = (Vec::new(), Vec::new());
    // Rows that are levels each hold no run.
    let runs = |rotor: &&ScreenedRotor| !rotor.data().rows_are_levels();
    for rotor in logs.iter().copied().flatten().flat_map(ScreenedLog::rotors).filter(runs) {
        errors_of(&equations, rotor.data(), &mut errors, &mut commands);
    }
    let samples = errors.len();
    let squares: f64 = errors.iter().map(|error| error * error).sum();
    let largest = errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()));
    // A log may hold a little more than all: nobody commands it, and no model says so.
    let (lowest, highest) = extremes(commands);
    let [lowest_command, highest_command] = [lowest, highest].map(|command: f64| command.clamp(0.0, 1.0));
    let rms = (squares / samples as f64).sqrt();
    (rms > 0.0 && largest.is_finite()).then_some(RotorError {
        rms,
        largest: largest.max(rms),
        samples,
        lowest_command,
        highest_command,
    })
}

fn errors_of(equations: &Equations, rotor: &RotorLog, errors: &mut Vec<f64>, commands: &mut Vec<f64>) {
    let mut trace = RotorTrace::default();
    for stretch in &rotor.stretches {
        // What was commanded before is not known, and the first reading is noisy: the run has forgotten both after a while.
        let Some(first) = stretch.clone().find(|row| rotor.rate[*row].is_finite()) else { continue };
        let rows = first..stretch.end;
        let from = rotor.command_from_beside(equations.command_delay(), &rows);
        let input = RotorInput {
            time: &rotor.time[rows.clone()],
            command: &rotor.command[rows.clone()],
            command_from: from.as_deref(),
            voltage: rotor.voltage.as_ref().map(|voltage| &voltage[rows.clone()]),
            side: side(rotor.number.saturating_sub(1)),
        };
        let start = RotorStart { rate: Some(rotor.rate[first]), is_first: true, ..RotorStart::default() };
        equations.simulate_rotor(&input, &start, &mut trace);
        let from = rotor.time[first]
            + equations.command_delay()
            + THRESHOLDS.forgotten_after / equations.rotor_pole();
        let scored = |row: &usize| rotor.rate[*row].is_finite() && rotor.time[*row] >= from;
        for (row, read) in rows.zip(&trace.measured).filter(|(row, _)| scored(row)) {
            errors.push(rotor.rate[row] - read);
            commands.push(rotor.command[row]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;

    /// A scale that was written in few digits, or a stick beyond its end: what is written must be read again.
    #[test]
    fn the_range_of_commands_is_one_that_a_model_may_have() {
        let of = |value: &dyn Fn(usize) -> f64| (0..500).map(value).collect::<Vec<f64>>();
        let command = |row: usize| if (row / 100).is_multiple_of(2) { 0.4 } else { 1.000_000_5 };
        let rate = of(&|row| 1_000.0 * command(row) + (row * 37 % 11) as f64);
        let columns = [("command_1", of(&command)), ("propeller_rate_1_rad_s", rate)];
        let log = ScreenedLog::from(Dataset::made(of(&|row| 0.02 * row as f64), columns));
        let error = rotor_error(&Model::paper(), &[&[log]]).expect("a turning rotor");
        assert_eq!((error.lowest_command, error.highest_command), (0.4, 1.0));
    }
}
