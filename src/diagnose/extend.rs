//! Adds effects to a model, refits, and writes down what it did to the error.

use super::block_builder::eligible;
use super::blocks::Blocks;
use super::candidate_fit::CandidateFit;
use super::caveats;
use super::config::DiagnoseConfig;
use super::data_split::DataSplit;
use super::diagnosis::ErrorSummary;
use super::pooled_logs;
use super::refit::Near;
use super::refusal::EffectRefusal;
use super::search_result::SearchResult;
use super::search_space::Search;
use super::stretches::Stretches;
use super::thresholds::THRESHOLDS;
use super::{DiagnoseError, check_logs};
use crate::identify;
use crate::model::{Effect, ErrorFall, LogReference, Model, ModelStep};
use crate::screening::attitude::inertia_in_degrees;
use crate::screening::summary::LogSummary;
use crate::screening::{Finding, ScreenedBody, ScreenedLog};

/// A model with more effects.
#[derive(Debug, Clone)]
pub struct Extension {
    /// The extended model, its ladder one step longer.
    pub model: Model,
    /// The error before and after.
    pub error: ErrorSummary,
    /// Nothing but noise is left.
    pub is_at_floor: bool,
    /// What to know about the data.
    pub findings: Vec<Finding>,
}

/// Adds the effects `ids` to `model`, refitting on `train`; `validate` is only looked at. Without effects the model's own
/// numbers are refitted, those whose change the data ask for.
///
/// # Errors
/// [`DiagnoseError`] when an effect is unknown, already there, or the logs lack what it needs, and where there is nothing
/// to refit.
pub fn extend(
    model: &Model,
    ids: &[String],
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
) -> Result<Extension, DiagnoseError> {
    let known = model.known_effects()?;
    let (part, mut findings) = check((model, &known), ids, (train, validate), config)?;
    let in_block = |split: &DataSplit| -> Vec<String> {
        let acts_here =
            |id: &&String| known.iter().any(|effect: &Effect| effect.id == **id && split.holds(effect));
        ids.iter().filter(acts_here).cloned().collect()
    };
    let search = || Search { base: model, known: &known, eligible: Vec::new(), progress: &|_| () };
    let rung = |split: DataSplit, effects: &[String], near: &[Near]| search().rung(split, effects, near);
    let fit_rung = |split: DataSplit, effects: &[String]| rung(split, effects, &[]);
    let select_parameters = |found: &SearchResult, fitted: &CandidateFit| {
        if !ids.is_empty() {
            return (fitted.clone(), Vec::new());
        }
        search().select_parameters(&found.split, &found.nominal, &found.refitted, fitted)
    };
    let build = |train: &[ScreenedLog], validate: &[ScreenedLog], near: &[Near]| {
        let find = |split: DataSplit| -> SearchResult {
            let inside = in_block(&split);
            rung(split, &inside, near)
        };
        Blocks::build(model, train, validate, config, (&find, &fit_rung), &select_parameters)
    };
    // Of long logs a part shows where the fit on all rows starts.
    let near = match &part {
        Some(part) => Near::of(&build(&part.train, &part.validate, &[])?.found),
        None => Vec::new(),
    };
    let mut blocks = build(train, validate, &near)?;
    check_fitted(ids, &blocks, (&known, train))?;
    let error = blocks.error_summary(config);
    if ids.is_empty() {
        check_numbers(model, (&blocks, &findings), &error)?;
    }
    findings.extend(allow_for_what_is_missing((model, &known), &[train, validate].concat(), &mut blocks));
    findings.extend(blocks.found.iter().flat_map(caveats::of_numbers));
    let mut extended = blocks.merged(model);
    findings.extend(inertia_in_degrees(model.body.inertia, extended.body.inertia));
    extended.ladder.push(step(model, ids, [train, validate], &error));
    extended.rotor_error = identify::rotor_error(&extended, &[train, validate]);
    Ok(Extension { model: extended, error, is_at_floor: blocks.is_at_floor(), findings })
}

/// Whether `ids` can be added to `model` on these logs at all: the stretches of long ones that show where the fit on all rows
/// starts, and what to know about the data.
fn check(
    (model, known): (&Model, &[Effect]),
    ids: &[String],
    (train, validate): (&[ScreenedLog], &[ScreenedLog]),
    config: &DiagnoseConfig,
) -> Result<(Option<Stretches>, Vec<Finding>), DiagnoseError> {
    let logs = [train, validate].concat();
    let mut findings: Vec<Finding> = logs.iter().flat_map(|log| LogSummary::of(log).findings).collect();
    check_effects(model, ids, &logs)?;
    let requested: Vec<Effect> = known.iter().filter(|effect| ids.contains(&effect.id)).cloned().collect();
    check_logs(model, &requested, &logs)?;
    findings.extend(identify::check_columns(&logs, model)?);
    let part = Stretches::of(train, validate, config.searched_rows);
    let seen = part.as_ref().map(|part| [&part.train[..], &part.validate[..]].concat());
    findings.extend(caveats::seen_by_base(model, train, validate));
    pooled_logs::check(model, known, seen.as_ref().unwrap_or(&logs), config.horizon)?;
    Ok((part, findings))
}

