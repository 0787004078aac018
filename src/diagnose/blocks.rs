//! The blocks of a model one after the other: the rotors, then the body that they drive.

use super::assemble::{self, MOST_ALTERNATIVES};
use super::block_builder::{Driver, body_stage, rotor_stage};
use super::candidate_fit::Trial;
use super::config::DiagnoseConfig;
use super::data_split::Stage;
use super::diagnosis::{ErrorStory, Verdict};
use super::error::DiagnoseError;
use super::model_selection::senses_rotors;
use super::search_result::Found;
use super::verdict;
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::requirements::nothing_in_common;

/// A body's squared error must differ by this share before it decides about the rotors.
pub(crate) const DECIDES: f64 = 0.05;

/// The blocks of a model beside their data, each with what was found.
pub(crate) struct Blocks {
    pub(crate) found: Vec<Found>,
    pub(crate) verdicts: Vec<Verdict>,
    /// The logs hold a body that was held still, and is left out.
    pub(crate) is_held: bool,
}

/// Logs and settings of a diagnosis.
pub(crate) struct Question<'a> {
    pub(crate) model: &'a Model,
    pub(crate) train: &'a [Dataset],
    pub(crate) validate: &'a [Dataset],
    pub(crate) horizon: f64,
    pub(crate) find: &'a dyn Fn(Stage) -> Found,
    pub(crate) look: Look<'a>,
    pub(crate) settle: Settle<'a>,
}

/// Refits a block's own numbers with the given effects, without a search.
pub(crate) type Look<'a> = &'a dyn Fn(Stage, &[String]) -> Found;

/// The body, and what it was under the rotors that drove it before it was asked.
pub(crate) type Driven = (Found, Option<Found>);

/// Takes back what a set changed of the base's own numbers for nothing: the set, and the names of the changed ones.
pub(crate) type Settle<'a> = &'a dyn Fn(&Found, &Trial) -> (Trial, Vec<String>);

impl Blocks {
    /// Builds the rotor block, then the body block that its answer drives; `find` looks into each, `look` only refits a
    /// block's own numbers and the effects it is given.
    pub(crate) fn build(
        model: &Model,
        train: &[Dataset],
        validate: &[Dataset],
        config: &DiagnoseConfig,
        (find, look): (&dyn Fn(Stage) -> Found, Look),
        settle: Settle,
    ) -> Result<Self, DiagnoseError> {
        let question = Question { model, train, validate, horizon: config.horizon, find, look, settle };
        let mut rotor = rotor_stage(train, validate).map(find);
        let body = question.body(rotor.as_ref().map(|found| (found, &found.answer)), find)?;
        let body = match (&mut rotor, body) {
            (Some(rotor), Some(body)) => {
                let body = question.decide(rotor, body)?;
                let driven = question.ask(rotor, body)?;
                Some(question.told_from_before(rotor, driven)?)
            }
            (_, body) => body,
        };
        // Beside rotors a body that was held has nothing to say.
        let is_held = rotor.is_some() && body.as_ref().is_some_and(verdict::is_held);
        let body = body.filter(|_| !is_held);
        let found: Vec<Found> = rotor.into_iter().chain(body).collect();
        if found.is_empty() {
            let logs: Vec<&Dataset> = train.iter().chain(validate).collect();
            return Err(DiagnoseError::NothingToCompare(nothing_in_common(&logs)));
        }
        let verdicts = found.iter().map(verdict::verdict).collect();
        Ok(Self { found, verdicts, is_held })
    }

    /// Whether each block that says something is left with nothing but noise.
    pub(crate) fn is_at_floor(&self) -> bool {
        let judged =
            self.found.iter().zip(&self.verdicts).filter(|(_, it)| **it != Verdict::InsufficientData);
        judged.into_iter().all(|(found, _)| found.over_floor(&found.answer).0 <= found.at_floor())
    }

    /// The model with what each block found.
    pub(crate) fn merged(&self, model: &Model) -> Model {
        assemble::merged(model, &self.found, &self.verdicts)
    }

    /// The error in the block and channel where it says most.
    pub(crate) fn error_story(&self, config: &DiagnoseConfig) -> ErrorStory {
        let (main, channel) = assemble::main_block(&self.found);
        assemble::error_story(main, channel, config)
    }
}

impl Question<'_> {
    /// The body as one answer about the rotors drives it; `None` when the logs hold no body.
    pub(crate) fn body(
        &self,
        rotor: Option<(&Found, &Trial)>,
        find: &dyn Fn(Stage) -> Found,
    ) -> Result<Option<Found>, DiagnoseError> {
        let equations = rotor.map_or(self.model, |(_, answer)| &answer.model).equations()?;
        let driver = Driver {
            equations: &equations,
            trial: rotor.map(|(_, answer)| answer),
            stage: rotor.map(|(found, _)| &found.stage),
        };
        Ok(body_stage(self.train, self.validate, &driver, self.horizon)?.map(find))
    }

    /// A late sensor and a late rotor look alike from the command to the reading, and not to the body: where the
    /// rotors' answers differ in their sensor, the one that leaves the body less to explain is taken.
    fn decide(&self, rotor: &mut Found, mut body: Found) -> Result<Found, DiagnoseError> {
        let mine = senses_rotors(&rotor.answer);
        let others: Vec<Trial> = rotor.alternatives.iter().take(MOST_ALTERNATIVES).cloned().collect();
        let mut kept = Vec::new();
        for other in others {
            if senses_rotors(&other) == mine {
                kept.push(other);
                continue;
            }
            // Numbers that moved for nothing would drive the body with their noise.
            let (settled, changed) = (self.settle)(rotor, &other);
            let Some(driven) = self.body(Some((rotor, &settled)), self.find)? else { continue };
            match prefers(&body, &driven) {
                Some(true) => {}
                None => kept.push(other),
                Some(false) => {
                    kept.clear();
                    rotor.answer = settled;
                    rotor.changed = changed;
                    body = driven;
                }
            }
        }
        if senses_rotors(&rotor.answer) != mine
            && let Some(last) = rotor.ladder.last_mut()
        {
            *last = rotor.answer.clone();
        }
        rotor.alternatives = kept;
        Ok(body)
    }
}

/// Whether the first body is the simpler explanation; `None` where both are as good.
fn prefers(one: &Found, other: &Found) -> Option<bool> {
    let at_floor = |found: &Found| found.over_floor(&found.answer).0 <= found.at_floor();
    if at_floor(one) != at_floor(other) {
        return Some(at_floor(one));
    }
    let size = |found: &Found| found.answer.effects.len() + found.changed.len();
    if size(one) != size(other) {
        return Some(size(one) < size(other));
    }
    let channels = 0..one.stage.train.channels().len();
    let score = |found: &Found| {
        let share = |channel: usize| {
            (found.answer.channel_error(&found.stage, channel, true) / one.floors[channel]).powi(2)
        };
        channels.clone().map(share).sum::<f64>()
    };
    let (a, b) = (score(one), score(other));
    ((a - b).abs() > DECIDES * a.min(b)).then_some(a < b)
}
