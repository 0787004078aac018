//! Model selection: what an effect must gain, which sets are identifiable, and which the data cannot tell apart.

use std::ops::Range;

use super::block_data::{BlockData, Runs};
use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::grid_search::finest;
use super::not_named::Unmet;
use super::rotor_block::RotorRun;
use super::surrogate_test::surrogate;
use super::thresholds::THRESHOLDS;
use crate::effect::{Site, Term, find};
use crate::estimation::output_error::Residuals;
use crate::model::{Effect, Model};
use crate::threads::both;

pub(crate) fn over_floor(split: &DataSplit, fitted: &CandidateFit, floors: &[f64; 2]) -> (f64, usize) {
    let ratio = |channel: usize| fitted.channel_error(split, channel, true) / floors[channel];
    let channels = 0..split.train.channels().len();
    channels.map(|channel| (ratio(channel), channel)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((1.0, 0))
}

/// How many times the noise a set leaves of what it was fitted on, or of what was held out, in the channel where that is most.
/// Noise with a memory counts as noise here, as in the verdict: no effect is looked for in it.
pub(crate) fn over_floors(split: &DataSplit, fitted: &CandidateFit) -> f64 {
    over_both(split, fitted, BlockData::floors)
}

/// The same over what surely is noise.
pub(crate) fn over_white_floors(split: &DataSplit, fitted: &CandidateFit) -> f64 {
    over_both(split, fitted, BlockData::white_floors)
}

fn over_both(
    split: &DataSplit,
    fitted: &CandidateFit,
    floors: impl Fn(&BlockData, &Residuals, f64) -> [f64; 2] + Sync,
) -> f64 {
    let inertia = fitted.model.body.inertia;
    let (train, held_out) = both(
        || floors(&split.train, &fitted.fit.residuals, inertia),
        || floors(&split.validate, &fitted.held_out.residuals, inertia),
    );
    let of_channel = |channel: usize| {
        let fitted_on = fitted.channel_error(split, channel, false) / train[channel];
        fitted_on.max(fitted.channel_error(split, channel, true) / held_out[channel])
    };
    (0..split.train.channels().len()).map(of_channel).fold(0.0, f64::max)
}

/// Whether `after` gains enough for its extra freedom over `before`.
pub(crate) fn improves(split: &DataSplit, before: &CandidateFit, after: &CandidateFit) -> bool {
    shortfall(split, before, after).is_none()
}

/// What `after` falls short of to gain enough over `before`; `None` where it does gain enough.
pub(crate) fn shortfall(split: &DataSplit, before: &CandidateFit, after: &CandidateFit) -> Option<Unmet> {
    if before.is_exact(split) {
        return Some(Unmet::NothingLeft);
    }
    // What is not a number is no gain.
    let exceeds = |value: f64, least: f64| value > least;
    let held_out = 1.0 - after.validate(split) / before.validate(split);
    let fitted = 1.0 - after.fit.cost / before.fit.cost;
    // The held-out data may hardly excite what the data fitted on show well.
    let little = held_out > THRESHOLDS.little_gain
        && fitted > THRESHOLDS.much_training_gain
        && before.held_out_consistency(after) > THRESHOLDS.very_consistent;
    if !little {
        if !exceeds(held_out, THRESHOLDS.least_gain) {
            return Some(Unmet::TooLittle { share: held_out, needed: THRESHOLDS.least_gain });
        }
        if !exceeds(fitted, THRESHOLDS.least_training_gain) {
            return Some(Unmet::TooLittleFitted { share: fitted, needed: THRESHOLDS.least_training_gain });
        }
        let standard_errors = before.consistency(after);
        if !exceeds(standard_errors, THRESHOLDS.consistent) {
            return Some(Unmet::Unsteady { standard_errors, needed: THRESHOLDS.consistent });
        }
    }
    let p_value = surrogate(before, after, period(split)).p_value;
    let most = THRESHOLDS.significance_level;
    exceeds(p_value, most).then_some(Unmet::Chance { p_value, most })
}

/// Windows may only be shifted whole.
pub(crate) fn period(split: &DataSplit) -> usize {
    if split.train.is_rotor() { 1 } else { split.validate.units().first().map_or(1, std::ops::Range::len) }
}

/// Noise floors from the answer's residuals on both parts.
pub(crate) fn joint_floors(split: &DataSplit, best: &CandidateFit) -> [f64; 2] {
    on_both_parts(split, best, BlockData::floors)
}

fn on_both_parts(
    split: &DataSplit,
    best: &CandidateFit,
    floors: impl Fn(&BlockData, &Residuals, f64) -> [f64; 2] + Sync,
) -> [f64; 2] {
    let inertia = best.model.body.inertia;
    let (train, validate) = both(
        || floors(&split.train, &best.fit.residuals, inertia),
        || floors(&split.validate, &best.held_out.residuals, inertia),
    );
    [0.5 * (train[0] + validate[0]), 0.5 * (train[1] + validate[1])]
}

/// Weighs each channel of the split by how large its noise is.
pub(crate) fn weigh_channels(split: &mut DataSplit, fitted: &CandidateFit) {
    let floors = split.train.white_floors(&fitted.fit.residuals, fitted.model.body.inertia);
    let weight = |channel: usize| {
        floors[channel].max(THRESHOLDS.least_channel_weight * fitted.channel_error(split, channel, false))
    };
    let channels = split.train.channels().len();
    let sigma = [weight(0), if channels > 1 { weight(1) } else { 1.0 }];
    split.set_sigma(sigma);
}

/// Whether a set can be physics: every effect of it determined, none cancelled by another.
pub(crate) fn is_identifiable(split: &DataSplit, fitted: &CandidateFit, known: &[Effect]) -> bool {
    unidentified(split, fitted, known).is_none()
}

/// Why a set cannot be physics; `None` where it can be.
pub(crate) fn unidentified(split: &DataSplit, fitted: &CandidateFit, known: &[Effect]) -> Option<Unmet> {
    if !is_exercised(split, fitted) {
        return Some(Unmet::NotExercised { needed: THRESHOLDS.fewest_beyond_limit });
    }
    if !fitted.is_determined(split, known) || has_too_fine_a_grid(split, fitted, known) {
        return Some(Unmet::NotDetermined);
    }
    fitted.cancels(split, known).then_some(Unmet::Cancels)
}

/// Whether a grid of a set is one on which hardly two of the commands share a level.
fn has_too_fine_a_grid(split: &DataSplit, fitted: &CandidateFit, known: &[Effect]) -> bool {
    let own = known.iter().filter(|effect| effect.is_grid() && fitted.effects.contains(&effect.id));
    let names =
        own.flat_map(|effect| effect.parameters.iter().map(|own| format!("{}.{}", effect.id, own.name)));
    let steps: Vec<f64> = names.filter_map(|name| fitted.model.parameter(&name)).collect();
    // Commands are counted where there is a grid only.
    let Some(step) = steps.into_iter().reduce(f64::min) else { return false };
    step < THRESHOLDS.end_of_finest_grid * finest(&split.train)
}

/// Whether the data go beyond the limit that a set says the command has.
fn is_exercised(split: &DataSplit, fitted: &CandidateFit) -> bool {
    let Runs::Rotor(runs) = &split.train.runs else { return true };
    let is_limit = |id: &String| find(id).is_some_and(|card| card.acts_as == Some(Term::Saturation));
    let limit = fitted.effects.iter().any(is_limit).then(|| fitted.model.greatest_command()).flatten();
    limit.is_none_or(|limit| {
        let mut beyond: Vec<f64> = Vec::new();
        let mut commands = runs.iter().flat_map(|run| &run.command).filter(|command| **command > limit);
        commands.any(|command| {
            if !beyond.contains(command) {
                beyond.push(*command);
            }
            beyond.len() >= THRESHOLDS.fewest_beyond_limit
        })
    })
}

/// Whether a set gives the rotors' sensor a law of its own, as a delay.
pub(crate) fn senses_rotors(fitted: &CandidateFit) -> bool {
    fitted.effects.iter().any(|id| find(id).is_some_and(|card| card.site == Site::RotorRateSensor))
}

pub(crate) fn same_set(a: &[String], b: &[String]) -> bool {
    a.len() == b.len() && a.iter().all(|id| b.contains(id))
}

/// Squared error on all data, fitted and held out, but for how each log begins: there a rotor with a dead time is on its way to what nobody
/// logged, and laws of delay differ in what they take that to be.
pub(crate) fn loss(split: &DataSplit, fitted: &CandidateFit) -> f64 {
    let training = fitted.fit.cost - beginnings(&split.train, &fitted.fit.residuals.all());
    let held_out = fitted.held_out.cost - beginnings(&split.validate, &fitted.held_out.residuals.all());
    training * fitted.train(split).signum() + held_out
}

/// Squared error of the rotors in the beginnings of their logs.
fn beginnings(data: &BlockData, residuals: &[f64]) -> f64 {
    let Runs::Rotor(runs) = &data.runs else { return 0.0 };
    let firsts = runs.iter().zip(data.units()).filter(|(run, _)| run.rows.start == 0);
    let of_run = |(run, unit): (&RotorRun, &Range<usize>)| -> f64 {
        let until = run.time.first().map_or(0.0, |first| first + THRESHOLDS.unlogged_command_s);
        let count = run.time.iter().take_while(|time| **time < until).count();
        residuals[unit.clone()].iter().take(count).map(|residual| residual * residual).sum()
    };
    firsts.map(of_run).sum()
}

/// Mean square of noise alone, in the measure of [`CandidateFit::validate`].
pub(crate) fn floor(split: &DataSplit, floors: &[f64; 2]) -> f64 {
    let channels = split.train.channels().len();
    let share = |channel: usize| (floors[channel] / split.train.sigma[channel]).powi(2);
    (0..channels).map(share).sum::<f64>() / channels as f64
}

/// Sets as small as the answer that the data cannot tell apart from it, nearest first.
pub(crate) fn indistinguishable(
    split: &DataSplit,
    best: &CandidateFit,
    fits: &[CandidateFit],
    known: &[Effect],
) -> Vec<CandidateFit> {
    // What the answer itself leaves unexplained blurs the difference between laws.
    let floors = on_both_parts(split, best, BlockData::white_floors);
    let left = 1.0 - (floor(split, &floors) / best.validate(split)).clamp(0.0, 1.0);
    let tolerance = same_share(best) + THRESHOLDS.indistinguishable_share * left;
    let limit = |fitted: &CandidateFit| {
        // A delay of the sensor and one of the rotor differ in how a log begins; that must not decide between them.
        let is_other_sensor = senses_rotors(fitted) != senses_rotors(best);
        loss(split, best)
            * (1.0 + if is_other_sensor { tolerance.max(THRESHOLDS.least_gain) } else { tolerance })
    };
    let near = fits.iter().filter(|fitted| {
        fitted.effects.len() <= best.effects.len()
            && !same_set(&fitted.effects, &best.effects)
            && loss(split, fitted) <= limit(fitted)
            && is_identifiable(split, fitted, known)
    });
    let mut near: Vec<CandidateFit> = near.filter(|_| !best.effects.is_empty()).cloned().collect();
    near.sort_by(|a, b| loss(split, a).total_cmp(&loss(split, b)));
    best_of_each(split, near)
}

/// Share of the squared error within which two sets are the same: a difference in log-likelihood of ten, or half a percent.
pub(crate) fn same_share(best: &CandidateFit) -> f64 {
    let residuals = [&best.fit.residuals, &best.held_out.residuals];
    let used = residuals.iter().flat_map(|it| it.measured()).filter(|value| **value != 0.0).count();
    (2.0 * THRESHOLDS.same_likelihood / used.max(1) as f64).max(THRESHOLDS.same_error)
}

/// The base's own numbers that a fit left at the end of their range, a pole or an inertia that no bench has.
pub(crate) fn ran_off(fitted: &CandidateFit, base: &Model) -> Vec<&'static str> {
    let inertia = fitted.model.body.inertia / base.body.inertia;
    let own = [
        ("pole", fitted.model.actuator.pole, THRESHOLDS.pole_bounds),
        ("inertia", inertia, THRESHOLDS.inertia_bounds),
    ];
    let share = THRESHOLDS.bound_share;
    let is_at_end = |value: f64, (lowest, highest): (f64, f64)| {
        value <= lowest * (1.0 + share) || value >= highest * (1.0 - share)
    };
    let ran_off = own.into_iter().filter(|(name, value, bounds)| {
        fitted.names.iter().any(|free| free == name) && is_at_end(*value, *bounds)
    });
    ran_off.map(|(name, ..)| name).collect()
}