/// Widens the standard errors of what was found; the effects that most of one is for.
fn allow_for_what_is_missing(
    (model, known): (&Model, &[Effect]),
    logs: &[ScreenedLog],
    blocks: &mut Blocks,
) -> Vec<Finding> {
    for found in &mut blocks.found {
        let eligible = eligible((known, model), &found.split, logs);
        Search { base: model, known, eligible, progress: &|_| () }.allow_for_what_is_missing(found);
    }
    blocks.found.iter().flat_map(SearchResult::unnamed_effects).collect()
}

/// The step that a ladder takes from `model` by adding `ids`.
pub(crate) fn step(
    model: &Model,
    ids: &[String],
    [train, validate]: [&[ScreenedLog]; 2],
    error: &ErrorSummary,
) -> ModelStep {
    ModelStep {
        added: ids.to_vec(),
        logs: train.iter().map(reference).collect(),
        validation: validate.iter().map(reference).collect(),
        error: ErrorFall {
            measure: error.measure.clone(),
            noise_floor: error.noise_floor,
            train_before: error.base.train,
            train_after: error.extended.train,
            validate_before: error.base.validate,
            validate_after: error.extended.validate,
        },
        before: model.parameters(),
        standard_errors_before: model.standard_errors.clone(),
    }
}

/// Refuses effects that cannot be added from these logs.
fn check_effects(model: &Model, ids: &[String], logs: &[ScreenedLog]) -> Result<(), DiagnoseError> {
    for (index, id) in ids.iter().enumerate() {
        let effect = model.effect(id)?;
        let twice = ids[..index].contains(id).then_some(EffectRefusal::AskedTwice);
        if let Some(why) = twice.or_else(|| super::block_builder::refusal(&effect, model, logs)) {
            return Err(DiagnoseError::Refused { effect: id.clone(), why });
        }
    }
    Ok(())
}

/// Refuses effects that nothing was fitted to.
fn check_fitted(
    ids: &[String],
    blocks: &Blocks,
    (known, logs): (&[Effect], &[ScreenedLog]),
) -> Result<(), DiagnoseError> {
    if let Some(id) =
        ids.iter().find(|id| !blocks.found.iter().any(|found| found.answer.effects.contains(id)))
    {
        let is_of_body = known.iter().any(|effect| effect.id == *id && !effect.site.is_rotor());
        let held: Vec<String> = logs
            .iter()
            .filter(|log| is_of_body && log.body().is_some_and(ScreenedBody::is_held))
            .map(|log| log.source_name().to_owned())
            .collect();
        let why =
            if held.is_empty() { EffectRefusal::NoBlock } else { EffectRefusal::BodyHeldIn { logs: held } };
        return Err(DiagnoseError::Refused { effect: id.clone(), why });
    }
    // Data that excite nothing would leave the effect at its start, and the ladder would say that it was fitted.
    for found in blocks.found.iter().filter(|found| !found.answer.effects.is_empty()) {
        if let Some(why) = found.split.insufficient_data() {
            return Err(DiagnoseError::Refused { effect: found.answer.effects.join(" + "), why });
        }
    }
    Ok(())
}

/// Refuses numbers that are the model's own, and those that no bench has: what was not measured (a rate that stood still, or read zero) asks for such.
fn check_numbers(
    model: &Model,
    (blocks, findings): (&Blocks, &[Finding]),
    error: &ErrorSummary,
) -> Result<(), DiagnoseError> {
    let (before, extended) = (model.parameters(), blocks.merged(model));
    // The numbers of effects are fitted each time: what moves them by less than their error says nothing new.
    let is_same = |name: &str, from: f64, to: f64| {
        let known_to = extended.standard_errors.get(name).filter(|_| name.contains('.'));
        from == to || known_to.is_some_and(|known_to| (to - from).abs() < *known_to)
    };
    let stays =
        |(name, from): (&String, &f64)| extended.parameter(name).is_some_and(|to| is_same(name, *from, to));
    if before.iter().all(stays) {
        let poor = blocks.found.iter().find_map(|found| found.split.insufficient_data());
        let unchanged = || DiagnoseError::NothingChanged {
            error: Box::new(error.clone()),
            is_at_floor: blocks.is_at_floor(),
            findings: findings.to_vec(),
        };
        return Err(poor.map_or_else(unchanged, DiagnoseError::NothingToRefit));
    }
    let is_absurd = |name: &str, from: f64, to: f64| {
        let error = extended.standard_errors.get(name).copied().unwrap_or(0.0);
        // Known to the last digit is no number of a fit, either.
        let is_known = error > 0.0 && error < from.abs() + to.abs();
        from != to && !(is_known && to.abs() < THRESHOLDS.absurd_change * from.abs().max(1.0))
    };
    let mut numbers = before.iter().filter_map(|(name, from)| Some((name, *from, extended.parameter(name)?)));
    match numbers.find(|(name, from, to)| is_absurd(name, *from, *to)) {
        Some((name, from, to)) => Err(DiagnoseError::AbsurdNumber { name: name.clone(), from, to }),
        None => Ok(()),
    }
}

fn reference(log: &ScreenedLog) -> LogReference {
    LogReference { file: log.source_name().to_owned(), sha256: log.raw().sha256().to_owned() }
}
