//! What output-error fitting fits, and what it finds.

use std::ops::Range;
use std::sync::Arc;

use super::measured_rows::{MeasuredRows, Residuals};

/// What can be fitted.
pub trait OutputError: Sync {
    /// Where each unit's residuals stand in the residual vector.
    fn units(&self) -> &[Range<usize>];
    /// Number of local parameters of each unit.
    fn locals(&self) -> usize;
    /// Length of the residual vector.
    fn len(&self) -> usize;
    /// Whether there is no residual.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The rows in which something was measured, the same for all parts of the same data; `None` = all are kept.
    fn measured(&self) -> Option<&Arc<MeasuredRows>> {
        None
    }
    /// How residuals are made of a few units at a time; `None` where units are few and long.
    fn by_units(&self, _globals: &[f64]) -> Option<Box<dyn UnitResiduals + '_>> {
        None
    }
    /// Writes measured minus simulated over its standard deviation; zero where nothing was measured.
    /// `locals` holds those of unit 0, then of unit 1, ...
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]);
    /// The size of a change of a local parameter that shows: the step of its derivative.
    fn local_scale(&self, index: usize) -> f64;
    /// Between which a local parameter of a unit may be; all there is, if nothing else is known.
    fn local_bounds(&self, _unit: usize, _index: usize) -> (f64, f64) {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

/// Residuals at certain globals, made of a few units at a time: units do not see each other.
pub trait UnitResiduals: Sync {
    /// Writes the residuals of some units, which follow each other, as [`OutputError::residuals`] does; `locals` and `out` are theirs.
    fn write(&self, units: Range<usize>, locals: &[f64], out: &mut [f64]);
}

/// A global parameter of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Free {
    /// Where the fit starts.
    pub start: f64,
    /// Smallest and largest value.
    pub bounds: (f64, f64),
    /// Its typical size, for the step of the derivative.
    pub scale: f64,
}

/// Relative step of the difference quotients: half the digits of a double, rounded up for kinks in the laws.
const DERIVATIVE_STEP: f64 = 1e-6;
/// The same of locals, of their scale: they enter almost linearly.
pub(super) const LOCAL_STEP: f64 = 1e-3;

impl Free {
    /// Whether it may move at all.
    pub(super) fn is_free(&self) -> bool {
        self.bounds.0 < self.bounds.1
    }

    /// The step of its difference quotient at a value.
    pub(super) fn derivative_step(&self, value: f64) -> f64 {
        let size = (DERIVATIVE_STEP * value.abs().max(self.scale)).max(f64::MIN_POSITIVE);
        if value + size > self.bounds.1 { -size } else { size }
    }

    /// The value, or the bound that it is beyond; bounds that are not numbers, as absurd data give them, bound nothing.
    pub(super) fn within(&self, value: f64) -> f64 {
        value.max(self.bounds.0).min(self.bounds.1)
    }
}

/// When a fit stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitConfig {
    /// Most accepted or refused steps.
    pub iterations: usize,
    /// It has converged when a step lowers the cost by less than this share.
    pub tolerance: f64,
    /// A fit that stays above this cost is for nothing, and is given up when it hardly falls any more.
    pub goal: Option<f64>,
    /// Whether a step that went as predicted may be followed by another one without derivatives of its own.
    pub reuses_slopes: bool,
    /// Whether units that leave much at the end are fitted by themselves, and the fit goes on from there.
    pub rescues_units: bool,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self { iterations: 40, tolerance: 1e-7, goal: None, reuses_slopes: false, rescues_units: true }
    }
}

/// What a fit found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Global parameters.
    pub globals: Vec<f64>,
    /// Local parameters, unit by unit.
    pub locals: Vec<f64>,
    /// Standard error of each global parameter; infinite where the data do not determine it.
    pub standard_errors: Vec<f64>,
    /// Sum of squares of the residuals.
    pub cost: f64,
    /// Residuals at the solution.
    pub residuals: Residuals,
    /// Steps taken.
    pub iterations: usize,
}
