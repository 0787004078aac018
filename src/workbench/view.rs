//! The desk as the page reads it: names, numbers and sentences, no curves.

use std::sync::Arc;

use serde::Serialize;
use serde_json::{Value, json};

use super::answers::{self, card};
use super::by_hand;
use super::desk::{Compared, Desk, DeskLog, DeskModel, DeskSearch, LogContent, OpenLog, Origin, SearchState};
use super::guesses;
use super::shown::ShownComparison;
use crate::compare::ScoredBlock;
use crate::effect::find;
use crate::log::signals::log_signal;
use crate::model::Model;
use crate::report::comparison;
use crate::report::measure::say_measures;
use crate::report::story::step_title;

/// What the page hears while something goes on.
#[derive(Debug, Serialize)]
pub(super) struct Tick<'a> {
    /// A page whose desk has another number reads it anew.
    revision: u64,
    search: Option<SearchView<'a>>,
    /// What is being read or compared.
    looking: Option<&'a str>,
}

#[derive(Debug, Serialize)]
struct SearchView<'a> {
    kind: super::desk::SearchKind,
    #[serde(flatten)]
    state: &'a SearchState,
    fitted: usize,
    leading: &'a [String],
    tried: &'a [(Vec<String>, f64)],
    /// [s] so far, or in all.
    seconds: f64,
}

impl<'a> Tick<'a> {
    pub fn of(desk: &'a Desk) -> Self {
        let looking = desk.looking.as_ref().map(|looking| looking.name.as_str());
        Self { revision: desk.revision, search: desk.search.as_ref().map(SearchView::of), looking }
    }
}

impl<'a> SearchView<'a> {
    fn of(search: &'a DeskSearch) -> Self {
        Self {
            kind: search.kind,
            state: &search.state,
            fitted: search.fitted,
            leading: &search.leading,
            tried: &search.tried,
            seconds: search.took.unwrap_or_else(|| search.began.elapsed()).as_secs_f64(),
        }
    }
}

/// The whole desk.
pub(super) fn desk(desk: &Desk) -> Value {
    let chosen = desk.model(desk.chosen).ok();
    let by_hand = |search| chosen.map(|model| by_hand::search(desk, search, &model.typed()));
    let mut view = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "tick": Tick::of(desk),
        "chosen": desk.chosen,
        "logs": desk.logs.iter().map(|it| log(desk, it)).collect::<Vec<_>>(),
        "models": desk.models.iter().map(model).collect::<Vec<_>>(),
        "answered": desk.answered.as_ref().map(|it| answers::shown(desk, it)),
        "discovered": desk.discovered.as_ref().map(|it| answers::shown(desk, &it.answered)),
        "done": desk.done,
        "notices": desk.notices,
        "by_hand": json!({ "diagnose": by_hand("diagnose"), "discover": by_hand("discover") }),
    });
    say_measures(&mut view);
    view
}

fn log(desk: &Desk, log: &DeskLog) -> Value {
    let mapping = log.mapping.as_ref().map(|it| &it.name);
    let mut view = json!({ "id": log.id, "name": log.typed, "role": log.role, "mapping": mapping, "choice": log.choice });
    match &log.content {
        LogContent::Opening => view["state"] = json!("opening"),
        LogContent::Guessed => {
            view["state"] = json!("guessed");
            view["guess"] = json!(log.guess.as_ref().map(|guess| guesses::view(desk, guess)));
        }
        LogContent::Parts(parts) => {
            let each = parts.iter().map(|(part, seconds)| json!({ "part": part, "seconds": seconds }));
            view["state"] = json!("parts");
            view["parts"] = each.collect();
        }
        LogContent::Failed(why) => {
            view["state"] = json!("failed");
            view["why"] = json!(why);
        }
        LogContent::Open(open) => {
            let time = open.log.raw().time();
            let ends = [time.first(), time.last()].map(|at| at.copied().unwrap_or(0.0));
            let channels = open.channels.iter().map(|channel| {
                let known = log_signal(&channel.name);
                json!({ "name": channel.name, "unit": known.map_or("", |it| it.unit), "meaning": known.map_or("", |it| it.meaning) })
            });
            view["state"] = json!("open");
            view["format"] = json!(open.format);
            view["others"] = json!(others(log, open));
            view["rows"] = json!(open.log.raw().len());
            view["ends_s"] = json!(ends);
            view["channels"] = channels.collect();
            view["notes"] = json!(open.notes);
            view["stuck"] = json!(log.stuck);
            view["sha256"] = json!(open.log.raw().sha256());
            view["is_compared"] =
                json!(log.compared.as_ref().is_some_and(|it| Arc::ptr_eq(&it.content, open)));
            view["by_hand"] = json!(by_hand::compare(desk, log.id).ok());
        }
    }
    if let Some(compared) = &log.compared {
        view["compared"] = compared_view(compared);
    }
    view
}

