//! The data of one block: what is fitted on, what is held out.

use super::block_data::{BlockData, Runs};
use super::body_block::BodyRun;
use super::directions::Directions;
use super::refusal::EffectRefusal;
use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::extremes;
use crate::log::signals::MOST_ROTORS;
use crate::model::{Effect, Model};
use crate::screening::telemetry_rate::{is_too_seldom, rate_needed, reading_interval};

/// The data of one block: to fit on, to validate on.
#[derive(Debug, Clone)]
pub struct DataSplit {
    /// To fit on.
    pub train: BlockData,
    /// Held out: other logs, or the same ones where `folds` says how they are parted.
    pub validate: BlockData,
    /// Where no other logs are given: parts to fit on, each with the part held out. Together the held-out
    /// parts are the whole.
    pub folds: Vec<(BlockData, BlockData)>,
    /// A part of the training data that suffices to compare starts; `None` where there are few.
    pub coarse: Option<BlockData>,
    /// The body was held still in all logs to fit on.
    pub is_body_held: bool,
    too_seldom: Option<EffectRefusal>,
    /// Nothing shows how a rotor follows its command: its pole is no number of these data.
    is_at_rest: bool,
    /// The base's curve and k_V stay as they are: fitted on a part of the levels they do worse on the others.
    pub(crate) holds_levels: bool,
}

impl DataSplit {
    /// To fit on `train` and validate on `validate`; without the latter every part of `train` is held out from a fit on the
    /// others.
    #[must_use]
    pub fn new(mut train: BlockData, mut validate: Option<BlockData>) -> Self {
        let of_held_out = || validate.as_ref().and_then(BlockData::step_delay);
        if let Some(common) = train.step_delay().or_else(of_held_out) {
            // What nobody can tell from none is none.
            for delay in [common, 0.0] {
                train.take_delay(delay);
                validate.iter_mut().for_each(|held_out| held_out.take_delay(delay));
            }
        }
        let folds = match validate {
            Some(_) => Vec::new(),
            None => (0..THRESHOLDS.folds)
                .map(|fold| {
                    (train.part(fold, THRESHOLDS.folds, false), train.part(fold, THRESHOLDS.folds, true))
                })
                .collect(),
        };
        let share = THRESHOLDS.coarse_share.max(train.readings() / THRESHOLDS.enough_samples);
        let part = || {
            if train.holds_levels() {
                // A part of them in one piece would miss most.
                train.with_levels_thinned()
            } else if train.readings() > THRESHOLDS.long_log {
                train.in_long_pieces(share)
            } else {
                train.thinned(share)
            }
        };
        let is_many = if train.holds_levels() {
            (THRESHOLDS.enough_samples + 1..=THRESHOLDS.long_log).contains(&train.readings())
        } else {
            train.len() > THRESHOLDS.many_samples
        };
        let coarse = is_many.then(part);
        Self {
            validate: validate.unwrap_or_else(|| train.clone()),
            train,
            folds,
            coarse,
            is_body_held: false,
            too_seldom: None,
            is_at_rest: false,
            holds_levels: false,
        }
    }

    /// Whether all data are too many to find the way on; then the part to find it on.
    #[must_use]
    pub fn shortened(&self) -> Option<&BlockData> {
        self.coarse.as_ref().filter(|_| self.train.readings() > THRESHOLDS.long_log)
    }

    /// Tells both parts how large the noise of each channel is.
    pub fn set_sigma(&mut self, sigma: [f64; 2]) {
        // A channel without noise would weigh everything.
        let sigma = sigma.map(|sigma| if sigma.is_finite() && sigma > 0.0 { sigma } else { f64::EPSILON });
        let folds = self.folds.iter_mut().flat_map(|(train, held_out)| [train, held_out]);
        folds
            .chain([&mut self.train, &mut self.validate])
            .chain(&mut self.coarse)
            .for_each(|data| data.sigma = sigma);
    }

