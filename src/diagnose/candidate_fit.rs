//! One set of effects, everything refitted, validated on data it has not seen.

use super::block_data::{BlockData, Runs};
use super::data_split::DataSplit;
use super::problem::Problem;
use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use crate::effect::{self, Law, Site, Term};
use crate::estimation::consistency::{self as stretchwise, power};
use crate::estimation::output_error::{Fit, OutputError, Residuals};
use crate::model::{Effect, EffectParameter, Model};

/// A set of effects after its fit.
#[derive(Debug, Clone)]
pub struct CandidateFit {
    /// Ids of the effects added to the base, in order.
    pub effects: Vec<String>,
    /// The fitted model.
    pub model: Model,
    /// Names of the parameters that were free.
    pub names: Vec<String>,
    /// The fit on the training part.
    pub fit: Fit,
    /// The same parameters on the held-out part, only initial states refitted.
    pub held_out: Fit,
}

impl CandidateFit {
    /// Its model alone: what it leaves is let go of.
    pub(crate) fn into_model(self) -> Model {
        self.model
    }

    /// Mean square of the held-out residuals over the noise's, the freedom of initial states taken off.
    #[must_use]
    pub fn validate(&self, split: &DataSplit) -> f64 {
        noise_multiple(&self.held_out, &split.validate)
    }

    /// The same on the training part.
    #[must_use]
    pub fn train(&self, split: &DataSplit) -> f64 {
        noise_multiple(&self.fit, &split.train)
    }

    /// Root mean square of one channel in its unit, on the training or the held-out part.
    #[must_use]
    pub fn channel_error(&self, split: &DataSplit, channel: usize, held_out: bool) -> f64 {
        let (fit, data) =
            if held_out { (&self.held_out, &split.validate) } else { (&self.fit, &split.train) };
        let pieces = data.pieces(channel);
        let values = pieces.iter().flat_map(|piece| fit.residuals.part(piece)).filter(|value| **value != 0.0);
        let (count, sum) = values.fold((0usize, 0.0), |(count, sum), value| (count + 1, sum + value * value));
        let free = count.saturating_sub(live_units(fit, data)).max(1);
        (sum / free as f64).sqrt() * data.sigma[channel]
    }

    /// Whether its error is below what these data can resolve: then nothing is left to gain.
    #[must_use]
    pub fn is_exact(&self, split: &DataSplit) -> bool {
        let of = |channel: usize| {
            let least = split.validate.resolution(channel);
            self.channel_error(split, channel, true) <= least
                && self.channel_error(split, channel, false) <= least
        };
        (0..split.train.channels().len()).all(of)
    }

    /// The fit with its residuals over the noise that another split of the same data takes as the unit; `None` where the
    /// data are laid out in another way.
    #[must_use]
    pub fn in_units_of(&self, own: &DataSplit, other: &DataSplit) -> Option<Self> {
        let scaled = |fit: &Fit, own: &BlockData, other: &BlockData| {
            (own.units() == other.units() && fit.residuals.len() == other.len()).then_some(())?;
            let mut residuals = fit.residuals.all().into_owned();
            for channel in 0..own.channels().len() {
                let factor = own.sigma[channel] / other.sigma[channel];
                for piece in own.pieces(channel) {
                    residuals[piece].iter_mut().for_each(|residual| *residual *= factor);
                }
            }
            let cost = power(&residuals);
            let residuals = Residuals::of(residuals, other.measured_rows());
            Some(Fit { residuals, cost, ..fit.clone() })
        };
        let (fit, held_out) = (
            scaled(&self.fit, &own.train, &other.train)?,
            scaled(&self.held_out, &own.validate, &other.validate)?,
        );
        Some(Self { fit, held_out, ..self.clone() })
    }

    /// By how much the squared error falls from `self` to `after`, over the standard error of that fall from stretch
    /// to stretch, on the part where it is the steadier: simulation errors are correlated, so samples do not count,
    /// stretches do; and where whole levels are held out, errors of the level hide what a law of transients gains.
    #[must_use]
    pub fn consistency(&self, after: &Self) -> f64 {
        self.held_out_consistency(after).max(consistency(&self.fit.residuals, &after.fit.residuals))
    }

    /// The same on the held-out part.
    #[must_use]
    pub fn held_out_consistency(&self, after: &Self) -> f64 {
        consistency(&self.held_out.residuals, &after.held_out.residuals)
    }