/// The file of a log that holds other ones, too.
fn others(log: &DeskLog, open: &OpenLog) -> Option<String> {
    let (part, count) = open.part?;
    let file = log.typed.strip_suffix(&format!("#{part}"))?;
    (count > 1).then(|| file.to_owned())
}

/// The blocks of a log, with the error of each model.
fn compared_view(compared: &Compared) -> Value {
    let found = match &compared.found {
        Ok(found) => found,
        Err(why) => return json!({ "models": compared.models, "why": why }),
    };
    let pairs: Vec<(u64, &ShownComparison)> = compared.models.iter().copied().zip(found.iter()).collect();
    let mut keys: Vec<(&str, &str)> = Vec::new();
    for block in pairs.iter().flat_map(|(_, shown)| &shown.comparison.blocks) {
        let key = (block.name.as_str(), block.signal.as_str());
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    let blocks = keys.into_iter().map(|key| {
        let is_it = |(block, _): &(&ScoredBlock, _)| (block.name.as_str(), block.signal.as_str()) == key;
        let of_models = pairs.iter().filter_map(|(model, shown)| Some((*model, shown.blocks().find(is_it)?)));
        let each: Vec<ModelBlock> =
            of_models.map(|(model, (block, worst_s))| (model, block, worst_s)).collect();
        block(&each)
    });
    let torque = pairs.iter().filter_map(|(model, shown)| {
        let torque = shown.comparison.unknown_torque.as_ref()?;
        Some(json!({ "model": model, "rms": torque.rms, "uncertainty": torque.uncertainty }))
    });
    let worst = pairs.iter().map(|(model, shown)| {
        let it = &shown.comparison;
        json!({
            "model": model,
            "block": it.worst().map(|block| &block.name),
            "signal": it.worst().map(|block| &block.signal),
            "is_adequate": it.is_adequate(),
        })
    });
    json!({
        "models": compared.models,
        "blocks": blocks.collect::<Vec<_>>(),
        "unknown_torque": torque.collect::<Vec<_>>(),
        "worst": worst.collect::<Vec<_>>(),
    })
}

/// A model, its block, and where that one's error is largest [s].
type ModelBlock<'a> = (u64, &'a ScoredBlock, Option<(f64, f64)>);

fn block(each: &[ModelBlock]) -> Value {
    let Some((_, first, _)) = each.first() else { return Value::Null };
    let errors = each.iter().map(|(model, block, worst_s)| {
        let error = &block.error;
        json!({
            "model": model,
            "rms": error.rms,
            "fit_percent": error.fit_percent,
            "noise_floor": error.noise_floor,
            "is_noise": error.is_noise(),
            "worst_s": worst_s,
        })
    });
    json!({
        "name": first.name,
        "signal": first.signal,
        "unit": first.unit,
        "driven_by": first.driven_by,
        "run": comparison::run(first.run),
        "errors": errors.collect::<Vec<_>>(),
    })
}

fn model(model: &DeskModel) -> Value {
    let own = &model.model;
    let rung = |step: &crate::model::ModelStep| json!({ "title": step_title(step), "added": step.added, "error": step.error });
    let effects =
        own.effects.iter().map(|added| json!({ "id": added.id, "card": find(&added.id).map(card) }));
    json!({
        "id": model.id,
        "name": own.name,
        "file": model.typed(),
        "is_made": model.origin == Origin::Made,
        "is_tried": model.origin == Origin::Tried,
        "shown": model.shown,
        "effects": effects.collect::<Vec<_>>(),
        "ladder": own.ladder.iter().map(rung).collect::<Vec<_>>(),
        "parameters": parameters(own),
        "notes": model.notes,
    })
}

/// Each number of a model with its error, in the model file's unit.
fn parameters(model: &Model) -> Vec<Value> {
    let each = model.parameters().into_iter().map(|(name, value)| {
        let of_effect = name.split_once('.').and_then(|(id, bare)| {
            find(id)?
                .parameters
                .iter()
                .find(|known| known.name == bare)
                .map(|it| (it.unit, it.symbol, it.meaning))
        });
        let (unit, symbol, meaning) = of_effect.unwrap_or_else(|| {
            let (unit, symbol) = Model::base_parameter_unit(&name);
            (unit, symbol, "")
        });
        json!({
            "name": name,
            "symbol": symbol,
            "unit": unit,
            "meaning": meaning,
            "value": value,
            "standard_error": model.standard_errors.get(&name),
        })
    });
    each.collect()
}
