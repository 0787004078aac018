//! A search on the desk: what is missing, or a model with more effects. It works on what lay there when it began, by the
//! functions that the commands call.

use std::sync::Arc;
use std::time::Instant;

use super::desk::{
    Answered, Desk, DeskModel, DeskSearch, Discovered, LogUse, OpenLog, Origin, ReadLog, Recipe,
    SearchInputs, SearchKind, SearchState,
};
use super::guarded::Ended;
use super::{ActError, answers, by_hand};
use crate::cancel::Cancel;
use crate::diagnose::{DiagnoseConfig, Diagnosis};
use crate::discover::{Discovery, LawVerdict};
use crate::identify::IdentifySettings;
use crate::model::Model;
use crate::report::findings::sentences;
use crate::report::next_steps::{Typed, next_steps};
use crate::screening::ScreenedLog;
use crate::session::{self, Extended, Job, Progress, SessionError};
use crate::signal::ROTORS;

/// What a search needs.
pub(super) struct SearchTask {
    kind: SearchKind,
    recipe: Recipe,
    model: Model,
    /// Name of the model that it makes.
    name: String,
    fit: Vec<Arc<OpenLog>>,
    held_out: Vec<Arc<OpenLog>>,
    /// The command that does the same.
    by_hand: String,
    /// The files as one types them: the model, the logs to fit on, those held out.
    typed: (String, Vec<String>, Vec<String>),
    /// What the command says of how those logs are read.
    options: String,
}

/// A search that has begun.
#[derive(Debug, Clone)]
pub(super) struct Begun {
    id: u64,
    cancel: Cancel,
}

/// What a search found.
pub(super) enum SearchFound {
    Diagnosis(Box<Diagnosis>),
    Law(Box<Discovery>),
    Model(Box<Extended>),
    /// A model of the bench, and what to know of it in sentences.
    Identified(Box<Model>, Vec<String>),
}

impl SearchTask {
    /// What lies on the desk now.
    pub fn of(desk: &mut Desk, kind: SearchKind, added: Vec<String>) -> Result<Self, ActError> {
        if desk.is_searching() {
            return Err(ActError::Busy);
        }
        let recipe = Recipe { added, of: SearchInputs::of(desk) };
        let SearchInputs { fit, held_out, .. } = &recipe.of;
        if fit.is_empty() {
            return Err(ActError::NoLog);
        }
        by_hand::check_together(desk)?;
        if kind == SearchKind::Identify {
            check_rotors(desk)?;
        }
        let open = |logs: &[ReadLog]| -> Result<Vec<Arc<OpenLog>>, ActError> {
            logs.iter().map(|log| Ok(Arc::clone(desk.log(log.id)?.open()?))).collect()
        };
        let names = |logs: &[ReadLog]| -> Result<Vec<String>, ActError> {
            logs.iter().map(|log| Ok(desk.log(log.id)?.typed.clone())).collect()
        };
        let typed = (names(fit)?, names(held_out)?);
        let (fit, held_out) = (open(fit)?, open(held_out)?);
        let from = desk.model(desk.chosen)?;
        let (model, typed) = (from.model.clone(), (from.typed(), typed.0, typed.1));
        let name = match kind {
            SearchKind::Diagnose => String::new(),
            SearchKind::Identify => desk.fresh_name("identified"),
            SearchKind::Discover => desk.fresh_name("law"),
            _ => desk.fresh_name("step"),
        };
        let by_hand = match kind {
            SearchKind::Identify => by_hand::identify(desk, &format!("{name}.toml")),
            SearchKind::Diagnose => by_hand::search(desk, "diagnose", &typed.0),
            SearchKind::Discover => by_hand::search(desk, "discover", &typed.0),
            _ => by_hand::extend(desk, &typed.0, &recipe.added, &format!("{name}.toml")),
        };
        let options = by_hand::options_typed(desk);
        Ok(Self { kind, recipe, model, name, fit, held_out, by_hand, typed, options })
    }

    /// Puts it on the desk as running.
    pub fn begin(&self, desk: &mut Desk) -> Begun {
        let begun = Begun { id: desk.fresh_id(), cancel: Cancel::default() };
        desk.search = Some(DeskSearch {
            id: begun.id,
            kind: self.kind,
            state: SearchState::Running,
            fitted: 0,
            leading: Vec::new(),
            tried: Vec::new(),
            began: Instant::now(),
            took: None,
            cancel: begun.cancel.clone(),
        });
        begun
    }

