//! The one table of sensors. What the program knows of a sensor stands in its row; every other place is generated from it:
//! the fields of [`super::Sensors`] and of a recording's message, the roles of a bench file, the columns of a log, the
//! tables `[guard.NAME]` and `[emulator.sensors.NAME]`, the guard's limits, what the emulator sends and the monitor shows.
//!
//! A new sensor is a row at the end, and a line in the emulated plant that says what it senses. The order of the rows is that of
//! the fields in recordings and shared memory, and of the guard's codes and the emulator's random streams, so that no row may
//! be put between others.

/// How many values a sensor gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Multiplicity {
    /// One.
    Single,
    /// One device with an axis each.
    Axes,
    /// One device on each rotor.
    Rotors,
}

/// A row of the table, beside the names.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRow {
    /// How many values it gives.
    pub multiplicity: Multiplicity,
    /// Place of its columns among those of the sensors in a log; of equals the row above comes first.
    pub log_place: u32,
    /// Whether the log format knows it: a mapping must give its unit, and a log of lockstep holds it. Others are only exported.
    pub is_log_signal: bool,
    /// Whether a fit or a comparison rests on its readings in a log: then screening looks at each of them.
    pub is_screened: bool,
    /// `MESSAGE.signal` of the built-in bench, for each value; empty = the built-in bench gives it no role.
    pub bus: &'static [&'static str],
    /// What the emulated sensor is by default.
    pub emulated: EmulatedRow,
    /// How the monitor shows it; `None` = it does not.
    pub monitor: Option<MonitorRow>,
}

/// The guard's defaults of a sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GuardRow {
    /// Whether the bench may run only while it is good.
    pub required: bool,
    /// Lowest and highest possible value, in SI.
    pub range: (f64, f64),
    /// Age of the last good value at which the rotors are stopped.
    pub stale_after: After,
    /// How long the value may stay the same to the last bit while frames go on and a rotor is commanded.
    pub frozen_after: After,
}

/// A time of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum After {
    /// The guard's hold time.
    Hold,
    /// [s]
    Seconds(f64),
    /// Never.
    Never,
}

/// Defaults of an emulated sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EmulatedRow {
    /// [Hz] samples each second; 0 = the emulated bench has none unless its file says so.
    pub rate_hz: f64,
    /// [unit of the sensor] rms of white, normally distributed noise.
    pub noise: f64,
    /// [unit of the sensor] step of the quantizer; 0 = none.
    pub quantization: f64,
    /// Whether it samples only when another sensor does, the first time after it is due. The plant is then integrated in the same
    /// steps with and without it, and nothing else changes by a bit.
    pub is_passenger: bool,
}

/// How the monitor shows a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MonitorRow {
    /// Name for people; the number of a rotor follows it.
    pub label: &'static str,
    /// Digits behind the point.
    pub digits: usize,
    /// Whether it is shown though it never gave a value.
    pub always: bool,
}

/// A sensor with a clock of its own.
pub(super) const fn emulated(rate_hz: f64, noise: f64, quantization: f64) -> EmulatedRow {
    EmulatedRow { rate_hz, noise, quantization, is_passenger: false }
}

/// A sensor that samples when another does.
pub(super) const fn passenger(rate_hz: f64, noise: f64, quantization: f64) -> EmulatedRow {
    EmulatedRow { is_passenger: true, ..emulated(rate_hz, noise, quantization) }
}

/// Shown from the start.
pub(super) const fn shown(label: &'static str, digits: usize) -> Option<MonitorRow> {
    Some(MonitorRow { label, digits, always: true })
}

/// Shown from its first value on.
pub(super) const fn shown_once_given(label: &'static str, digits: usize) -> Option<MonitorRow> {
    Some(MonitorRow { label, digits, always: false })
}

