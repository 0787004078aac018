//! The page of `compare`: where a model fails, with every signal. Its words are in `story`.

mod story;

use super::{Axis, Bars, Mark, Page, Plot, Series, TextTable, Tone, number};
use crate::compare::{Comparison, Direction, Regressor, ScoredBlock};
use crate::estimation::quantile::median_step;
use crate::log::Dataset;
use crate::log::signals::LOG_SIGNALS;
use crate::report::thresholds::THRESHOLDS;
use crate::screening::ScreenedLog;
use story::{about, block_table, blocks_of, change, keys, notes, once, percent, sentences, torque_sentence};

pub use story::{run, text};

/// Dependences shown of a block.
const SHOWN: usize = 5;

/// The axis of a column of the log, or of its rate, with its unit.
fn channel_axis(on: &Regressor) -> Axis {
    let unit = LOG_SIGNALS.iter().find(|known| known.name == on.column).map_or("", |known| known.unit);
    let unit = match (unit, on.is_rate) {
        ("" | "-", true) => "1/s".to_owned(),
        ("rad/s", true) => "rad/s²".to_owned(),
        (unit, true) => format!("{unit}/s"),
        (unit, false) => unit.to_owned(),
    };
    Axis::new(&on.to_string(), &unit)
}

/// The page, with every signal.
#[must_use]
pub fn page(found: &[Vec<Comparison>], logs: &[ScreenedLog]) -> Page {
    let mut page = Page::new("Where the model fails");
    write(&mut page, found, logs);
    page
}

/// Adds the signals of every log to a page.
pub(super) fn write(page: &mut Page, found: &[Vec<Comparison>], logs: &[ScreenedLog]) {
    for (comparisons, screened) in found.iter().zip(logs) {
        let log = screened.dataset();
        page.heading(log.source_name()).paragraph(about(screened));
        page.list(notes(comparisons, screened).into_iter().map(|note| format!("Note: {note}")));
        if let Some(change) = change(comparisons) {
            page.verdict(Mark::Plain, change + ".");
        }
        let verdict = |comparison: &Comparison| {
            if comparison.is_adequate() {
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
            }
        };
        for (models, (mark, sentence)) in once(comparisons.iter().map(|it| (it.model.as_str(), verdict(it))))
        {
            page.verdict(mark, format!("{models}: {sentence}"));
        }
        page.table(block_table(comparisons).caption(
            "Each block alone, driven by measured inputs where there are any. `fit` is MATLAB's `compare` figure. \
             The floor is what the noise of the sensors would leave of a perfect model.",
        ));
        let fails =
            |key: &(&str, &str)| blocks_of(comparisons, *key).any(|(_, block)| !block.error.is_noise());
        let (failing, adequate): (Vec<_>, Vec<_>) = keys(comparisons).into_iter().partition(fails);
        for key in failing {
            page.heading(format!("{}: {}", key.0, key.1));
            block_section(page, comparisons, key, log);
        }
        torque_section(page, comparisons, log);
        if !adequate.is_empty() {
            page.heading("At the noise floor");
        }
        for key in adequate {
            page.details(format!("{}: {}", key.0, key.1), |page| block_section(page, comparisons, key, log));
        }
    }
}

/// A line through the samples that were measured, which a sensor slower than the log has in some rows only; it breaks where
/// they are farther apart than `gap` [s] and than usual.
fn whole_line(name: &str, time: &[f64], values: &[f64], gap: f64) -> Series {
    let known = time.iter().zip(values).filter(|(_, value)| value.is_finite());
    let (time, values): (Vec<f64>, Vec<f64>) = known.map(|(time, value)| (*time, *value)).unzip();
    let usual = median_step(time.iter().copied()).unwrap_or(0.0);
    Series::line(name, &time, &values).break_over(gap.max(THRESHOLDS.drawn_gap * usual))
}

