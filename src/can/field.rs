//! The roles a DBC signal can play: a field of [`Sensors`], or a part of the command.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::signal::{ROTORS, Sample, Sensors};

/// A field of [`Sensors`] that a signal feeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SensorField {
    /// [rad/s] [`Sensors::body_rate`].
    BodyRate,
    /// [rad] [`Sensors::body_angle`].
    BodyAngle,
    /// [m/s²] [`Sensors::acceleration`], x.
    AccelerationX,
    /// [m/s²] [`Sensors::acceleration`], y.
    AccelerationY,
    /// [m/s²] [`Sensors::acceleration`], z.
    AccelerationZ,
    /// [V] [`Sensors::battery_voltage`].
    BatteryVoltage,
    /// [rad/s] [`Sensors::propeller_rate`] of rotor 1.
    #[serde(rename = "propeller_rate_1")]
    PropellerRate1,
    /// [rad/s] [`Sensors::propeller_rate`] of rotor 2.
    #[serde(rename = "propeller_rate_2")]
    PropellerRate2,
    /// [A] [`Sensors::current`] of rotor 1.
    #[serde(rename = "current_1")]
    Current1,
    /// [A] [`Sensors::current`] of rotor 2.
    #[serde(rename = "current_2")]
    Current2,
    /// [N] [`Sensors::thrust`] of rotor 1.
    #[serde(rename = "thrust_1")]
    Thrust1,
    /// [N] [`Sensors::thrust`] of rotor 2.
    #[serde(rename = "thrust_2")]
    Thrust2,
}

/// A part of the command that a signal carries to the ESCs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandField {
    /// [-] u_1, 0..1.
    #[serde(rename = "rotor_1")]
    Rotor1,
    /// [-] u_2, 0..1.
    #[serde(rename = "rotor_2")]
    Rotor2,
    /// Code of the guard's state; for people who watch the bus.
    State,
}

impl SensorField {
    /// All of them, in the order of the log's columns.
    pub const ALL: [Self; 12] = [
        Self::BatteryVoltage,
        Self::PropellerRate1,
        Self::PropellerRate2,
        Self::Thrust1,
        Self::Thrust2,
        Self::Current1,
        Self::Current2,
        Self::BodyRate,
        Self::BodyAngle,
        Self::AccelerationX,
        Self::AccelerationY,
        Self::AccelerationZ,
    ];

    /// As files spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::BodyRate => "body_rate",
            Self::BodyAngle => "body_angle",
            Self::AccelerationX => "acceleration_x",
            Self::AccelerationY => "acceleration_y",
            Self::AccelerationZ => "acceleration_z",
            Self::BatteryVoltage => "battery_voltage",
            Self::PropellerRate1 => "propeller_rate_1",
            Self::PropellerRate2 => "propeller_rate_2",
            Self::Current1 => "current_1",
            Self::Current2 => "current_2",
            Self::Thrust1 => "thrust_1",
            Self::Thrust2 => "thrust_2",
        }
    }

    /// SI unit of the field, as [`crate::unit::Unit::si`] spells it.
    #[must_use]
    pub fn si(self) -> &'static str {
        match self {
            Self::BodyRate | Self::PropellerRate1 | Self::PropellerRate2 => "rad/s",
            Self::BodyAngle => "rad",
            Self::AccelerationX | Self::AccelerationY | Self::AccelerationZ => "m/s^2",
            Self::BatteryVoltage => "V",
            Self::Current1 | Self::Current2 => "A",
            Self::Thrust1 | Self::Thrust2 => "N",
        }
    }

    /// The bit of this field in [`super::Decoded::updated`].
    #[must_use]
    pub fn bit(self) -> u32 {
        1 << self as u32
    }

    /// The field in `sensors`.
    #[must_use]
    #[inline]
    pub fn of(self, sensors: &Sensors) -> &Sample {
        match self {
            Self::BodyRate => &sensors.body_rate,
            Self::BodyAngle => &sensors.body_angle,
            Self::AccelerationX => &sensors.acceleration[0],
            Self::AccelerationY => &sensors.acceleration[1],
            Self::AccelerationZ => &sensors.acceleration[2],
            Self::BatteryVoltage => &sensors.battery_voltage,
            Self::PropellerRate1 => &sensors.propeller_rate[0],
            Self::PropellerRate2 => &sensors.propeller_rate[1],
            Self::Current1 => &sensors.current[0],
            Self::Current2 => &sensors.current[1],
            Self::Thrust1 => &sensors.thrust[0],
            Self::Thrust2 => &sensors.thrust[1],
        }
    }

    /// The field in `sensors`, to write.
    #[must_use]
    #[inline]
    pub fn of_mut(self, sensors: &mut Sensors) -> &mut Sample {
        match self {
            Self::BodyRate => &mut sensors.body_rate,
            Self::BodyAngle => &mut sensors.body_angle,
            Self::AccelerationX => &mut sensors.acceleration[0],
            Self::AccelerationY => &mut sensors.acceleration[1],
            Self::AccelerationZ => &mut sensors.acceleration[2],
            Self::BatteryVoltage => &mut sensors.battery_voltage,
            Self::PropellerRate1 => &mut sensors.propeller_rate[0],
            Self::PropellerRate2 => &mut sensors.propeller_rate[1],
            Self::Current1 => &mut sensors.current[0],
            Self::Current2 => &mut sensors.current[1],
            Self::Thrust1 => &mut sensors.thrust[0],
            Self::Thrust2 => &mut sensors.thrust[1],
        }
    }
}

impl CommandField {
    /// All of them.
    pub const ALL: [Self; ROTORS + 1] = [Self::Rotor1, Self::Rotor2, Self::State];

    /// As files spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotor1 => "rotor_1",
            Self::Rotor2 => "rotor_2",
            Self::State => "state",
        }
    }

    /// SI unit of the field.
    #[must_use]
    pub fn si(self) -> &'static str {
        "-"
    }
}

impl fmt::Display for SensorField {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl fmt::Display for CommandField {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}