    /// Why the training data cannot tell anything about this block; `None` when they can.
    #[must_use]
    pub fn insufficient_data(&self) -> Option<EffectRefusal> {
        let (samples, is_exciting, why) = match &self.train.runs {
            Runs::Rotor(runs) => {
                (longest_rotor(runs), is_any_moved(runs), EffectRefusal::CommandsNotExciting)
            }
            Runs::Body(runs) => {
                let samples = runs.iter().map(|run| run.rate.len()).sum::<usize>();
                (samples, is_torque_moved(runs), EffectRefusal::TorqueNotExciting)
            }
        };
        if self.too_seldom.is_some() {
            return self.too_seldom.clone();
        }
        let needed = THRESHOLDS.fewest_samples;
        if self.is_body_held {
            return Some(EffectRefusal::BodyHeldStill);
        }
        if samples < needed {
            return Some(EffectRefusal::TooFewSamples { samples, needed });
        }
        (!is_exciting).then_some(why)
    }

    /// Whether the rotors' runs have a battery voltage.
    fn has_voltage(&self) -> bool {
        match &self.train.runs {
            Runs::Rotor(runs) => runs.iter().all(|run| run.voltage.is_some()),
            Runs::Body(_) => true,
        }
    }

    /// Base parameters of this block that a fit may change.
    #[must_use]
    pub fn base_parameters(&self, model: &Model) -> Vec<String> {
        let is_held = |name: &String| self.holds_levels && name != "pole";
        let mut names = self.all_base_parameters(model);
        names.retain(|name| !is_held(name));
        names
    }

    /// The same with those that are held.
    pub(crate) fn all_base_parameters(&self, model: &Model) -> Vec<String> {
        let names = if self.train.is_rotor() { model.rotor_parameters() } else { model.body_parameters() };
        let usable = |name: &&str| match *name {
            "voltage_gain" => self.has_voltage(),
            "pole" => !self.is_at_rest,
            _ => true,
        };
        names.into_iter().filter(usable).map(str::to_owned).collect()
    }

    /// The same data, with whether the rates of every rotor come too seldom to show how a rotor of the model follows its command (what
    /// happens between two of them would be taken for a law of levels), and whether no row is on its way to a new level: from drift
    /// within levels at rest a pole of any size would come, and effects that explain it.
    #[must_use]
    pub fn judged_by(mut self, model: &Model) -> Self {
        let Runs::Rotor(runs) = &self.train.runs else { return self };
        let intervals = runs.iter().filter_map(|run| reading_interval(&run.time, &run.measured));
        let pole = model.actuator.pole;
        self.is_at_rest = Directions::of(runs, pole).are_at_rest();
        let slow = intervals.reduce(f64::min).filter(|interval| is_too_seldom(*interval, pole));
        self.too_seldom = slow.map(|interval| EffectRefusal::ReadingsTooSeldom {
            rate_hz: interval.recip(),
            needed_hz: rate_needed(pole),
        });
        self
    }

    /// Whether the rotors are at rest throughout: nothing shows how they follow.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        self.is_at_rest
    }

    /// Whether an effect acts in this block.
    #[must_use]
    pub fn holds(&self, effect: &Effect) -> bool {
        effect.site.is_rotor() == self.train.is_rotor()
    }
}

/// Samples of the rotor that has most.
fn longest_rotor(runs: &[RotorRun]) -> usize {
    let of = |rotor: usize| runs.iter().filter(|run| run.rotor == rotor).map(|run| run.time.len()).sum();
    (0..MOST_ROTORS).map(of).max().unwrap_or(0)
}

/// Whether a rotor's command moves. Each by itself: two that stand at different commands do not.
fn is_any_moved(runs: &[RotorRun]) -> bool {
    let moves = |rotor: usize| {
        let own = runs.iter().filter(|run| run.rotor == rotor);
        range(own.flat_map(|run| run.command.iter().copied())) > THRESHOLDS.least_command_range
    };
    (0..MOST_ROTORS).any(moves)
}

/// Whether the torque moves: what is left of a constant one is rounding.
fn is_torque_moved(runs: &[BodyRun]) -> bool {
    let torque = || runs.iter().flat_map(|run| run.input.torque.iter().copied());
    let greatest = torque().map(f64::abs).fold(0.0, f64::max);
    range(torque()) > THRESHOLDS.least_torque_range * greatest
}

/// From the least to the greatest of the values that are there.
fn range(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = extremes(values);
    high - low
}

#[cfg(test)]
mod tests {
    use super::super::tests::at_once;
    use super::*;

