//! Whether the numbers of a log can be what their names say: limits, signs, and units that were mistaken.

use super::battery_range::EMPTY;
use super::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use super::saturation;
use crate::estimation::quantile::{median, quantile};
use crate::identify::IdentifyError;
use crate::model::Model;
use crate::screening::Finding;
use crate::unit::STANDARD_GRAVITY;

/// [-] [rad/s] [V] beyond these a column cannot be in the unit of its name: percent or microseconds; rpm, for a
/// propeller's tip at 7000 rad/s reaches the speed of sound 5 cm from its axis; millivolts.
const IMPOSSIBLE: (f64, f64, f64) = (1.5, 7000.0, 1000.0);
/// [s] samples further apart than this tell nothing of a rotor, whose transients last a tenth of that.
const SLOWEST: f64 = 2.0;
/// [rad/s] the noise of a rotor that stands stays below.
const STANDING: f64 = 50.0;
/// Share of the samples at the limit of the command from which it is said, and from which most of a log says one thing.
const SATURATED: (f64, f64) = (0.02, 0.3);
/// Distinct commands below the highest that a signal with more than a few levels has.
const LEVELS: usize = 50;
/// Factor between the rates and the template's from which a mistaken unit is asked for.
pub(crate) const ANOTHER: f64 = 3.5;
/// Factor between a unit's and the ratio that was found, within which it may be that unit.
const LIKE: f64 = 1.8;
/// Share of a column below its greatest values that a few flipped bits may be.
pub(crate) const MOST: f64 = 0.99;
/// [-] commands from which rates are held against the template's: below, losses that it does not know count, and in the dead
/// zone of its controller a rotor stands.
pub(crate) const LEAST_HELD: f64 = 0.15;
/// Units that a rate may have been written in, and what they say for 1 rad/s.
pub(crate) const UNITS: [(&str, f64); 4] = [
    ("rpm", 60.0 / std::f64::consts::TAU),
    ("rev/s", 1.0 / std::f64::consts::TAU),
    ("krpm", 0.06 / std::f64::consts::TAU),
    ("deg/s", 360.0 / std::f64::consts::TAU),
];

/// The same factor of thrusts: they go with the square of the rates, and another rotor's are further from the template's.
const ANOTHER_THRUST: f64 = 6.0;
/// Units that a thrust may have been written in and that are further from 1 N than that, and what they say for 1 N.
const THRUST_UNITS: [(&str, f64); 3] =
    [("gf", 1e3 / STANDARD_GRAVITY), ("kgf", 1.0 / STANDARD_GRAVITY), ("mN", 1e3)];

/// Units of thrust nearer to 1 N. Another propeller's thrusts are as near: they are asked for only within a share of what
/// they would say, and where the rates are the template's within as much.
const NEAR_THRUST_UNITS: [(&str, f64); 2] =
    [("lbf", 1.0 / 4.448_221_615_260_5), ("ozf", 16.0 / 4.448_221_615_260_5)];
const NEAR: f64 = 1.15;

