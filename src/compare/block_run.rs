//! A block that was run: measured and modelled signal, and how noise reaches them.

use std::ops::Range;

use super::run::Run;

/// A block that was run, before it is scored.
pub(crate) struct BlockRun {
    pub name: &'static str,
    pub signal: String,
    pub unit: &'static str,
    pub driven_by: Vec<String>,
    pub run: Run,
    /// Whether what a perfect model leaves changes from sample to sample by the sensor's noise alone, or by hardly more: the
    /// noisy start of a window moves all of it smoothly.
    pub shows_noise: bool,
    pub rows: Vec<usize>,
    /// What is scored; not-a-number elsewhere.
    pub measured: Vec<f64>,
    /// What was measured, scored or not.
    pub shown: Vec<f64>,
    pub modelled: Vec<f64>,
    /// Parts without a hole.
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
        name: &'static str,
        signal: &str,
        unit: &'static str,
        driven_by: &[&str],
        floor: NoisePath,
    ) -> Self {
        Self {
            name,
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
            measured: Vec::new(),
            shown: Vec::new(),
            modelled: Vec::new(),
            pieces: Vec::new(),
            one_step: None,
            floor,
        }
    }

    /// Adds a part without a hole: rows of the log, and both signals there.
    pub(crate) fn add(&mut self, rows: Range<usize>, measured: &[f64], modelled: &[f64]) {
        self.add_scored(rows, measured, measured, modelled);
    }

    /// The same where only a part of what was `measured` is `scored`, and not-a-number elsewhere.
    pub(crate) fn add_scored(
        &mut self,
        rows: Range<usize>,
        measured: &[f64],
        scored: &[f64],
        modelled: &[f64],
    ) {
        let from = self.rows.len();
        self.rows.extend(rows);
        self.shown.extend_from_slice(measured);
        self.measured.extend_from_slice(scored);
        self.modelled.extend_from_slice(modelled);
        self.pieces.push(from..self.rows.len());
    }

    /// Whether each piece is a window, started at a measurement.
    pub(crate) fn is_in_windows(&self) -> bool {
        matches!(self.floor, NoisePath::Window { .. })
    }

    /// Measured minus modelled, where it is scored.
    pub(crate) fn residual(&self) -> Vec<f64> {
        self.measured.iter().zip(&self.modelled).map(|(y, m)| y - m).collect()
    }
}
