//! The story of `compare` in words and tables, and as one screen of text.

use std::fmt::Write as _;

use crate::compare::{Block, Comparison, Direction, Regressor, Run};
use crate::report::findings::{sentence, text as text_of};
use crate::report::story::wrapped;
use crate::report::thresholds::THRESHOLDS;
use crate::report::{Mark, Table, number, sparkline};
use crate::screening::ScreenedLog;
use crate::screening::summary::LogSummary;

/// How a block was run.
#[must_use]
pub fn run(run: Run) -> String {
    match run {
        Run::Free => "free run".to_owned(),
        Run::Windows(seconds) => format!("windows of {seconds} s"),
        Run::EachSample => "at each sample".to_owned(),
        Run::Smoothed => "smoothed alike".to_owned(),
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
) -> impl Iterator<Item = (&'a Comparison, &'a Block)> {
    comparisons.iter().filter_map(move |comparison| {
        let block = comparison.blocks.iter().find(|block| block.name == name && block.signal == signal)?;
        Some((comparison, block))
    })
}

pub(super) fn block_table(comparisons: &[Comparison]) -> Table {
    let mut table = Table::new([
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
fn narrow_table(comparisons: &[Comparison]) -> Table {
    let several = comparisons.len() > 1;
    let model = several.then_some("model");
    let rest = ["error", "floor", "fit %", "expl. %", "noise %", "rest %"];
    let mut table = Table::new(["block"].into_iter().chain(model).chain(rest));
    for (name, signal) in keys(comparisons) {
        for (comparison, block) in blocks_of(comparisons, (name, signal)) {
            let what = match signal {
                "body_rate_rad_s" => " rate",
                "body_angle_rad" => " angle",
                _ => "",
            };
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
            table = table.row([format!("{name}{what}")].into_iter().chain(model).chain(cells));
        }
    }
    table
}

/// Sentences about where a block fails.
pub(super) fn sentences(comparison: &Comparison, block: &Block) -> Vec<String> {
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
fn dependences(comparison: &Comparison, block: &Block) -> String {
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
fn follows(block: &Block) -> Option<String> {
    let evidence = block.failure.correlations.iter().filter(|c| {
        c.peak.abs() > c.bound && c.direction == Direction::ErrorFollows && c.with != block.signal
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

/// What to know about a log, first what makes everything else worthless.
pub(super) fn notes(comparisons: &[Comparison], log: &ScreenedLog) -> Vec<String> {
    let mistaken = comparisons.first().map_or(&[][..], |first| &first.mistaken_columns);
    let found = LogSummary::of(log).findings;
    let others = found.iter().filter(|finding| !mistaken.contains(finding));
    mistaken.iter().map(sentence).chain(others.map(text_of)).collect()
}

/// One screen.
#[must_use]
pub fn text(found: &[Vec<Comparison>], logs: &[ScreenedLog]) -> String {
    let mut out = String::new();
    for (comparisons, log) in found.iter().zip(logs) {
        // Writing to a `String` cannot fail.
        let _ = writeln!(out, "{}: {}\n", log.source_name(), about(log));
        let _ = writeln!(out, "{}", narrow_table(comparisons).text());
        for comparison in comparisons {
            let Some(worst) = comparison.worst() else { continue };
            if comparison.is_adequate() {
                let _ = writeln!(out, "{}: every block is at its noise floor.", comparison.model);
                continue;
            }
            let _ = writeln!(out, "{} fails most in:", comparison.model);
            for sentence in sentences(comparison, worst) {
                out += &wrapped("  ", &sentence);
            }
            if let Some(sentence) = torque_sentence(comparison) {
                out += &wrapped("  ", &sentence);
            }
            let over_time: Vec<f64> = worst.failure.over_time.iter().map(|(_, rms)| *rms).collect();
            let _ = writeln!(out, "  error over time  {}", sparkline(&over_time, 60));
        }
        for note in notes(comparisons, log) {
            out += &wrapped("Note: ", &note);
        }
        out.push('\n');
    }
    let wanting = found.iter().flatten().any(|comparison| !comparison.is_adequate());
    if wanting {
        out.push_str(
            "Which effect is missing: rotorbench diagnose --model MODEL --log LOG [--validate LOG2]\n",
        );
    }
    out
}
