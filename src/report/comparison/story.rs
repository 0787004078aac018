//! The story of `compare` in words and tables, and as one screen of text.

use std::fmt::Write as _;

use crate::compare::{Comparison, Direction, Regressor, RunMode, ScoredBlock};
use crate::report::findings::text as text_of;
use crate::report::notes::{Detail, lines, of_all};
use crate::report::story::wrapped;
use crate::report::thresholds::THRESHOLDS;
use crate::report::{Mark, TextTable, number, sparkline};
use crate::screening::summary::LogSummary;
use crate::screening::{Finding, ScreenedLog};
use crate::signal::columns;

/// How a block was run.
#[must_use]
pub fn run(run: RunMode) -> String {
    match run {
        RunMode::Free => "free run".to_owned(),
        RunMode::Windows(seconds) => format!("windows of {seconds} s"),
        RunMode::EachSample => "at each sample".to_owned(),
        RunMode::Smoothed => "both smoothed".to_owned(),
    }
}

pub(super) fn percent(share: f64) -> String {
    format!("{} %", bare_percent(share))
}

/// The same without its unit.
fn bare_percent(share: f64) -> String {
    number(100.0 * share, if share < THRESHOLDS.small_share { 2 } else { 3 })
}

/// Words for what an error depends on.
fn plain(on: &Regressor) -> String {
    let Regressor { column, is_rate } = on;
    if *is_rate { format!("the rate of `{column}`") } else { format!("`{column}`") }
}

/// One line about a log: how long, how fast, how whole.
pub(super) fn about(log: &ScreenedLog) -> String {
    let log = log.raw();
    let seconds = log.time().last().unwrap_or(&0.0) - log.time().first().unwrap_or(&0.0);
    let holes = log.holes();
    let lost: f64 = holes.iter().map(|hole| hole.length).sum();
    let whole = match holes.len() {
        0 => "no holes".to_owned(),
        1 => format!("1 hole of {} s", number(lost, 2)),
        many => format!("{many} holes, {} s in all", number(lost, 2)),
    };
    let rate = 1.0 / log.median_interval();
    format!("{} samples, {} s at {} Hz, {whole}", log.len(), number(seconds, 3), number(rate, 3))
}

/// Block and signal, each once, in the order of the models' blocks.
pub(super) fn keys(comparisons: &[Comparison]) -> Vec<(&str, &str)> {
    let mut keys: Vec<(&str, &str)> = Vec::new();
    for block in comparisons.iter().flat_map(|comparison| &comparison.blocks) {
        if !keys.contains(&(&block.name, &block.signal)) {
            keys.push((&block.name, &block.signal));
        }
    }
    keys
}

/// The block of that name and signal, of each model that has one.
pub(super) fn blocks_of<'a>(
    comparisons: &'a [Comparison],
    (name, signal): (&str, &str),
) -> impl Iterator<Item = (&'a Comparison, &'a ScoredBlock)> {
    comparisons.iter().filter_map(move |comparison| {
        let block = comparison.blocks.iter().find(|block| block.name == name && block.signal == signal)?;
        Some((comparison, block))
    })
}

pub(super) fn block_table(comparisons: &[Comparison]) -> TextTable {
    let mut table = TextTable::new([
        "block",
        "signal",
        "model",
        "error",
        "floor",
        "unit",
        "fit [%]",
        "explained",
        "noise",
        "unexplained",
    ]);
    for key in keys(comparisons) {
        for (comparison, block) in blocks_of(comparisons, key) {
            let error = &block.error;
            let mark = if error.is_noise() { Mark::Good } else { Mark::Warning };
            table = table.marked_row(
                mark,
                [
                    key.0.to_owned(),
                    key.1.to_owned(),
                    comparison.model.clone(),
                    number(error.rms, 3),
                    number(error.noise_floor, 3),
                    block.unit.to_owned(),
                    number(error.fit_percent, 3),
                    percent(error.explained),
                    percent(error.noise),
                    percent(error.unexplained),
                ],
            );
        }
    }
    table
}

/// The same for 80 columns: the block's name says the signal, shares are in percent.
fn narrow_table(comparisons: &[Comparison]) -> TextTable {
    let several = comparisons.len() > 1;
    let model = several.then_some("model");
    let rest = ["error", "floor", "fit %", "expl. %", "noise %", "rest %"];
    let mut table = TextTable::new(["block"].into_iter().chain(model).chain(rest));
    for (name, signal) in keys(comparisons) {
        for (comparison, block) in blocks_of(comparisons, (name, signal)) {
            let error = &block.error;
            let cells = [
                format!("{} {}", number(error.rms, 3), block.unit),
                number(error.noise_floor, 3),
                number(error.fit_percent, 3),
                bare_percent(error.explained),
                bare_percent(error.noise),
                bare_percent(error.unexplained),
            ];
            let model = several.then(|| comparison.model.clone());
            table = table.row([label(name, signal)].into_iter().chain(model).chain(cells));
        }
    }
    table
}

