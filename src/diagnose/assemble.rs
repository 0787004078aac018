//! The answer, put together from what was found in each block.

use std::collections::BTreeMap;

use super::candidate_fit::Trial;
use super::config::DiagnoseConfig;
use super::diagnosis::{
    Both, Candidate, ChangedParameter, Diagnosis, ErrorStory, FoundParameter, NextExperiment, Place, Rung,
    Verdict,
};
use super::search_result::Found;
use super::verdict::{joint, turns_against_torque};
use crate::effect;
use crate::estimation::dependence::evidence;
use crate::log::Dataset;
use crate::model::{Effect, Model};

/// Sets named beside the answer.
pub(crate) const MOST_ALTERNATIVES: usize = 2;

/// The answer from what was found in each block, and the verdict on it.
pub(crate) fn conclude(
    model: &Model,
    known: &[Effect],
    (blocks, verdicts): (&[Found], &[Verdict]),
    logs: &[&Dataset],
    config: &DiagnoseConfig,
) -> Diagnosis {
    let verdict = joint(verdicts);
    let effects: Vec<String> = blocks.iter().flat_map(|found| found.answer.effects.clone()).collect();
    let (main, channel) = main_block(blocks);
    let extended = merged(model, blocks, verdicts);
    let alternatives = alternatives(blocks);
    let next_experiment = next_experiment(&effects, &alternatives);
    Diagnosis {
        verdict,
        parameters: parameters(&extended, known, &effects),
        changed_parameters: changed_parameters(model, blocks, verdicts),
        error: error_story(main, channel, config),
        r#where: places(blocks, verdicts),
        ladder: main.ladder.iter().map(|trial| rung(main, trial, channel)).collect(),
        candidates: blocks.iter().flat_map(|found| candidates(found, channel_of(found))).collect(),
        findings: super::caveats::warnings(logs, blocks),
        next_experiment,
        turns_against_torque: blocks.iter().any(turns_against_torque),
        alternatives,
        effects,
        model: extended,
    }
}

/// The channel that a block's error is told in: the first, where the recalibrated base plainly fails in it, else
/// the one in which it fails most.
fn channel_of(found: &Found) -> usize {
    let first = found.recalibrated.channel_error(&found.stage, 0, true) / found.floors[0];
    if first > PLAINLY { 0 } else { found.over_floor(&found.recalibrated).1 }
}

/// An error this far over its noise floor is plain to see.
const PLAINLY: f64 = 1.5;

/// The block and channel that the error is told in: where the recalibrated base is worst over its noise.
pub(crate) fn main_block(blocks: &[Found]) -> (&Found, usize) {
    let worst = |found: &&Found| {
        let (stale, recalibrated) =
            (found.over_floor(&found.stale).0, found.over_floor(&found.recalibrated).0);
        // Where an effect is named the recalibrated base is what it must beat; else the stale one tells more.
        let is_named = found.ladder.last().is_some_and(|trial| !trial.effects.is_empty());
        if is_named { 1e3 * recalibrated } else { stale }
    };
    let best = blocks.iter().max_by(|a, b| worst(a).total_cmp(&worst(b))).unwrap_or(&blocks[0]);
    (best, channel_of(best))
}

/// The model with what each block found.
pub(crate) fn merged(model: &Model, blocks: &[Found], verdicts: &[Verdict]) -> Model {
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

fn changed_parameters(model: &Model, blocks: &[Found], verdicts: &[Verdict]) -> Vec<ChangedParameter> {
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

fn error_of(found: &Found, trial: &Trial, channel: usize) -> Both {
    Both {
        train: trial.channel_error(&found.stage, channel, false),
        validate: trial.channel_error(&found.stage, channel, true),
    }
}

pub(crate) fn error_story(found: &Found, channel: usize, config: &DiagnoseConfig) -> ErrorStory {
    let what = found.stage.train.channels()[channel];
    let how = if found.stage.train.is_rotor() {
        "free run between holes".to_owned()
    } else {
        format!("free run over windows of {} s, initial state fitted", config.horizon)
    };
    ErrorStory {
        measure: format!("rms of {}, {how} [{}]", what.name, what.unit),
        noise_floor: found.floors[channel],
        base: error_of(found, &found.stale, channel),
        recalibrated: error_of(found, &found.recalibrated, channel),
        extended: error_of(found, &found.answer, channel),
    }
}

fn rung(found: &Found, trial: &Trial, channel: usize) -> Rung {
    Rung { effects: trial.effects.clone(), validate: trial.channel_error(&found.stage, channel, true) }
}

/// Sets that the data cannot tell from the answer: one block's set exchanged for another.
fn alternatives(blocks: &[Found]) -> Vec<Vec<String>> {
    let mut sets = Vec::new();
    for (index, found) in blocks.iter().enumerate() {
        for other in &found.alternatives {
            let set = blocks.iter().enumerate().flat_map(|(block, found)| {
                if block == index { other.effects.clone() } else { found.answer.effects.clone() }
            });
            sets.push(set.collect());
        }
    }
    sets.truncate(MOST_ALTERNATIVES);
    sets
}

fn candidates(found: &Found, channel: usize) -> Vec<Candidate> {
    let best = &found.answer;
    let what = found.stage.train.channels()[channel];
    let base = found.recalibrated.channel_error(&found.stage, channel, true);
    let mut candidates: Vec<Candidate> = found
        .singles
        .iter()
        .map(|single| {
            // By the set that is left, not by place: an exchange of effects moves the one and not the other.
            let rest = |trial: &&Trial| {
                trial.effects.len() + 1 == best.effects.len()
                    && best.effects.iter().all(|id| (*id == single.effect) != trial.effects.contains(id))
            };
            let named = best.effects.contains(&single.effect);
            let drop_one = named.then(|| found.dropped.iter().find(rest)).flatten();
            Candidate {
                effect: single.effect.clone(),
                channel: format!("{} [{}]", what.name, what.unit),
                train: single.trial.as_ref().map(|trial| trial.channel_error(&found.stage, channel, false)),
                validate: single.trial.as_ref().map(|trial| trial.channel_error(&found.stage, channel, true)),
                chance: single.luck.map(|luck| luck.chance),
                luck: single.luck.map(|luck| base * (1.0 - luck.share).sqrt()),
                drop_one: drop_one.map(|trial| trial.channel_error(&found.stage, channel, true)),
                note: single.note.clone(),
            }
        })
        .collect();
    let error = |candidate: &Candidate| candidate.validate.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| error(a).total_cmp(&error(b)));
    candidates
}

fn places(blocks: &[Found], verdicts: &[Verdict]) -> Vec<Place> {
    let mut places = Vec::new();
    let judged = blocks.iter().zip(verdicts).filter(|(_, verdict)| **verdict != Verdict::InsufficientData);
    for (found, _) in judged {
        let best_is_base = found.answer.effects.is_empty();
        let fit = if best_is_base { &found.stale.fit } else { &found.recalibrated.fit };
        for evidence in evidence(&found.stage.train, fit) {
            let power = evidence.error.iter().map(|value| value * value).sum::<f64>()
                / evidence.error.len().max(1) as f64;
            let excess = ((power / evidence.noise.max(f64::MIN_POSITIVE)) - 1.0).max(0.0);
            let (depends_on, explained) = evidence.strongest();
            places.push(Place { block: evidence.block, share_of_error: excess, depends_on, explained });
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
