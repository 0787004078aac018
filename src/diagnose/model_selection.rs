//! What an effect must bring to be worth its place, which sets can be physics, and which the data cannot tell apart.

use std::ops::Range;

use super::block_builder::UNTOLD_S;
use super::block_data::{BlockData, Runs};
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::rotor_block::RotorRun;
use super::surrogate_test::luck;
use crate::effect::{Site, Term, find};
use crate::estimation::noise_floor::floors;
use crate::model::Effect;

/// Held-out squared error must fall by this share for one more effect: less is not worth a law.
pub(crate) const LEAST_GAIN: f64 = 0.03;
/// A smaller share will do where it is very steady and the fitted data gain much.
const LITTLE_GAIN: f64 = 0.01;
/// Standard errors of a fall that is very steady.
const VERY_STEADY: f64 = 3.0;
/// A gain that shifted traces reach more often than this is luck.
pub(crate) const MOST_CHANCE: f64 = 0.05;
/// The error must fall by more than this many standard errors of its fall, stretch by stretch.
const STEADY: f64 = 2.0;
/// A channel whose error is mostly model error must not rule the others by its small noise.
const LEAST_SIGMA_SHARE: f64 = 0.2;

pub(crate) fn over_floor(stage: &Stage, trial: &Trial, floors: &[f64; 2]) -> (f64, usize) {
    let ratio = |channel: usize| trial.channel_error(stage, channel, true) / floors[channel];
    let channels = 0..stage.train.channels().len();
    channels.map(|channel| (ratio(channel), channel)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1.0, 0))
}

/// Whether `after` is worth its extra freedom over `before`.
pub(crate) fn gains(stage: &Stage, before: &Trial, after: &Trial) -> bool {
    if before.is_exact(stage) {
        return false;
    }
    let judged = 1.0 - after.validate(stage) / before.validate(stage);
    let fitted = 1.0 - after.fit.cost / before.fit.cost;
    let plainly = judged > LEAST_GAIN && fitted > 0.5 * LEAST_GAIN && before.steadiness(after) > STEADY;
    // The data judged on may hardly excite what the data fitted on show well.
    let little =
        judged > LITTLE_GAIN && fitted > 2.0 * LEAST_GAIN && before.judged_steadiness(after) > VERY_STEADY;
    (plainly || little) && luck(before, after, period(stage)).chance <= MOST_CHANCE
}

/// Windows may only be shifted whole.
pub(crate) fn period(stage: &Stage) -> usize {
    if stage.train.is_rotor() { 1 } else { stage.validate.units().first().map_or(1, std::ops::Range::len) }
}

/// Noise floors from the answer's residuals on both parts.
pub(crate) fn joint_floors(stage: &Stage, best: &Trial) -> [f64; 2] {
    let (train, validate) = (
        floors(&stage.train, &best.fit.residuals, best.model.body.inertia),
        floors(&stage.validate, &best.judged.residuals, best.model.body.inertia),
    );
    [0.5 * (train[0] + validate[0]), 0.5 * (train[1] + validate[1])]
}

/// Tells the stage how large its noise is.
pub(crate) fn weigh(stage: &mut Stage, trial: &Trial) {
    let floors = floors(&stage.train, &trial.fit.residuals, trial.model.body.inertia);
    let weight =
        |channel: usize| floors[channel].max(LEAST_SIGMA_SHARE * trial.channel_error(stage, channel, false));
    let channels = stage.train.channels().len();
    let sigma = [weight(0), if channels > 1 { weight(1) } else { 1.0 }];
    stage.set_sigma(sigma);
}

/// Whether a set can be physics: every effect of it determined, none cancelled by another.
pub(crate) fn is_sound(stage: &Stage, trial: &Trial, known: &[Effect]) -> bool {
    is_exercised(stage, trial) && trial.is_determined(stage, known) && !trial.cancels(stage, known)
}

/// Different commands that must lie beyond a limit: one cannot be told from a curve that bends there.
const FEWEST_BEYOND: usize = 2;

/// Whether the data go beyond the limit that a set says the command has.
fn is_exercised(stage: &Stage, trial: &Trial) -> bool {
    let Runs::Rotor(runs) = &stage.train.runs else { return true };
    let is_limit = |id: &String| find(id).is_some_and(|card| card.acts_as == Some(Term::Saturation));
    let limit = trial.effects.iter().any(is_limit).then(|| trial.model.term(Site::Command, Term::Saturation));
    limit.flatten().and_then(|values| values.first().copied()).is_none_or(|limit| {
        let mut beyond: Vec<f64> = Vec::new();
        let mut commands = runs.iter().flat_map(|run| &run.command).filter(|command| **command > limit);
        commands.any(|command| {
            if !beyond.contains(command) {
                beyond.push(*command);
            }
            beyond.len() >= FEWEST_BEYOND
        })
    })
}