/// The name of a block that says the signal.
fn label(name: &str, signal: &str) -> String {
    let what = match signal {
        columns::BODY_RATE => " rate",
        columns::BODY_ANGLE => " angle",
        _ => "",
    };
    format!("{name}{what}")
}

/// From model to model: the error of each block, and which blocks stay as they are. `None` of one model.
pub(super) fn change(comparisons: &[Comparison]) -> Option<String> {
    let names: Vec<&str> = comparisons.iter().map(|comparison| comparison.model.as_str()).collect();
    let (mut moved, mut same) = (Vec::new(), Vec::new());
    for key in keys(comparisons) {
        let blocks: Vec<&ScoredBlock> = blocks_of(comparisons, key).map(|(_, block)| block).collect();
        let errors: Vec<String> = blocks.iter().map(|block| number(block.error.rms, 3)).collect();
        match blocks[..] {
            [first, _, ..] if errors.windows(2).any(|pair| pair[0] != pair[1]) => moved.push(format!(
                "{} {} {} (noise {})",
                label(key.0, key.1),
                errors.join(" -> "),
                first.unit,
                number(first.error.noise_floor, 2)
            )),
            [_, _, ..] => same.push(label(key.0, key.1)),
            _ => {}
        }
    }
    if !same.is_empty() {
        moved.push(format!("the same: {}", same.join(", ")));
    }
    (names.len() > 1 && !moved.is_empty()).then(|| format!("{}: {}", names.join(" -> "), moved.join("; ")))
}

/// What is said of each model; of those of which the same is said, once. Names before it.
pub(super) fn once<'a, T: PartialEq>(said: impl Iterator<Item = (&'a str, T)>) -> Vec<(String, T)> {
    let mut groups: Vec<(Vec<&str>, T)> = Vec::new();
    for (model, what) in said {
        match groups.iter_mut().find(|(_, known)| *known == what) {
            Some((models, _)) => models.push(model),
            None => groups.push((vec![model], what)),
        }
    }
    groups.into_iter().map(|(models, what)| (models.join(" and "), what)).collect()
}

/// Sentences about where a block fails.
pub(super) fn sentences(comparison: &Comparison, block: &ScoredBlock) -> Vec<String> {
    let mut out = Vec::new();
    let error = &block.error;
    let how_far = if error.over_floor().is_finite() {
        format!("{} times its noise floor", number(error.over_floor(), 3))
    } else {
        "and what was measured never moves".to_owned()
    };
    out.push(format!(
        "`{}` ({}, {}): error {} {}, {how_far}.",
        block.name,
        block.signal,
        run(block.run),
        number(error.rms, 3),
        block.unit
    ));
    let groups: Vec<String> = block
        .failure
        .groups
        .iter()
        .map(|group| format!("{} {} (mean {})", group.name, number(group.rms, 3), number(group.mean, 2)))
        .collect();
    if !groups.is_empty() {
        out.push(format!("Rms [{}]: {}.", block.unit, groups.join(", ")));
    }
    if let Some(spectrum) = &block.failure.spectrum {
        out.push(format!(
            "Below {} Hz lie {} of its power, above {}.",
            number(spectrum.corner_hz, 2),
            percent(spectrum.low),
            percent(spectrum.high)
        ));
    }
    out.push(dependences(comparison, block));
    out.extend(follows(block));
    out
}

/// What a block's error is a function of.
fn dependences(comparison: &Comparison, block: &ScoredBlock) -> String {
    let of_torque = block.name == "body" && comparison.unknown_torque.is_some();
    let what = if of_torque { "The unknown torque" } else { "The error" };
    let real: Vec<String> = block
        .failure
        .dependences
        .iter()
        .filter(|dependence| dependence.is_real())
        .take(3)
        .map(|d| format!("{} {} (by chance {})", percent(d.explained), plain(&d.on), percent(d.surrogate)))
        .collect();
    if real.is_empty() {
        format!("{what} depends on no measured channel by more than chance.")
    } else {
        format!("{what} is a function of: {}.", real.join(", "))
    }
}

/// The channel that a block's error follows most.
fn follows(block: &ScoredBlock) -> Option<String> {
    let evidence = block.failure.correlations.iter().filter(|c| {
        c.peak.abs() > THRESHOLDS.plain_correlation * c.bound
            && c.direction == Direction::ErrorFollows
            && c.with != block.signal
    });
    let c = evidence.max_by(|a, b| a.peak.abs().total_cmp(&b.peak.abs()))?;
    let moves = if c.lag_s > 0.0 {
        format!("It follows `{}` by {} s", c.with, number(c.lag_s, 2))
    } else {
        format!("It moves with `{}`", c.with)
    };
    let (peak, bound) = (number(c.peak, 2), number(c.bound, 2));
    Some(format!("{moves} (correlation {peak}, by chance below {bound})."))
}

