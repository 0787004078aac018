//! Rows at which a rotor stands or starts: the model has no law for that.

use crate::screening::channel::Judgement;
use crate::screening::left_out::STANDSTILL;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::LEAST_COMMAND;
use crate::screening::thresholds::THRESHOLDS;

/// Takes the rates of a rotor that stands or starts out of the score.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let (at_rest, rotor) = (&rotor.at_rest, &mut rotor.data);
    let rows: Vec<usize> = at_rest.iter().copied().filter(|row| rotor.rate[*row].is_finite()).collect();
    rows.iter().for_each(|row| rotor.rate[*row] = f64::NAN);
    let finding = rotor.finding(STANDSTILL).with("least_command", LEAST_COMMAND);
    let finding = finding.with("starting_s", THRESHOLDS.starting);
    (!rows.is_empty()).then(|| Judgement::new(finding, rows))
}
