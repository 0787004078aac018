//! The answer, put together from what was found in each block.

use std::collections::BTreeMap;

use super::block_data::BlockOutput;
use super::candidate_fit::CandidateFit;
use super::config::DiagnoseConfig;
use super::diagnosis::{
    ChangedParameter, Diagnosis, ErrorSummary, FailurePlace, FoundParameter, LadderStep, NextExperiment,
    RankedCandidate, TrainValidate, Verdict,
};
use super::residual_evidence::evidence;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use super::unnamed;
use super::verdict::{joint, turns_against_torque};
use crate::effect;
use crate::estimation::moments::mean_square;
use crate::model::{Effect, Measure, Model};
use crate::screening::attitude::inertia_in_degrees;
use crate::screening::{DrivenBy, ScreenedLog};

/// The answer from what was found in each block, and the verdict on it.
pub(crate) fn conclude(
    model: &Model,
    known: &[Effect],
    (blocks, verdicts): (&[SearchResult], &[Verdict]),
    logs: &[ScreenedLog],
    config: &DiagnoseConfig,
) -> Diagnosis {
    let verdict = joint(verdicts);
    let effects: Vec<String> = blocks.iter().flat_map(|found| found.answer.effects.clone()).collect();
    let (main, channel) = main_block(blocks);
    let extended = merged(model, blocks, verdicts);
    let changed_parameters = changed_parameters(model, blocks, verdicts);
    let inertia = changed_parameters.iter().find(|changed| changed.is_inertia());
    let in_degrees = inertia.and_then(|inertia| inertia_in_degrees(inertia.from, inertia.to));
    let (nearest, further_alternatives) = alternatives(blocks);
    let (alternatives, alternative_errors): (Vec<_>, Vec<_>) = nearest.into_iter().unzip();
    let next_experiment = next_experiment(&effects, &alternatives);
    Diagnosis {
        verdict,
        parameters: parameters(&extended, known, &effects),
        changed_parameters,
        error: error_summary(main, channel, config),
        r#where: places(blocks, verdicts),
        ladder: main.ladder.iter().map(|fitted| rung(main, fitted, channel)).collect(),
        candidates: blocks.iter().flat_map(|found| candidates(found, &effects)).collect(),
        findings: super::caveats::warnings(logs, blocks).into_iter().chain(in_degrees).collect(),
        next_experiment,
        is_torque_driven: logs
            .iter()
            .filter_map(ScreenedLog::body)
            .any(|body| body.driven_by() == DrivenBy::TorqueCommand),
        turns_against_torque: blocks.iter().any(turns_against_torque),
        alternatives,
        further_alternatives,
        common_effects: common_effects(blocks),
        alternative_errors,
        effects,
        model: extended,
    }
}

/// The channel in which a block's error is given: the first, where the refitted baseline plainly fails in it, else
/// the one in which it fails most.
pub(crate) fn main_channel(found: &SearchResult) -> usize {
    let first = found.refitted.channel_error(&found.split, 0, true) / found.floors[0];
    if first > THRESHOLDS.plain_error { 0 } else { found.over_floor(&found.refitted).1 }
}

/// The block and channel in which the error is given: where the refitted baseline is worst over its noise.
pub(crate) fn main_block(blocks: &[SearchResult]) -> (&SearchResult, usize) {
    let worst = |found: &&SearchResult| {
        let (nominal, refitted) = (found.over_floor(&found.nominal).0, found.over_floor(&found.refitted).0);
        // Where an effect is named the refitted baseline is what it must beat; else the nominal one shows more.
        let is_named = found.ladder.last().is_some_and(|fitted| !fitted.effects.is_empty());
        if is_named { 1e3 * refitted } else { nominal }
    };
    let best = blocks.iter().max_by(|a, b| worst(a).total_cmp(&worst(b))).unwrap_or(&blocks[0]);
    (best, main_channel(best))
}

/// The model with what each block found.
pub(crate) fn merged(model: &Model, blocks: &[SearchResult], verdicts: &[Verdict]) -> Model {
    let mut merged = model.clone();
    for (found, verdict) in blocks.iter().zip(verdicts) {
        let best = &found.answer;
        // A block that is fine keeps its numbers.
        if *verdict == Verdict::Adequate || *verdict == Verdict::InsufficientData {
            continue;
        }
        for added in &best.model.effects {
            if !merged.has(&added.id) && best.effects.contains(&added.id) {
                merged.effects.push(added.clone());
            }
        }
        for name in &best.names {
            if let Some(value) = best.model.parameter(name) {
                merged.set_parameter(name, value);
            }
            if let Some(error) = best.model.standard_errors.get(name) {
                merged.standard_errors.insert(name.clone(), *error);
            }
        }
    }
    merged
}

fn parameters(model: &Model, known: &[Effect], effects: &[String]) -> BTreeMap<String, FoundParameter> {
    let mut parameters = BTreeMap::new();
    for effect in known.iter().filter(|effect| effects.contains(&effect.id)) {
        for parameter in &effect.parameters {
            let name = format!("{}.{}", effect.id, parameter.name);
            if let Some(value) = model.parameter(&name) {
                let standard_error = model.standard_errors.get(&name).copied();
                parameters
                    .insert(name, FoundParameter { value, standard_error, unit: parameter.unit.clone() });
            }
        }
    }
    parameters
}

