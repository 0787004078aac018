//! Columns of a log that blocks are driven by, or answer.

pub(crate) const RATES: [&str; 2] = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s"];
pub(crate) const COMMANDS: [&str; 2] = ["command_1", "command_2"];
/// Columns of rotor `rotor`, from 0; a log may hold more of them than the two of a bench.
pub(crate) fn rate(rotor: usize) -> String {
    format!("propeller_rate_{}_rad_s", rotor + 1)
}

pub(crate) fn command(rotor: usize) -> String {
    format!("command_{}", rotor + 1)
}

pub(crate) fn thrust(rotor: usize) -> String {
    format!("thrust_{}_n", rotor + 1)
}

pub(crate) const BODY_RATE: &str = "body_rate_rad_s";
pub(crate) const BODY_ANGLE: &str = "body_angle_rad";
pub(crate) const TORQUE_COMMAND: &str = "torque_command_nm";
pub(crate) const BATTERY: &str = "battery_voltage_v";