fn block_section(page: &mut Page, comparisons: &[Comparison], key: (&str, &str), log: &Dataset) {
    let blocks: Vec<(&Comparison, &ScoredBlock)> = blocks_of(comparisons, key).collect();
    let Some((_, first)) = blocks.first() else { return };
    page.paragraph(format!(
        "Driven by {}; {}.",
        first.driven_by.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "),
        run(first.run)
    ));
    // Curves break where the log has a hole.
    let gap = THRESHOLDS.drawn_gap * log.median_interval();
    let group = format!("{} {}", key.0, log.source_name());
    let axis = |name: &str| Axis::new(name, first.unit);
    let seconds = || Axis::new("time", "s");
    let mut signals = Plot::new("Measured and modelled", seconds(), axis(key.1)).group(&group).series(
        whole_line("measured", &first.trace.time(), &first.trace.measured(), gap).tone(Tone::Measured),
    );
    let mut residuals =
        Plot::new("Measured minus modelled", seconds(), axis("error")).group(&group).height(180);
    let mut rms = Plot::new("Error over time (rms)", seconds(), axis("error")).group(&group).height(140);
    for (comparison, block) in &blocks {
        let trace = &block.trace;
        let residual = trace.residual();
        let single = blocks.len() == 1;
        let time = trace.time();
        let line = |name: &str, values: &[f64]| whole_line(name, &time, values, gap);
        let modelled = line(&comparison.model, trace.modelled());
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
    let said =
        blocks.iter().map(|(comparison, block)| (comparison.model.as_str(), sentences(comparison, block)));
    for (models, lines) in once(said) {
        page.list(lines.into_iter().map(|line| format!("**{models}** {line}")));
    }
    details_of_each(page, &blocks);
}

/// Models that fail in the same way are shown once.
fn details_of_each(page: &mut Page, blocks: &[(&Comparison, &ScoredBlock)]) {
    page.details("Where it fails in detail", |page| {
        for (at, (comparison, block)) in blocks.iter().enumerate() {
            let is_same =
                |other: &ScoredBlock| other.failure == block.failure && other.error.rms == block.error.rms;
            if !blocks[..at].iter().any(|(_, other)| is_same(other)) {
                details(page, &comparison.model, block);
            }
        }
    });
}

fn details(page: &mut Page, model: &str, block: &ScoredBlock) {
    page.subheading(format!("{} of `{model}`", block.name));
    let mut groups = TextTable::new(["modelled signal", "samples", "rms", "mean", "share of squared error"])
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
                .series(Series::line(model, &at, &density).tone(Tone::Residual))
                .span("corner", spectrum.corner_hz, spectrum.corner_hz),
        );
    }
    dependences(page, block);
    correlations(page, block);
}

/// What a block's error is a function of.
fn dependences(page: &mut Page, block: &ScoredBlock) {
    let of_torque = block.name == "body";
    let (what, unit) = if of_torque { ("unknown torque", "N m") } else { ("error", block.unit) };
    if !block.failure.dependences.is_empty() {
        let mut bars = Bars::new(format!("Share of the {what} that is a function of"), "%");
        for d in block.failure.dependences.iter().take(2 * SHOWN) {
            let mark = if d.is_real() { Mark::Warning } else { Mark::Plain };
            let note = format!("by chance {}", percent(d.surrogate));
            bars = bars.noted_bar(d.on.to_string(), 100.0 * d.explained, mark, note);
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
}

/// What a block's error moves with.
fn correlations(page: &mut Page, block: &ScoredBlock) {
    if !block.failure.correlations.is_empty() {
        let mut table =
            TextTable::new(["channel", "correlation", "by chance", "error comes later by [s]", ""])
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
    let gap = THRESHOLDS.drawn_gap * log.median_interval();
    for comparison in comparisons {
        let Some(torque) = &comparison.unknown_torque else { continue };
        if let Some(sentence) = torque_sentence(comparison) {
            page.paragraph(sentence);
        }
        let edge = |side: f64| -> Vec<f64> {
            torque.torque.iter().zip(&torque.standard_error).map(|(t, e)| t + side * e).collect()
        };
        let time = torque.rows.values(log.time());
        page.plot(
            Plot::new(
                format!("Torque that `{}` does not know", comparison.model),
                Axis::new("time", "s"),
                Axis::new("torque", "N m"),
            )
            .group(format!("body {}", log.source_name()))
            .series(Series::band("standard error", &time, &edge(-1.0), &edge(1.0)))
            .series(
                Series::line("unknown torque", &time, &torque.torque).tone(Tone::Residual).break_over(gap),
            ),
        );
    }
}
