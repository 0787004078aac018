//! Whether the numbers of a log can be what their names say: limits, signs, and units that were mistaken.

use super::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{median, quantile};
use crate::model::Model;
use crate::screening::Finding;
use crate::unit::STANDARD_GRAVITY;

/// Factor between the rates and the template's from which a mistaken unit is asked for.
pub(crate) const ANOTHER: f64 = THRESHOLDS.another_rate_unit;
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

/// Units that a thrust may have been written in and that are further from 1 N than that, and what they say for 1 N.
const THRUST_UNITS: [(&str, f64); 3] =
    [("gf", 1e3 / STANDARD_GRAVITY), ("kgf", 1.0 / STANDARD_GRAVITY), ("mN", 1e3)];

/// Units of thrust nearer to 1 N. Another propeller's thrusts are as near: they are asked for only within a share of what
/// they would say, and where the rates are the template's within as much.
const NEAR_THRUST_UNITS: [(&str, f64); 2] =
    [("lbf", 1.0 / 4.448_221_615_260_5), ("ozf", 16.0 / 4.448_221_615_260_5)];

/// The unit that says nearly `ratio` for one of the right ones.
fn nearest(units: &[(&'static str, f64)], ratio: f64) -> Option<&'static str> {
    let away = |unit: &(&str, f64)| (ratio / unit.1).ln().abs();
    let nearest = units.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.filter(|unit| away(unit) < THRESHOLDS.unit_like.ln()).map(|unit| unit.0)
}

pub(crate) fn is_another(ratio: &f64, another: f64) -> bool {
    !(1.0 / another..another).contains(ratio)
}

/// A finding, and whether it is impossible that the column is what its name says.
pub(crate) type Suspicion = (Finding, bool);

/// Samples that are `interval` [s] apart, too far to see a rotor move.
pub(crate) fn too_far_apart(log: &str, subject: &str, interval: f64) -> Finding {
    Finding::new("samples_too_far_apart", subject).of(log).with("interval_s", interval)
}

impl RotorLog {
    /// Columns that can hardly be in the unit of their name.
    pub(crate) fn mistaken(&self) -> Vec<Suspicion> {
        let suspects = [self.slow_time(), self.wide_command(), self.fast_rate()];
        let others = [self.standing_rate(), self.backward_rate(), self.high_voltage()];
        suspects.into_iter().chain(others).flatten().collect()
    }

    fn slow_time(&self) -> Option<Suspicion> {
        let finding = || self.finding("samples_too_far_apart").with("interval_s", self.interval);
        (self.interval > THRESHOLDS.slowest_samples).then(|| (finding(), true))
    }

    fn wide_command(&self) -> Option<Suspicion> {
        let (low, high) = bounds(&self.command);
        let finding = || self.finding("command_out_of_range").with("least", low).with("greatest", high);
        (high > 1.0 + 1e-9 || low < -1e-9).then(|| (finding(), high > THRESHOLDS.impossible_command))
    }

    fn fast_rate(&self) -> Option<Suspicion> {
        // Readings that a flipped bit wrote are outliers; here most of the upper hundredth counts.
        let fastest = quantile(self.rate.iter().copied(), MOST).unwrap_or(0.0);
        let finding = || self.finding("rate_too_fast").with("greatest_rad_s", fastest);
        (fastest > THRESHOLDS.fast_rate).then(|| (finding(), fastest > THRESHOLDS.impossible_rate))
    }

    fn standing_rate(&self) -> Option<Suspicion> {
        let (slowest, fastest) = bounds(&self.rate);
        let finding = || {
            let finding =
                self.finding("rotor_does_not_turn").with("greatest_command", bounds(&self.command).1);
            finding.with("least_rad_s", slowest).with("greatest_rad_s", fastest)
        };
        self.stands(slowest, fastest).then(|| (finding(), true))
    }

    fn backward_rate(&self) -> Option<Suspicion> {
        let (slowest, fastest) = bounds(&self.rate);
        let finding = || self.finding("rate_negative").with("least_rad_s", slowest);
        (slowest < -THRESHOLDS.negative_rate * fastest.abs() && bounds(&self.command).1 >= LEAST_COMMAND)
            .then(|| (finding(), fastest < -slowest))
    }

    fn high_voltage(&self) -> Option<Suspicion> {
        let (low, high) = self.voltage.as_deref().map(bounds)?;
        let is_impossible = high > THRESHOLDS.impossible_voltage;
        let finding = || {
            let finding =
                self.finding("battery_voltage_too_high").with("least_v", low).with("greatest_v", high);
            finding.with("unit", if is_impossible { "mV" } else { "" })
        };
        (high >= THRESHOLDS.high_voltage).then(|| (finding(), is_impossible))
    }

    /// Whether the rates under command are noise about zero, `slowest` and `fastest` [rad/s] its ends.
    fn stands(&self, slowest: f64, fastest: f64) -> bool {
        let ends = fastest.max(-slowest);
        if slowest >= -THRESHOLDS.negative_rate * fastest.abs() || ends > THRESHOLDS.standing_rate {
            return false;
        }
        let commanded = self.command.iter().zip(&self.rate).filter(|(command, _)| **command >= LEAST_HELD);
        median(commanded.map(|(_, rate)| *rate)).is_some_and(|middle| middle.abs() < 0.5 * ends)
    }

    /// How much of the log is at the limit of the command, and what can still be done.
    pub(crate) fn command_saturated(&self) -> Option<Finding> {
        let known = || self.command.iter().copied().filter(|command| command.is_finite());
        let highest = bounds(&self.command).1.min(1.0);
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
        let finding = self.finding("command_saturated").with("at", highest).with("share", share);
        let finding = finding.with("hides_all", usize::from(share > THRESHOLDS.command_mostly_at_limit));
        (share > THRESHOLDS.command_at_limit && saturates).then_some(finding)
    }

    /// The middle of what is asked of each row and of the rate [rad/s] that the model's rotor has at its command.
    fn middle(&self, model: &Model, of: impl Fn(usize, f64) -> f64) -> Option<f64> {
        let ratio = |row: usize| {
            let expected = model.steady_rate(self.command[row]);
            (self.command[row] >= LEAST_HELD && expected > 0.0).then(|| of(row, expected))
        };
        let rows = self.segments.iter().cloned().flatten();
        median(rows.filter_map(ratio))
    }

    /// How many times what the model's rotor has at the same commands the rates are.
    fn rate_ratio(&self, model: &Model) -> Option<f64> {
        self.middle(model, |row, expected| self.rate[row].abs() / expected)
    }

    /// Says so where rates or thrusts are those of another unit, by what the template's rotor does at the same commands. It
    /// may well be another rotor: nothing is refused.
    pub(crate) fn hold_against(&self, template: &Model, warnings: &mut Vec<Finding>) {
        let mut say = |code, values: &[f64], ratio: f64, unit: Option<&str>| {
            let (least, most) = bounds(values);
            let finding = self.finding(code).with("least", least).with("greatest", most).with("ratio", ratio);
            warnings.push(finding.with("unit", unit.unwrap_or_default()));
        };
        let of_rates = self.rate_ratio(template);
        if let Some(ratio) = of_rates.filter(|ratio| is_another(ratio, ANOTHER)) {
            say("rate_unlike_template", &self.rate, ratio, nearest(&UNITS, ratio));
        }
        let Some(thrust) = self.thrust.as_deref() else { return };
        let coefficient = template.actuator.thrust_coefficient;
        let of_thrusts =
            self.middle(template, |row, expected| thrust[row] / (coefficient * expected * expected));
        // What is below zero has the wrong sign, which is found where the curve is fitted.
        let Some(ratio) = of_thrusts.filter(|ratio| *ratio > 0.0) else { return };
        let is_near = |unit: &&(&str, f64)| !is_another(&(ratio / unit.1), THRESHOLDS.near_unit);
        let near = NEAR_THRUST_UNITS
            .iter()
            .find(is_near)
            .filter(|_| of_rates.is_some_and(|it| !is_another(&it, THRESHOLDS.near_unit)));
        if let Some((unit, _)) = near {
            say("thrust_unlike_template", thrust, ratio, Some(unit));
        } else if is_another(&ratio, THRESHOLDS.another_thrust_unit) {
            say("thrust_unlike_template", thrust, ratio, nearest(&THRUST_UNITS, ratio));
        }
    }
}
