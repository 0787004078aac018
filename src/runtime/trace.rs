//! What happened, slot by slot, as a log.

use crate::clock;
use crate::log::dataset::{Dataset, DatasetError};
use crate::signal::{Applied, Sample, Sensors};

/// Columns of a trace after `time_s`, in the order of the log format.
const COLUMNS: [&str; 11] = [
    "command_1",
    "command_2",
    "battery_voltage_v",
    "propeller_rate_1_rad_s",
    "propeller_rate_2_rad_s",
    "thrust_1_n",
    "thrust_2_n",
    "current_1_a",
    "current_2_a",
    "body_rate_rad_s",
    "body_angle_rad",
];

/// A log under construction: one row each slot, with the commands applied from then on.
///
/// A cell is filled only when its sensor has given a value since the row before: a slower sensor leaves
/// empty cells, never a value that was not measured.
#[derive(Debug, Clone, Default)]
pub struct Trace {
    time: Vec<f64>,
    columns: [Vec<f64>; COLUMNS.len()],
    counts: [u32; COLUMNS.len()],
}

impl Trace {
    /// A row at `time_ns` of the log's own time.
    pub fn push(&mut self, time_ns: u64, sensors: &Sensors, applied: &Applied) {
        let samples: [&Sample; COLUMNS.len() - 2] = [
            &sensors.battery_voltage,
            &sensors.propeller_rate[0],
            &sensors.propeller_rate[1],
            &sensors.thrust[0],
            &sensors.thrust[1],
            &sensors.current[0],
            &sensors.current[1],
            &sensors.body_rate,
            &sensors.body_angle,
        ];
        self.time.push(clock::span_s(time_ns));
        for (column, command) in self.columns.iter_mut().zip(applied.rotor) {
            column.push(command);
        }
        let rest = self.columns.iter_mut().zip(&mut self.counts).skip(2);
        for ((column, count), sample) in rest.zip(samples) {
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
        for (name, column) in COLUMNS.into_iter().zip(self.columns) {
            if column.iter().any(|value| value.is_finite()) {
                dataset.insert(name, column)?;
            }
        }
        Ok(dataset)
    }
}
