//! What happened, slot by slot, as a log.

use crate::clock;
use crate::log::dataset::{Dataset, DatasetError};
use crate::signal::columns;
use crate::signal::{Applied, Channel, ROTORS, Sensors};

/// The commands' columns of a trace; those of the log format's sensors follow.
const SENSORS: usize = Channel::LOG_SIGNALS.len();

/// A log under construction: one row each slot, with the commands applied from then on.
///
/// A cell is filled only when its sensor has given a value since the row before: a slower sensor leaves
/// empty cells, never a value that was not measured.
#[derive(Debug, Clone, Default)]
pub struct LogTrace {
    time: Vec<f64>,
    commands: [Vec<f64>; ROTORS],
    measured: [Vec<f64>; SENSORS],
    counts: [u32; SENSORS],
}

impl LogTrace {
    /// A row at `time_ns` of the log's own time.
    pub fn push(&mut self, time_ns: u64, sensors: &Sensors, applied: &Applied) {
        self.time.push(clock::span_s(time_ns));
        for (column, command) in self.commands.iter_mut().zip(applied.rotor) {
            column.push(command);
        }
        let measured = self.measured.iter_mut().zip(&mut self.counts);
        for ((column, count), channel) in measured.zip(Channel::LOG_SIGNALS) {
            let sample = channel.of(sensors);
            let fresh = sample.is_good() && sample.count != *count;
            *count = sample.count;
            column.push(if fresh { sample.value } else { f64::NAN });
        }
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }

    /// The log, with the columns that hold a value.
    ///
    /// # Errors
    /// [`DatasetError::Time`] when rows were pushed out of order.
    pub fn into_dataset(self, source_name: &str) -> Result<Dataset, DatasetError> {
        let mut dataset = Dataset::new(source_name, "", self.time)?;
        let names = columns::COMMANDS.into_iter().chain(Channel::LOG_SIGNALS.map(Channel::column));
        for (name, column) in names.zip(self.commands.into_iter().chain(self.measured)) {
            if column.iter().any(|value| value.is_finite()) {
                dataset.insert(name, column)?;
            }
        }
        Ok(dataset)
    }
}
