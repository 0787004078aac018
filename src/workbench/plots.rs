//! What a plot shows, for as many pixels as it has.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::ActError;
use super::bands::Band;
use super::curves::{Drawn, RangeStatistics, RowCurve, Slots};
use super::desk::{Desk, OpenLog};
use super::shown::ShownComparison;
use super::thresholds::THRESHOLDS;
use crate::log::signals::log_signal;

/// The name of a plot of the torque that a model lacks.
pub(super) const UNKNOWN_TORQUE: &str = "unknown_torque";

/// What a page asks for.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlotQuery {
    /// Number of the log.
    log: u64,
    /// [s] from where; the log's beginning.
    from: Option<f64>,
    /// [s] to where; its end.
    to: Option<f64>,
    /// [pixel] of width.
    pixels: usize,
    /// A block of the model, with its signal; or `unknown_torque`.
    block: Option<String>,
    signal: Option<String>,
    /// A channel of the log, by its name, instead of a block.
    channel: Option<String>,
}

/// What is drawn.
#[derive(Debug, Serialize)]
pub(super) struct PlotAnswer {
    /// [s] of each slot.
    x: Vec<f64>,
    curves: Vec<Curve>,
    bands: Vec<Band>,
    /// [s] begin and end of the log.
    ends: (f64, f64),
}

#[derive(Debug, Serialize)]
struct Curve {
    /// `measured`, `modelled`, `error`, `torque`, `lower`, `upper`, `channel`.
    kind: &'static str,
    /// Number of the model; none of what was measured.
    model: Option<u64>,
    /// Name of the channel.
    name: String,
    unit: &'static str,
    #[serde(flatten)]
    drawn: Drawn,
    /// Of what is seen, every sample.
    range: RangeStatistics,
}

impl Curve {
    fn of(
        kind: &'static str,
        model: Option<u64>,
        (name, unit): (&str, &'static str),
        slots: &Slots,
        line: &RowCurve,
    ) -> Self {
        Self { kind, model, name: name.to_owned(), unit, drawn: slots.draw(line), range: slots.range(line) }
    }
}

/// What an answer is made of: taken from the desk under its lock, drawn without it.
pub(super) struct PlotTask {
    query: PlotQuery,
    content: Arc<OpenLog>,
    compared: Option<(Vec<u64>, Arc<Vec<ShownComparison>>)>,
}

impl PlotTask {
    /// What the desk has of it.
    pub fn of(desk: &Desk, query: PlotQuery) -> Result<Self, ActError> {
        let log = desk.log(query.log)?;
        let compared = log.compared.as_ref();
        // The curves of a block are of the rows that were compared, of which there may be more by now.
        let of_block = compared.filter(|_| query.block.is_some()).map(|it| &it.content);
        let content = Arc::clone(of_block.map_or_else(|| log.open(), Ok)?);
        let compared = compared.and_then(|it| Some((it.models.clone(), Arc::clone(it.found.as_ref().ok()?))));
        Ok(Self { query, content, compared })
    }

    /// Draws it.
    pub fn draw(&self) -> PlotAnswer {
        let log = self.content.log.raw();
        let time = log.time();
        let ends = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
        let finite = |asked: Option<f64>, else_: f64| asked.filter(|it| it.is_finite()).unwrap_or(else_);
        let (from, to) = (finite(self.query.from, ends.0), finite(self.query.to, ends.1));
        let pixels = self.query.pixels.clamp(1, THRESHOLDS.widest_picture);
        let slots = Slots::new(time, (from, to), pixels, self.content.bands.interval);
        let mut curves = match (&self.query.block, &self.query.channel) {
            (Some(block), _) if block == UNKNOWN_TORQUE => self.torque(&slots),
            (Some(block), _) => self.block(&slots, block),
            (None, Some(channel)) => self.channel(&slots, channel),
            (None, None) => Vec::new(),
        };
        curves.truncate(THRESHOLDS.most_curves);
        let mut marked: Vec<&str> = curves.iter().map(|curve| curve.name.as_str()).collect();
        marked.dedup();
        let bands = self.content.bands.within(log, slots.rows(), &marked, (to - from) / pixels as f64);
        PlotAnswer { x: slots.at, curves, bands, ends }
    }

    fn pairs(&self) -> impl Iterator<Item = (u64, &ShownComparison)> {
        let pairs = self.compared.as_ref().map(|(models, found)| models.iter().copied().zip(found.iter()));
        pairs.into_iter().flatten()
    }

    /// Measured once, then modelled and error of each model.
    fn block(&self, slots: &Slots, name: &str) -> Vec<Curve> {
        let signal = self.query.signal.as_deref().unwrap_or_default();
        let mut curves: Vec<Curve> = Vec::new();
        for (model, shown) in self.pairs() {
            let Some((block, lines)) = shown.lines(name, signal) else { continue };
            for (kind, line) in lines {
                let is_measured = kind == "measured";
                if is_measured && !curves.is_empty() {
                    continue;
                }
                let model = (!is_measured).then_some(model);
                curves.push(Curve::of(kind, model, (&block.signal, block.unit), slots, &line));
            }
        }
        curves
    }

    /// The torque that each model lacks, and its standard error to both sides.
    fn torque(&self, slots: &Slots) -> Vec<Curve> {
        let each = self.pairs().flat_map(|(model, shown)| {
            shown
                .torque_lines()
                .map(move |(kind, line)| Curve::of(kind, Some(model), (UNKNOWN_TORQUE, "N m"), slots, &line))
        });
        each.collect()
    }

    /// A channel as it was logged.
    fn channel(&self, slots: &Slots, name: &str) -> Vec<Curve> {
        let known = self.content.channels.iter().find(|it| it.name == name);
        let there = known.and_then(|known| Some((known, self.content.log.raw().column(name)?)));
        let curves = there.into_iter().map(|(channel, values)| {
            let unit = log_signal(&channel.name).map_or("", |known| known.unit);
            Curve::of("channel", None, (&channel.name, unit), slots, &channel.line(values))
        });
        curves.collect()
    }
}

/// Where the error of a block lives: over frequency, and over what it depends on.
pub(super) fn failure(desk: &Desk, log: u64, block: &str, signal: &str) -> Result<Value, ActError> {
    let log = desk.log(log)?;
    let compared = log.compared.as_ref();
    let found = compared.and_then(|it| Some((&it.models, it.found.as_ref().ok()?)));
    let (models, found) = found.ok_or(ActError::Nothing("compare"))?;
    let each = models.iter().zip(found.iter()).filter_map(|(model, shown)| {
        let block = shown.comparison.blocks.iter().find(|it| it.name == block && it.signal == signal)?;
        let dependences = block.failure.dependences.iter().filter(|it| it.is_real());
        let dependences = dependences.map(|it| {
            let unit = log_signal(&it.on.column).map_or("", |known| known.unit);
            let unit = format!("{unit}{}", if it.on.is_rate { "/s" } else { "" });
            json!({ "on": it.on.to_string(), "unit": unit, "explained": it.explained, "by_chance": it.surrogate, "curve": it.curve })
        });
        Some(json!({
            "model": model,
            "unit": block.unit,
            "of": if block.name == "body" { "unknown torque" } else { "error" },
            "of_unit": if block.name == "body" { "N m" } else { block.unit },
            "spectrum": block.failure.spectrum.as_ref().map(|it| json!({ "corner_hz": it.corner_hz, "density": it.density })),
            "groups": block.failure.groups,
            "over_time": block.failure.over_time,
            "dependences": dependences.collect::<Vec<_>>(),
        }))
    });
    Ok(json!(each.collect::<Vec<_>>()))
}
