//! A command that stands at its limit: that more was asked for, or that the rotor got less, does not show there.

use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::{LEAST_COMMAND, bounds};
use crate::screening::thresholds::THRESHOLDS;

/// How much of the log is at the limit of the command, and what can still be done; nothing is left out.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    if !rotor.is_measured() {
        return None;
    }
    let rotor = &rotor.data;
    let known = || rotor.command.iter().copied().filter(|command| command.is_finite());
    let highest = bounds(&rotor.command).1.min(1.0);
    let at_limit = known().filter(|&u| u >= highest - 1e-9).count() as f64;
    let share = at_limit / known().count().max(1) as f64;
    let mut levels: Vec<i64> = known().map(|u| (1e6 * u).round() as i64).collect();
    levels.sort_unstable();
    levels.dedup();
    // Of a few levels the highest is held as long as the others; where many pile up at one, something saturates.
    let saturates = highest >= 1.0 - 1e-9
        || (levels.len() > THRESHOLDS.command_levels
            && share > THRESHOLDS.command_at_highest
            && highest > LEAST_COMMAND);
    let finding = rotor.finding("command_saturated").with("at", highest).with("share", share);
    let finding = finding.with("hides_all", usize::from(share > THRESHOLDS.command_mostly_at_limit));
    (share > THRESHOLDS.command_at_limit && saturates).then(|| Judgement::new(finding, Vec::new()))
}
