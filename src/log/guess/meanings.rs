//! The words by which columns of others are known.

use crate::log::thresholds::THRESHOLDS;
use crate::signal::{Sensor, columns};

/// A signal, and the words that mean it.
pub(super) struct Meaning {
    /// Column of our log; [`columns::ANY_ROTOR`] stands for the rotor's number.
    pub signal: &'static str,
    /// SI unit.
    pub si: &'static str,
    /// One of these words is in the name.
    pub words: &'static [&'static str],
    /// One of these is, too; empty = nothing more is wanted.
    pub with: &'static [&'static str],
    /// None of these is.
    pub without: &'static [&'static str],
    /// The unit alone says it, where the name says nothing else.
    pub by_unit: bool,
    /// Units by the largest size of the values, the smallest first; the last holds for all above.
    pub units: &'static [(f64, &'static str)],
}

/// Words that mean time in one language and something else in another: where the values grow.
pub(super) const GROWING: [&str; 3] = ["tempo", "tiempo", "temps"];

/// Words of what is asked for: no sensor measures that.
pub(super) const ASKED: [&str; 17] = [
    "target",
    "setpoint",
    "set_point",
    "desired",
    "ref",
    "reference",
    "referencia",
    "demand",
    "demanded",
    "goal",
    "soll",
    "consigna",
    "commanded",
    "command",
    "cmd",
    "requested",
    "wanted",
];

/// The meanings, in the order in which they are asked.
pub(super) const MEANINGS: &[Meaning] = &[
    Meaning {
        signal: columns::TIME,
        si: "s",
        words: &[
            "time",
            "t",
            "timestamp",
            "zeit",
            "seconds",
            "clock",
            "ts",
            "ms_today",
            GROWING[0],
            GROWING[1],
            GROWING[2],
        ],
        with: &[],
        without: &["constant", "step"],
        by_unit: false,
        units: &[],
    },
    Meaning {
        signal: Sensor::Thrust.column_of_any_rotor(),
        si: "N",
        words: &["thrust", "lift", "schub", "load_cell", "loadcell"],
        with: &[],
        without: &["efficiency", "command", "setpoint", "raw", "counts", "adc", "torque"],
        by_unit: false,
        units: &[(THRESHOLDS.guess_thrust, "N"), (f64::INFINITY, "gf")],
    },
    Meaning {
        signal: columns::BATTERY_VOLTAGE,
        si: "V",
        words: &["voltage", "volt", "volts", "voltaje", "vbat", "spannung", "vbus"],
        with: &[],
        without: &["cell", "reference"],
        by_unit: true,
        units: &[(THRESHOLDS.guess_voltage, "V"), (f64::INFINITY, "mV")],
    },
    Meaning {
        signal: Sensor::Current.column_of_any_rotor(),
        si: "A",
        words: &["current", "amperage", "amps", "strom"],
        with: &[],
        without: &["efficiency"],
        by_unit: true,
        units: &[(THRESHOLDS.guess_current, "A"), (f64::INFINITY, "mA")],
    },
    Meaning {
        signal: Sensor::MotorTemperature.column_of_any_rotor(),
        si: "K",
        words: &["temperature", "temp"],
        with: &[],
        without: &["esc", "mos", "fet", "mosfet", "ambient", "air", "imu", "board", "cpu"],
        by_unit: false,
        units: &[(THRESHOLDS.guess_temperature, "degC"), (f64::INFINITY, "K")],
    },
    Meaning {
        signal: Sensor::EscTemperature.column_of_any_rotor(),
        si: "K",
        words: &["temperature", "temp"],
        with: &[],
        without: &["motor", "ambient", "air", "imu", "board", "cpu"],
        by_unit: false,
        units: &[(THRESHOLDS.guess_temperature, "degC"), (f64::INFINITY, "K")],
    },
    Meaning {
        signal: columns::BODY_RATE,
        si: "rad/s",
        words: &["gyro", "body_rate", "bodyrate", "pitchrate", "rollrate"],
        with: &[],
        without: &["x", "y", "z", "bias"],
        by_unit: false,
        units: &[(THRESHOLDS.guess_body_rate, "rad/s"), (f64::INFINITY, "deg/s")],
    },
    Meaning {
        signal: columns::BODY_ANGLE,
        si: "rad",
        words: &["angle", "theta", "attitude", "pitch", "roll", "winkel", "angulo", "ángulo"],
        with: &[],
        without: &["rate", "command", "setpoint", "reference", "u", "w"],
        by_unit: false,
        units: &[(THRESHOLDS.guess_body_angle, "rad"), (f64::INFINITY, "deg")],
    },
    Meaning {
        signal: columns::ANY_PROPELLER_RATE,
        si: "rad/s",
        words: &["rpm", "erpm", "speed", "omega", "drehzahl", "propeller_rate", "w"],
        with: &[],
        without: &[
            "electrical",
            "electric",
            "air",
            "wind",
            "command",
            "setpoint",
            "gyro",
            "carriage",
            "meters",
            "steps",
            "counts",
            "ticks",
            "pulses",
            "yaw",
            "pitch",
            "roll",
        ],
        by_unit: true,
        units: &[(THRESHOLDS.guess_propeller_rate, "rad/s"), (f64::INFINITY, "rpm")],
    },
    Meaning {
        signal: columns::TORQUE_COMMAND,
        si: "N m",
        words: &["torque", "moment"],
        // A torque that is measured, as on a thrust stand, is none that was commanded.
        with: &["command", "cmd", "setpoint", "commanded", "control"],
        without: &["motor", "shaft", "measured"],
        by_unit: false,
        units: &[(f64::INFINITY, "N m")],
    },
    Meaning {
        signal: columns::ANY_COMMAND,
        si: "-",
        words: &["command", "throttle", "esc", "cmd", "pwm", "duty", "dshot", "u", "motor"],
        with: &[],
        without: &[
            "speed",
            "power",
            "efficiency",
            "servo",
            "torque",
            "collective",
            "rc",
            "vibration",
            "yaw",
            "pitch",
            "roll",
        ],
        by_unit: false,
        units: &[],
    },
];
