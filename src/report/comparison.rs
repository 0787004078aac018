//! The story of `compare`: where a model fails, as one screen of text and as a page.

use std::fmt::Write as _;

use super::story::wrapped;
use super::{Axis, Bars, Mark, Page, Plot, Series, Table, Tone, number, sparkline};
use crate::diagnose::compare::{Block, Comparison, Direction};
use crate::record::Dataset;
use crate::record::dataset::LOG_SIGNALS;
use crate::record::findings::Findings;

/// Dependences shown of a block.
const SHOWN: usize = 5;

fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share, if share < 0.1 { 2 } else { 3 }))
}

/// Words for a column.
fn plain(column: &str) -> String {
    match column.strip_prefix("d/dt ") {
        Some(column) => format!("the rate of `{column}`"),
        None => format!("`{column}`"),
    }
}

/// The axis of a column of the log, or of its rate (`d/dt ...`), with its unit.
fn channel_axis(column: &str) -> Axis {
    let (bare, rate) = column.strip_prefix("d/dt ").map_or((column, false), |bare| (bare, true));
    let unit = LOG_SIGNALS.iter().find(|known| known.name == bare).map_or("", |known| known.unit);
    let unit = match (unit, rate) {
        ("" | "-", true) => "1/s".to_owned(),
        ("rad/s", true) => "rad/s²".to_owned(),
        (unit, true) => format!("{unit}/s"),
        (unit, false) => unit.to_owned(),
    };
    Axis::new(column, &unit)
}

