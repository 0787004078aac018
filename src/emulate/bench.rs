//! What the emulated bench is made of: the numbers of its rotors and of its body.

use serde::{Deserialize, Serialize};

use crate::model::Model;

use super::error::EmulateError;

/// The `[emulator.plant]` table: what the emulated bench is made of. Defaults are [LPC16] Tables I and IV.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantConfig {
    /// [kg m²] J.
    pub inertia: f64,
    /// [m] d, lever arm of each rotor.
    pub arm: f64,
    /// [rad/s] p.
    pub pole: f64,
    /// [N s²/rad²] c of f = c ω².
    ///
    /// **Deviation:** [LPC16] Table IV gives only the tangent c_p1 ω + c_p0 of its Fig. 4; this is the parabola
    /// through the origin that has this tangent: c = c_p1² / (4 |c_p0|).
    pub thrust_coefficient: f64,
    /// [rad/s] g(u): coefficients by ascending power of the command. [LPC16] Eq. (7).
    pub steady_rate: Vec<f64>,
    /// [rad/(s V)] k_V.
    pub voltage_gain: f64,
    /// [V] v_bmax.
    pub full_voltage: f64,
    /// [rad/s] ω_0, rotor rate at hover.
    pub hover_rate: f64,
    /// [rad] of the mechanical stops on both sides; 0 = none.
    pub angle_stop: f64,
    /// Whether the body is held still, as for experiments on the actuators alone.
    pub clamped: bool,
}

impl Default for PlantConfig {
    fn default() -> Self {
        let (slope, offset) = (0.0197, 6.0771); // c_p1, |c_p0|
        Self {
            inertia: 0.032,
            arm: 0.25,
            pole: 16.0,
            thrust_coefficient: slope * slope / (4.0 * offset),
            steady_rate: vec![0.0, 1124.5, 447.1],
            voltage_gain: 40.0,
            full_voltage: 12.6,
            hover_rate: 2.0 * offset / slope,
            angle_stop: 1.2,
            clamped: false,
        }
    }
}

impl PlantConfig {
    /// The parameters of a model file: its numbers, none of its code.
    #[must_use]
    pub fn from_model(model: &Model) -> Self {
        let (actuator, body) = (&model.actuator, &model.body);
        Self {
            inertia: body.inertia,
            arm: body.arm,
            pole: actuator.pole,
            thrust_coefficient: actuator.thrust_coefficient,
            steady_rate: actuator.steady_rate.clone(),
            voltage_gain: actuator.voltage_gain,
            full_voltage: actuator.full_voltage,
            hover_rate: actuator.hover_rate,
            ..Self::default()
        }
    }

    /// [rad/s] g(u).
    pub(super) fn steady_rate(&self, u: f64) -> f64 {
        let mut power = 1.0;
        let mut rate = 0.0;
        for coefficient in &self.steady_rate {
            rate += coefficient * power;
            power *= u;
        }
        rate
    }

    /// [-] u_0: command that holds the hover rate at full battery, from g(u_0) = ω_0; 1 when none does.
    #[must_use]
    pub fn hover_command(&self) -> f64 {
        // Regula falsi would be faster, but halving cannot fail on any rising curve.
        let (mut low, mut high) = (0.0, 1.0);
        while high - low > 1e-12 {
            let middle = f64::midpoint(low, high);
            if self.steady_rate(middle) < self.hover_rate {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    pub(super) fn check(&self) -> Result<(), EmulateError> {
        let positive = [
            ("inertia", self.inertia),
            ("arm", self.arm),
            ("pole", self.pole),
            ("thrust_coefficient", self.thrust_coefficient),
            ("full_voltage", self.full_voltage),
            ("hover_rate", self.hover_rate),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(EmulateError::NotPositive { name, value });
            }
        }
        let finite = [("voltage_gain", self.voltage_gain), ("angle_stop", self.angle_stop)];
        for (name, value) in finite {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(EmulateError::Negative { name, value });
            }
        }
        if !self.steady_rate.iter().all(|coefficient| coefficient.is_finite()) || self.steady_rate.len() > 8 {
            return Err(EmulateError::Curve);
        }
        Ok(())
    }
}