pub(super) fn torque_sentence(comparison: &Comparison) -> Option<String> {
    let torque = comparison.unknown_torque.as_ref()?;
    Some(format!(
        "The torque that `{}` does not know: {} N m rms (mean {}), known only to {}; the rotors and effects it \
         knows give {}.",
        comparison.model,
        number(torque.rms, 2),
        number(torque.mean, 2),
        number(torque.uncertainty, 2),
        number(torque.known_rms, 2)
    ))
}

/// Columns that can hardly be what their names say: all numbers of a comparison are of them.
fn mistaken(comparisons: &[Comparison]) -> &[Finding] {
    comparisons.first().map_or(&[][..], |first| &first.mistaken_columns)
}

/// The same in sentences, ahead of the numbers.
fn first(comparisons: &[Comparison], detail: Detail) -> String {
    let own: Vec<Finding> = mistaken(comparisons).iter().map(|it| it.clone().of("")).collect();
    let said = lines(&of_all(&own), "Note: ", detail);
    if said.is_empty() { said } else { said + "\n" }
}

/// What to know about a log, first what makes everything else worthless.
fn findings(comparisons: &[Comparison], log: &ScreenedLog) -> Vec<Finding> {
    let mistaken = mistaken(comparisons);
    let found = LogSummary::of(log).findings;
    let others = found.into_iter().filter(|finding| !mistaken.contains(finding));
    mistaken.iter().cloned().chain(others).collect()
}

/// The same in sentences; whose log it is stands above them.
pub(super) fn notes(comparisons: &[Comparison], log: &ScreenedLog) -> Vec<String> {
    findings(comparisons, log).iter().map(text_of).collect()
}

/// Where a model fails most; nothing in it where every block is at its floor, `None` where there is no block.
fn where_worst(comparison: &Comparison) -> Option<Option<String>> {
    let worst = comparison.worst()?;
    if comparison.is_adequate() {
        return Some(None);
    }
    let said = sentences(comparison, worst).into_iter().chain(torque_sentence(comparison));
    let mut out: String = said.map(|sentence| wrapped("  ", &sentence)).collect();
    let over_time: Vec<f64> = worst.failure.over_time.iter().map(|(_, rms)| *rms).collect();
    // Writing to a `String` cannot fail.
    let _ = writeln!(out, "  error over time  {}", sparkline(&over_time, 60));
    Some(Some(out))
}

/// One screen; `detail` says how much of the notes is said, `next` is the command that looks for what is missing.
#[must_use]
pub fn text(found: &[Vec<Comparison>], logs: &[ScreenedLog], detail: Detail, next: &str) -> String {
    let mut out = String::new();
    for (comparisons, log) in found.iter().zip(logs) {
        // Writing to a `String` cannot fail.
        let _ = writeln!(out, "{}: {}\n", log.source_name(), about(log));
        out += &first(comparisons, detail);
        if let Some(change) = change(comparisons) {
            out += &(wrapped("", &change) + "\n");
        }
        let _ = writeln!(out, "{}", narrow_table(comparisons).text());
        let said = comparisons.iter().filter_map(|it| Some((it.model.as_str(), where_worst(it)?)));
        for (models, worst) in once(said) {
            out += &worst.map_or_else(
                || format!("{models}: every block is at its noise floor.\n"),
                |worst| format!("Largest over its noise with {models}:\n{worst}"),
            );
        }
        out.push('\n');
    }
    // Of one log it goes without saying whose they are.
    let is_one = logs.len() == 1;
    let of = |finding: Finding, log: &ScreenedLog| finding.of(if is_one { "" } else { log.source_name() });
    let said = found.iter().zip(logs).flat_map(|(comparisons, log)| {
        let others = findings(comparisons, log).into_iter().filter(|it| !mistaken(comparisons).contains(it));
        others.map(move |finding| of(finding, log))
    });
    let said: Vec<Finding> = said.collect();
    let said = lines(&of_all(&said), "Note: ", detail);
    if !said.is_empty() {
        out += &(said + "\n");
    }
    // The command goes on with the last model.
    let wanting = found.iter().filter_map(|models| models.last()).any(|comparison| !comparison.is_adequate());
    if wanting {
        // Writing to a `String` cannot fail.
        let _ =
            writeln!(out, "Which effect is missing (--validate LOG names a log to judge it on):\n  {next}");
    }
    out
}