    /// Searches, and tells `hear` of it.
    pub fn run(&self, begun: &Begun, hear: &(dyn Fn(Progress) + Sync)) -> Result<SearchFound, SessionError> {
        // Stands for a mistake of the program's own, which no input may bring about.
        #[cfg(test)]
        assert_ne!(self.recipe.added, ["a mistake"], "made for a test");
        let job = Job::new(&begun.cancel, hear);
        let config = DiagnoseConfig::default();
        let own =
            |logs: &[Arc<OpenLog>]| logs.iter().map(|open| open.log.clone()).collect::<Vec<ScreenedLog>>();
        let (fit, held_out) = (own(&self.fit), own(&self.held_out));
        let logs = (&fit[..], &held_out[..]);
        let found = match self.kind {
            SearchKind::Identify => {
                let rotors = session::rotors(&fit).last().copied().unwrap_or(0).max(ROTORS);
                let settings =
                    IdentifySettings { rotors: (1..=rotors).collect(), ..IdentifySettings::default() };
                let found = session::identify(&fit, &held_out, &settings, &job)?;
                SearchFound::Identified(Box::new(found.model), sentences(&found.findings))
            }
            SearchKind::Diagnose => SearchFound::Diagnosis(Box::new(session::diagnose(
                &self.model,
                &fit,
                &held_out,
                &config,
                &job,
            )?)),
            SearchKind::Discover => {
                SearchFound::Law(Box::new(session::discover(&self.model, &fit, &held_out, &config, &job)?))
            }
            SearchKind::Recalibrate => {
                SearchFound::Model(Box::new(session::refit(&self.model, logs, &config, &job)?))
            }
            SearchKind::Extend | SearchKind::Try => SearchFound::Model(Box::new(session::extend(
                &self.model,
                &self.recipe.added,
                logs,
                &config,
                &job,
            )?)),
        };
        Ok(found)
    }

    /// Puts what was found on the desk.
    pub fn end(&self, desk: &mut Desk, begun: &Begun, ended: Result<SearchFound, Ended>) {
        let state = match ended {
            Ok(SearchFound::Diagnosis(diagnosis)) => {
                self.answer(desk, *diagnosis);
                SearchState::Done
            }
            Ok(SearchFound::Law(found)) => {
                self.law(desk, *found);
                SearchState::Done
            }
            Ok(SearchFound::Model(extended)) => {
                self.lay_model(desk, extended.extension.model, sentences(&extended.findings));
                SearchState::Done
            }
            Ok(SearchFound::Identified(model, notes)) => {
                self.lay_model(desk, *model, notes);
                SearchState::Done
            }
            Err(Ended::Cancelled) => SearchState::Cancelled,
            Err(Ended::Failed(why)) => SearchState::Failed(why),
        };
        if let Some(search) = desk.search.as_mut().filter(|search| search.id == begun.id) {
            search.took = Some(search.began.elapsed());
            search.state = state;
        }
    }

    fn answer(&self, desk: &mut Desk, diagnosis: Diagnosis) {
        let (model, fit, held_out) = &self.typed;
        let words = |logs: &[String]| logs.iter().map(|log| by_hand::quoted(log)).collect::<Vec<_>>();
        let options = Typed { logs: self.options.clone(), ..Typed::default() };
        let next = next_steps(&diagnosis, &by_hand::quoted(model), (&words(fit), &words(held_out)), &options);
        desk.done.push(self.by_hand.clone());
        let shown = Arc::new(answers::of_diagnosis(&diagnosis, &next));
        desk.answered = Some(Answered { of: self.recipe.of.clone(), shown });
    }

    /// The law is kept beside the desk until it is added.
    fn law(&self, desk: &mut Desk, mut found: Discovery) {
        found.model.name.clone_from(&self.name);
        let is_law = found.verdict == LawVerdict::Law;
        let file = format!("{}.toml", self.name);
        let output = if is_law { by_hand::written_to(&self.by_hand, &file) } else { self.by_hand.clone() };
        let shown = Arc::new(answers::of_law(&found, &output));
        desk.done.push(output);
        let answered = Answered { of: self.recipe.of.clone(), shown };
        let made = is_law.then(|| (found.model, sentences(&found.findings)));
        desk.discovered = Some(Discovered { answered, made });
    }

    fn lay_model(&self, desk: &mut Desk, mut model: Model, notes: Vec<String>) {
        model.name.clone_from(&self.name);
        let is_tried = self.kind == SearchKind::Try;
        desk.models.retain(|it| it.origin != Origin::Tried || it.id == desk.chosen);
        let id = desk.fresh_id();
        let shown = [self.recipe.of.model, id];
        desk.models.iter_mut().for_each(|it| it.shown = shown.contains(&it.id));
        desk.models.push(DeskModel {
            id,
            model,
            origin: if is_tried { Origin::Tried } else { Origin::Made },
            shown: true,
            notes,
            recipe: (self.kind != SearchKind::Identify).then(|| self.recipe.clone()),
        });
        if !is_tried {
            desk.chosen = id;
            desk.done.push(self.by_hand.clone());
        }
        desk.look_anew();
    }
}

/// Refuses chosen rotors: `identify --rotors` keeps their numbers, which a log of chosen ones no longer has.
fn check_rotors(desk: &Desk) -> Result<(), ActError> {
    let mut fitted = desk.logs.iter().filter(|log| log.role != LogUse::Look);
    match fitted.find(|log| !log.choice.rotors.is_empty()) {
        Some(log) => Err(ActError::ChosenRotors(log.typed.clone())),
        None => Ok(()),
    }
}