/// Whether a set says that the rotors' sensor is late.
pub(crate) fn senses_rotors(trial: &Trial) -> bool {
    trial.effects.iter().any(|id| find(id).is_some_and(|card| card.site == Site::RotorRateSensor))
}

pub(crate) fn same_set(a: &[String], b: &[String]) -> bool {
    a.len() == b.len() && a.iter().all(|id| b.contains(id))
}

/// Squared error on all data, fitted and held out, but for how each log begins: there a late rotor is on its way to what nobody
/// logged, and laws of lateness differ in what they take that to be.
pub(crate) fn loss(stage: &Stage, trial: &Trial) -> f64 {
    let fitted = trial.fit.cost - beginnings(&stage.train, &trial.fit.residuals);
    let judged = trial.judged.cost - beginnings(&stage.validate, &trial.judged.residuals);
    fitted * trial.train(stage).signum() + judged
}

/// Squared error of the rotors in the beginnings of their logs.
fn beginnings(data: &BlockData, residuals: &[f64]) -> f64 {
    let Runs::Rotor(runs) = &data.runs else { return 0.0 };
    let firsts = runs.iter().zip(data.units()).filter(|(run, _)| run.rows.start == 0);
    let of_run = |(run, unit): (&RotorRun, &Range<usize>)| -> f64 {
        let until = run.time.first().map_or(0.0, |first| first + UNTOLD_S);
        let count = run.time.iter().take_while(|time| **time < until).count();
        residuals[unit.clone()].iter().take(count).map(|residual| residual * residual).sum()
    };
    firsts.map(of_run).sum()
}

/// Share of the unexplained squared error within which two sets are the same to us, a tenth of the error itself: what is
/// left out of both may make up for as much.
const BLUR: f64 = 0.21;

/// Mean square of noise alone, in the measure of [`Trial::validate`].
pub(crate) fn floor(stage: &Stage, floors: &[f64; 2]) -> f64 {
    let channels = stage.train.channels().len();
    let share = |channel: usize| (floors[channel] / stage.train.sigma[channel]).powi(2);
    (0..channels).map(share).sum::<f64>() / channels as f64
}

/// Sets as small as the answer whose error cannot be told from its, nearest first.
pub(crate) fn nearest(stage: &Stage, best: &Trial, trials: &[Trial], known: &[Effect]) -> Vec<Trial> {
    let used = best.fit.residuals.iter().chain(&best.judged.residuals).filter(|value| **value != 0.0).count();
    // A difference in log-likelihood of ten, or half a percent of the squared error; and what the answer itself
    // leaves unexplained blurs the difference between laws.
    let left = 1.0 - (floor(stage, &joint_floors(stage, best)) / best.validate(stage)).clamp(0.0, 1.0);
    let tolerance = (2.0 * 10.0 / used.max(1) as f64).max(0.005) + BLUR * left;
    let limit = |trial: &Trial| {
        // A late sensor and a late rotor differ in how a log begins; that must not decide between them.
        let twin = senses_rotors(trial) != senses_rotors(best);
        loss(stage, best) * (1.0 + if twin { tolerance.max(LEAST_GAIN) } else { tolerance })
    };
    let near = trials.iter().filter(|trial| {
        trial.effects.len() <= best.effects.len()
            && !same_set(&trial.effects, &best.effects)
            && loss(stage, trial) <= limit(trial)
            && is_sound(stage, trial, known)
    });
    let mut near: Vec<Trial> = near.filter(|_| !best.effects.is_empty()).cloned().collect();
    near.sort_by(|a, b| loss(stage, a).total_cmp(&loss(stage, b)));
    near.dedup_by(|a, b| same_set(&a.effects, &b.effects));
    near
}

