//! One set of effects, everything refitted, judged on data it has not seen.

use super::block_data::{BlockData, Runs};
use super::data_split::Stage;
use super::problem::Problem;
use super::rotor_block::RotorRun;
use crate::effect::Law;
use crate::estimation::noise_floor::RESOLUTION;
use crate::estimation::output_error::{Fit, OutputError};
use crate::model::{Effect, EffectParameter, Model};

/// A set of effects after its fit.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Ids of the effects added to the base, in order.
    pub effects: Vec<String>,
    /// The fitted model.
    pub model: Model,
    /// Names of the parameters that were free.
    pub names: Vec<String>,
    /// The fit on the training part.
    pub fit: Fit,
    /// The same parameters on the held-out part, only initial states refitted.
    pub judged: Fit,
}

/// Number of stretches that residuals are compared by.
const CHUNKS: usize = 24;
/// Fewer stretches than this have no scatter worth the name.
const FEWEST_CHUNKS: usize = 4;

impl Trial {
    /// Mean square of the held-out residuals over the noise's, the freedom of initial states taken off.
    #[must_use]
    pub fn validate(&self, stage: &Stage) -> f64 {
        mean_square(&self.judged, &stage.validate)
    }

    /// The same on the training part.
    #[must_use]
    pub fn train(&self, stage: &Stage) -> f64 {
        mean_square(&self.fit, &stage.train)
    }

    /// Root mean square of one channel in its unit, on the training or the held-out part.
    #[must_use]
    pub fn channel_error(&self, stage: &Stage, channel: usize, held_out: bool) -> f64 {
        let (fit, data) = if held_out { (&self.judged, &stage.validate) } else { (&self.fit, &stage.train) };
        let pieces = data.pieces(channel);
        let values =
            pieces.iter().flat_map(|piece| &fit.residuals[piece.clone()]).filter(|value| **value != 0.0);
        let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
        let free = count.saturating_sub(live_units(fit, data)).max(1);
        (sum / free as f64).sqrt() * data.sigma[channel]
    }

    /// Whether its error is below what these data can resolve: then nothing is left to gain.
    #[must_use]
    pub fn is_exact(&self, stage: &Stage) -> bool {
        let of = |channel: usize| {
            let least = RESOLUTION * stage.validate.spread(channel);
            self.channel_error(stage, channel, true) <= least
                && self.channel_error(stage, channel, false) <= least
        };
        (0..stage.train.channels().len()).all(of)
    }

    /// The trial with its residuals over the noise that another stage of the same data takes as the unit; `None` where the
    /// data are not laid out alike.
    #[must_use]
    pub fn in_units_of(&self, own: &Stage, other: &Stage) -> Option<Self> {
        let scaled = |fit: &Fit, own: &BlockData, other: &BlockData| {
            (own.units() == other.units() && fit.residuals.len() == other.len()).then_some(())?;
            let mut fit = fit.clone();
            for channel in 0..own.channels().len() {
                let factor = own.sigma[channel] / other.sigma[channel];
                for piece in own.pieces(channel) {
                    fit.residuals[piece].iter_mut().for_each(|residual| *residual *= factor);
                }
            }
            fit.cost = power(&fit.residuals);
            Some(fit)
        };
        let (fit, judged) = (
            scaled(&self.fit, &own.train, &other.train)?,
            scaled(&self.judged, &own.validate, &other.validate)?,
        );
        Some(Self { fit, judged, ..self.clone() })
    }

    /// By how much the squared error falls from `self` to `after`, over the standard error of that fall from stretch
    /// to stretch, on the part where it is the steadier: simulation errors are correlated, so samples do not count,
    /// stretches do; and where whole levels are held out, errors of the level hide what a law of transients gains.
    #[must_use]
    pub fn steadiness(&self, after: &Self) -> f64 {
        self.judged_steadiness(after).max(steadiness(&self.fit.residuals, &after.fit.residuals))
    }

    /// The same on the held-out part.
    #[must_use]
    pub fn judged_steadiness(&self, after: &Self) -> f64 {
        steadiness(&self.judged.residuals, &after.judged.residuals)
    }