pub(crate) fn changed_parameters(
    model: &Model,
    blocks: &[SearchResult],
    verdicts: &[Verdict],
) -> Vec<ChangedParameter> {
    let mut changed = Vec::new();
    for (found, _) in
        blocks.iter().zip(verdicts).filter(|(_, verdict)| **verdict != Verdict::InsufficientData)
    {
        for name in &found.changed {
            let best = &found.answer.model;
            let (unit, symbol) = Model::base_parameter_unit(name);
            changed.push(ChangedParameter {
                symbol: symbol.to_owned(),
                unit: unit.to_owned(),
                from: model.parameter(name).unwrap_or(f64::NAN),
                to: best.parameter(name).unwrap_or(f64::NAN),
                standard_error: best.standard_errors.get(name).copied(),
                name: name.clone(),
            });
        }
    }
    changed
}

fn error_of(found: &SearchResult, fitted: &CandidateFit, channel: usize) -> TrainValidate {
    TrainValidate {
        train: fitted.channel_error(&found.split, channel, false),
        validate: fitted.channel_error(&found.split, channel, true),
    }
}

pub(crate) fn error_summary(found: &SearchResult, channel: usize, config: &DiagnoseConfig) -> ErrorSummary {
    let what = found.split.train.channels()[channel];
    let windows_s = (!found.split.train.is_rotor()).then_some(config.horizon);
    ErrorSummary {
        channel: label(what),
        unit: what.unit,
        measure: Measure::of_free_runs(what.name, windows_s, what.unit),
        noise_floor: found.floors[channel],
        base: error_of(found, &found.nominal, channel),
        refitted: error_of(found, &found.refitted, channel),
        extended: error_of(found, &found.answer, channel),
    }
}

/// A channel with its unit.
fn label(channel: BlockOutput) -> String {
    format!("{} [{}]", channel.name, channel.unit)
}

fn rung(found: &SearchResult, fitted: &CandidateFit, channel: usize) -> LadderStep {
    LadderStep {
        effects: fitted.effects.clone(),
        validate: fitted.channel_error(&found.split, channel, true),
    }
}