    /// Whether two of its effects work against each other and little is left of both: then they are no physics but
    /// a curve bent to the data.
    #[must_use]
    pub fn cancels(&self, split: &DataSplit, known: &[Effect]) -> bool {
        if self.effects.len() < 2 {
            return false;
        }
        let traces: Vec<Vec<f64>> = self.effects.iter().map(|id| self.trace(split, &[id], known)).collect();
        let ids = &self.effects;
        let mut pairs = (0..ids.len()).flat_map(|one| (one + 1..ids.len()).map(move |two| (one, two)));
        pairs.any(|(one, two)| {
            let least = THRESHOLDS.cancelled_share * power(&traces[one]).min(power(&traces[two]));
            // A body may run away with one and without the other: then only both together say what is left.
            let sum =
                || traces[one].iter().zip(&traces[two]).map(|(one, two)| (one + two).powi(2)).sum::<f64>();
            let may_run_away = !split.train.is_rotor();
            sum() < least || may_run_away && power(&self.trace(split, &[&ids[one], &ids[two]], known)) < least
        })
    }

    /// Whether the data hold every effect of a single parameter away from where it would not be there: of two lags in a row,
    /// each of which could be none, one is insignificant. Where each run's start of a slow state is free, a level of its own for each
    /// run comes with it, and only its course speaks for it: that must be the plainer.
    #[must_use]
    pub fn is_determined(&self, split: &DataSplit, known: &[Effect]) -> bool {
        let has_free_start = self.fit.locals.len() > split.train.units().len();
        if has_free_start && self.is_a_level(split, known) {
            return false;
        }
        let added = known.iter().filter(|effect| self.effects.contains(&effect.id));
        let numbers = added.filter_map(|effect| effect.card).flat_map(|card| {
            let is_free = has_free_start && matches!(&card.law, Law::Memory(memory) if memory.slow);
            let least = if is_free { THRESHOLDS.identifiable_slow } else { THRESHOLDS.identifiable };
            let tested = if is_free || card.parameters.len() == 1 { card.parameters } else { &[] };
            let numbers = tested.iter().filter(|parameter| !parameter.neutral.is_nan());
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
            let unknown = if is_command_delay(&name) { split.train.delay_unknown() } else { 0.0 };
            away > least * error.hypot(unknown)
        })
    }

    /// Whether a slow state hardly moves within the longest run: with a free start for each run it is a level of its own for
    /// each, which any two logs that differ ask for.
    fn is_a_level(&self, split: &DataSplit, known: &[Effect]) -> bool {
        let Runs::Rotor(runs) = &split.train.runs else { return false };
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
            (memory.rate)(&values) * longest < THRESHOLDS.least_slow_course
        })
    }

    /// What the effects add to the fitted simulation on the training part, all else held.
    fn trace(&self, split: &DataSplit, ids: &[&String], known: &[Effect]) -> Vec<f64> {
        let inside: Vec<&Effect> = known.iter().filter(|effect| self.model.has(&effect.id)).collect();
        let model = ids.iter().fold(self.model.clone(), |model, id| model.without(id));
        let without = Problem::new(&split.train, model, Vec::new(), &inside);
        let mut residuals = vec![0.0; self.fit.residuals.len()];
        without.residuals(&[], &self.fit.locals, &mut residuals);
        residuals.iter().zip(&*self.fit.residuals.all()).map(|(without, with)| without - with).collect()
    }
}

fn consistency(before: &Residuals, after: &Residuals) -> f64 {
    let (stretches, fewest) = (THRESHOLDS.stretches_compared, THRESHOLDS.fewest_stretches_compared);
    stretchwise::consistency(before, after, stretches, fewest)
}

/// Units in which anything was measured.
fn live_units(fit: &Fit, data: &BlockData) -> usize {
    data.units().iter().filter(|unit| fit.residuals.part(unit).iter().any(|value| *value != 0.0)).count()
}

/// Mean square of the residuals over the noise, the freedom of initial states taken off.
pub(crate) fn noise_multiple(fit: &Fit, data: &BlockData) -> f64 {
    let used = fit.residuals.measured().iter().filter(|value| **value != 0.0).count();
    let locals = fit.locals.len().checked_div(data.units().len()).unwrap_or(0);
    let free = used.saturating_sub(live_units(fit, data) * locals).max(1);
    fit.cost / free as f64
}

/// Whether a parameter is the dead time of the commands.
pub(crate) fn is_command_delay(name: &str) -> bool {
    let card = effect::acting_as(Site::Command, Term::DeadTime);
    let of_card = card.zip(name.split_once('.'));
    of_card.is_some_and(|(card, (id, own))| card.id == id && card.parameters.iter().any(|it| it.name == own))
}

