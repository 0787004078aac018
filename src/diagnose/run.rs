//! From logs to the answer.

use std::collections::BTreeMap;

use super::block_builder::refusal;
use super::blocks::Blocks;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::diagnosis::{
    Both, Candidate, ChangedParameter, Diagnosis, ErrorStory, FoundParameter, NextExperiment, Place, Rung,
    Verdict,
};
use super::pooled_logs;
use super::search::{Found, Search};
use super::verdict::joint;
use crate::effect;
use crate::estimation::dependence::evidence;
use crate::identify::{self, IdentifyError};
use crate::log::Dataset;
use crate::model::{Effect, Model, ModelError, UndefinedRow};
use crate::screening::Finding;
use crate::screening::requirements::{Absurd, check_magnitudes, repeated, without_battery};
use crate::unit::short;

/// Settings of a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub struct DiagnoseConfig {
    /// [s] length of the windows over which the body runs freely.
    pub horizon: f64,
}

impl Default for DiagnoseConfig {
    fn default() -> Self {
        // Long enough for weak torques to add up, short enough for an unstable body: facts of real benches.
        Self { horizon: 0.4 }
    }
}

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum DiagnoseError {
    /// The model cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No block of the model can be judged from the logs.
    #[error("{0}")]
    NothingToCompare(String),
    /// A value that no bench can have measured.
    #[error(transparent)]
    Absurd(#[from] Absurd),
    /// A column that cannot be what its name says, or is of another rotor than the model's.
    #[error(transparent)]
    Column(#[from] IdentifyError),
    /// An effect cannot be added from these logs.
    #[error("effect `{effect}`: {why}")]
    Refused {
        /// Id.
        effect: String,
        /// Why.
        why: String,
    },
    /// No number of the base has to change, or can.
    #[error("nothing to take over: {0}")]
    NothingToRefit(String),
    /// Logs that cannot come from one bench.
    #[error(
        "{log} and {other_log} are not of one bench: alone the first gives {parameter} = {value:.6}, the second {other:.6}; diagnose each by itself"
    )]
    DifferentBenches {
        /// The number in which they differ.
        parameter: String,
        /// One log.
        log: String,
        /// Its value, in the parameter's SI unit.
        value: f64,
        /// The other log.
        other_log: String,
        /// Its value.
        other: f64,
    },
    /// An expression has no value on the data.
    #[error("effect `{effect}`: its expression is not a number on {log} at {} s ({})", short(*time), signals.join(", "))]
    NotANumber {
        /// Id of the user's effect.
        effect: String,
        /// The log.
        log: String,
        /// [s] where.
        time: f64,
        /// What the expression saw there.
        signals: Vec<String>,
    },
}

/// Sets named beside the answer.
pub(crate) const MOST_ALTERNATIVES: usize = 2;

/// Finds what the model is missing.
///
/// # Errors
/// [`DiagnoseError`] when model and logs do not meet.
pub fn diagnose(
    model: &Model,
    train: &[Dataset],
    validate: &[Dataset],
    config: &DiagnoseConfig,
    done: &(dyn Fn() + Sync),
) -> Result<Diagnosis, DiagnoseError> {
    let known = model.known_effects()?;
    let read: Vec<&Dataset> = train.iter().chain(validate).collect();
    read.iter().try_for_each(|log| check_magnitudes(log))?;
    let mut told = Vec::new();
    let fresh = [train, validate].map(|logs| crate::screening::rate_dropouts::measured(logs, &mut told));
    let [train, validate] = [fresh[0].as_ref(), fresh[1].as_ref()];
    let logs: Vec<Dataset> = train.iter().chain(validate).cloned().collect();
    check_logs(model, &known, &logs)?;
    told.extend(identify::check_columns(&logs, model)?.into_iter().map(Finding::from));
    pooled_logs::check(model, &known, &logs, config.horizon)?;
    let search = |stage: Stage| {
        let held = |effect: &&Effect| stage.holds(effect);
        let mut eligible: Vec<_> =
            known.iter().filter(held).map(|effect| (effect, refusal(effect, model, &logs))).collect();
        if let Some(why) = stage.too_poor() {
            eligible.iter_mut().for_each(|(_, note)| *note = note.take().or_else(|| Some(why.clone())));
        }
        Search { base: model, known: &known, eligible, done }.run(stage)
    };
    let settle = |found: &Found, trial: &Trial| {
        let search = Search { base: model, known: &known, eligible: Vec::new(), done };
        search.settle(&found.stage, &found.stale, &found.recalibrated, trial)
    };
    let look = |stage: Stage, effects: &[String]| {
        Search { base: model, known: &known, eligible: Vec::new(), done }.refit(stage, effects)
    };
    let blocks = Blocks::build(model, train, validate, config, (&search, &look), &settle)?;
    let mut diagnosis = conclude(model, &known, &blocks, &read, config);
    // The findings tell of some of these cells, too.
    told.retain(|sentence| !diagnosis.findings.contains(sentence));
    let said = repeated(train, validate)
        .into_iter()
        .chain(without_battery(model, &logs))
        .map(Finding::from)
        .chain(told);
    diagnosis.findings.splice(0..0, said);
    if blocks.is_held {
        diagnosis.findings.push(
            "the body does not move, whatever the torque on it: it was held still, and these logs say nothing of it"
                .to_owned().into(),
        );
    }
    Ok(diagnosis)
}

/// Refuses logs and expressions that no fit can start from.
pub(crate) fn check_logs(model: &Model, effects: &[Effect], logs: &[Dataset]) -> Result<(), DiagnoseError> {
    for log in logs {
        check_magnitudes(log)?;
        let undefined = model.first_undefined_row(effects, log.time(), &|name| log.column(name))?;
        if let Some(UndefinedRow { effect, time, signals }) = undefined {
            return Err(DiagnoseError::NotANumber {
                effect,
                log: log.source_name().to_owned(),
                time,
                signals,
            });
        }
    }
    Ok(())
}

fn conclude(
    model: &Model,
    known: &[Effect],
    all: &Blocks,
    logs: &[&Dataset],
    config: &DiagnoseConfig,
) -> Diagnosis {
    let (blocks, verdicts) = (&all.found[..], &all.verdicts[..]);
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
        turns_against_torque: blocks.iter().any(super::caveats::turns_against_torque),
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
