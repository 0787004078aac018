//! The answer, put together.

use std::collections::BTreeMap;

use super::answer::{Discovery, LawVerdict, OtherLaw, PlaceShare, TellApart};
use super::formula::{Formula, LawTask};
use super::law::{CandidateLaw, LawTerm};
use super::places::PlaceScore;
use super::search::BlockResult;
use super::shape::{Shaped, along, centred, names, share};
use super::thresholds::THRESHOLDS;
use crate::diagnose::assemble::{changed_parameters, error_summary, main_channel, merged};
use crate::diagnose::diagnosis::{FoundParameter, TrainValidate};
use crate::diagnose::search_result::SearchResult;
use crate::diagnose::search_space::Search;
use crate::diagnose::verdict::verdict;
use crate::diagnose::{DiagnoseConfig, Diagnosis, Verdict};
use crate::effect::find;
use crate::model::{Effect, Model};

/// What the catalogue says, where there is nothing to discover.
pub(crate) fn of_catalogue(diagnosis: Diagnosis) -> Discovery {
    let verdict = match diagnosis.verdict {
        Verdict::MissingEffect => LawVerdict::Catalogue,
        other => LawVerdict::Diagnosed(other),
    };
    Discovery {
        verdict,
        block: None,
        site: None,
        channels: Vec::new(),
        confidence: None,
        expression: None,
        forms: Vec::new(),
        parameters: BTreeMap::new(),
        user_effect: None,
        shape: None,
        error: diagnosis.error.clone(),
        alternatives: Vec::new(),
        r#where: Vec::new(),
        effects: diagnosis.effects.clone(),
        changed_parameters: diagnosis.changed_parameters.clone(),
        next_experiment: None,
        findings: diagnosis.findings.clone(),
        model: diagnosis.model.clone(),
        diagnosis,
    }
}

/// The answer about the block `index` of those searched.
pub(crate) fn conclude(
    asked: &LawTask,
    diagnosis: Diagnosis,
    blocks: (&[SearchResult], &[Verdict], usize),
    searched: BlockResult,
    config: &DiagnoseConfig,
) -> Discovery {
    let mut answer = of_catalogue(diagnosis);
    let block = if asked.split().train.is_rotor() { "rotors" } else { "body" };
    answer.block = Some(block.to_owned());
    answer.verdict = LawVerdict::Diagnosed(Verdict::Unknown);
    answer.r#where = shares(&searched);
    let shape = Shaped::of(&searched);
    let Some(formula) = searched.formula.clone().filter(|formula| explains(&searched, formula)) else {
        return of_shape(answer, &searched, shape);
    };
    if let Some(effects) = as_good_in_catalogue(&searched, &formula) {
        answer.effects = effects;
        answer.verdict = LawVerdict::Catalogue;
        return answer;
    }
    let Some(result) = with_law(&searched, &formula) else { return of_shape(answer, &searched, shape) };
    let is_law = verdict(&result) == Verdict::MissingEffect;
    answer.alternatives = others(&searched, &formula, main_channel(&result));
    answer.next_experiment = tell_apart(&searched, &formula);
    answer.confidence = searched.confidence;
    of_law(&mut answer, &searched, &formula.law, (blocks, result), config);
    let coefficients = formula.law.coefficients_in(&answer.model, asked.id);
    answer.shape = shape.map(|shape| {
        let fitted = shape.refit(asked);
        shape.drawn(fitted.as_ref(), asked, Some((&formula.law, &coefficients)))
    });
    answer.verdict = if is_law { LawVerdict::Law } else { LawVerdict::Shape };
    answer
}

