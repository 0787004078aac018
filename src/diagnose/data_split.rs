//! The data of one block: what is fitted on, what is judged on.

use super::block_data::{BlockData, Runs};
use crate::model::{Effect, Model};
use crate::signal::ROTORS;

/// Fewer training samples than this cannot tell.
const FEWEST_SAMPLES: usize = 100;
/// [-] commands that stay within this of each other excite nothing.
const LEAST_COMMAND: f64 = 1e-3;
/// Share of the greatest torque that its changes must be.
const LEAST_TORQUE: f64 = 1e-6;

/// The data of one block: to fit on, to judge on.
#[derive(Debug, Clone)]
pub struct Stage {
    /// To fit on.
    pub train: BlockData,
    /// Held out: other logs, or the same ones where `folds` says how they are parted.
    pub validate: BlockData,
    /// Where no other logs are given: parts to fit on, each with the part it is judged on. Together the judged
    /// parts are the whole.
    pub folds: Vec<(BlockData, BlockData)>,
    /// A part of the training data that suffices to compare starts; `None` where there are few.
    pub coarse: Option<BlockData>,
}

/// Training samples below which every one of them is looked at.
const MANY_SAMPLES: usize = 3000;
/// Share of the data, one in so many, that suffices to compare starts; and readings that do, of however many.
const COARSE: usize = 3;
const ENOUGH_SAMPLES: usize = 12_000;
/// Readings from which a fit goes on a part of them as far as it can before it goes on all.
const LONG: usize = 30_000;
/// Parts that a log is cut into where no other is given.
const FOLDS: usize = 3;

impl Stage {
    /// To fit on `train` and judge on `validate`; without the latter every part of `train` is judged by a fit on the
    /// others.
    #[must_use]
    pub fn new(train: BlockData, validate: Option<BlockData>) -> Self {
        let folds = match validate {
            Some(_) => Vec::new(),
            None => (0..FOLDS)
                .map(|fold| (train.part(fold, FOLDS, false), train.part(fold, FOLDS, true)))
                .collect(),
        };
        // Of levels held for long a part would miss most.
        let share = COARSE.max(train.readings() / ENOUGH_SAMPLES);
        let part = || if train.readings() > LONG { train.halfway(share) } else { train.thinned(share) };
        let coarse = (train.len() > MANY_SAMPLES && !train.holds_levels()).then(part);
        Self { validate: validate.unwrap_or_else(|| train.clone()), train, folds, coarse }
    }

    /// Whether all data are too many to find the way on; then the part to find it on.
    #[must_use]
    pub fn shortened(&self) -> Option<&BlockData> {
        self.coarse.as_ref().filter(|_| self.train.readings() > LONG)
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
    pub fn too_poor(&self) -> Option<String> {
        let spread = |values: &mut dyn Iterator<Item = f64>| {
            let finite = values.filter(|value| value.is_finite());
            let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value), high.max(value))
            });
            high - low
        };
        let (samples, moved, what) = match &self.train.runs {
            Runs::Rotor(runs) => {
                let of = |rotor: usize| {
                    runs.iter().filter(|run| run.rotor == rotor).map(|run| run.time.len()).sum()
                };
                let samples: usize = (0..ROTORS).map(of).max().unwrap_or(0);
                // Each by itself: two that stand at different commands do not move.
                let moves = |rotor: usize| {
                    let own = runs.iter().filter(|run| run.rotor == rotor);
                    spread(&mut own.flat_map(|run| run.command.iter().copied())) > LEAST_COMMAND
                };
                let moved = (0..ROTORS).any(moves);
                (samples, moved, "the rotors' commands")
            }
            Runs::Body(runs) => {
                let samples = runs.iter().map(|run| run.rate.len()).sum::<usize>();
                let torque = || runs.iter().flat_map(|run| run.input.torque.iter().copied());
                let greatest = torque().map(f64::abs).fold(0.0, f64::max);
                // What is left of a constant one is rounding.
                (samples, spread(&mut torque()) > LEAST_TORQUE * greatest, "the torque on the body")
            }
        };
        if samples < FEWEST_SAMPLES {
            return Some(format!(
                "{samples} samples are too few to tell anything, {FEWEST_SAMPLES} are the least"
            ));
        }
        (!moved).then(|| format!("{what} hardly changed: these data excite nothing"))
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
        let names = if self.train.is_rotor() { model.rotor_parameters() } else { model.body_parameters() };
        let usable = |name: &&str| *name != "voltage_gain" || self.has_voltage();
        names.into_iter().filter(usable).map(str::to_owned).collect()
    }

    /// Whether an effect acts in this block.
    #[must_use]
    pub fn holds(&self, effect: &Effect) -> bool {
        effect.site.is_rotor() == self.train.is_rotor()
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::log::Dataset;

    /// Without other logs each sample is judged exactly once, by a fit that has not seen it.
    #[test]
    fn every_sample_is_judged_once_and_by_a_fit_on_others() {
        let time: Vec<f64> = (0..600).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("here", "", time).expect("time rises");
        let command = (0..600).map(|row| 0.4 + 0.1 * f64::from(row / 3 % 2)).collect();
        log.insert("command_1", command).expect("fits");
        log.insert("propeller_rate_1_rad_s", vec![600.0; 600]).expect("fits");
        let stage = Stage::new(BlockData::new(Runs::Rotor(rotor_runs(&[log]))), None);
        let counts = |data: &BlockData| match &data.runs {
            Runs::Rotor(runs) => runs[0].counts.clone(),
            Runs::Body(_) => Vec::new(),
        };
        assert_eq!(stage.folds.len(), FOLDS);
        let folds: Vec<_> =
            stage.folds.iter().map(|(train, held_out)| (counts(train), counts(held_out))).collect();
        for row in 0..600 {
            assert_eq!(folds.iter().filter(|(_, held_out)| held_out[row]).count(), 1, "row {row}");
            assert!(folds.iter().all(|(train, held_out)| train[row] != held_out[row]), "row {row}");
        }
    }
}
