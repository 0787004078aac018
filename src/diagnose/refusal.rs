//! Why an effect is not tried, or not taken: a code with its numbers.

use serde::Serialize;

use crate::unit::short;

/// To a tenth.
fn tenths(value: f64) -> String {
    short((10.0 * value).round() / 10.0)
}

/// To two digits.
fn two_digits(value: f64) -> String {
    format!("{value:.1e}").parse().map_or_else(|_| short(value), short)
}

/// Why an effect is not tried, or was refused after it had been.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "code", rename_all = "snake_case")]
pub enum EffectRefusal {
    /// The effect is in the model.
    #[error("the model has it")]
    InModel,
    /// A number of the model does the same.
    #[error("the model has it, as {parameter}")]
    InModelAs {
        /// Name of the number.
        parameter: &'static str,
    },
    /// The static curve of the model is a polynomial of as high a degree.
    #[error("the model's curve g(u) has a cubic of its own")]
    CubicInCurve,
    /// Over few levels a grid is an offset of each of them at will.
    #[error("a log holds {commands} different commands, {needed} are the least that can show a grid")]
    TooFewCommands {
        /// Different commands of a log.
        commands: usize,
        /// The least.
        needed: usize,
    },
    /// Nearly all scored transients go one way, and the effect is the difference between the ways.
    #[error("of the scored rows on their way to a new level {rising} rise and {falling} fall: it takes both")]
    OneDirection {
        /// Scored rows on the way up.
        rising: usize,
        /// Scored rows on the way down.
        falling: usize,
    },
    /// The scored rows are at rest, and the effect shows where a rotor is on its way only.
    #[error(
        "the rotors are at rest: {moving} scored rows are on their way to a new rate, {needed} are the least that show how a rotor follows"
    )]
    NoTransients {
        /// Scored rows that are not at rest.
        moving: usize,
        /// The least.
        needed: usize,
    },
    /// A law of the gyro in time, and the measured angle moves with it.
    #[error(
        "the slope of the measured angle leads the gyro by {lag_ms:.1} ± {error_ms:.1} ms: it does not lag"
    )]
    AngleShowsNoLag {
        /// [ms] lag of the gyro behind the angle's slope.
        lag_ms: f64,
        /// [ms] its standard error.
        error_ms: f64,
    },
    /// A constant of the gyro, and held against the measured angle it is none.
    #[error(
        "the gyro's bias drifts: beside the slope of the measured angle it is between {} and {} rad/s",
        two_digits(*least_rad_s),
        two_digits(*most_rad_s)
    )]
    BiasDrifts {
        /// [rad/s] the least bias of a part of the log.
        least_rad_s: f64,
        /// [rad/s] the most.
        most_rad_s: f64,
    },
    /// A law of the gyro, and no gyro measured the rate.
    #[error("the rate is a difference of the angle: no gyro measured it")]
    RateOfAngle,
    /// A log has not got what the effect reads.
    #[error("needs `{column}`, which a log lacks")]
    ColumnLacking {
        /// The column.
        column: String,
    },
    /// Named twice on the command line.
    #[error("it is asked for twice")]
    AskedTwice,
    /// Nothing in the logs that it acts in.
    #[error("the logs have no block that it acts in")]
    NoBlock,
    /// It acts in the body, which was held still.
    #[error("the body was held still in {}: log it swinging", logs.join(", "))]
    BodyHeldIn {
        /// The logs.
        logs: Vec<String>,
    },
    /// Insufficient data: too few samples.
    #[error("{samples} samples are too few to tell anything, {needed} are the least")]
    TooFewSamples {
        /// How many there are.
        samples: usize,
        /// The least.
        needed: usize,
    },
    /// Insufficient data: no rotor's command is exciting.
    #[error("the rotors' commands hardly changed: these data excite nothing")]
    CommandsNotExciting,
    /// Insufficient data: the rates of every rotor come too seldom to show how it follows its command.
    #[error("rates come at {} Hz, {} Hz are the least that show how this rotor follows", tenths(*rate_hz), tenths(*needed_hz))]
    ReadingsTooSeldom {
        /// [Hz] how often they come.
        rate_hz: f64,
        /// [Hz] the least.
        needed_hz: f64,
    },
    /// Insufficient data: the torque is not exciting.
    #[error("the torque on the body hardly changed: these data excite nothing")]
    TorqueNotExciting,
    /// The body was held still.
    #[error("the body does not move, whatever the torque on it")]
    BodyHeldStill,
    /// The surrogate test of the battery's reading.
    #[error("the battery's reading, shifted in time, does as well")]
    BatteryByChance {
        /// [-] share of shifted readings that do as well.
        p_value: f64,
    },
}