/// What is said of a law, with the block's `result` that has it.
fn of_law(
    answer: &mut Discovery,
    searched: &BlockResult,
    law: &CandidateLaw,
    ((blocks, verdicts, index), result): ((&[SearchResult], &[Verdict], usize), SearchResult),
    config: &DiagnoseConfig,
) {
    let asked = &searched.task;
    let found = &result.answer.model;
    answer.error = error_summary(&result, main_channel(&result), config);
    answer.parameters = numbers(found, searched, law);
    let user = law.at(found, asked.id).user_effect(asked.id, &law.coefficients_in(found, asked.id));
    answer.site = Some(law.site);
    answer.channels = names(law.channels().into_iter());
    answer.forms = law.at(found, asked.id).terms.iter().map(LawTerm::shown_form).collect();
    answer.expression = Some(user.expression.clone());
    answer.effects.clone_from(&asked.start.effects);
    // What was left of this block without the law is no news.
    let is_of_block = |subject: &str| asked.split().train.channels().iter().any(|it| it.name == subject);
    answer.findings.retain(|it| it.code != "error_above_floor" || !is_of_block(&it.subject));
    let (mut blocks, mut verdicts) = (blocks.to_vec(), verdicts.to_vec());
    let unnamed = result.unnamed_effects();
    (blocks[index], verdicts[index]) = (result, Verdict::MissingEffect);
    answer.changed_parameters = changed_parameters(asked.model, &blocks, &verdicts);
    let mut model = asked.model.clone();
    model.user_effects.push(user.clone());
    answer.model = merged(&model, &blocks, &verdicts);
    answer.findings.retain(|it| !is_of_other_effect(&it.subject, &answer.model));
    answer.findings.extend(unnamed);
    answer.user_effect = Some(user);
}

/// Whether a finding is of an effect, or of a number of one, that the answer's model does not have.
fn is_of_other_effect(subject: &str, model: &Model) -> bool {
    let id = subject.split('.').next().unwrap_or(subject);
    find(id).is_some() && !model.has(id)
}

/// Whether a formula takes off most of what is above the noise.
fn explains(searched: &BlockResult, formula: &Formula) -> bool {
    let task = &searched.task;
    let left = task.over_floor(task.before);
    left > THRESHOLDS.least_left && task.explained(&formula.fitted) > THRESHOLDS.least_explained
}

/// A set of the catalogue that does as well.
fn as_good_in_catalogue(searched: &BlockResult, formula: &Formula) -> Option<Vec<String>> {
    let task = &searched.task;
    let found = task.found;
    let limit = task.loss(&formula.fitted) * (1.0 + task.tolerance(&formula.fitted));
    let singles = found.singles.iter().filter_map(|single| single.fitted.as_ref());
    let sets = singles.chain(&found.alternatives).chain([&found.answer]);
    let sets = sets.filter(|fitted| !fitted.effects.is_empty() && task.loss(fitted) <= limit);
    let best = sets.min_by(|a, b| task.loss(a).total_cmp(&task.loss(b)))?;
    Some(best.effects.clone())
}

/// The block with the law as its answer: of the base's own numbers only those changed that it needs, and standard errors that allow for
/// what is not in it.
fn with_law(searched: &BlockResult, formula: &Formula) -> Option<SearchResult> {
    let task = &searched.task;
    let coefficients = formula.law.coefficients_in(&formula.fitted.model, task.id);
    let models = task.with_law(&formula.law, &coefficients)?;
    let search = models.search();
    let found = task.found;
    let (answer, changed) =
        search.select_parameters(&found.split, &found.nominal, &found.refitted, &formula.fitted);
    let fits = [found.nominal.clone(), found.refitted.clone(), answer];
    let mut result = SearchResult::of_one(found.split.clone(), fits, changed);
    let is_tried = |effect: &&Effect| {
        found.singles.iter().any(|single| single.effect == effect.id && single.refusal.is_none())
    };
    let eligible = search.known.iter().filter(is_tried).map(|effect| (effect, None)).collect();
    Search { eligible, ..search }.allow_for_what_is_missing(&mut result);
    Some(result)
}

/// Without a formula: the smooth function, where it explains enough.
fn of_shape(mut answer: Discovery, searched: &BlockResult, shape: Option<Shaped>) -> Discovery {
    let Some(shape) = shape.filter(|shape| shape.explained > THRESHOLDS.shape_explained) else {
        return answer;
    };
    // One step of Gauss and Newton says what it may do; the whole fit, what it does.
    let task = &searched.task;
    let Some(refitted) = shape.refit(task) else { return answer };
    let is_near =
        shape.is_near(task, &refitted) || task.explained(&refitted.fitted) > THRESHOLDS.shape_explained;
    if !is_near || !task.gains(task.before, &refitted.fitted) {
        return answer;
    }
    let channel = main_channel(task.found);
    let error = |held_out| refitted.fitted.channel_error(task.split(), channel, held_out);
    answer.error.extended = TrainValidate { train: error(false), validate: error(true) };
    answer.verdict = LawVerdict::Shape;
    answer.site = Some(shape.place.place.site);
    answer.channels = names(shape.place.place.channels.iter());
    answer.confidence = searched.confidence;
    answer.shape = Some(shape.drawn(Some(&refitted), task, None));
    answer
}

