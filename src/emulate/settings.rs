//! Settings of the emulator and their check.

use serde::{Deserialize, Serialize};

use crate::clock;
use crate::guard::GuardConfig;

use super::Emulator;
use super::battery::BatteryConfig;
use super::bench::PlantConfig;
use super::error::EmulateError;
use super::hidden_config::HiddenConfig;
use super::plant::Plant;
use super::rotor_fault::{BuiltFault, RotorFault};
use super::sensor::SensorsConfig;

/// One `[[emulator.impulse]]` table: a rectangular torque from outside.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Impulse {
    /// [s] since the start of the emulator.
    pub at_s: f64,
    /// [s]
    pub duration_s: f64,
    /// [N m]
    pub torque: f64,
}

/// The `[emulator]` table of the bench file.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EmulatorConfig {
    /// Seed of every random number.
    pub seed: u64,
    /// [s] longest integration step.
    pub integration_step_s: f64,
    /// [s] transport delay of commands on their way to the ESCs.
    pub command_delay_s: f64,
    /// [s] after which an emulated ESC stops its rotor when no command comes, as real ones do; `None` = what ESCs on the bench's
    /// bus come with, where that is known, else the guard's built-in `hold_s`, as the guide asks of real ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub esc_timeout_s: Option<f64>,
    /// [rad] body angle at the start.
    pub initial_angle: f64,
    /// Somebody holds the body still until a rotor is first commanded, as one does on a bench with a pendulum.
    pub hold_until_commanded: bool,
    /// [s] after which the script of impulses begins again; 0 = it runs once.
    pub impulse_period_s: f64,
    /// What the bench is made of.
    pub plant: PlantConfig,
    /// Battery.
    pub battery: BatteryConfig,
    /// Sensors.
    pub sensors: SensorsConfig,
    /// Torques from outside.
    pub impulse: Vec<Impulse>,
    /// Effects the bench has and no model mentions.
    pub hidden: Vec<HiddenConfig>,
    /// What breaks on its rotors.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fault: Vec<RotorFault>,
}

impl Default for EmulatorConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            integration_step_s: 0.0005,
            command_delay_s: 0.0,
            esc_timeout_s: None,
            initial_angle: 0.0,
            hold_until_commanded: true,
            impulse_period_s: 0.0,
            plant: PlantConfig::default(),
            battery: BatteryConfig::default(),
            sensors: SensorsConfig::default(),
            impulse: Vec::new(),
            hidden: Vec::new(),
            fault: Vec::new(),
        }
    }
}

/// [s] the timeout that the guide asks of ESCs: the time for which the guard holds a command, as it is built in.
fn asked_esc_timeout_s() -> f64 {
    GuardConfig::default().hold_s
}

impl EmulatorConfig {
    /// With every number that the file leaves open; its ESCs stop after `usual_esc_timeout_s` unless it says otherwise.
    #[must_use]
    pub fn completed(self, usual_esc_timeout_s: Option<f64>) -> Self {
        let esc_timeout_s = self.esc_timeout_s.or(usual_esc_timeout_s);
        Self { esc_timeout_s: Some(esc_timeout_s.unwrap_or_else(asked_esc_timeout_s)), ..self }
    }

    /// Checks the settings and builds the emulated bench.
    ///
    /// # Errors
    /// [`EmulateError`] naming the key that cannot be.
    pub fn build(&self) -> Result<Emulator, EmulateError> {
        let esc_timeout_s = self.esc_timeout_s.unwrap_or_else(asked_esc_timeout_s);
        let spans = [
            ("integration_step_s", self.integration_step_s, 1e-6, 0.005),
            ("command_delay_s", self.command_delay_s, 0.0, 0.5),
            ("esc_timeout_s", esc_timeout_s, 0.001, 3600.0),
            ("initial_angle", self.initial_angle, -3.2, 3.2),
            ("impulse_period_s", self.impulse_period_s, 0.0, 1e6),
        ];
        for (name, value, low, high) in spans {
            if !(low..=high).contains(&value) {
                return Err(EmulateError::Range { name, value, low, high });
            }
        }
        let plant = Plant::build(&self.plant, &self.battery, &self.hidden)?;
        let delay = self.command_delay_s + plant.command_delay();
        Ok(Emulator {
            plant,
            devices: self.sensors.devices()?,
            impulses: self.impulses_ns()?,
            impulse_period_ns: clock::span_ns(self.impulse_period_s),
            step_ns: clock::span_ns(self.integration_step_s).max(1),
            delay_ns: clock::span_ns(delay),
            esc_timeout_ns: clock::span_ns(esc_timeout_s),
            initial_angle: self.initial_angle,
            hold_until_commanded: self.hold_until_commanded,
            seed: self.seed,
            faults: self.faults()?,
        })
    }

    /// In the order in which they come.
    fn faults(&self) -> Result<Vec<BuiltFault>, EmulateError> {
        let mut faults = self.fault.iter().map(RotorFault::build).collect::<Result<Vec<_>, _>>()?;
        faults.sort_by_key(|fault| fault.at_ns);
        Ok(faults)
    }

    fn impulses_ns(&self) -> Result<Vec<(u64, u64, f64)>, EmulateError> {
        let check = |name, value: f64, low: f64, high: f64| {
            let inside = (low..=high).contains(&value);
            if inside { Ok(value) } else { Err(EmulateError::Range { name, value, low, high }) }
        };
        let edges = |impulse: &Impulse| {
            let start = check("impulse.at_s", impulse.at_s, 0.0, 1e6)?;
            let span = check("impulse.duration_s", impulse.duration_s, 1e-4, 1e6)?;
            let torque = check("impulse.torque", impulse.torque, -100.0, 100.0)?;
            Ok((clock::span_ns(start), clock::span_ns(start + span), torque))
        };
        self.impulse.iter().map(edges).collect()
    }
}