    /// Whether two of its effects work against each other and little is left of both: then they are no physics but
    /// a curve bent to the data.
    #[must_use]
    pub fn cancels(&self, stage: &Stage, known: &[Effect]) -> bool {
        let traces: Vec<Vec<f64>> = self.effects.iter().map(|id| self.trace(stage, &[id], known)).collect();
        let ids = &self.effects;
        let mut pairs = (0..ids.len()).flat_map(|one| (one + 1..ids.len()).map(move |two| (one, two)));
        pairs.any(|(one, two)| {
            let least = LEFT_OF_BOTH * power(&traces[one]).min(power(&traces[two]));
            // A body may run away with one and without the other: then only both at once say what is left.
            let sum =
                || traces[one].iter().zip(&traces[two]).map(|(one, two)| (one + two).powi(2)).sum::<f64>();
            let may_run_away = !stage.train.is_rotor();
            sum() < least || may_run_away && power(&self.trace(stage, &[&ids[one], &ids[two]], known)) < least
        })
    }

    /// Whether the data hold every effect of a single parameter away from where it would not be there: of two lags in a row,
    /// each of which could be none, one is idle. Where each run's start of a slow state is free, a level of its own for each
    /// run comes with it, and only its course speaks for it: more is asked of that.
    #[must_use]
    pub fn is_determined(&self, stage: &Stage, known: &[Effect]) -> bool {
        let has_free_start = self.fit.locals.len() > stage.train.units().len();
        if has_free_start && self.is_a_level(stage, known) {
            return false;
        }
        let added = known.iter().filter(|effect| self.effects.contains(&effect.id));
        let numbers = added.filter_map(|effect| effect.card).flat_map(|card| {
            let is_free = has_free_start && matches!(&card.law, Law::Memory(memory) if memory.slow);
            let least = if is_free { DETERMINED_SLOW } else { DETERMINED };
            let looked_at = if is_free || card.parameters.len() == 1 { card.parameters } else { &[] };
            let numbers = looked_at.iter().filter(|parameter| !parameter.neutral.is_nan());
            numbers
                .map(move |parameter| (format!("{}.{}", card.id, parameter.name), parameter.neutral, least))
        });
        numbers.into_iter().all(|(name, neutral, least)| {
            let (Some(value), Some(error)) =
                (self.model.parameter(&name), self.model.standard_errors.get(&name))
            else {
                return false;
            };
            // An infinitely fast pole is none: its time is what is measured.
            let away = if neutral.is_infinite() { value.abs() } else { (value - neutral).abs() };
            away > least * error
        })
    }

    /// Whether a slow state hardly moves within the longest run: with a free start for each run it is a level of its own for
    /// each, which any two logs that differ ask for.
    fn is_a_level(&self, stage: &Stage, known: &[Effect]) -> bool {
        let Runs::Rotor(runs) = &stage.train.runs else { return false };
        let span =
            |run: &RotorRun| run.time.last().zip(run.time.first()).map_or(0.0, |(last, first)| last - first);
        let longest = runs.iter().map(span).fold(0.0, f64::max);
        let slow =
            known.iter().filter(|effect| self.effects.contains(&effect.id)).filter_map(
                |effect| match &effect.law {
                    Law::Memory(memory) if memory.slow => Some((memory, effect)),
                    _ => None,
                },
            );
        slow.into_iter().any(|(memory, effect)| {
            let value = |parameter: &EffectParameter| {
                self.model.parameter(&format!("{}.{}", effect.id, parameter.name)).unwrap_or(f64::NAN)
            };
            let values: Vec<f64> = effect.parameters.iter().map(value).collect();
            (memory.rate)(&values) * longest < LEAST_WAY
        })
    }

    /// What the effects add to the fitted simulation on the training part, all else held.
    fn trace(&self, stage: &Stage, ids: &[&String], known: &[Effect]) -> Vec<f64> {
        let inside: Vec<&Effect> = known.iter().filter(|effect| self.model.has(&effect.id)).collect();
        let model = ids.iter().fold(self.model.clone(), |model, id| model.without(id));
        let without = Problem::new(&stage.train, model, Vec::new(), &inside);
        let mut residuals = vec![0.0; self.fit.residuals.len()];
        without.residuals(&[], &self.fit.locals, &mut residuals);
        residuals.iter().zip(&self.fit.residuals).map(|(without, with)| without - with).collect()
    }
}