/// A set, the held-out error of the block that it is another one of, and its unit.
type WithError = (Vec<String>, (f64, &'static str));

/// All sets that the data cannot tell from the answer of a block: first one with two effects in the place of one, then the nearest other.
fn indistinguishable(found: &SearchResult) -> impl Iterator<Item = &CandidateFit> {
    let (larger, others) = (found.two_for_one.iter(), found.alternatives.iter());
    let firsts = larger.clone().take(1).chain(others.clone().take(1));
    firsts.chain(larger.skip(1)).chain(others.skip(1))
}

/// Sets that the data cannot tell from the answer, one block's set exchanged for another: the nearest, and further ones.
fn alternatives(blocks: &[SearchResult]) -> (Vec<WithError>, Vec<Vec<String>>) {
    let mut nearest = Vec::new();
    for (index, found) in blocks.iter().enumerate() {
        for other in indistinguishable(found) {
            let set = blocks.iter().enumerate().flat_map(|(block, found)| {
                if block == index { other.effects.clone() } else { found.answer.effects.clone() }
            });
            let channel = main_channel(found);
            let error = other.channel_error(&found.split, channel, true);
            nearest.push((set.collect(), (error, found.split.train.channels()[channel].unit)));
        }
    }
    let further = nearest.split_off(nearest.len().min(THRESHOLDS.most_alternatives));
    let further = further.into_iter().take(THRESHOLDS.most_further_alternatives).map(|(set, _)| set);
    (nearest, further.collect())
}

/// The effects of the answer that every set has which the data cannot tell from it.
fn common_effects(blocks: &[SearchResult]) -> Vec<String> {
    let of_block = |found: &SearchResult| {
        let is_common = |id: &&String| indistinguishable(found).all(|other| other.effects.contains(id));
        found.answer.effects.iter().filter(is_common).cloned().collect::<Vec<_>>()
    };
    blocks.iter().flat_map(of_block).collect()
}

/// The candidates of a block; `named_effects` are those of all blocks.
fn candidates(found: &SearchResult, named_effects: &[String]) -> Vec<RankedCandidate> {
    let (best, channel) = (&found.answer, main_channel(found));
    let what = found.split.train.channels()[channel];
    let base = found.refitted.channel_error(&found.split, channel, true);
    let mut candidates: Vec<RankedCandidate> = found
        .singles
        .iter()
        .map(|single| {
            // By the set that is left, not by place: an exchange of effects moves the one and not the other.
            let rest = |fitted: &&CandidateFit| {
                fitted.effects.len() + 1 == best.effects.len()
                    && best.effects.iter().all(|id| (*id == single.effect) != fitted.effects.contains(id))
            };
            let named = best.effects.contains(&single.effect);
            let drop_one = named.then(|| found.dropped.iter().find(rest)).flatten();
            RankedCandidate {
                effect: single.effect.clone(),
                channel: label(what),
                train: single
                    .fitted
                    .as_ref()
                    .map(|fitted| fitted.channel_error(&found.split, channel, false)),
                validate: single
                    .fitted
                    .as_ref()
                    .map(|fitted| fitted.channel_error(&found.split, channel, true)),
                p_value: single.surrogate.map(|surrogate| surrogate.p_value),
                surrogate_error: single.surrogate.map(|surrogate| base * (1.0 - surrogate.share).sqrt()),
                drop_one: drop_one.map(|fitted| fitted.channel_error(&found.split, channel, true)),
                refusal: single.refusal.clone(),
                not_named: unnamed::in_answer(found, named_effects, single),
            }
        })
        .collect();
    let error = |candidate: &RankedCandidate| candidate.validate.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| error(a).total_cmp(&error(b)));
    candidates
}

fn places(blocks: &[SearchResult], verdicts: &[Verdict]) -> Vec<FailurePlace> {
    let mut places = Vec::new();
    let held_out = blocks.iter().zip(verdicts).filter(|(_, verdict)| **verdict != Verdict::InsufficientData);
    for (found, _) in held_out {
        let best_is_base = found.answer.effects.is_empty();
        let fit = if best_is_base { &found.nominal.fit } else { &found.refitted.fit };
        for evidence in evidence(&found.split.train, fit) {
            let excess =
                ((mean_square(&evidence.error) / evidence.noise.max(f64::MIN_POSITIVE)) - 1.0).max(0.0);
            let (depends_on, explained) = evidence.strongest();
            places.push(FailurePlace {
                block: evidence.block,
                share_of_error: excess,
                depends_on,
                explained,
            });
        }
    }
    let total: f64 = places.iter().map(|place| place.share_of_error).sum();
    if total > 0.0 {
        places.iter_mut().for_each(|place| place.share_of_error /= total);
    }
    places.sort_by(|a, b| b.share_of_error.total_cmp(&a.share_of_error));
    places
}

fn next_experiment(effects: &[String], alternatives: &[Vec<String>]) -> Option<NextExperiment> {
    let other = alternatives.first()?;
    let differs = |set: &[String], other: &[String]| set.iter().find(|id| !other.contains(id)).cloned();
    let card = differs(effects, other)
        .and_then(|id| effect::find(&id))
        .or_else(|| differs(other, effects).and_then(|id| effect::find(&id)));
    Some(NextExperiment {
        separates: std::iter::once(effects.to_vec()).chain(alternatives.iter().cloned()).collect(),
        run: card.map_or_else(String::new, |card| card.experiment.to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use super::super::candidate_fit::CandidateFit;
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    #[test]
    fn what_every_set_has_counts_the_sets_that_are_not_listed() {
        let set = |ids: &[&str]| {
            let effects = ids.iter().map(|id| (*id).to_owned()).collect();
            CandidateFit { effects, ..leaves((0..ROWS).map(noise).collect()) }
        };
        let mut found = SearchResult::of_one(split(), [&[][..], &[], &["a", "b"]].map(set), Vec::new());
        assert_eq!(common_effects(std::slice::from_ref(&found)), ["a", "b"]);
        found.alternatives = vec![set(&["a", "b", "c"]); 7];
        found.alternatives.push(set(&["c", "b"]));
        assert_eq!(common_effects(std::slice::from_ref(&found)), ["b"], "the last of eight has no a");
        found.two_for_one.push(set(&["a", "c", "d"]));
        assert!(common_effects(std::slice::from_ref(&found)).is_empty());
    }

    #[test]
    fn of_many_sets_two_stand_with_their_errors_and_four_more_without() {
        let set = |id: &str| {
            let residuals = (0..ROWS).map(noise).collect();
            CandidateFit { effects: vec![id.to_owned()], ..leaves(residuals) }
        };
        let mut found = SearchResult::of_one(split(), ["a", "b", "c"].map(set), Vec::new());
        for (others, nearest, further) in [(0, 0, 0), (2, 2, 0), (3, 2, 1), (6, 2, 4), (9, 2, 4)] {
            found.alternatives = (0..others).map(|number: usize| set(&number.to_string())).collect();
            let (with_errors, without) = alternatives(std::slice::from_ref(&found));
            assert_eq!((with_errors.len(), without.len()), (nearest, further), "{others}");
            let sets: Vec<String> =
                with_errors.iter().map(|it| &it.0).chain(&without).flatten().cloned().collect();
            let expected: Vec<String> = (0..nearest + further).map(|number| number.to_string()).collect();
            assert_eq!(sets, expected, "nearest first");
        }
        found.alternatives = ["a", "b"].map(set).to_vec();
        found.two_for_one = ["c", "d"].map(set).to_vec();
        let (with_errors, without) = alternatives(std::slice::from_ref(&found));
        let sets: Vec<String> =
            with_errors.iter().map(|it| &it.0).chain(&without).flatten().cloned().collect();
        assert_eq!(
            sets,
            ["c", "a", "d", "b"],
            "two effects for one, and the nearest of the same size, before the others"
        );
    }
}
