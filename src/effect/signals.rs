//! Signals that laws look at, by the names that expressions use: those of the table of sensors, without unit.

use crate::signal::{Channel, ROTORS, Sensor};

/// [s]
pub const TIME: &str = "time";
/// [-]
pub const COMMAND: &str = "command";
/// [N m]
pub const TORQUE: &str = "torque";
/// [V]
pub const BATTERY_VOLTAGE: &str = Channel::BatteryVoltage.name();
/// [rad/s] of the rotor that a law acts on.
pub const PROPELLER_RATE: &str = Sensor::PropellerRate.name();
/// [rad/s] of each, where a law acts on the body.
pub const PROPELLER_RATES: [&str; ROTORS] = [Channel::PropellerRate1.name(), Channel::PropellerRate2.name()];
/// [rad]
pub const BODY_ANGLE: &str = Channel::BodyAngle.name();
/// [rad/s]
pub const BODY_RATE: &str = Channel::BodyRate.name();
