//! Columns of a log that blocks are driven by, or answer.

pub(crate) const RATES: [&str; 2] = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s"];
pub(crate) const COMMANDS: [&str; 2] = ["command_1", "command_2"];
pub(crate) const THRUSTS: [&str; 2] = ["thrust_1_n", "thrust_2_n"];
pub(crate) const BODY_RATE: &str = "body_rate_rad_s";
pub(crate) const BODY_ANGLE: &str = "body_angle_rad";
pub(crate) const TORQUE_COMMAND: &str = "torque_command_nm";
pub(crate) const BATTERY: &str = "battery_voltage_v";
