//! The rotor as identified.

use serde::Serialize;

use crate::log::segments::held_throughout;
use crate::model::{Equations, Model, RotorInput, RotorStart, RotorTrace, polynomial};

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
    pub(crate) fn equations(&self) -> Equations {
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
    pub(crate) fn run_from(
        &self,
        rate: Option<f64>,
        time: &[f64],
        command: &[f64],
        voltage: Option<&[f64]>,
    ) -> RotorTrace {
        let command = held_throughout(command);
        let voltage =
            voltage.filter(|volts| volts.iter().any(|volts| volts.is_finite())).map(held_throughout);
        let input = RotorInput {
            time,
            command: &command,
            command_from: None,
            voltage: voltage.as_deref(),
            side: 1.0,
        };
        let mut trace = RotorTrace::with_squares();
        self.equations().simulate_rotor(&input, &RotorStart { rate, ..RotorStart::default() }, &mut trace);
        trace
    }
}
