//! Where effects act, and what their laws may look at there.

use super::signals::{
    BATTERY_VOLTAGE, BODY_ANGLE, BODY_RATE, COMMAND, PROPELLER_RATE, PROPELLER_RATES, TIME, TORQUE,
};

/// Where an effect acts: the quantity its law adds to. Of a law of one's own: `examples/own_effect.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// [-] the command before the static curve.
    Command,
    /// [rad/s] the steady rate z after the static curve.
    SteadyRate,
    /// [rad/s²] the rotor's acceleration.
    RotorAcceleration,
    /// [rad/s] the measured rotor rate.
    RotorRateSensor,
    /// [N] the thrust of each rotor.
    Thrust,
    /// [N m] the torque on the body.
    Torque,
    /// [rad/s] the measured body rate.
    BodyRateSensor,
}

impl Site {
    /// Whether it acts in the rotors, before thrust; else in the body.
    #[must_use]
    pub fn is_rotor(self) -> bool {
        matches!(self, Self::Command | Self::SteadyRate | Self::RotorAcceleration | Self::RotorRateSensor)
    }

    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::SteadyRate => "steady_rate",
            Self::RotorAcceleration => "rotor_acceleration",
            Self::RotorRateSensor => "rotor_rate_sensor",
            Self::Thrust => "thrust",
            Self::Torque => "torque",
            Self::BodyRateSensor => "body_rate_sensor",
        }
    }

    /// Whether an expression there may have a memory of its own.
    #[must_use]
    pub fn lets_expressions_remember(self) -> bool {
        matches!(self, Self::Command | Self::SteadyRate | Self::Torque)
    }

    /// The signals that an expression there may look at, by name without unit: those that are known wherever the site's law is
    /// worked out, in `diagnose`, in `compare` and in the emulator.
    #[must_use]
    pub fn signals(self) -> &'static [&'static str] {
        match self {
            Self::Command => &[TIME, COMMAND, BATTERY_VOLTAGE, "full_voltage", "hover_rate", "side"],
            Self::SteadyRate | Self::RotorAcceleration | Self::RotorRateSensor => &[
                TIME,
                COMMAND,
                BATTERY_VOLTAGE,
                "full_voltage",
                "steady_rate",
                PROPELLER_RATE,
                "hover_rate",
                "side",
            ],
            Self::Thrust => {
                &["thrust", PROPELLER_RATE, "hover_rate", BODY_ANGLE, BODY_RATE, "full_voltage", "side"]
            }
            Self::Torque => &[
                TIME,
                TORQUE,
                PROPELLER_RATES[0],
                PROPELLER_RATES[1],
                "hover_rate",
                BODY_ANGLE,
                BODY_RATE,
                "full_voltage",
            ],
            Self::BodyRateSensor => &[TIME, BODY_ANGLE, BODY_RATE, "hover_rate", "full_voltage"],
        }
    }
}

/// What a law may look at, at one instant. Rotor laws see one rotor; `side` says which.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// [s] time as the log counts it.
    pub time: f64,
    /// [-] u, the rotor's command as it is after the laws before.
    pub command: f64,
    /// [V] v_b.
    pub battery_voltage: f64,
    /// [V] v_bmax.
    pub full_voltage: f64,
    /// [rad/s] z, the steady rate as it is after the laws before.
    pub steady_rate: f64,
    /// [rad/s] ω_p, the rotor's rate.
    pub propeller_rate: f64,
    /// [rad/s] p, the rotor's pole.
    pub pole: f64,
    /// [rad/s] ω_0, the rotor's rate in hover.
    pub hover_rate: f64,
    /// [-] u_0, the command that holds hover at full battery.
    pub hover_command: f64,
    /// +1 for rotor 1, -1 for rotor 2. See the drawing in the crate's page.
    pub side: f64,
    /// [m] d, the lever arm.
    pub arm: f64,
    /// [N s²/rad²] c in f = c ω_p².
    pub thrust_coefficient: f64,
    /// [N] the rotor's thrust as it is after the laws before.
    pub thrust: f64,
    /// [rad/s] rate of rotor 1.
    pub propeller_rate_1: f64,
    /// [rad/s] rate of rotor 2.
    pub propeller_rate_2: f64,
    /// [N m] torque of the actuators on the body, as it is after the laws before.
    pub torque: f64,
    /// [rad] θ.
    pub body_angle: f64,
    /// [rad/s] ω_b.
    pub body_rate: f64,
    /// What an expression with a memory remembers, in the unit of what it follows; `None`: it is at rest.
    pub memory: Option<f64>,
}
