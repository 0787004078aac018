//! The pages of `diagnose` and `extend`: what is missing, why, and how far the error falls.

use super::card_sentence::{card_sentence, in_doubt};
use super::found_parameters::found_parameters;
use super::measure::measure;
use super::next_steps::NextStep;
use super::story::{error_table, failing, moves_voltage_gain, step_title};
use super::verdict;
use super::{Bars, Mark, Page, TextTable, comparison, number};
use crate::compare::Comparison;
use crate::diagnose::diagnosis::{ErrorSummary, FailurePlace, FoundParameter, RankedCandidate};
use crate::diagnose::{Diagnosis, Extension, Verdict};
use crate::effect::{Site, find};
use crate::model::{Change, Model};
use crate::report::thresholds::THRESHOLDS;
use crate::screening::ScreenedLog;

/// The page of a diagnosis; `compared` are the model and its extension on each of `logs`; `next` says what to do.
#[must_use]
pub fn page(
    diagnosis: &Diagnosis,
    compared: &[Vec<Comparison>],
    logs: &[ScreenedLog],
    next: &[NextStep],
) -> Page {
    let mut page = Page::new("What the model is missing");
    let (mark, sentence) = headline(diagnosis);
    page.verdict(mark, sentence);
    for said in verdict::beneath(diagnosis, "**") {
        page.verdict(Mark::Warning, said);
    }
    key_numbers(&mut page, &diagnosis.error);
    page.heading("What to do next").list(next.iter().map(NextStep::text));
    let moved = moves_voltage_gain(diagnosis.changed_parameters.iter().map(|changed| &changed.name));
    cards(&mut page, &diagnosis.effects, (&diagnosis.model, moved), diagnosis.parameters.iter());
    parameters(&mut page, diagnosis);
    if let Some(reservation) = verdict::reservation(diagnosis) {
        page.paragraph(reservation);
    }
    page.heading("How far the error falls");
    page.table(
        error_table(&diagnosis.error, ["model", "fitted on", "held out"])
            .caption(measure(&diagnosis.error.measure)),
    );
    ladder(&mut page, diagnosis);
    candidates(&mut page, diagnosis);
    let places: Vec<_> = failing(diagnosis).collect();
    let says = |place: &&FailurePlace| places.len() > 1 || place.explained >= THRESHOLDS.shown_explained;
    if places.iter().any(says) {
        let mut table =
            TextTable::new(["block", "share of the error above noise [%]", "follows", "explains [%]"])
                .caption("Where the model fails, its own parameters refitted");
        for place in &places {
            table = table.row([
                place.block.clone(),
                number(100.0 * place.share_of_error, 3),
                place.depends_on.clone(),
                number(100.0 * place.explained, 3),
            ]);
        }
        page.heading("Where it fails").table(table);
    }
    let notes: Vec<String> = verdict::notes(diagnosis).map(super::findings::sentence).collect();
    if !notes.is_empty() {
        page.heading("Notes").list(notes);
    }
    signals(&mut page, compared, logs);
    page
}

/// The page of an extension by `added`; `compared` are the model and its extension on each of `logs`.
#[must_use]
pub fn extension_page(
    extension: &Extension,
    added: &[String],
    compared: &[Vec<Comparison>],
    logs: &[ScreenedLog],
) -> Page {
    let mut page = Page::new("The extended model");
    let error = &extension.error;
    let (mark, sentence) = verdict::extension(extension, added);
    page.verdict(mark, sentence);
    key_numbers(&mut page, error);
    let moved = moves_voltage_gain(extension.model.last_changes().iter().map(|changed| &changed.name));
    let found = found_parameters(&extension.model);
    let found = || found.iter().map(|(name, found)| (name, found));
    cards(&mut page, added, (&extension.model, moved), found());
    parameter_table(&mut page, found());
    change_table(&mut page, extension.model.last_changes().into_iter());
    page.heading("How far the error falls");
    page.table(error_table(error, ["model", "fitted on", "held out"]).caption(measure(&error.measure)));
    let mut steps = TextTable::new(["step", "added", "held-out error before", "after", "what"])
        .caption("The ladder: every step this model has taken");
    for (number_of, step) in extension.model.ladder.iter().enumerate() {
        steps = steps.row([
            (number_of + 1).to_string(),
            step_title(step),
            number(step.error.validate_before, 4),
            number(step.error.validate_after, 4),
            measure(&step.error.measure),
        ]);
    }
    page.table(steps);
    signals(&mut page, compared, logs);
    page
}