fn shares(searched: &BlockResult) -> Vec<PlaceShare> {
    let of = |place: &PlaceScore| PlaceShare {
        site: place.place.site,
        channels: names(place.place.channels.iter()),
        by_direction: place.place.way.is_some(),
        explained: share(searched, place),
    };
    searched.places.iter().map(of).collect()
}

/// The parameters of the law with the standard errors of the answer.
fn numbers(model: &Model, searched: &BlockResult, law: &CandidateLaw) -> BTreeMap<String, FoundParameter> {
    let id = searched.task.id;
    let coefficients = law.coefficients_in(model, id);
    let of = |parameter: crate::model::UserParameter| {
        let name = format!("{id}.{}", parameter.name);
        let value = model.parameter(&name).unwrap_or(parameter.start);
        let standard_error = model.standard_errors.get(&name).copied();
        (parameter.name, FoundParameter { value, standard_error, unit: parameter.unit })
    };
    law.user_effect(id, &coefficients).parameters.into_iter().map(of).collect()
}

/// Points along a range.
const POINTS: usize = 101;

fn spaced(from: f64, to: f64) -> Vec<f64> {
    (0..POINTS).map(|at| from + (to - from) * at as f64 / (POINTS - 1) as f64).collect()
}

/// The largest difference of two laws of one channel over a range, their means apart, as a share of what the first does there.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let (one, other) = (centred(one), centred(other));
    let size = one.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let most = one.iter().zip(&other).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
    if size > 0.0 { most / size } else { 0.0 }
}

fn others(searched: &BlockResult, formula: &Formula, channel: usize) -> Vec<OtherLaw> {
    let task = &searched.task;
    let own = formula.law.coefficients_in(&formula.fitted.model, task.id);
    let of = |other: &Formula| {
        let coefficients = other.law.coefficients_in(&other.fitted.model, task.id);
        let same = formula.law.shares_place(&other.law);
        let visited = formula.law.channels().first().map(|it| spaced(it.low, it.high)).filter(|_| same);
        let both = visited
            .and_then(|at| Some((along(&formula.law, &own, &at)?, along(&other.law, &coefficients, &at)?)));
        OtherLaw {
            site: other.law.site,
            expression: other.law.expression(),
            channels: names(other.law.channels().into_iter()),
            parameters: numbers(&other.fitted.model, searched, &other.law),
            validate: other.fitted.channel_error(task.split(), channel, true),
            differs_by: both.map(|(own, other)| difference(&own, &other)),
        }
    };
    let mut others: Vec<OtherLaw> = searched.others.iter().map(of).collect();
    others.sort_by(|a, b| a.validate.total_cmp(&b.validate));
    others.truncate(THRESHOLDS.most_alternatives);
    others
}

/// What would tell the formula from the others: of one channel further out, of several apart.
fn tell_apart(searched: &BlockResult, formula: &Formula) -> Option<TellApart> {
    let other = searched.others.first()?;
    let channels = formula.law.channels();
    if !formula.law.shares_place(&other.law) || channels.len() > 1 {
        let mut all = names(channels.into_iter());
        let more = names(other.law.channels().into_iter());
        all.extend(more.into_iter().filter(|name| !formula.law.channels().iter().any(|it| it.log == name)));
        return Some(TellApart { channels: all, to: None });
    }
    let channel = channels.first()?;
    let more = THRESHOLDS.compared_beyond * channel.range();
    let at = spaced(channel.low - more, channel.high + more);
    let values = |formula: &Formula| {
        along(&formula.law, &formula.law.coefficients_in(&formula.fitted.model, searched.task.id), &at)
    };
    let (one, two) = (values(formula)?, values(other)?);
    let apart = |index: &usize| (one[*index] - two[*index]).abs();
    let most = (0..at.len()).max_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    Some(TellApart { channels: vec![channel.log.to_owned()], to: Some(at[most]) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A search that ended in `unknown` had tried effects; what was found of their numbers is no news beside a law.
    #[test]
    fn findings_of_effects_that_the_answer_does_not_have_are_no_news() {
        let model = Model::paper();
        let model = model.with(&model.effect("torque_delay").expect("known"));
        for (subject, expected) in [
            ("gravity_pendulum.moment", true),
            ("ground_effect", true),
            ("torque_delay.delay", false),
            ("torque_delay", false),
            ("rotors", false),
            ("train.csv", false),
        ] {
            assert_eq!(is_of_other_effect(subject, &model), expected, "{subject}");
        }
    }
}