/// The best sets on the way to the answer, each a part of the next, the answer last.
pub(crate) fn steps(stage: &Stage, best: &Trial, trials: &[Trial]) -> Vec<Trial> {
    let mut path = Vec::new();
    let mut now = best.clone();
    while !now.effects.is_empty() {
        path.push(now.clone());
        let part = |trial: &&Trial| {
            trial.effects.len() + 1 == now.effects.len()
                && trial.effects.iter().all(|id| now.effects.contains(id))
        };
        match trials.iter().filter(part).min_by(|a, b| a.validate(stage).total_cmp(&b.validate(stage))) {
            Some(trial) => now = trial.clone(),
            None => break,
        }
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::estimation::output_error::Fit;
    use crate::log::Dataset;
    use crate::model::Model;

    const ROWS: usize = 4800;

    fn stage() -> Stage {
        let time: Vec<f64> = (0..ROWS).map(|row| 0.01 * row as f64).collect();
        let mut log = Dataset::new("here", "", time).expect("time rises");
        // Three levels: 0.4, 0.6 and 0.8.
        log.insert("command_1", (0..ROWS).map(|row| 0.4 + 0.2 * (row / 40 % 3) as f64).collect())
            .expect("fits");
        log.insert("propeller_rate_1_rad_s", vec![600.0; ROWS]).expect("fits");
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log])));
        Stage::new(data.clone(), Some(data))
    }

    /// A set that leaves these residuals on both parts.
    fn leaves(residuals: Vec<f64>) -> Trial {
        let cost = residuals.iter().map(|value| value * value).sum();
        let fit = Fit {
            globals: Vec::new(),
            locals: Vec::new(),
            standard_errors: Vec::new(),
            cost,
            residuals,
            iterations: 0,
        };
        let (effects, names, model) = (Vec::new(), Vec::new(), Model::paper());
        Trial { effects, model, names, judged: fit.clone(), fit }
    }

    /// Noise of ±1 without a pattern: a bit of a hash (splitmix64).
    fn noise(row: usize) -> f64 {
        let mut bits = (row as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        if (bits >> 40) & 1 == 0 { 1.0 } else { -1.0 }
    }

    fn gain_of(trace: impl Fn(usize) -> f64) -> bool {
        let after: Vec<f64> = (0..ROWS).map(noise).collect();
        let before = (0..ROWS).map(|row| noise(row) + trace(row)).collect();
        gains(&stage(), &leaves(before), &leaves(after))
    }

    #[test]
    fn a_trace_all_along_is_worth_a_law() {
        // Of a pattern that no shift repeats.
        assert!(gain_of(|row| 0.5 * noise(row + 100_000)));
        // A fall of one in a hundred is not.
        assert!(!gain_of(|row| 0.09 * noise(row + 100_000)));
    }

    #[test]
    fn a_trace_in_one_stretch_is_not_worth_a_law_however_large() {
        assert!(!gain_of(|row| if row < ROWS / 24 { 3.0 * noise(row + 100_000) } else { 0.0 }));
    }

    #[test]
    fn a_trace_that_does_as_well_when_shifted_is_luck() {
        assert!(!gain_of(|row| if row % 2 == 0 { 0.8 } else { -0.8 }));
    }

    /// Of noise, a trace that has nothing to do with it explains the square of a standard normal number, of as many as there
    /// are rows: one in twenty 3.84 or more.
    #[test]
    fn what_luck_reaches_is_what_a_trace_without_meaning_explains() {
        let trace = |row: usize| 0.5 * noise(row + 100_000);
        let before = leaves((0..ROWS).map(|row| noise(row) + trace(row)).collect());
        let found = luck(&before, &leaves((0..ROWS).map(noise).collect()), 1);
        let squares = found.share * ROWS as f64;
        // The 95 % point of 199 draws: between the 91 % and the 98 % point of the law, nearly always.
        assert!((2.9..5.4).contains(&squares), "{squares}");
        assert!(found.chance < 0.01, "and the trace itself explains a fifth: {}", found.chance);
    }

    /// Few windows have few shifts: their signs tell, too.
    #[test]
    fn of_a_dozen_windows_a_trace_with_meaning_is_no_luck_and_one_without_is() {
        let (windows, period) = (12, 40);
        let rows = windows * period;
        let chance = |trace: &dyn Fn(usize) -> f64, own: f64| {
            let after = leaves((0..rows).map(|row| noise(row) + (own - 1.0) * trace(row)).collect());
            let before = leaves((0..rows).map(|row| noise(row) + own * trace(row)).collect());
            luck(&before, &after, period).chance
        };
        let real = chance(&|row| noise(row + 100_000), 1.0);
        assert!(real <= 0.02, "{real}");
        // Of twenty that have nothing to do with the residual one at 5 % is due; five would come in 0.3 % of all cases.
        let lucky = (0..20).filter(|seed| chance(&|row| noise(row + 1_000_000 * (seed + 1)), 0.0) <= 0.05);
        assert!(lucky.count() < 5);
        let seven = leaves(vec![1.0; 7 * period]);
        assert_eq!(luck(&seven, &leaves(vec![0.5; 7 * period]), period).chance, 1.0, "too few to tell");
    }

    #[test]
    fn a_limit_beyond_which_one_command_lies_is_a_bend_of_the_curve() {
        let known = Model::paper().known_effects().expect("the catalogue");
        let saturation = known.iter().find(|effect| effect.id == "command_saturation").expect("known");
        for (limit, sound) in [(0.5, true), (0.7, false), (0.9, false)] {
            let mut trial = leaves(vec![1.0; ROWS]);
            trial.effects.push(saturation.id.clone());
            trial.model = Model::paper().with(saturation);
            trial.model.set_parameter("command_saturation.limit", limit);
            assert_eq!(is_exercised(&stage(), &trial), sound, "limit {limit}");
        }
    }
}