fn headline(diagnosis: &Diagnosis) -> (Mark, String) {
    let mark = match diagnosis.verdict {
        Verdict::Adequate => Mark::Good,
        Verdict::Unknown => Mark::Bad,
        _ => Mark::Warning,
    };
    (mark, verdict::sentence(diagnosis, "**"))
}

pub(super) fn key_numbers(page: &mut Page, error: &ErrorSummary) {
    let with_unit = |error_of: f64| format!("{} {}", number(error_of, 3), error.unit);
    page.key_numbers([
        ("held-out error of the model as it is", with_unit(error.base.validate)),
        ("its own parameters refitted", with_unit(error.refitted.validate)),
        ("extended", with_unit(error.extended.validate)),
        ("noise floor: what the sensors alone would leave", with_unit(error.noise_floor)),
    ])
    .paragraph(format!("Error: {}.", measure(&error.measure)));
    if error.is_refitted_worse() {
        page.paragraph(super::story::REFITTED_WORSE);
    }
}

/// The cards of effects in plain words; of the user's own what the model file says of them.
fn cards<'a>(
    page: &mut Page,
    effects: &[String],
    base: (&Model, bool),
    found: impl Iterator<Item = (&'a String, &'a FoundParameter)> + Clone,
) {
    let acts_on = |site: Site| format!("(acts on: {})", site.name().replace('_', " "));
    for user in effects.iter().filter_map(|id| base.0.user_effect(id)) {
        page.heading(&user.id);
        if !user.meaning.is_empty() {
            page.paragraph(&user.meaning);
        }
        page.formula(format!("+ {}    {}", user.expression, acts_on(user.site)))
            .paragraph("An effect of the user's own, from the model file.");
    }
    for card in effects.iter().filter_map(|id| find(id)) {
        let meaning = card_sentence(card, in_doubt(base, card, found.clone()));
        page.heading(card.id)
            .paragraph(format!("{meaning} {}", card.report[1]))
            .formula(format!("{}    {}", card.equation, acts_on(card.site)))
            .paragraph(format!("How it shows: {}", card.residual))
            .paragraph(format!("Source: {}. Experiment: {}", card.source, card.experiment));
    }
}

fn parameters(page: &mut Page, diagnosis: &Diagnosis) {
    parameter_table(page, diagnosis.parameters.iter());
    change_table(
        page,
        diagnosis.changed_parameters.iter().map(|changed| Change {
            name: changed.name.clone(),
            from: changed.from,
            to: changed.to,
            standard_error: changed.standard_error,
        }),
    );
}

/// The base's own numbers that have other values.
fn change_table(page: &mut Page, changes: impl Iterator<Item = Change>) {
    let mut changed = TextTable::new(["parameter", "in the model", "found", "standard error", "unit"])
        .caption("Parameters of the base that have other values");
    for change in changes {
        let (unit, symbol) = Model::base_parameter_unit(&change.name);
        changed = changed.row([
            format!("{} ({symbol})", change.name),
            number(change.from, 4),
            number(change.to, 4),
            with_error(change.standard_error),
            unit.to_owned(),
        ]);
    }
    if !changed.is_empty() {
        page.table(changed);
    }
}

fn with_error(error: Option<f64>) -> String {
    error.map_or_else(|| "-".to_owned(), |error| number(error, 2))
}

fn parameter_table<'a>(page: &mut Page, parameters: impl Iterator<Item = (&'a String, &'a FoundParameter)>) {
    let mut found = TextTable::new(["parameter", "symbol", "value", "standard error", "unit", "what it is"])
        .caption("Fitted parameters");
    for (name, parameter) in parameters {
        let known = name
            .split_once('.')
            .and_then(|(id, bare)| find(id)?.parameters.iter().find(|known| known.name == bare));
        found = found.row([
            name.clone(),
            known.map_or_else(String::new, |known| known.symbol.to_owned()),
            number(parameter.value, 4),
            with_error(parameter.standard_error),
            parameter.unit.clone(),
            known.map_or_else(String::new, |known| known.meaning.to_owned()),
        ]);
    }
    if !found.is_empty() {
        page.table(found);
    }
}