/// Of the fits of one set, on several ways to it, the one that leaves least.
pub(crate) fn best_of_each(split: &DataSplit, fits: Vec<CandidateFit>) -> Vec<CandidateFit> {
    let mut best: Vec<(f64, CandidateFit)> = Vec::with_capacity(fits.len());
    for fitted in fits {
        let loss = loss(split, &fitted);
        match best.iter_mut().find(|(_, known)| same_set(&known.effects, &fitted.effects)) {
            Some(known) if loss < known.0 => *known = (loss, fitted),
            Some(_) => {}
            None => best.push((loss, fitted)),
        }
    }
    best.into_iter().map(|(_, fitted)| fitted).collect()
}

/// The best sets on the way to the answer, each a part of the next, the answer last.
pub(crate) fn steps(split: &DataSplit, best: &CandidateFit, fits: &[CandidateFit]) -> Vec<CandidateFit> {
    let mut path = Vec::new();
    let mut now = best.clone();
    while !now.effects.is_empty() {
        path.push(now.clone());
        let part = |fitted: &&CandidateFit| {
            fitted.effects.len() + 1 == now.effects.len()
                && fitted.effects.iter().all(|id| now.effects.contains(id))
        };
        match fits.iter().filter(part).min_by(|a, b| a.validate(split).total_cmp(&b.validate(split))) {
            Some(fitted) => now = fitted.clone(),
            None => break,
        }
    }
    path.reverse();
    path
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    fn unmet_by(trace: impl Fn(usize) -> f64) -> Option<Unmet> {
        let after: Vec<f64> = (0..ROWS).map(noise).collect();
        let before = (0..ROWS).map(|row| noise(row) + trace(row)).collect();
        shortfall(&split(), &leaves(before), &leaves(after))
    }

    fn gain_of(trace: impl Fn(usize) -> f64) -> bool {
        unmet_by(trace).is_none()
    }

    #[test]
    fn a_number_at_the_end_of_its_range_has_run_off_where_it_was_free() {
        let base = Model::paper();
        let ran = |name: &str, value: f64, free: &str| {
            let mut fitted = CandidateFit { names: vec![free.to_owned()], ..leaves(vec![0.0; ROWS]) };
            fitted.model = base.clone();
            fitted.model.set_parameter(name, value);
            ran_off(&fitted, &base)
        };
        let (lowest, highest) = THRESHOLDS.pole_bounds;
        assert_eq!(ran("pole", lowest, "pole"), ["pole"]);
        assert_eq!(ran("pole", highest, "pole"), ["pole"]);
        assert!(ran("pole", 1.01 * lowest, "pole").is_empty(), "a slow one");
        assert!(ran("pole", lowest, "inertia").is_empty(), "the base's own");
        let most = THRESHOLDS.inertia_bounds.1 * base.body.inertia;
        assert_eq!(ran("inertia", most, "inertia"), ["inertia"]);
        assert!(ran("inertia", 0.1 * most, "inertia").is_empty(), "a heavy one");
    }

    /// Three levels 0.2 apart: of a step of 0.2 each has its own, of one of 0.3 two have the same.
    #[test]
    fn a_grid_on_which_no_two_commands_share_a_level_is_none() {
        let (base, split) = (Model::paper(), split());
        let known = base.known_effects().expect("the catalogue");
        let grid = known.iter().find(|effect| effect.is_grid()).expect("known");
        let of = |effects: &[&str], step: f64| {
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            let mut model = base.with(grid);
            model.set_parameter("command_quantization.step", step);
            model.standard_errors.insert("command_quantization.step".to_owned(), 1e-3);
            CandidateFit { effects, model, ..leaves(vec![1.0; ROWS]) }
        };
        let why = |step: f64| unidentified(&split, &of(&["command_quantization"], step), &known);
        assert_eq!((why(0.2), why(0.3)), (Some(Unmet::NotDetermined), None));
        assert!(!has_too_fine_a_grid(&split, &of(&["transport_delay"], 0.2), &known), "the model's own");
    }

    #[test]
    fn each_condition_of_a_gain_is_named() {
        let apart = |row: usize| noise(row + 100_000);
        let first_stretch = |row: usize| if row < ROWS / 24 { 3.0 * apart(row) } else { 0.0 };
        assert_eq!(unmet_by(|row| 0.5 * apart(row)), None);
        assert!(
            matches!(unmet_by(|row| 0.09 * apart(row)), Some(Unmet::TooLittle { share, .. }) if share < 0.03)
        );
        assert!(
            matches!(unmet_by(first_stretch), Some(Unmet::Unsteady { standard_errors, .. }) if standard_errors < 2.0)
        );
        let alternating = |row: usize| if row.is_multiple_of(2) { 0.8 } else { -0.8 };
        assert!(matches!(unmet_by(alternating), Some(Unmet::Chance { p_value, .. }) if p_value > 0.05));
        // Held out alone it gains.
        let before = leaves((0..ROWS).map(|row| noise(row) + 0.5 * apart(row)).collect());
        let after = CandidateFit { fit: before.fit.clone(), ..leaves((0..ROWS).map(noise).collect()) };
        let unmet = shortfall(&split(), &before, &after);
        assert!(matches!(unmet, Some(Unmet::TooLittleFitted { share: 0.0, .. })), "{unmet:?}");
        let exact = leaves(vec![1e-9; ROWS]);
        assert_eq!(shortfall(&split(), &exact, &after), Some(Unmet::NothingLeft));
    }

    /// Fitted on two ways, with another one between them.
    #[test]
    fn a_set_that_the_data_cannot_tell_apart_is_listed_once() {
        let set = |id: &str, more: f64| {
            let residuals = (0..ROWS).map(|row| (1.0 + more) * noise(row)).collect();
            CandidateFit { effects: vec![id.to_owned()], ..leaves(residuals) }
        };
        // Half a percent of the square is a quarter of one of the residual.
        let fits = [set("b", 0.0005), set("far", 0.01), set("c", 0.001), set("b", 0.0015)];
        let near = indistinguishable(&split(), &set("a", 0.0), &fits, &[]);
        let ids: Vec<&str> = near.iter().map(|it| it.effects[0].as_str()).collect();
        assert_eq!(ids, ["b", "c"]);
    }

    #[test]
    fn a_trace_all_along_is_a_law() {
        // Of a pattern that no shift repeats.
        assert!(gain_of(|row| 0.5 * noise(row + 100_000)));
        // A fall of one in a hundred is not.
        assert!(!gain_of(|row| 0.09 * noise(row + 100_000)));
    }

    #[test]
    fn a_trace_in_one_stretch_is_no_law_however_large() {
        assert!(!gain_of(|row| if row < ROWS / 24 { 3.0 * noise(row + 100_000) } else { 0.0 }));
    }

    #[test]
    fn a_trace_that_does_as_well_when_shifted_is_chance() {
        assert!(!gain_of(|row| if row % 2 == 0 { 0.8 } else { -0.8 }));
    }

    /// Of noise, a trace that has nothing to do with it explains the square of a standard normal number, of as many as there
    /// are rows: one in twenty 3.84 or more.
    #[test]
    fn what_surrogates_reach_is_what_a_trace_without_meaning_explains() {
        let trace = |row: usize| 0.5 * noise(row + 100_000);
        let before = leaves((0..ROWS).map(|row| noise(row) + trace(row)).collect());
        let found = surrogate(&before, &leaves((0..ROWS).map(noise).collect()), 1);
        let squares = found.share * ROWS as f64;
        // The 95 % point of 199 draws: between the 91 % and the 98 % point of the law, nearly always.
        assert!((2.9..5.4).contains(&squares), "{squares}");
        assert!(found.p_value < 0.01, "and the trace itself explains a fifth: {}", found.p_value);
    }

    /// Few windows have few shifts: their signs tell, too.
    #[test]
    fn of_a_dozen_windows_a_trace_with_meaning_is_significant_and_one_without_is() {
        let (windows, period) = (12, 40);
        let rows = windows * period;
        let p_value = |trace: &dyn Fn(usize) -> f64, own: f64| {
            let after = leaves((0..rows).map(|row| noise(row) + (own - 1.0) * trace(row)).collect());
            let before = leaves((0..rows).map(|row| noise(row) + own * trace(row)).collect());
            surrogate(&before, &after, period).p_value
        };
        let real = p_value(&|row| noise(row + 100_000), 1.0);
        assert!(real <= 0.02, "{real}");
        // Of twenty that have nothing to do with the residual one at 5 % is due; five would come in 0.3 % of all cases.
        let by_chance =
            (0..20).filter(|seed| p_value(&|row| noise(row + 1_000_000 * (seed + 1)), 0.0) <= 0.05);
        assert!(by_chance.count() < 5);
        let seven = leaves(vec![1.0; 7 * period]);
        assert_eq!(surrogate(&seven, &leaves(vec![0.5; 7 * period]), period).p_value, 1.0, "too few to tell");
    }

    #[test]
    fn a_limit_beyond_which_one_command_lies_is_a_bend_of_the_curve() {
        let known = Model::paper().known_effects().expect("the catalogue");
        let saturation = known.iter().find(|effect| effect.id == "command_saturation").expect("known");
        for (limit, identifiable) in [(0.5, true), (0.7, false), (0.9, false)] {
            let mut fitted = leaves(vec![1.0; ROWS]);
            fitted.effects.push(saturation.id.clone());
            fitted.model = Model::paper().with(saturation);
            fitted.model.set_parameter("command_saturation.limit", limit);
            let unmet = unidentified(&split(), &fitted, &[]);
            let expected = (!identifiable).then_some(Unmet::NotExercised { needed: 2 });
            assert_eq!(unmet, expected, "limit {limit}");
        }
    }
}