/// Calls `$with!` with the rows. Of each: what it is; its field in `Sensors`, type and [`super::Sensor`]; SI unit (as
/// [`crate::unit::Unit::si`] spells it) and the end of its columns' names; for each value [`super::Channel`], role, meaning and
/// place in the field; its table in `[guard]` with the defaults, where the guard may watch it; the rest.
macro_rules! sensor_table {
    ($with:ident) => {
        $with! {
            /// [rad/s] gyroscope, about the bench's axis.
            body_rate: Sample as BodyRate, "rad/s" "_rad_s",
                [BodyRate "body_rate" "body rate"],
                guard(body_rate = GuardRow { required: true, range: (-20.0, 20.0), stale_after: Hold, frozen_after: Hold }),
                SensorRow {
                    multiplicity: Multiplicity::Single,
                    log_place: 4,
                    is_log_signal: true,
                    is_screened: true,
                    bus: &["GYRO.rate"],
                    emulated: emulated(1000.0, 0.004, 1.0 / 1024.0),
                    monitor: shown("body rate", 4),
                };
            /// [rad] encoder or potentiometer at the pivot, where the bench has one; recorded, not used by EMC.
            body_angle: Sample as BodyAngle, "rad" "_rad",
                [BodyAngle "body_angle" "body angle"],
                guard(body_angle = GuardRow { required: false, range: (-3.2, 3.2), stale_after: Hold, frozen_after: Never }),
                SensorRow {
                    multiplicity: Multiplicity::Single,
                    log_place: 5,
                    is_log_signal: true,
                    is_screened: true,
                    bus: &[],
                    emulated: emulated(200.0, 0.001, std::f64::consts::TAU / 16384.0),
                    monitor: None,
                };
            /// [m/s²] accelerometer x, y, z, at the pivot.
            acceleration: [Sample; 3] as Acceleration, "m/s^2" "_m_s2",
                [
                    AccelerationX "acceleration_x" "acceleration x" [0],
                    AccelerationY "acceleration_y" "acceleration y" [1],
                    AccelerationZ "acceleration_z" "acceleration z" [2],
                ],
                guard(),
                SensorRow {
                    multiplicity: Multiplicity::Axes,
                    log_place: 6,
                    is_log_signal: false,
                    is_screened: false,
                    bus: &[
                        "ACCELEROMETER.acceleration_x",
                        "ACCELEROMETER.acceleration_y",
                        "ACCELEROMETER.acceleration_z",
                    ],
                    emulated: emulated(200.0, 0.05, 0.01),
                    monitor: None,
                };
            /// [V] battery.
            battery_voltage: Sample as BatteryVoltage, "V" "_v",
                [BatteryVoltage "battery_voltage" "battery voltage"],
                guard(battery_voltage = GuardRow { required: true, range: (6.0, 60.0), stale_after: Seconds(1.0), frozen_after: Never }),
                SensorRow {
                    multiplicity: Multiplicity::Single,
                    log_place: 0,
                    is_log_signal: true,
                    is_screened: true,
                    bus: &["ESC_1_STATUS.voltage"],
                    emulated: emulated(100.0, 0.01, 0.01),
                    monitor: shown("battery", 2),
                };
            /// [rad/s] rotor speeds (mechanical), as the ESCs report them.
            propeller_rate: [Sample; ROTORS] as PropellerRate, "rad/s" "_rad_s",
                [
                    PropellerRate1 "propeller_rate_1" "speed of rotor 1" [0],
                    PropellerRate2 "propeller_rate_2" "speed of rotor 2" [1],
                ],
                guard(propeller_rate = GuardRow {
                    required: true,
                    range: (-10.0, 3000.0),
                    stale_after: Hold,
                    frozen_after: Seconds(0.5),
                }),
                SensorRow {
                    multiplicity: Multiplicity::Rotors,
                    log_place: 1,
                    is_log_signal: true,
                    is_screened: true,
                    bus: &["ESC_1_STATUS.speed", "ESC_2_STATUS.speed"],
                    emulated: emulated(200.0, 1.5, 0.1),
                    monitor: shown("rotor", 1),
                };
            /// [A] motor or ESC input currents, as the ESCs report them.
            current: [Sample; ROTORS] as Current, "A" "_a",
                [
                    Current1 "current_1" "current of rotor 1" [0],
                    Current2 "current_2" "current of rotor 2" [1],
                ],
                guard(current = GuardRow {
                    required: false,
                    range: (-50.0, 200.0),
                    stale_after: Seconds(1.0),
                    frozen_after: Never,
                }),
                SensorRow {
                    multiplicity: Multiplicity::Rotors,
                    log_place: 3,
                    is_log_signal: true,
                    is_screened: false,
                    bus: &["ESC_1_STATUS.current", "ESC_2_STATUS.current"],
                    emulated: emulated(200.0, 0.1, 0.05),
                    monitor: None,
                };
            /// [N] load cells below the rotors, where the bench has them.
            thrust: [Sample; ROTORS] as Thrust, "N" "_n",
                [
                    Thrust1 "thrust_1" "thrust of rotor 1" [0],
                    Thrust2 "thrust_2" "thrust of rotor 2" [1],
                ],
                guard(thrust = GuardRow {
                    required: false,
                    range: (-50.0, 500.0),
                    stale_after: Seconds(1.0),
                    frozen_after: Never,
                }),
                SensorRow {
                    multiplicity: Multiplicity::Rotors,
                    log_place: 2,
                    is_log_signal: true,
                    is_screened: true,
                    bus: &[],
                    emulated: emulated(0.0, 0.02, 0.005),
                    monitor: None,
                };
            /// [K] temperatures of the ESCs, where they report them.
            esc_temperature: [Sample; ROTORS] as EscTemperature, "K" "_k",
                [
                    EscTemperature1 "esc_temperature_1" "temperature of the ESC of rotor 1" [0],
                    EscTemperature2 "esc_temperature_2" "temperature of the ESC of rotor 2" [1],
                ],
                guard(esc_temperature = GuardRow {
                    required: false,
                    range: (223.15, 473.15),
                    stale_after: Seconds(2.0),
                    frozen_after: Never,
                }),
                SensorRow {
                    multiplicity: Multiplicity::Rotors,
                    log_place: 7,
                    is_log_signal: true,
                    is_screened: false,
                    bus: &[],
                    emulated: passenger(0.0, 0.2, 0.1),
                    monitor: shown_once_given("ESC", 1),
                };
            /// [K] temperatures of the motors, where they have a sensor.
            motor_temperature: [Sample; ROTORS] as MotorTemperature, "K" "_k",
                [
                    MotorTemperature1 "motor_temperature_1" "temperature of motor 1" [0],
                    MotorTemperature2 "motor_temperature_2" "temperature of motor 2" [1],
                ],
                guard(motor_temperature = GuardRow {
                    required: false,
                    range: (223.15, 473.15),
                    stale_after: Seconds(2.0),
                    frozen_after: Never,
                }),
                SensorRow {
                    multiplicity: Multiplicity::Rotors,
                    log_place: 8,
                    is_log_signal: true,
                    is_screened: false,
                    bus: &[],
                    emulated: passenger(0.0, 0.2, 0.1),
                    monitor: shown_once_given("motor", 1),
                };
        }
    };
}
pub(crate) use sensor_table;