fn ladder(page: &mut Page, diagnosis: &Diagnosis) {
    let title = format!("The ladder: held-out {}", measure(&diagnosis.error.measure));
    let mut bars = Bars::new(title, "");
    let mut before: &[String] = &[];
    for rung in &diagnosis.ladder {
        let new: Vec<String> = rung.effects.iter().filter(|id| !before.contains(id)).cloned().collect();
        let grows =
            !before.is_empty() && before.iter().all(|id| rung.effects.contains(id)) && !new.is_empty();
        let label = match (rung.effects.is_empty(), grows) {
            (true, _) => "its own parameters refitted".to_owned(),
            (false, true) => format!("+ {}", new.join(" + ")),
            (false, false) => rung.effects.join(" + "),
        };
        bars = bars.bar(label, rung.validate, Mark::Plain);
        before = &rung.effects;
    }
    page.bars(bars.level("noise floor", diagnosis.error.noise_floor));
}

/// Each candidate alone, block by block, the one that the error is given in first, against the noise floor.
fn candidates(page: &mut Page, diagnosis: &Diagnosis) {
    let mut tried: Vec<_> =
        diagnosis.candidates.iter().filter_map(|candidate| Some((candidate, candidate.validate?))).collect();
    tried.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut channels: Vec<&str> = tried.iter().map(|(candidate, _)| candidate.channel.as_str()).collect();
    channels.sort_unstable();
    channels.dedup();
    channels.sort_by_key(|channel| !diagnosis.error.is_of(channel));
    page.heading("The candidates").paragraph(
        "Each effect alone, all parameters refitted, validated on data that no fit has seen. Left of `base, refitted` it helps; at \
         the noise floor nothing is left to explain; right of `one in twenty by chance` an effect that means nothing gets, too. `by chance` is how often the same effect does as well when its trace is \
         shifted in time and so means nothing: above 0.05 it counts as chance, however far the bar has fallen.",
    );
    for channel in channels {
        let of_channel: Vec<_> =
            tried.iter().copied().filter(|(candidate, _)| candidate.channel == channel).collect();
        let is_named = |it: &(&RankedCandidate, f64)| diagnosis.effects.contains(&it.0.effect);
        let bars = candidates_of(channel, &of_channel, diagnosis);
        if diagnosis.error.is_of(channel) || of_channel.iter().any(is_named) {
            page.bars(bars);
        } else {
            let what = channel.split(' ').next().unwrap_or(channel);
            page.details(format!("Candidates for {what}, where nothing was found missing"), |page| {
                page.bars(bars);
            });
        }
    }
    let refused: Vec<String> = diagnosis
        .candidates
        .iter()
        .filter_map(|candidate| Some(format!("`{}`: {}", candidate.effect, candidate.refusal.as_ref()?)))
        .collect();
    let not_named: Vec<String> =
        super::not_named::all(diagnosis).map(|(effect, why)| format!("`{effect}`: {why}")).collect();
    if !not_named.is_empty() {
        page.details("Candidates that are not named, and why", |page| {
            page.list(not_named);
        });
    }
    if !refused.is_empty() {
        page.details("Candidates that were not tried, or refused", |page| {
            page.list(refused);
        });
    }
}

/// The candidates for one channel, with their errors, the least first.
fn candidates_of(channel: &str, tried: &[(&RankedCandidate, f64)], diagnosis: &Diagnosis) -> Bars {
    let mut bars = Bars::new(format!("Every candidate alone: held-out error of {channel}"), "");
    for (candidate, error) in tried {
        let note =
            candidate.p_value.map_or_else(String::new, |chance| format!("by chance {}", number(chance, 2)));
        let mark = if diagnosis.effects.contains(&candidate.effect) { Mark::Good } else { Mark::Plain };
        bars = bars.noted_bar(candidate.effect.clone(), *error, mark, note);
    }
    let by_chance = tried.iter().filter_map(|(candidate, _)| candidate.surrogate_error).reduce(f64::min);
    if let Some(by_chance) = by_chance {
        bars = bars.level("one in twenty by chance", by_chance);
    }
    if diagnosis.error.is_of(channel) {
        bars = bars
            .level("noise floor", diagnosis.error.noise_floor)
            .level("base, refitted", diagnosis.error.refitted.validate);
    }
    bars
}

/// Both models on the logs, block by block.
pub(super) fn signals(page: &mut Page, compared: &[Vec<Comparison>], logs: &[ScreenedLog]) {
    page.heading("Both models on the logs").paragraph(
        "The same samples count as above, but each stretch and window starts at the measured state, where the diagnosis fits \
         its start and runs on over short holes: the errors here are other numbers than those above.",
    );
    comparison::write(page, compared, logs);
}
