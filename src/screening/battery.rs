//! The battery of a log as the checks see it that judge its reading as a whole. Its single cells are a channel's.

use super::Finding;
use super::rotor_data::RotorLog;
use crate::log::Dataset;
use crate::signal::columns::BATTERY_VOLTAGE;

/// A battery whose reading is being judged.
pub(crate) struct CheckedBattery<'a> {
    /// A log whose channels were judged.
    pub log: &'a Dataset,
    /// The rotors that turn and are measured.
    pub turning: Vec<&'a RotorLog>,
}

impl CheckedBattery<'_> {
    /// A finding in its reading.
    pub(crate) fn finding(&self, code: &'static str) -> Finding {
        Finding::new(code, BATTERY_VOLTAGE).of(self.log.source_name())
    }

    /// Rows that hold a reading.
    pub(crate) fn rows(&self) -> Vec<usize> {
        let readings = self.log.column(BATTERY_VOLTAGE).unwrap_or_default();
        (0..readings.len()).filter(|row| readings[*row].is_finite()).collect()
    }
}