/// One line about a log: how long, how fast, how whole.
fn about(log: &Dataset) -> String {
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

fn block_table(comparisons: &[Comparison]) -> Table {
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
    let mut keys: Vec<(&str, &str)> = Vec::new();
    for block in comparisons.iter().flat_map(|comparison| &comparison.blocks) {
        if !keys.contains(&(&block.name, &block.signal)) {
            keys.push((&block.name, &block.signal));
        }
    }
    for key in keys {
        for comparison in comparisons {
            let same = |block: &&Block| (block.name.as_str(), block.signal.as_str()) == key;
            let Some(block) = comparison.blocks.iter().find(same) else { continue };
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
    let mut names: Vec<(&str, &str)> = Vec::new();
    for block in comparisons.iter().flat_map(|comparison| &comparison.blocks) {
        if !names.contains(&(&block.name, &block.signal)) {
            names.push((&block.name, &block.signal));
        }
    }
    for (name, signal) in names {
        for comparison in comparisons {
            let found = comparison.blocks.iter().find(|block| block.name == name && block.signal == signal);
            let Some(block) = found else { continue };
            let what = match signal {
                "body_rate_rad_s" => " rate",
                "body_angle_rad" => " angle",
                _ => "",
            };
            let error = &block.error;
            let share = |share: f64| number(100.0 * share, if share < 0.1 { 2 } else { 3 });
            let cells = [
                format!("{} {}", number(error.rms, 3), block.unit),
                number(error.noise_floor, 3),
                number(error.fit_percent, 3),
                share(error.explained),
                share(error.noise),
                share(error.unexplained),
            ];
            let model = several.then(|| comparison.model.clone());
            table = table.row([format!("{name}{what}")].into_iter().chain(model).chain(cells));
        }
    }
    table
}

/// Sentences about where a block fails.
fn sentences(comparison: &Comparison, block: &Block) -> Vec<String> {
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
        block.run,
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
    let of_torque = block.name == "body" && comparison.unknown_torque.is_some();
    let what = if of_torque { "The unknown torque" } else { "The error" };
    let real: Vec<String> = block
        .failure
        .dependences
        .iter()
        .filter(|dependence| dependence.is_real())
        .take(3)
        .map(|d| format!("{} {} (by luck {})", percent(d.explained), plain(&d.on), percent(d.luck)))
        .collect();
    out.push(if real.is_empty() {
        format!("{what} depends on no measured channel by more than luck.")
    } else {
        format!("{what} is a function of: {}.", real.join(", "))
    });
    let evidence = block.failure.correlations.iter().filter(|c| {
        c.peak.abs() > c.bound && c.direction == Direction::ErrorFollows && c.with != block.signal
    });
    if let Some(c) = evidence.max_by(|a, b| a.peak.abs().total_cmp(&b.peak.abs())) {
        let moves = if c.lag_s > 0.0 {
            format!("It follows `{}` by {} s", c.with, number(c.lag_s, 2))
        } else {
            format!("It moves with `{}`", c.with)
        };
        out.push(format!(
            "{moves} (correlation {}, by luck below {}).",
            number(c.peak, 2),
            number(c.bound, 2)
        ));
    }
    out
}

fn torque_sentence(comparison: &Comparison) -> Option<String> {
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

/// One screen.
#[must_use]
pub fn text(found: &[Vec<Comparison>], logs: &[Dataset]) -> String {
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
        for warning in Findings::of(log).warnings {
            out += &wrapped("Note: ", &warning);
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

/// The page, with every signal.
#[must_use]
pub fn page(found: &[Vec<Comparison>], logs: &[Dataset]) -> Page {
    let mut page = Page::new("Where the model fails");
    write(&mut page, found, logs);
    page
}

/// Adds the signals of every log to a page.
pub(super) fn write(page: &mut Page, found: &[Vec<Comparison>], logs: &[Dataset]) {
    for (comparisons, log) in found.iter().zip(logs) {
        page.heading(log.source_name()).paragraph(about(log));
        page.list(Findings::of(log).warnings.into_iter().map(|warning| format!("Note: {warning}")));
        for comparison in comparisons {
            let (mark, sentence) = if comparison.is_adequate() {
                (Mark::Good, "every block is at its noise floor: nothing is left to explain.".to_owned())
            } else {
                let worst = comparison.worst().map_or_else(String::new, |block| {
                    format!(
                        "`{}` fails most: {} {} where {} would be noise.",
                        block.name,
                        number(block.error.rms, 3),
                        block.unit,
                        number(block.error.noise_floor, 3)
                    )
                });
                (Mark::Warning, worst)
            };
            page.verdict(mark, format!("`{}`: {sentence}", comparison.model));
        }
        page.table(block_table(comparisons).caption(
            "Each block alone, driven by measured inputs where there are any. `fit` is MATLAB's `compare` figure. \
             The floor is what the noise of the sensors would leave of a perfect model.",
        ));
        let mut keys: Vec<(String, String)> = Vec::new();
        for block in comparisons.iter().flat_map(|comparison| &comparison.blocks) {
            let key = (block.name.clone(), block.signal.clone());
            if !keys.contains(&key) {
                keys.push(key);
            }
        }
        let fails = |key: &(String, String)| {
            let blocks = comparisons.iter().flat_map(|comparison| &comparison.blocks);
            blocks.filter(|b| (&b.name, &b.signal) == (&key.0, &key.1)).any(|b| !b.error.is_noise())
        };
        let (failing, sound): (Vec<_>, Vec<_>) = keys.into_iter().partition(fails);
        for key in &failing {
            page.heading(format!("{}: {}", key.0, key.1));
            block_section(page, comparisons, key, log);
        }
        torque_section(page, comparisons, log);
        if !sound.is_empty() {
            page.heading("At the noise floor");
        }
        for key in &sound {
            page.details(format!("{}: {}", key.0, key.1), |page| block_section(page, comparisons, key, log));
        }
    }
}

fn block_section(page: &mut Page, comparisons: &[Comparison], key: &(String, String), log: &Dataset) {
    let blocks: Vec<(&Comparison, &Block)> = comparisons
        .iter()
        .filter_map(|c| c.blocks.iter().find(|b| (&b.name, &b.signal) == (&key.0, &key.1)).map(|b| (c, b)))
        .collect();
    let Some((_, first)) = blocks.first() else { return };
    page.paragraph(format!(
        "Driven by {}; {}.",
        first.driven_by.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
        first.run
    ));
    // Curves break where the log has a hole.
    let gap = 2.5 * log.median_interval();
    let group = format!("{} {}", key.0, log.source_name());
    let axis = |name: &str| Axis::new(name, first.unit);
    let seconds = || Axis::new("time", "s");
    let mut signals = Plot::new("Measured and modelled", seconds(), axis(&key.1)).group(&group).series(
        Series::line("measured", &first.trace.time, &first.trace.measured)
            .tone(Tone::Measured)
            .break_over(gap),
    );
    let mut residuals =
        Plot::new("Measured minus modelled", seconds(), axis("error")).group(&group).height(180);
    let mut rms = Plot::new("Error over time (rms)", seconds(), axis("error")).group(&group).height(140);
    for (comparison, block) in &blocks {
        let trace = &block.trace;
        let residual: Vec<f64> = trace.measured.iter().zip(&trace.modelled).map(|(y, m)| y - m).collect();
        let single = blocks.len() == 1;
        let line = |name: &str, values: &[f64]| Series::line(name, &trace.time, values).break_over(gap);
        let modelled = line(&comparison.model, &trace.modelled);
        let error = line(&comparison.model, &residual);
        signals = signals.series(if single { modelled.tone(Tone::Model) } else { modelled });
        residuals = residuals.series(if single { error.tone(Tone::Residual) } else { error });
        let (at, size): (Vec<f64>, Vec<f64>) = block.failure.over_time.iter().copied().unzip();
        rms = rms.series(Series::line(comparison.model.clone(), &at, &size));
    }
    let floor = first.error.noise_floor;
    page.plot(signals)
        .plot(residuals.level("noise floor", floor).level("", -floor))
        .plot(rms.level("noise floor", floor));
    for (comparison, block) in &blocks {
        let lines = sentences(comparison, block);
        page.list(lines.into_iter().map(|line| format!("**{}** {line}", comparison.model)));
    }
    page.details("Where it fails in detail", |page| {
        for (comparison, block) in &blocks {
            details(page, comparison, block);
        }
    });
}

fn details(page: &mut Page, comparison: &Comparison, block: &Block) {
    page.subheading(format!("{} of `{}`", block.name, comparison.model));
    let mut groups = Table::new(["modelled signal", "samples", "rms", "mean", "share of squared error"])
        .caption(format!("At rest and in motion [{}]", block.unit));
    for group in &block.failure.groups {
        groups = groups.row([
            group.name.to_owned(),
            group.samples.to_string(),
            number(group.rms, 3),
            number(group.mean, 2),
            percent(group.share),
        ]);
    }
    page.table(groups);
    if let Some(spectrum) = &block.failure.spectrum {
        let (at, density): (Vec<f64>, Vec<f64>) = spectrum.density.iter().copied().unzip();
        let hertz = Axis::new("frequency", "Hz").logarithmic();
        let density_axis = Axis::new("density", &format!("{}/√Hz", block.unit)).logarithmic();
        page.plot(
            Plot::new("Error over frequency", hertz, density_axis)
                .height(200)
                .series(Series::line(comparison.model.clone(), &at, &density).tone(Tone::Residual))
                .span("corner", spectrum.corner_hz, spectrum.corner_hz),
        );
    }
    let of_torque = block.name == "body";
    let (what, unit) = if of_torque { ("unknown torque", "N m") } else { ("error", block.unit) };
    if !block.failure.dependences.is_empty() {
        let mut bars = Bars::new(format!("Share of the {what} that is a function of"), "%");
        for d in block.failure.dependences.iter().take(2 * SHOWN) {
            let mark = if d.is_real() { Mark::Warning } else { Mark::Plain };
            let note = format!("by luck {}", percent(d.luck));
            bars = bars.noted_bar(d.on.clone(), 100.0 * d.explained, mark, note);
        }
        page.bars(bars);
    }
    for d in block.failure.dependences.iter().filter(|d| d.is_real()).take(SHOWN) {
        let (at, mean): (Vec<f64>, Vec<f64>) = d.curve.iter().copied().unzip();
        page.plot(
            Plot::new(format!("Mean {what} over {}", d.on), channel_axis(&d.on), Axis::new(what, unit))
                .height(180)
                .series(Series::line("mean in each bin", &at, &mean).tone(Tone::Residual)),
        );
    }
    if !block.failure.correlations.is_empty() {
        let mut table = Table::new(["channel", "correlation", "by luck", "error comes later by [s]", ""])
            .caption("Cross-correlation. In closed loop only an error that comes later is evidence.");
        for c in block.failure.correlations.iter().take(2 * SHOWN) {
            let words = match c.direction {
                Direction::ErrorFollows => "error follows",
                Direction::ErrorLeads => "error leads: feedback looks like this",
            };
            let mark = if c.peak.abs() > c.bound && c.direction == Direction::ErrorFollows {
                Mark::Warning
            } else {
                Mark::Plain
            };
            table = table.marked_row(
                mark,
                [c.with.clone(), number(c.peak, 2), number(c.bound, 2), number(c.lag_s, 2), words.to_owned()],
            );
        }
        page.table(table);
    }
}

fn torque_section(page: &mut Page, comparisons: &[Comparison], log: &Dataset) {
    if comparisons.iter().all(|comparison| comparison.unknown_torque.is_none()) {
        return;
    }
    page.heading("The unknown torque").paragraph(
        "The disturbance state of the embedded model, estimated forwards and backwards over the log: what torque \
         would make the model right. The band is one standard error to both sides.",
    );
    let gap = 2.5 * log.median_interval();
    for comparison in comparisons {
        let Some(torque) = &comparison.unknown_torque else { continue };
        if let Some(sentence) = torque_sentence(comparison) {
            page.paragraph(sentence);
        }
        let edge = |side: f64| -> Vec<f64> {
            torque.torque.iter().zip(&torque.standard_error).map(|(t, e)| t + side * e).collect()
        };
        page.plot(
            Plot::new(
                format!("Torque that `{}` does not know", comparison.model),
                Axis::new("time", "s"),
                Axis::new("torque", "N m"),
            )
            .group(format!("body {}", log.source_name()))
            .series(Series::band("standard error", &torque.time, &edge(-1.0), &edge(1.0)))
            .series(
                Series::line("unknown torque", &torque.time, &torque.torque)
                    .tone(Tone::Residual)
                    .break_over(gap),
            ),
        );
    }
}