    /// Without other logs each sample is held out exactly once, by a fit that has not seen it.
    #[test]
    fn every_sample_is_held_out_once_from_a_fit_on_others() {
        let split = DataSplit::new(at_once((0..600).map(|row| 0.4 + 0.1 * f64::from(row / 3 % 2))), None);
        let counts = |data: &BlockData| match &data.runs {
            Runs::Rotor(runs) => runs[0].counts.clone(),
            Runs::Body(_) => Vec::new(),
        };
        assert_eq!(split.folds.len(), THRESHOLDS.folds);
        let folds: Vec<_> =
            split.folds.iter().map(|(train, held_out)| (counts(train), counts(held_out))).collect();
        for row in 0..600 {
            assert_eq!(folds.iter().filter(|(_, held_out)| held_out[row]).count(), 1, "row {row}");
            assert!(folds.iter().all(|(train, held_out)| train[row] != held_out[row]), "row {row}");
        }
    }

    /// Starts are compared on a part of many samples; of levels held for long, of which more are needed, on all levels.
    #[test]
    fn of_many_samples_a_part_is_enough_to_compare_starts() {
        let part_read = |rows: usize, level: usize, each: usize| {
            let rows = u32::try_from(rows).expect("few");
            let level = u32::try_from(level).expect("few");
            let mut data = at_once((0..rows).map(|row| 0.3 + 0.05 * f64::from(row / level % 7)));
            let Runs::Rotor(runs) = &mut data.runs else { unreachable!("a rotor") };
            let read = runs[0].measured.iter().enumerate();
            runs[0].measured = read.map(|(row, it)| if row % each == 0 { *it } else { f64::NAN }).collect();
            let split = DataSplit::new(data, None);
            split.coarse.map(|coarse| match &coarse.runs {
                Runs::Rotor(runs) => (coarse.len(), runs[0].steps()),
                Runs::Body(_) => (0, 0),
            })
        };
        let part = |rows: usize, level: usize| part_read(rows, level, 1);
        let (many, enough) = (THRESHOLDS.many_samples, THRESHOLDS.enough_samples);
        assert_eq!(part(many, 3), None);
        let (short, steps) = part(2 * many, 3).expect("many");
        assert!(short == 2 * many / THRESHOLDS.coarse_share && steps < short / 2);
        assert_eq!(part(enough, 400), None);
        let (thinned, steps) = part(2 * enough, 400).expect("very many");
        assert!(thinned < enough && steps == 2 * enough / 400 - 1, "{thinned} {steps}");
        assert_eq!(part_read(2 * enough, 400, 4), None, "few of them were measured");
        assert_eq!(part(THRESHOLDS.long_log + 400, 400), None, "a fit would go over that part first");
    }

    /// What rates answered to, a dead time behind an instant, is the same before and after; the dead time is that of all logs, and none where
    /// nobody can tell it from none.
    #[test]
    fn logs_whose_commands_step_between_rows_have_one_dead_time() {
        let log = |found: f64| {
            let mut data = at_once((0..600).map(|row| 0.4 + 0.1 * f64::from(row / 30 % 2)));
            let Runs::Rotor(runs) = &mut data.runs else { unreachable!("a rotor") };
            runs[0].command_from = Some(runs[0].time.iter().map(|at| at - 0.004).collect());
            (runs[0].delay_found, runs[0].delay_unknown) = (found, 0.003);
            data
        };
        let run = |data: &BlockData| match &data.runs {
            Runs::Rotor(runs) => (runs[0].delay_found, runs[0].command_from.as_deref().map(|from| from[50])),
            Runs::Body(_) => (f64::NAN, None),
        };
        let answered = |found: f64| 0.5 - 0.004 + found;
        for (train, validate, common) in [(0.020, 0.021, 0.020), (0.005, 0.002, 0.0), (0.020, 0.040, 0.020)] {
            let split = DataSplit::new(log(train), Some(log(validate)));
            for (data, found) in [(&split.train, train), (&split.validate, validate)] {
                let (delay, from) = run(data);
                assert!((from.expect("known") + delay - answered(found)).abs() < 1e-12);
                // A log that is further from the others than one can be unsure keeps its own.
                let kept = if (found - common).abs() < 0.006 { common } else { found };
                assert!((delay - kept).abs() < 1e-12, "{found}: {delay}");
            }
        }
    }
}
