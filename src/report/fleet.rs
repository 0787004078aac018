//! Many benches as a screen and as a page.

use std::path::{Path, PathBuf};

use super::findings::sentence;
use super::next_steps::{NextStep, Typed, next_steps};
use super::table::number;
use super::{Mark, Page, TextTable, diagnosis, json};
use crate::fleet::{AnswerAndPage, BenchRow, Diagnosed, Fleet, FleetError, ParameterSpread, ShardEvent};

/// One screen.
#[must_use]
pub fn text(fleet: &Fleet) -> String {
    let mut out = headline(fleet) + "\n\n";
    for table in [effects(fleet), parameters(fleet), benches(fleet, false)] {
        if !table.is_empty() {
            out += &(table.text() + "\n");
        }
    }
    for note in notes(fleet) {
        out += &format!("Note: {note}\n");
    }
    out
}

/// The page.
#[must_use]
pub fn page(fleet: &Fleet) -> Page {
    let mut page = Page::new("A fleet of benches");
    page.verdict(if fleet.is_whole() { Mark::Good } else { Mark::Bad }, headline(fleet));
    page.list(notes(fleet));
    page.heading("What they are missing").table(effects(fleet));
    page.heading("Parameters over the benches").table(parameters(fleet));
    page.heading("Bench by bench").table(benches(fleet, true));
    page
}

/// The answer of a bench as `diagnose --json` has it, and its page where one is wanted.
///
/// # Errors
/// [`FleetError::Json`].
pub fn story(found: &Diagnosed) -> Result<AnswerAndPage, FleetError> {
    let answer = json::diagnosis(found.diagnosis)?;
    let page = found
        .compared
        .as_ref()
        .map(|compared| diagnosis::page(found.diagnosis, compared, found.shown(), &next(found)).emit());
    Ok((answer, page))
}

/// What to do next with a bench, by commands that have the options of its keys.
fn next(found: &Diagnosed) -> Vec<NextStep> {
    let bench = found.bench;
    let named = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    let option = |name: &str, value: Option<String>| value.map(|value| format!(" --{name} {value}"));
    let typed = Typed {
        logs: option("mapping", bench.mapping.clone()).unwrap_or_default(),
        windows: option("horizon-s", bench.horizon_s.map(|it| it.to_string())).unwrap_or_default(),
    };
    let logs = (&named(&bench.log)[..], &named(&bench.validate)[..]);
    next_steps(found.diagnosis, &bench.model.display().to_string(), logs, &typed)
}

/// What is said of a plan with a log of another program.
#[must_use]
pub fn foreign_log(log: &Path) -> String {
    let log = log.display();
    format!(
        "hint: the columns of {log} are another program's: say `mapping = \"FILE\"` at each [[bench]] with such logs before `fleet run` \
         (`rotorbench import {log} --write-mapping FILE` writes a guess to look at)"
    )
}

/// A line for each thing heard of a shard.
#[must_use]
pub fn event(event: ShardEvent) -> String {
    match event {
        ShardEvent::Begins { bench, number, of } => format!("{number} of {of}: {bench} ... "),
        ShardEvent::Present => "is there already\n".to_owned(),
        ShardEvent::Answered => "done\n".to_owned(),
        ShardEvent::Failed(why) => format!("failed: {why}\n"),
    }
}

fn headline(fleet: &Fleet) -> String {
    let diagnosed = fleet.benches.len() - fleet.failed;
    let verdicts: Vec<String> =
        fleet.verdicts.iter().map(|it| format!("{} {}", it.benches, it.verdict.replace('_', " "))).collect();
    let verdicts = if verdicts.is_empty() { String::new() } else { format!(" ({})", verdicts.join(", ")) };
    format!(
        "{diagnosed} benches diagnosed{verdicts}, {} failed, {} without an answer.",
        fleet.failed,
        fleet.missing.len()
    )
}

fn notes(fleet: &Fleet) -> Vec<String> {
    let missing = (!fleet.missing.is_empty()).then(|| format!("no answer yet: {}", fleet.missing.join(", ")));
    let error = |row: &BenchRow| Some(format!("{} failed: {}", row.bench, row.error.as_ref()?));
    let failed = fleet.benches.iter().filter_map(error);
    missing.into_iter().chain(failed).chain(fleet.findings.iter().map(sentence)).collect()
}

fn effects(fleet: &Fleet) -> TextTable {
    let table = TextTable::new(["missing effect", "benches", "share [%]", "in the model of"]);
    fleet.effects.iter().fold(table, |table, it| {
        let counts = [it.benches.to_string(), number(100.0 * it.share, 3), it.in_models.to_string()];
        table.row([it.effect.clone()].into_iter().chain(counts))
    })
}

fn parameters(fleet: &Fleet) -> TextTable {
    let headers =
        ["parameter", "unit", "benches", "least", "quarter", "median", "three quarters", "greatest"];
    let row = |table: TextTable, it: &ParameterSpread| {
        let values = [it.least, it.lower_quartile, it.median, it.upper_quartile, it.greatest];
        let names = [it.parameter.clone(), it.unit.clone(), it.benches.to_string()];
        table.row(names.into_iter().chain(values.map(|value| number(value, 4))))
    };
    fleet.parameters.iter().fold(TextTable::new(headers), row)
}

fn benches(fleet: &Fleet, linked: bool) -> TextTable {
    let headers = ["bench", "verdict", "missing", "noise floor", "as it is", "refitted", "extended"];
    fleet.benches.iter().fold(TextTable::new(headers), |table, row| {
        table.marked_row(if row.error.is_some() { Mark::Bad } else { Mark::Plain }, cells(row, linked))
    })
}

fn cells(row: &BenchRow, linked: bool) -> Vec<String> {
    let name = match &row.page {
        Some(page) if linked => format!("[{}]({page})", row.bench),
        _ => row.bench.clone(),
    };
    if row.error.is_some() {
        return vec![name, "failed".to_owned()];
    }
    let errors = [row.noise_floor, row.base, row.refitted, row.extended];
    let errors = errors.map(|value| value.map_or_else(String::new, |value| number(value, 3)));
    [name, row.verdict.replace('_', " "), row.effects.join(" + ")].into_iter().chain(errors).collect()
}
