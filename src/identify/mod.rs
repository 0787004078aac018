//! Section III of [LPC16] as a pipeline, and joint estimation.
//!
//! [`identify`] takes logs of any kind, finds what each of them permits (and whether each rotor's rates can be those of its
//! commands, `command_response`), and goes the paper's way as far as they reach:
//!
//! 1. k_V from stretches of constant command, [LPC16] Eq. (6) (`voltage_gain`);
//! 2. g(u) from slow ramps, Eq. (9), its degree by cross-validation, and whether the ramps were slow enough for
//!    Eq. (4) (`static_curve`, `ramp_lag`);
//! 3. p from exciting commands, section III.B, by output error (`pole`), against a delay and a second pole (`lag_order`),
//!    with the delay in the model where the data determine it (`dead_time`);
//! 4. the thrust curve where thrust was measured, Eq. (13) (`thrust_curve`), the body from attitude logs, Eq. (1)
//!    (`inertia`);
//! 5. validation on other logs as in Fig. 3 (`validate`).
//!
//! Where ramps or constant commands are missing, pole, curve and battery gain come from one joint estimation (`joint_fit`).
//! Standard errors allow for correlated residuals. What is found on the way is a [`Finding`] with a code and numbers.

mod assemble;
mod command_response;
mod command_timing;
mod consistency;
mod dead_time;
mod inertia;
mod inputs;
#[cfg(test)]
mod interval_coverage;
mod joint_fit;
mod lag_order;
mod mistaken_columns;
mod omitted_torque;
pub(crate) mod pipeline;
mod quantized_voltage;
mod ramp_lag;
mod regressors;
mod result;
mod rotor_mismatch;
mod significance;
mod single_rotor_fit;
mod static_curve;
mod steady_rows;
mod steps;
pub mod thresholds;
mod thrust_curve;
mod unidentified;
mod validate;
mod voltage_gain;
mod voltage_instruments;

use serde::Serialize;

use crate::log::segments::held_throughout;
use crate::model::{Equations, Model, RotorInput, RotorStart, RotorTrace, polynomial};
use crate::screening::{Finding, ScreeningError};

pub use dead_time::Delay;
pub use inertia::Body;
pub use joint_fit::JointFit;
pub use lag_order::LagAlternative;
pub use mistaken_columns::check_columns;
pub use pipeline::{STEPS, identify, identify_with_progress};
pub use result::{Identification, IdentifySettings, Part, PoleFit, RotorModel};
pub use static_curve::{DegreeScore, RampCheck, StaticCurve};
pub use steady_rows::HIGHEST_DEGREE;
pub use thrust_curve::ThrustCurve;
pub use validate::Validation;
pub use voltage_gain::{BatteryGain, LevelGain};

/// Why nothing could be identified.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// No log was given.
    #[error("no log to identify from")]
    NoLog,
    /// The logs permit none of the steps.
    #[error("nothing can be identified")]
    Nothing {
        /// What is wrong with the logs: first why those that have no part have none.
        reasons: Vec<Finding>,
        /// What each step lacks; none where there is no rotor.
        steps: Vec<Part>,
    },
    /// A log that cannot be used.
    #[error(transparent)]
    Screening(#[from] ScreeningError),
    /// A setting outside its range.
    #[error("the degree of g(u) must lie in 1..{HIGHEST_DEGREE}, not {0}")]
    Degree(usize),
}

impl IdentifyError {
    /// The same as a finding, for who goes on without.
    #[must_use]
    pub fn into_finding(self) -> Finding {
        match self {
            Self::Screening(ScreeningError::Column(finding)) => *finding,
            other => Finding::new("columns_not_checked", "").with("error", other.to_string()),
        }
    }
}

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
    fn unknown() -> Self {
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
struct Weighted {
    estimate: Estimate,
    /// Standard deviation over the estimates.
    spread: f64,
}

impl Weighted {
    /// Weights by the inverse variances. Where the estimates scatter more than their standard errors allow,
    /// the standard error of the mean grows with the scatter (Birge 1932).
    fn mean(estimates: &[Estimate]) -> Self {
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

/// The rotor as identified: what the model file gets.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IdentifiedActuator {
    /// [rad/s] `c_gj` of u^j, from j = 1: linear, quadratic, ...
    pub coefficients: Vec<f64>,
    /// [rad/(s V)]
    pub voltage_gain: f64,
    /// [V]
    pub full_voltage: f64,
    /// [rad/s]
    pub pole: f64,
    /// [s] transport delay of the command; zero: none.
    pub delay: f64,
    /// [N s²/rad²]
    pub thrust_coefficient: f64,
}

impl IdentifiedActuator {
    /// [rad/s] z = g(u) - k_V (v_bmax - v_b). [LPC16] Eq. (2).
    ///
    /// **Deviation:** the print has `+ k_V`, which contradicts its Eq. (6).
    #[must_use]
    pub fn steady_rate(&self, command: f64, voltage: Option<f64>) -> f64 {
        let drop =
            voltage.filter(|voltage| voltage.is_finite()).map_or(0.0, |voltage| self.full_voltage - voltage);
        command * polynomial(&self.coefficients, command) - self.voltage_gain * drop
    }

    /// The rotor as the model runs it.
    fn equations(&self) -> Equations {
        let mut model = Model::paper();
        model.actuator.steady_rate = std::iter::once(0.0).chain(self.coefficients.iter().copied()).collect();
        model.actuator.voltage_gain = self.voltage_gain;
        model.actuator.full_voltage = self.full_voltage;
        model.actuator.pole = self.pole;
        model.bare_equations().with_command_delay(self.delay)
    }

    /// [rad/s] free run over `time` with commands and voltages held between samples, from the steady rate of the
    /// first command. Missing cells hold the value before.
    #[must_use]
    pub fn simulate(&self, time: &[f64], command: &[f64], voltage: Option<&[f64]>) -> Vec<f64> {
        self.run_from(None, time, command, voltage).rate
    }

    /// The same from a given rate, or from the first steady one, with what happens between the samples.
    fn run_from(
        &self,
        rate: Option<f64>,
        time: &[f64],
        command: &[f64],
        voltage: Option<&[f64]>,
    ) -> RotorTrace {
        let command = held_throughout(command);
        let voltage =
            voltage.filter(|volts| volts.iter().any(|volts| volts.is_finite())).map(held_throughout);
        let input = RotorInput { time, command: &command, voltage: voltage.as_deref(), side: 1.0 };
        let mut trace = RotorTrace::with_squares();
        self.equations().simulate_rotor(&input, &RotorStart { rate, ..RotorStart::default() }, &mut trace);
        trace
    }
}
