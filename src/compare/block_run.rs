//! A block that was run: measured and modelled signal, and how noise reaches them.

use std::ops::Range;

use super::run::Run;
use crate::log::Dataset;

/// A block that was run, before it is scored.
pub(crate) struct BlockRun {
    pub name: String,
    pub signal: String,
    pub unit: &'static str,
    pub driven_by: Vec<String>,
    pub run: Run,
    /// Whether what a perfect model leaves changes from sample to sample by the sensor's noise alone, or by hardly more: the
    /// noisy start of a window moves all of it smoothly.
    pub shows_noise: bool,
    /// Rows of the log, those of pieces that follow each other as one.
    pub rows: Vec<Range<usize>>,
    /// What is scored where it is not the log's own column; not-a-number elsewhere.
    pub scored: Option<Vec<f64>>,
    pub modelled: Vec<f64>,
    /// Parts without a hole: samples of the block, in order.
    pub pieces: Vec<Range<usize>>,
    pub one_step: Option<f64>,
    pub floor: NoisePath,
}

/// How the sensors' noise reaches the error of a block.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoisePath {
    /// Through the sensor of the signal alone.
    Sensor,
    /// Through thrust sensor and rotor rate, whose slope [N s/rad] is given.
    Thrust(f64),
    /// Through the start of each window and, where they drive the body, the rotors' rates.
    Window { rotors: bool, angle: bool },
    /// Through a slope over so many samples to both sides.
    Slope(usize),
}

impl BlockRun {
    /// An empty run of a block.
    pub(crate) fn new(
        name: &str,
        signal: &str,
        unit: &'static str,
        driven_by: &[&str],
        floor: NoisePath,
    ) -> Self {
        Self {
            name: name.to_owned(),
            signal: signal.to_owned(),
            unit,
            driven_by: driven_by.iter().map(|name| (*name).to_owned()).collect(),
            run: match floor {
                NoisePath::Sensor => Run::Free,
                NoisePath::Thrust(_) => Run::EachSample,
                _ => Run::Smoothed,
            },
            shows_noise: matches!(floor, NoisePath::Sensor | NoisePath::Window { .. }),
            rows: Vec::new(),
            scored: None,
            modelled: Vec::new(),
            pieces: Vec::new(),
            one_step: None,
            floor,
        }
    }

    /// Adds a part without a hole: rows of the log, and the modelled signal there.
    pub(crate) fn add(&mut self, rows: Range<usize>, modelled: &[f64]) {
        let from = self.modelled.len();
        match self.rows.last_mut() {
            Some(last) if last.end == rows.start => last.end = rows.end,
            _ => self.rows.push(rows),
        }
        self.modelled.extend_from_slice(modelled);
        self.pieces.push(from..self.modelled.len());
    }

    /// The same where what is scored is not the log's own column, or only a part of it.
    pub(crate) fn add_scored(&mut self, rows: Range<usize>, scored: &[f64], modelled: &[f64]) {
        self.scored.get_or_insert_default().extend_from_slice(scored);
        self.add(rows, modelled);
    }

    /// Whether each piece is a window, started at a measurement.
    pub(crate) fn is_in_windows(&self) -> bool {
        matches!(self.floor, NoisePath::Window { .. })
    }

    /// What is scored, sample by sample; not-a-number elsewhere.
    pub(crate) fn scored<'a>(&'a self, log: &'a Dataset) -> impl Iterator<Item = f64> + 'a {
        let own = self.rows.iter().filter(|_| self.scored.is_none());
        self.scored.iter().flatten().copied().chain(own.flat_map(|rows| self.column(log, rows)))
    }

    /// What was measured, scored or not.
    pub(crate) fn shown<'a>(&'a self, log: &'a Dataset) -> impl Iterator<Item = f64> + 'a {
        let is_smoothed = matches!(self.floor, NoisePath::Slope(_));
        let smoothed = self.scored.iter().filter(move |_| is_smoothed).flatten().copied();
        let own = self.rows.iter().filter(move |_| !is_smoothed);
        smoothed.chain(own.flat_map(|rows| self.column(log, rows)))
    }

    fn column<'a>(&self, log: &'a Dataset, rows: &Range<usize>) -> impl Iterator<Item = f64> + use<'a> {
        let column = log.column(&self.signal).unwrap_or_default();
        column.get(rows.clone()).unwrap_or_default().iter().copied()
    }

    /// Whether there is any sample to score.
    pub(crate) fn is_scored(&self, log: &Dataset) -> bool {
        self.scored(log).any(f64::is_finite)
    }

    /// Measured minus modelled, where it is scored.
    pub(crate) fn residual(&self, log: &Dataset) -> Vec<f64> {
        self.scored(log).zip(&self.modelled).map(|(y, m)| y - m).collect()
    }

    /// Row of the log of each sample.
    pub(crate) fn each_row(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().flat_map(Clone::clone)
    }
}
