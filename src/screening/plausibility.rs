//! Whether the numbers of a log can be what their names say: by what a model's rotor does at the same commands.

use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::median;
use crate::model::Model;

/// Share of a column below its greatest values that a few flipped bits may be.
pub(crate) const MOST: f64 = THRESHOLDS.most_of_a_column;
/// [-] commands from which rates are held against the template's: below, losses that it does not know count, and in the dead
/// zone of its controller a rotor stands.
pub(crate) const LEAST_HELD: f64 = THRESHOLDS.least_compared_command;
/// Units that a rate may have been written in, and what they say for 1 rad/s.
pub(crate) const UNITS: [(&str, f64); 4] = [
    ("rpm", 60.0 / std::f64::consts::TAU),
    ("rev/s", 1.0 / std::f64::consts::TAU),
    ("krpm", 0.06 / std::f64::consts::TAU),
    ("deg/s", 360.0 / std::f64::consts::TAU),
];

/// The unit that says nearly `ratio` for one of the right ones.
pub(super) fn nearest(units: &[(&'static str, f64)], ratio: f64) -> Option<&'static str> {
    let away = |unit: &(&str, f64)| (ratio / unit.1).ln().abs();
    let nearest = units.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.filter(|unit| away(unit) < THRESHOLDS.unit_like.ln()).map(|unit| unit.0)
}

pub(crate) fn is_another(ratio: &f64, another: f64) -> bool {
    !(1.0 / another..another).contains(ratio)
}

impl RotorLog {
    /// The middle of what is asked of each row and of the rate [rad/s] that the model's rotor has at its command.
    pub(super) fn middle(&self, model: &Model, of: impl Fn(usize, f64) -> f64) -> Option<f64> {
        let ratio = |row: usize| {
            let expected = model.steady_rate(self.command[row]);
            (self.command[row] >= LEAST_HELD && expected > 0.0).then(|| of(row, expected))
        };
        let rows = self.stretches.iter().cloned().flatten();
        median(rows.filter_map(ratio))
    }

    /// How many times what the model's rotor has at the same commands the rates are.
    pub(super) fn rate_ratio(&self, model: &Model) -> Option<f64> {
        self.middle(model, |row, expected| self.rate[row].abs() / expected)
    }
}
