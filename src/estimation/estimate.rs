//! Values with their standard errors.

use serde::Serialize;

/// A value with its standard error, in the unit of the value.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error; infinite = taken as given, not estimated.
    pub standard_error: f64,
}

impl Estimate {
    /// Nothing known.
    pub(crate) fn unknown() -> Self {
        Self { value: f64::NAN, standard_error: f64::NAN }
    }

    /// The estimate of a multiple.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self { value: self.value * factor, standard_error: self.standard_error * factor.abs() }
    }

    /// Distance from `truth` in standard errors.
    #[must_use]
    pub fn distance(&self, truth: f64) -> f64 {
        (self.value - truth).abs() / self.standard_error
    }
}

/// Mean of several estimates of the same quantity.
pub(crate) struct Weighted {
    pub estimate: Estimate,
    /// Standard deviation over the estimates.
    pub spread: f64,
}

impl Weighted {
    /// Weights by the inverse variances. Where the estimates scatter more than their standard errors allow,
    /// the standard error of the mean grows with the scatter (Birge 1932).
    pub fn mean(estimates: &[Estimate]) -> Self {
        let weight = |estimate: &Estimate| estimate.standard_error.powi(-2);
        let total: f64 = estimates.iter().map(weight).sum();
        let value = estimates.iter().map(|estimate| weight(estimate) * estimate.value).sum::<f64>() / total;
        let count = estimates.len() as f64;
        let chi_squared: f64 =
            estimates.iter().map(|estimate| weight(estimate) * (estimate.value - value).powi(2)).sum();
        let scatter = if count > 1.0 { (chi_squared / (count - 1.0)).sqrt() } else { 1.0 };
        let plain = estimates.iter().map(|estimate| estimate.value).sum::<f64>() / count;
        let squares: f64 = estimates.iter().map(|estimate| (estimate.value - plain).powi(2)).sum();
        let spread = if count > 1.0 { (squares / (count - 1.0)).sqrt() } else { 0.0 };
        Self { estimate: Estimate { value, standard_error: scatter.max(1.0) / total.sqrt() }, spread }
    }
}
