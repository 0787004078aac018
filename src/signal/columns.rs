//! Columns of a log by name, so that no other file spells them: of the sensors from their table ([`super::channels`]), and the few
//! that no sensor measures. Rotors are numbered from 1, as in the names.

use super::{Channel, ROTORS, Sensor};

/// [s]
pub const TIME: &str = "time_s";
/// [-] of the two rotors of a bench.
pub const COMMANDS: [&str; ROTORS] = ["command_1", "command_2"];
/// [N m] commanded torque on the body.
pub const TORQUE_COMMAND: &str = "torque_command_nm";
/// [V]
pub const BATTERY_VOLTAGE: &str = Channel::BatteryVoltage.column();
/// [rad/s]
pub const BODY_RATE: &str = Channel::BodyRate.column();
/// [rad]
pub const BODY_ANGLE: &str = Channel::BodyAngle.column();
/// [rad/s] of the two rotors of a bench.
pub const PROPELLER_RATES: [&str; ROTORS] =
    [Channel::PropellerRate1.column(), Channel::PropellerRate2.column()];

/// Stands for the number of any rotor, where what is said holds for each.
pub const ANY_ROTOR: char = '*';
/// [-] the command of any rotor.
pub const ANY_COMMAND: &str = "command_*";
/// [rad/s] the rate of any rotor.
pub const ANY_PROPELLER_RATE: &str = Sensor::PropellerRate.column_of_any_rotor();

/// The column that `of_any` is on rotor `number`.
#[must_use]
pub fn of_number(of_any: &str, number: usize) -> String {
    of_any.replacen(ANY_ROTOR, &number.to_string(), 1)
}

/// The command of rotor `number`.
#[must_use]
pub fn command(number: usize) -> String {
    of_number(ANY_COMMAND, number)
}

/// The rate of rotor `number`.
#[must_use]
pub fn propeller_rate(number: usize) -> String {
    of_number(ANY_PROPELLER_RATE, number)
}

/// The thrust of rotor `number`.
#[must_use]
pub fn thrust(number: usize) -> String {
    of_number(Sensor::Thrust.column_of_any_rotor(), number)
}

/// Whether this is the command of a rotor.
#[must_use]
pub fn is_command(column: &str) -> bool {
    is_of_rotors(column, ANY_COMMAND)
}

/// Whether this is the rate of a rotor.
#[must_use]
pub fn is_propeller_rate(column: &str) -> bool {
    is_of_rotors(column, ANY_PROPELLER_RATE)
}

/// Whether a column begins as `of_any` does.
fn is_of_rotors(column: &str, of_any: &str) -> bool {
    of_any.split(ANY_ROTOR).next().is_some_and(|start| column.starts_with(start))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_rotors_are_those_of_the_table() {
        let thrusts: Vec<String> = (1..=ROTORS).map(thrust).collect();
        assert_eq!(thrusts, Sensor::Thrust.channels().iter().map(|it| it.column()).collect::<Vec<_>>());
        let rates: Vec<String> = (1..=ROTORS).map(propeller_rate).collect();
        assert_eq!(rates, PROPELLER_RATES);
        assert_eq!((1..=ROTORS).map(command).collect::<Vec<_>>(), COMMANDS);
        assert!(is_command("command_12") && !is_command(TORQUE_COMMAND));
        assert!(is_propeller_rate("propeller_rate_7_rad_s") && !is_propeller_rate("propeller_rates"));
    }
}
