//! Logs of one bench: how one of them was written, so were the others.

use super::ScreenedLog;

/// The logs, each judged with what the others show of how all were written: where commands of a rotor step between rows in one of them,
/// fewer steps say so in another.
#[must_use]
pub fn of_one_bench(logs: &[ScreenedLog]) -> Vec<ScreenedLog> {
    let steps = |log: &ScreenedLog, number: usize| {
        log.rotor(number).is_some_and(|rotor| rotor.data().command_from.is_some())
    };
    let asked = |log: &ScreenedLog| {
        let numbers = log.rotors().map(super::ScreenedRotor::number);
        let own = numbers.filter(|number| !steps(log, *number));
        own.filter(|number| logs.iter().any(|other| steps(other, *number))).collect::<Vec<_>>()
    };
    let judged = |log: &ScreenedLog| match asked(log) {
        rotors if rotors.is_empty() => log.clone(),
        rotors => log.with_stepping(&rotors),
    };
    logs.iter().map(judged).collect()
}
