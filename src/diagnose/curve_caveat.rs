//! A shift of the static curve beside other numbers of that curve: together they are one curve, and none is a finding of its own.

use super::block_data::Runs;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use crate::effect::{Site, Term, acting_as};
use crate::model::{Model, polynomial};
use crate::screening::Finding;

/// By how much the rotors' curve is another than the model's over the commands of the logs, where that is much less than the shift that
/// is named: a curve that bends otherwise than its polynomial can needs a shift, and no rotor turns faster by it.
pub(crate) fn shift_is_curve(found: &SearchResult) -> Option<Finding> {
    let shift = acting_as(Site::SteadyRate, Term::Constant)?;
    let is_named = found.answer.effects.iter().any(|id| id == shift.id);
    let Runs::Rotor(runs) = &found.split.train.runs else { return None };
    let added = found.answer.model.parameter(&format!("{}.{}", shift.id, shift.parameters[0].name))?;
    let commands = || runs.iter().flat_map(|run| run.command.iter().copied()).filter(|it| it.is_finite());
    let (low, high) = (commands().reduce(f64::min)?, commands().reduce(f64::max)?);
    let (least, greatest) = difference(&found.nominal.model, (&found.answer.model, added), (low, high));
    let is_curve = least.abs().max(greatest.abs()) < THRESHOLDS.shift_of_curve * added.abs();
    (is_named && is_curve).then(|| {
        let finding = Finding::new("shift_is_curve", shift.id).with("shift_rad_s", added);
        let finding = finding.with("from_command", low).with("to_command", high);
        finding.with("least_rad_s", least).with("greatest_rad_s", greatest)
    })
}

/// [rad/s] least and greatest difference of a model's curve with this shift from another's, over these commands.
fn difference(before: &Model, (after, shift): (&Model, f64), (low, high): (f64, f64)) -> (f64, f64) {
    let of = |model: &Model, u: f64| polynomial(&model.actuator.steady_rate, u);
    let looks = THRESHOLDS.curve_looks;
    let commands = (0..=looks).map(|look| low + (high - low) * look as f64 / looks as f64);
    let differences = commands.map(|u| of(after, u) + shift - of(before, u));
    differences
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, greatest), it| (least.min(it), greatest.max(it)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 (u - 0.5)³, written out: a shift of -12.5 rad/s that no rotor shows by more than an eighth of that.
    #[test]
    fn a_bend_about_hover_written_out_is_no_shift() {
        let (before, mut after) = (Model::paper(), Model::paper());
        let own = before.actuator.steady_rate.clone();
        after.actuator.steady_rate = vec![own[0], own[1] + 75.0, own[2] - 150.0, 100.0];
        let (least, greatest) = difference(&before, (&after, -12.5), (0.25, 0.75));
        assert!((least + 1.5625).abs() < 1e-9 && (greatest - 1.5625).abs() < 1e-9, "{least} {greatest}");
    }
}