/// Standard errors by which a parameter must differ from none.
const DETERMINED: f64 = 2.0;
/// Time constants of a slow state that the longest run must last.
const LEAST_WAY: f64 = 0.2;
/// The same for one whose state at the start of each run is free, too.
const DETERMINED_SLOW: f64 = 3.0;
/// Of two effects that cancel, less than this share of the power of either is left.
const LEFT_OF_BOTH: f64 = 0.2;

fn steadiness(before: &[f64], after: &[f64]) -> f64 {
    let size = before.len().div_ceil(CHUNKS).max(1);
    let falls: Vec<f64> = before
        .chunks(size)
        .zip(after.chunks(size))
        .filter(|(before, _)| before.iter().any(|value| *value != 0.0))
        .map(|(before, after)| power(before) - power(after))
        .collect();
    if falls.len() < FEWEST_CHUNKS {
        return 0.0;
    }
    let count = falls.len() as f64;
    let mean = falls.iter().sum::<f64>() / count;
    let scatter = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0);
    mean / (scatter / count).sqrt().max(f64::MIN_POSITIVE)
}

fn power(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// Units in which anything was measured.
fn live_units(fit: &Fit, data: &BlockData) -> usize {
    data.units()
        .iter()
        .filter(|unit| fit.residuals[(*unit).clone()].iter().any(|value| *value != 0.0))
        .count()
}

fn mean_square(fit: &Fit, data: &BlockData) -> f64 {
    let used = fit.residuals.iter().filter(|value| **value != 0.0).count();
    let locals = fit.locals.len().checked_div(data.units().len()).unwrap_or(0);
    let free = used.saturating_sub(live_units(fit, data) * locals).max(1);
    fit.cost / free as f64
}

#[cfg(test)]
mod tests {
    use super::super::block_data::{BlockData, Runs};
    use super::super::body_block::{BodyRun, BodySource};
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::log::Dataset;

    /// An effect's id and its parameters: name, value, standard error.
    type Hidden<'a> = (&'a str, &'a [(&'a str, f64, f64)]);

    /// A body that swings 0.5 rad wide, with the given effects in the model at the given values.
    fn trial(effects: &[Hidden]) -> (Stage, Trial, Vec<Effect>) {
        let known = Model::paper().known_effects().expect("the catalogue");
        let mut model = Model::paper();
        for (id, parameters) in effects {
            model = model.with(known.iter().find(|effect| effect.id == *id).expect("known"));
            for (name, value, error) in *parameters {
                let name = format!("{id}.{name}");
                model.set_parameter(&name, *value);
                model.standard_errors.insert(name, *error);
            }
        }
        let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
        let angle: Vec<f64> = time.iter().map(|t| 0.5 * (3.0 * t).sin()).collect();
        let rate = time.iter().map(|t| 1.5 * (3.0 * t).cos()).collect();
        let (torque, zero) = (time.iter().map(|t| -0.144 * (3.0 * t).sin()).collect(), vec![0.0; 400]);
        let source = BodySource {
            torque,
            torque_slope: zero.clone(),
            carried: zero,
            rate,
            angle,
            time,
            ..BodySource::default()
        };
        let data = BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..400, source, 0.4)]));
        let inside: Vec<&Effect> = known.iter().filter(|effect| model.has(&effect.id)).collect();
        let problem = Problem::new(&data, model.clone(), Vec::new(), &inside);
        let locals = vec![0.0; problem.units().len() * problem.locals()];
        let mut residuals = vec![0.0; problem.len()];
        problem.residuals(&[], &locals, &mut residuals);
        let cost = power(&residuals);
        let fit =
            Fit { globals: Vec::new(), locals, standard_errors: Vec::new(), cost, residuals, iterations: 0 };
        let effects = effects.iter().map(|(id, _)| (*id).to_owned()).collect();
        let trial = Trial { effects, model, names: Vec::new(), judged: fit.clone(), fit };
        (Stage::new(data.clone(), Some(data)), trial, known)
    }

    #[test]
    fn a_spring_and_a_pendulum_of_opposite_sign_cancel_and_of_one_sign_do_not() {
        // The last two are so strong that either runs away without the other.
        for (moment, stiffness, cancels) in
            [(0.3, -0.3, true), (0.3, 0.3, false), (0.3, -0.05, false), (1.5, -1.5, true), (1.5, -0.5, false)]
        {
            let pendulum: &[_] = &[("moment", moment, 0.01), ("angle_offset", 0.0, 0.01)];
            let (stage, trial, known) = trial(&[
                ("gravity_pendulum", pendulum),
                ("cable_stiffness", &[("stiffness", stiffness, 0.01)]),
            ]);
            assert_eq!(trial.cancels(&stage, &known), cancels, "moment {moment}, stiffness {stiffness}");
        }
    }

    #[test]
    fn an_effect_within_two_standard_errors_of_none_is_not_determined() {
        for (id, name, value, error, determined) in [
            ("torque_bias", "torque", 0.03, 0.01, true),
            ("torque_bias", "torque", 0.015, 0.01, false),
            ("gyro_scale", "scale", 1.03, 0.01, true),
            ("gyro_scale", "scale", 1.015, 0.01, false),
            ("rotor_lag", "pole", 50.0, 20.0, true),
            ("rotor_lag", "pole", 50.0, 30.0, false),
        ] {
            let (stage, trial, known) = trial(&[(id, &[(name, value, error)])]);
            assert_eq!(trial.is_determined(&stage, &known), determined, "{id}.{name} = {value} ± {error}");
        }
    }

    /// Heat brings a level of its own for each run with it where its start is free: only a gain far from none speaks for it.
    #[test]
    fn heat_whose_start_is_free_must_be_plain() {
        for (error, determined) in [(0.006, true), (0.008, false)] {
            let numbers = [("gain", 0.02, error), ("time_constant", 30.0, 90.0)];
            let (stage, mut trial, known) = trial(&[("motor_heating", &numbers)]);
            let units = stage.train.units().len();
            trial.fit.locals = vec![0.0; 2 * units];
            assert_eq!(trial.is_determined(&stage, &known), determined, "± {error}");
            trial.fit.locals.truncate(units);
            assert!(trial.is_determined(&stage, &known), "the start is not free");
        }
    }

    /// Two logs that differ by a level each are no heat: one that would take hours moves nowhere in a minute.
    #[test]
    fn heat_that_hardly_moves_within_a_log_is_a_level() {
        let time: Vec<f64> = (0..6000).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("here", "", time).expect("time rises");
        log.insert("command_1", (0..6000).map(|row| 0.5 + 0.1 * f64::from(row / 40 % 2)).collect())
            .expect("fits");
        log.insert("propeller_rate_1_rad_s", vec![600.0; 6000]).expect("fits");
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log])));
        let rotor = Stage::new(data.clone(), Some(data));
        for (time_constant, determined) in [(30.0, true), (290.0, true), (310.0, false), (2000.0, false)] {
            let numbers = [("gain", 0.02, 1e-3), ("time_constant", time_constant, 1.0)];
            let (_, mut trial, known) = trial(&[("motor_heating", &numbers)]);
            trial.fit.locals = vec![0.0; 2 * rotor.train.units().len()];
            assert_eq!(trial.is_determined(&rotor, &known), determined, "{time_constant} s in 60 s");
        }
    }

    #[test]
    fn a_fall_in_one_stretch_is_not_steady_and_a_small_one_everywhere_is() {
        let before = vec![1.0; 240];
        let mut once = before.clone();
        once[..10].fill(0.0);
        assert!(steadiness(&before, &once) < 1.1);
        let everywhere: Vec<f64> = (0..240).map(|row| 0.99 + 0.001 * f64::from(row / 10 % 2)).collect();
        assert!(steadiness(&before, &everywhere) > 10.0);
        assert!(steadiness(&everywhere, &before) < -10.0);
    }
}