/// The unit that says nearly `ratio` for one of the right ones.
fn nearest(units: &[(&'static str, f64)], ratio: f64) -> Option<&'static str> {
    let away = |unit: &(&str, f64)| (ratio / unit.1).ln().abs();
    let nearest = units.iter().min_by(|a, b| away(a).total_cmp(&away(b)));
    nearest.filter(|unit| away(unit) < LIKE.ln()).map(|unit| unit.0)
}

pub(crate) fn is_another(ratio: &f64, another: f64) -> bool {
    !(1.0 / another..another).contains(ratio)
}

/// A ratio for people.
pub(crate) fn told(ratio: f64) -> String {
    crate::unit::short((1e3 * ratio).round() / 1e3)
}

/// A sentence, and whether it is impossible that the column is what its name says.
type Suspicion = (String, bool);

/// What to say of samples that are `interval` [s] apart.
pub(crate) fn too_far_apart(source: &str, interval: f64) -> String {
    format!(
        "{source}: samples are {interval:.0} s apart, too far for any rotor to be seen moving; if the time is in milliseconds \
         or microseconds, import it with unit `ms` or `us`"
    )
}

impl RotorLog {
    /// Says so where a column can hardly be in the unit of its name, or is at its limits; refuses where it cannot. A
    /// voltage that is none is taken away.
    pub(crate) fn check(&mut self, warnings: &mut Vec<Finding>) -> Result<(), IdentifyError> {
        warnings.extend(self.mistaken()?.into_iter().map(Finding::from));
        self.check_saturation(warnings);
        self.check_battery(warnings);
        Ok(())
    }

    /// What to say of columns that can hardly be in the unit of their name.
    ///
    /// # Errors
    /// [`IdentifyError::Unit`] of one that cannot.
    pub(crate) fn mistaken(&self) -> Result<Vec<String>, IdentifyError> {
        let suspects = [self.slow_time(), self.wide_command(), self.fast_rate()];
        let others = [self.standing_rate(), self.backward_rate(), self.high_voltage()];
        let told = suspects.into_iter().chain(others).flatten();
        told.map(
            |(sentence, impossible)| {
                if impossible { Err(IdentifyError::Unit(sentence)) } else { Ok(sentence) }
            },
        )
        .collect()
    }

    fn slow_time(&self) -> Option<Suspicion> {
        (self.interval > SLOWEST).then(|| (too_far_apart(&self.source, self.interval), true))
    }

    fn wide_command(&self) -> Option<Suspicion> {
        let (low, high) = bounds(&self.command);
        (high > 1.0 + 1e-9 || low < -1e-9).then(|| {
            let sentence = format!(
                "{}: commands reach from {low:.4} to {high:.4}, but 0 to 1 is expected; scale them with \
                 `import` (percent: scale 0.01; microseconds of a servo pulse: scale 0.001, offset -1)",
                self.source
            );
            (sentence, high > IMPOSSIBLE.0)
        })
    }

    fn fast_rate(&self) -> Option<Suspicion> {
        // Readings that a flipped bit wrote are told as wild; here most of the upper hundredth counts.
        let fastest = quantile(self.rate.iter().copied(), MOST).unwrap_or(0.0);
        (fastest > 5000.0).then(|| {
            let sentence = format!(
                "{}: rates reach {fastest:.0} rad/s ({:.0} rpm); if the column is in rpm, import it with \
                 unit `rpm` (electrical rpm of an ESC: scale 1/pole pairs beside it)",
                self.source,
                fastest * 60.0 / std::f64::consts::TAU
            );
            (sentence, fastest > IMPOSSIBLE.1)
        })
    }

    fn standing_rate(&self) -> Option<Suspicion> {
        let (slowest, fastest) = bounds(&self.rate);
        self.stands(slowest, fastest).then(|| {
            let sentence = format!(
                "{}: the rotor stands while it is commanded: up to {:.2}, and its rates lie about zero, from \
                 {slowest:.1} to {fastest:.1} rad/s; are the command columns those of another rotor? (leave them out, and the other rotor is taken alone)",
                self.source,
                bounds(&self.command).1
            );
            (sentence, true)
        })
    }

    fn backward_rate(&self) -> Option<Suspicion> {
        let (slowest, fastest) = bounds(&self.rate);
        (slowest < -0.05 * fastest.abs() && bounds(&self.command).1 >= LEAST_COMMAND).then(|| {
            let sentence = format!(
                "{}: rates are negative down to {slowest:.0} rad/s, but a rotor's command and rate have one sign here; if \
                 the column counts the other way round, import it with scale -1",
                self.source
            );
            (sentence, fastest < -slowest)
        })
    }

    fn high_voltage(&self) -> Option<Suspicion> {
        let (low, high) = self.voltage.as_deref().map(bounds)?;
        (high >= 100.0).then(|| {
            let sentence = format!(
                "{}: battery voltages from {low:.3} to {high:.3} V are not those of a battery; {}",
                self.source,
                if high > IMPOSSIBLE.2 {
                    "if the column is in millivolts, import it with unit `mV`; in hundredths of a volt, with the scale 0.01"
                } else {
                    "a charge in percent is no voltage (leave that column out); tenths of a volt want the scale 0.1 at `import`"
                }
            );
            (sentence, high > IMPOSSIBLE.2)
        })
    }

    /// Whether the rates under command are noise about zero, `slowest` and `fastest` [rad/s] its ends.
    fn stands(&self, slowest: f64, fastest: f64) -> bool {
        let ends = fastest.max(-slowest);
        if slowest >= -0.05 * fastest.abs() || ends > STANDING {
            return false;
        }
        let commanded = self.command.iter().zip(&self.rate).filter(|(command, _)| **command >= LEAST_HELD);
        median(commanded.map(|(_, rate)| *rate)).is_some_and(|middle| middle.abs() < 0.5 * ends)
    }

    /// Says how much of the log is at the limit of the command, and what can still be done.
    fn check_saturation(&self, warnings: &mut Vec<Finding>) {
        let known = || self.command.iter().copied().filter(|command| command.is_finite());
        let highest = bounds(&self.command).1.min(1.0);
        let at_limit = known().filter(|&u| u >= highest - 1e-9).count() as f64;
        let share = at_limit / known().count().max(1) as f64;
        let mut levels: Vec<i64> = known().map(|u| (1e6 * u).round() as i64).collect();
        levels.sort_unstable();
        levels.dedup();
        // Of a few levels the highest is held as long as the others; where many pile up at one, something clips.
        let clipped =
            highest >= 1.0 - 1e-9 || (levels.len() > LEVELS && share > 0.1 && highest > LEAST_COMMAND);
        if share <= SATURATED.0 || !clipped {
            return;
        }
        let mut sentence = format!(
            "{}: the command is at its limit {} in {:.0} % of the samples; that a controller asked for more, or that \
             the rotor got less, does not show there",
            self.source,
            crate::unit::short(highest),
            100.0 * share
        );
        if share > SATURATED.1 {
            sentence.push_str(
                ", and only what leads there and away excites g(u) and the pole: record again with a smaller amplitude or \
                 a lower operating point, or give only the part of the log that is not at the limit",
            );
        }
        warnings.push(sentence.into());
    }

    /// Takes readings away that no battery has, and the whole column where nothing else is in it.
    fn check_battery(&mut self, warnings: &mut Vec<Finding>) {
        let Some(voltage) = self.voltage.as_mut() else { return };
        let (low, high) = bounds(voltage);
        if median(voltage.iter().copied()).is_none_or(|volts| volts < EMPTY) {
            warnings.push(format!(
                "{}: `battery_voltage_v` reads {low:.2} to {high:.2} V, which no battery has that turns a rotor: it \
                 is not connected, or it is another column; taken as if no voltage had been measured",
                self.source
            ).into());
            self.voltage = None;
            return;
        }
        if let Some(clipped) = saturation::find(voltage, Some(&self.command)) {
            let at: Vec<String> = clipped.at.iter().map(|at| crate::unit::short(*at)).collect();
            warnings.push(format!(
                "{}: `battery_voltage_v` is clipped at {}: {} of {} readings stand there, and what the battery had is not known; \
                 taken as if no voltage had been measured; give only the part of the log that is not at the limit",
                self.source,
                at.join(" and "),
                clipped.cells,
                clipped.of
            ).into());
            self.voltage = None;
        }
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
        let mut say = |what: &str, values: &[f64], si: &str, ratio: f64, unit: Option<&str>| {
            let unit = unit.map_or_else(
                || "is the unit of the column right?".to_owned(),
                |name| {
                    format!("if the column is in {name}, import it with unit `{name}`; everything in {si} is off by that else")
                },
            );
            let (least, most) = bounds(values);
            warnings.push(format!(
                "{}: {what} from {least:.4} to {most:.4} {si} are {} times what the template's rotor does at these \
                 commands; {unit}",
                self.source,
                told(ratio)
            ).into());
        };
        let of_rates = self.rate_ratio(template);
        if let Some(ratio) = of_rates.filter(|ratio| is_another(ratio, ANOTHER)) {
            say("rates", &self.rate, "rad/s", ratio, nearest(&UNITS, ratio));
        }
        let Some(thrust) = self.thrust.as_deref() else { return };
        let coefficient = template.actuator.thrust_coefficient;
        let of_thrusts =
            self.middle(template, |row, expected| thrust[row] / (coefficient * expected * expected));
        // What is below zero has the wrong sign, which is told where the curve is fitted.
        let Some(ratio) = of_thrusts.filter(|ratio| *ratio > 0.0) else { return };
        let is_near = |unit: &&(&str, f64)| !is_another(&(ratio / unit.1), NEAR);
        let near = NEAR_THRUST_UNITS
            .iter()
            .find(is_near)
            .filter(|_| of_rates.is_some_and(|it| !is_another(&it, NEAR)));
        if let Some((unit, _)) = near {
            say("thrusts", thrust, "N", ratio, Some(unit));
        } else if is_another(&ratio, ANOTHER_THRUST) {
            say("thrusts", thrust, "N", ratio, nearest(&THRUST_UNITS, ratio));
        }
    }
}