#[cfg(test)]
mod tests {
    use super::super::block_data::{BlockData, Runs};
    use super::super::body_block::{BodyRun, BodySource};
    use super::super::model_selection::unidentified;
    use super::super::not_named::Unmet;
    use super::super::tests::at_once;
    use super::*;

    /// An effect's id and its parameters: name, value, standard error.
    type Hidden<'a> = (&'a str, &'a [(&'a str, f64, f64)]);

    /// A body that swings 0.5 rad wide, with the given effects in the model at the given values.
    fn fitted(effects: &[Hidden]) -> (DataSplit, CandidateFit, Vec<Effect>) {
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
            torque_slope: zero.clone().into(),
            propagated: zero.into(),
            rate,
            angle: angle.into(),
            time: time.into(),
            ..BodySource::default()
        };
        let data = BlockData::new(Runs::Body(vec![BodyRun::new(0, 0..400, source, 0.4)]));
        let inside: Vec<&Effect> = known.iter().filter(|effect| model.has(&effect.id)).collect();
        let problem = Problem::new(&data, model.clone(), Vec::new(), &inside);
        let locals = vec![0.0; problem.units().len() * problem.locals()];
        let mut residuals = vec![0.0; problem.len()];
        problem.residuals(&[], &locals, &mut residuals);
        let cost = power(&residuals);
        let fit = Fit {
            globals: Vec::new(),
            locals,
            standard_errors: Vec::new(),
            cost,
            residuals: residuals.into(),
            iterations: 0,
        };
        let effects = effects.iter().map(|(id, _)| (*id).to_owned()).collect();
        let fitted = CandidateFit { effects, model, names: Vec::new(), held_out: fit.clone(), fit };
        (DataSplit::new(data.clone(), Some(data)), fitted, known)
    }

    #[test]
    fn a_spring_and_a_pendulum_of_opposite_sign_cancel_and_of_one_sign_do_not() {
        // The last two are so strong that either runs away without the other.
        for (moment, stiffness, cancels) in
            [(0.3, -0.3, true), (0.3, 0.3, false), (0.3, -0.05, false), (1.5, -1.5, true), (1.5, -0.5, false)]
        {
            let pendulum: &[_] = &[("moment", moment, 0.01), ("angle_offset", 0.0, 0.01)];
            let (split, fitted, known) = fitted(&[
                ("gravity_pendulum", pendulum),
                ("cable_stiffness", &[("stiffness", stiffness, 0.01)]),
            ]);
            let expected = cancels.then_some(Unmet::Cancels);
            assert_eq!(
                unidentified(&split, &fitted, &known),
                expected,
                "moment {moment}, stiffness {stiffness}"
            );
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
            let (split, fitted, known) = fitted(&[(id, &[(name, value, error)])]);
            let expected = (!determined).then_some(Unmet::NotDetermined);
            assert_eq!(unidentified(&split, &fitted, &known), expected, "{id}.{name} = {value} ± {error}");
        }
    }

    /// Heat brings a level of its own for each run with it where its start is free: only a gain far from none speaks for it.
    #[test]
    fn heat_whose_start_is_free_must_be_plain() {
        for (error, determined) in [(0.006, true), (0.008, false)] {
            let numbers = [("gain", 0.02, error), ("time_constant", 30.0, 90.0)];
            let (split, mut fitted, known) = fitted(&[("motor_heating", &numbers)]);
            let units = split.train.units().len();
            fitted.fit.locals = vec![0.0; 2 * units];
            assert_eq!(fitted.is_determined(&split, &known), determined, "± {error}");
            fitted.fit.locals.truncate(units);
            assert!(fitted.is_determined(&split, &known), "the start is not free");
        }
    }

    /// Two logs that differ by a level each are no heat: one that would take hours moves nowhere in a minute.
    #[test]
    fn heat_that_hardly_moves_within_a_log_is_a_level() {
        let data = at_once((0..6000).map(|row| 0.5 + 0.1 * f64::from(row / 40 % 2)));
        let rotor = DataSplit::new(data.clone(), Some(data));
        for (time_constant, determined) in [(30.0, true), (290.0, true), (310.0, false), (2000.0, false)] {
            let numbers = [("gain", 0.02, 1e-3), ("time_constant", time_constant, 1.0)];
            let (_, mut fitted, known) = fitted(&[("motor_heating", &numbers)]);
            fitted.fit.locals = vec![0.0; 2 * rotor.train.units().len()];
            assert_eq!(fitted.is_determined(&rotor, &known), determined, "{time_constant} s in 60 s");
        }
    }
}
