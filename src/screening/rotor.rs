//! One rotor of a log as the checks see it: its part of the log, what is missing of its commands, and what is left of its rates.

use super::missing_commands::Missing;
use super::rotor_data::{HeldVoltage, RotorLog};
use crate::log::Dataset;
use crate::signal::columns;

/// A rotor that is being judged.
pub(crate) struct CheckedRotor<'a> {
    /// Its part of the log; rates that a check takes out of the score are missing in it.
    pub data: RotorLog,
    /// What is missing of its commands.
    pub missing: Missing,
    /// [rad/s] its rates as they were measured; empty without a column.
    pub measured: &'a [f64],
    /// Rows at which it stands or starts, ascending, by its rates before any check took one out.
    pub at_rest: Vec<usize>,
    /// [s] when it was commanded to turn after it had stood, by the same rates.
    pub starts: Vec<f64>,
    /// Whether its commands step between rows in another log of this bench.
    pub steps_elsewhere: bool,
}

impl<'a> CheckedRotor<'a> {
    /// Rotor `number` (from 1) of a log whose channels were judged; `None` when the log does not hold its command.
    /// `voltage` is that of the log.
    pub(crate) fn read(log: &'a Dataset, voltage: Option<&HeldVoltage>, number: usize) -> Option<Self> {
        let (data, missing) = RotorLog::read(log, voltage, number)?;
        let measured = log.column(&columns::propeller_rate(number)).unwrap_or_default();
        let (at_rest, starts) = (data.at_rest(), data.starts());
        Some(Self { data, missing, measured, at_rest, starts, steps_elsewhere: false })
    }

    /// Whether any of its rates is a measurement.
    pub(crate) fn is_measured(&self) -> bool {
        self.measured.iter().any(|rate| rate.is_finite())
    }
}
