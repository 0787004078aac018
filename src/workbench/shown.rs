//! What is drawn, with what of it need not be looked at again for every picture.

use std::sync::OnceLock;

use super::chunks::Chunks;
use super::curves::{RowCurve, worst_stretch};
use crate::compare::{Comparison, ScoredBlock, UnknownTorque};
use crate::log::Dataset;
use crate::threads::spread;

/// A channel of a log.
#[derive(Debug)]
pub(super) struct ShownChannel {
    pub name: String,
    /// Taken when it is drawn first.
    chunks: OnceLock<Chunks>,
}

impl ShownChannel {
    /// Those that have a reading.
    pub fn all_of(log: &Dataset) -> Vec<Self> {
        let names = log.names().filter(|name| log.has(name));
        names.map(|name| Self { name: name.to_owned(), chunks: OnceLock::new() }).collect()
    }

    /// Its curve; `values` are those of the log.
    pub fn line<'a>(&'a self, values: &'a [f64]) -> RowCurve<'a> {
        let chunks = self.chunks.get_or_init(|| Chunks::of(values.iter().copied()));
        RowCurve { rows: None, value: Box::new(move |_, row| values[row]), chunks: Some(chunks) }
    }
}

/// A model that was held beside a log.
#[derive(Debug)]
pub(super) struct ShownComparison {
    pub comparison: Comparison,
    /// In the order of its blocks.
    blocks: Vec<ShownBlock>,
    torque: Option<[Chunks; 3]>,
}

#[derive(Debug)]
struct ShownBlock {
    measured: Chunks,
    modelled: Chunks,
    error: Chunks,
    /// [s] where the error is largest.
    worst_s: Option<(f64, f64)>,
}

/// Which side of the unknown torque: one standard error below it, itself, one above.
const SIDES: [(&str, f64); 3] = [("lower", -1.0), ("upper", 1.0), ("torque", 0.0)];

impl ShownComparison {
    pub fn of(comparison: Comparison) -> Self {
        let blocks = spread(&comparison.blocks, ShownBlock::of);
        let torque = comparison.unknown_torque.as_ref().map(|torque| {
            SIDES.map(|(_, side)| Chunks::of((0..torque.rows.len()).map(|at| beside(torque, at, side))))
        });
        Self { comparison, blocks, torque }
    }

    /// Each block, and where its error is largest [s].
    pub fn blocks(&self) -> impl Iterator<Item = (&ScoredBlock, Option<(f64, f64)>)> {
        self.comparison.blocks.iter().zip(self.blocks.iter().map(|it| it.worst_s))
    }

    /// Curves of a block: what was measured, modelled, and the error.
    pub fn lines<'a>(
        &'a self,
        name: &str,
        signal: &str,
    ) -> Option<(&'a ScoredBlock, [(&'static str, RowCurve<'a>); 3])> {
        let at = self.comparison.blocks.iter().position(|it| it.name == name && it.signal == signal)?;
        let (block, shown) = (&self.comparison.blocks[at], self.blocks.get(at)?);
        let trace = &block.trace;
        let line = |value: Box<dyn Fn(usize, usize) -> f64 + 'a>, chunks| RowCurve {
            rows: Some(trace.rows()),
            value,
            chunks: Some(chunks),
        };
        let measured = Box::new(move |sample, row| trace.measured_at(sample, row));
        let modelled = Box::new(move |sample: usize, _: usize| trace.modelled()[sample]);
        // Where it is not scored there is no error, as in the report.
        let error = Box::new(move |sample, row| trace.residual_at(sample, row));
        let lines = [
            ("measured", line(measured, &shown.measured)),
            ("modelled", line(modelled, &shown.modelled)),
            ("error", line(error, &shown.error)),
        ];
        Some((block, lines))
    }

    /// The torque that the model lacks, and its standard error to both sides.
    pub fn torque_lines(&self) -> impl Iterator<Item = (&'static str, RowCurve<'_>)> {
        let torque = self.comparison.unknown_torque.iter().zip(&self.torque);
        torque.flat_map(|(torque, chunks)| {
            SIDES.into_iter().zip(chunks).map(move |((kind, side), chunks)| {
                let value = Box::new(move |sample: usize, _: usize| beside(torque, sample, side));
                (kind, RowCurve { rows: Some(&torque.rows), value, chunks: Some(chunks) })
            })
        })
    }
}

fn beside(torque: &UnknownTorque, sample: usize, side: f64) -> f64 {
    torque.torque[sample] + side * torque.standard_error[sample]
}

impl ShownBlock {
    fn of(block: &ScoredBlock) -> Self {
        let trace = &block.trace;
        let measured = Chunks::of(trace.measured().iter().copied());
        let modelled = Chunks::of(trace.modelled().iter().copied());
        let residual = trace.residual();
        let error = Chunks::of(residual.iter().copied());
        let worst_s = worst_stretch(&trace.time(), |sample| residual[sample]);
        Self { measured, modelled, error, worst_s }
    }
}
