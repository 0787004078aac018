//! Commands of a rotor that are missing (`missing_commands`): how many, and what is used all the same.

use crate::screening::channel::Judgement;
use crate::screening::left_out::COMMANDS_MISSING;
use crate::screening::rotor::CheckedRotor;

/// What is missing, and what was made of it. The rows themselves lie beside the stretches of known commands.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let CheckedRotor { data, missing, measured, .. } = rotor;
    if missing.places == 0 || !data.turns() {
        return None;
    }
    // Readings of runs that are too short are not used, either.
    let short = data.split_runs(measured).1.len();
    let finding = data.finding(COMMANDS_MISSING).rows(missing.rows + missing.cells);
    let finding = finding
        .with("interval_s", missing.interval)
        .with("places", missing.places)
        .with("missing_rows", missing.rows)
        .with("empty_cells", missing.cells)
        .with("used", data.scored().count() - short)
        .with("measured", data.rate.iter().filter(|rate| rate.is_finite()).count() - short);
    Some(Judgement { finding, rows: Vec::new(), biased: Vec::new() })
}
