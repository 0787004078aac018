//! A recording as a CSV log, and its raw frames as a candump log.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::io::Write;
use std::path::Path;

use crate::file::write_atomically_with;
use crate::signal::{Applied, Channel, Command, GuardStep, Sensors};

use super::candump;
use super::dataset::{Dataset, DatasetError};
use crate::recording::RecordError;
use crate::recording::raw_frame::RawFrame;
pub(crate) use crate::recording::reader::{End, Recording};
pub(crate) use crate::recording::sender::RecordedItem;
use crate::signal::columns;

/// Columns before those of the sensors.
const COMMANDS: [&str; 3] = [columns::COMMANDS[0], columns::COMMANDS[1], columns::TORQUE_COMMAND];

/// Columns behind those of the sensors.
const ESTIMATES: [&str; 5] =
    ["reference_angle_rad", "estimated_angle_rad", "disturbance_torque_nm", "guard_state", "guard_cause"];

/// Sensors' columns.
const SENSORS: usize = Channel::IN_LOG.len();

/// Columns of an exported log behind `time_s`.
pub const COLUMNS: [&str; COMMANDS.len() + SENSORS + ESTIMATES.len()] = columns();

const fn columns() -> [&'static str; COMMANDS.len() + SENSORS + ESTIMATES.len()] {
    let mut columns = [""; COMMANDS.len() + SENSORS + ESTIMATES.len()];
    let mut place = 0;
    while place < columns.len() {
        columns[place] = if place < COMMANDS.len() {
            COMMANDS[place]
        } else if place < COMMANDS.len() + SENSORS {
            Channel::IN_LOG[place - COMMANDS.len()].column()
        } else {
            ESTIMATES[place - COMMANDS.len() - SENSORS]
        };
        place += 1;
    }
    columns
}

/// Frames that may be out of order when several threads recorded them.
const REORDER: usize = 4096;

/// What an export amounted to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportSummary {
    /// Rows or frames written.
    pub written: u64,
    /// Periods whose time is not behind the one before: left out.
    pub out_of_order: u64,
    /// Records that the recorder itself lost.
    pub lost: u64,
    /// How the recording ends.
    pub end: End,
}

/// Turns guard periods into rows. A sensor's cell is filled only when it has given a good value since the row before;
/// a command's cell holds from its row until the next.
#[derive(Debug, Clone)]
struct Rows {
    counts: [u32; SENSORS],
    last_ns: Option<u64>,
    first_ns: u64,
    out_of_order: u64,
}

impl Rows {
    fn new() -> Self {
        Self { counts: [0; SENSORS], last_ns: None, first_ns: 0, out_of_order: 0 }
    }

    /// The row of a guard period: time since the first and the cells; `None` when time does not rise.
    fn row(&mut self, step: &GuardStep) -> Option<(f64, [f64; COLUMNS.len()])> {
        if self.last_ns.is_some_and(|last| step.now_ns <= last) {
            self.out_of_order += 1;
            return None;
        }
        if self.last_ns.is_none() {
            self.first_ns = step.now_ns;
        }
        self.last_ns = Some(step.now_ns);
        // A quotient, not a product by 1e-9: 20 ms is 0.02 then, to the last bit.
        let time = (step.now_ns - self.first_ns) as f64 / 1e9;
        Some((time, self.cells(&step.sensors, step.newest(), &step.applied)))
    }

    fn cells(
        &mut self,
        sensors: &Sensors,
        newest: Option<&Command>,
        applied: &Applied,
    ) -> [f64; COLUMNS.len()] {
        let said = |of: fn(&Command) -> f64| newest.map_or(f64::NAN, of);
        let mut cells = [f64::NAN; COLUMNS.len()];
        let commands = [applied.rotor[0], applied.rotor[1], said(|it| it.torque)];
        let measured = Channel::IN_LOG.iter().zip(&mut self.counts).map(|(channel, count)| {
            let sample = channel.of(sensors);
            let fresh = sample.is_good() && sample.count != *count;
            *count = sample.count;
            if fresh { sample.value } else { f64::NAN }
        });
        let beliefs = [
            said(|it| it.estimate.reference_angle),
            said(|it| it.estimate.body_angle),
            said(|it| it.estimate.disturbance_torque),
            f64::from(applied.state),
            f64::from(applied.cause),
        ];
        let values = commands.into_iter().chain(measured).chain(beliefs);
        cells.iter_mut().zip(values).for_each(|(cell, value)| *cell = value);
        cells
    }
}

/// Which columns hold a value anywhere.
fn used(recording: Recording) -> Result<[bool; COLUMNS.len()], RecordError> {
    let mut used = [false; COLUMNS.len()];
    let mut rows = Rows::new();
    for record in recording {
        if let RecordedItem::GuardStep(step) = record?
            && let Some((_, cells)) = rows.row(&step)
        {
            used.iter_mut().zip(cells).for_each(|(used, cell)| *used |= cell.is_finite());
        }
    }
    Ok(used)
}

/// Writes a recording as a CSV log, one row for each period of the guard, in bounded memory. The file appears complete
/// or not at all.
///
/// # Errors
/// [`RecordError`] when the recording cannot be read, holds no period of the guard, or the log cannot be written.
pub fn write_log(recording: &Path, log: &Path) -> Result<ExportSummary, RecordError> {
    let used = used(Recording::open(recording)?)?;
    if used.iter().all(|used| !used) {
        let reason = "it holds no period of a guard, so that there is nothing to tabulate".to_owned();
        return Err(RecordError::Foreign { path: recording.to_owned(), reason });
    }
    let mut source = Recording::open(recording)?;
    let mut lost = 0;
    let mut rows = Rows::new();
    let mut written = 0;
    let mut failure = None;
    let result = write_atomically_with(log, |file| {
        let names = COLUMNS.iter().zip(used).filter(|(_, used)| *used).map(|(name, _)| *name);
        writeln!(file, "{}", std::iter::once(columns::TIME).chain(names).collect::<Vec<_>>().join(","))?;
        for record in source.by_ref() {
            match record {
                Ok(RecordedItem::GuardStep(step)) => {
                    let Some((time, cells)) = rows.row(&step) else { continue };
                    write!(file, "{time}")?;
                    for (cell, _) in cells.iter().zip(used).filter(|(_, used)| *used) {
                        if cell.is_finite() { write!(file, ",{cell}")? } else { write!(file, ",")? }
                    }
                    writeln!(file)?;
                    written += 1;
                }
                Ok(RecordedItem::Status(status)) => lost = status.dropped,
                Ok(_) => {}
                Err(error) => {
                    failure = Some(error);
                    return Err(std::io::Error::other("the recording cannot be read"));
                }
            }
        }
        Ok(())
    });
    finish(result, failure, log)?;
    Ok(ExportSummary { written, out_of_order: rows.out_of_order, lost, end: end(&source) })
}

/// Rows collected into a log in memory.
pub(crate) struct Collected {
    rows: Rows,
    time: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Collected {
    pub(crate) fn new() -> Self {
        Self { rows: Rows::new(), time: Vec::new(), columns: vec![Vec::new(); COLUMNS.len()] }
    }

    pub(crate) fn push(&mut self, step: &GuardStep) {
        if let Some((seconds, cells)) = self.rows.row(step) {
            self.time.push(seconds);
            self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.push(cell));
        }
    }

    /// Rows left out because time did not rise.
    pub(crate) fn out_of_order(&self) -> u64 {
        self.rows.out_of_order
    }

    /// The log, with those of `columns` that hold a value.
    pub(crate) fn dataset(
        self,
        path: &Path,
        hash: String,
        columns: impl Fn(&str) -> bool,
    ) -> Result<Dataset, DatasetError> {
        let mut log = Dataset::new(path.display().to_string(), hash, self.time)?;
        for (name, values) in COLUMNS.into_iter().zip(self.columns) {
            if columns(name) && values.iter().any(|value| value.is_finite()) {
                log.insert(name, values)?;
            }
        }
        Ok(log)
    }
}

/// A recording as a log in memory.
///
/// # Errors
/// [`RecordError`] when the recording cannot be read or holds no period of the guard.
pub fn dataset(path: &Path) -> Result<Dataset, RecordError> {
    let foreign = |reason: String| RecordError::Foreign { path: path.to_owned(), reason };
    let mut collected = Collected::new();
    for record in Recording::open(path)? {
        if let RecordedItem::GuardStep(step) = record? {
            collected.push(&step);
        }
    }
    if collected.time.is_empty() {
        return Err(foreign(
            "it holds no period of a guard, so that there is nothing to tabulate".to_owned(),
        ));
    }
    let hash =
        super::csv::file_hash(path).map_err(|source| RecordError::Open { path: path.to_owned(), source })?;
    collected.dataset(path, hash, |_| true).map_err(|error| foreign(error.to_string()))
}

/// Writes the raw frames of a recording as a candump log, by their stamps.
///
/// # Errors
/// [`RecordError`] when the recording cannot be read or the log cannot be written.
pub fn write_candump(recording: &Path, log: &Path) -> Result<ExportSummary, RecordError> {
    let mut source = Recording::open(recording)?;
    let metadata = source.metadata().clone();
    let interface = if metadata.interface.is_empty() { "can0" } else { metadata.interface.as_str() };
    let (mut lost, mut written) = (0, 0);
    let mut failure = None;
    let result = write_atomically_with(log, |file| {
        // Frames wait in a heap, by stamp and order of arrival, until enough later ones have come.
        let mut waiting: BinaryHeap<Reverse<(u64, u64)>> = BinaryHeap::new();
        let mut frames: BTreeMap<u64, RawFrame> = BTreeMap::new();
        let mut arrived = 0;
        let mut put = |file: &mut dyn Write, frame: Option<RawFrame>| -> std::io::Result<()> {
            let line = frame.and_then(|it| candump::emit(&it, metadata.wall_ns(it.stamp_ns), interface));
            if let Some(line) = line {
                writeln!(file, "{line}")?;
                written += 1;
            }
            Ok(())
        };
        for record in source.by_ref() {
            match record {
                Ok(RecordedItem::Frame(frame)) => {
                    waiting.push(Reverse((frame.stamp_ns, arrived)));
                    frames.insert(arrived, frame);
                    arrived += 1;
                    if waiting.len() > REORDER
                        && let Some(Reverse((_, order))) = waiting.pop()
                    {
                        put(file, frames.remove(&order))?;
                    }
                }
                Ok(RecordedItem::Status(status)) => lost = status.dropped,
                Ok(_) => {}
                Err(error) => {
                    failure = Some(error);
                    return Err(std::io::Error::other("the recording cannot be read"));
                }
            }
        }
        while let Some(Reverse((_, order))) = waiting.pop() {
            put(file, frames.remove(&order))?;
        }
        Ok(())
    });
    finish(result, failure, log)?;
    Ok(ExportSummary { written, out_of_order: 0, lost, end: end(&source) })
}

/// The error of the recording, if there was one, else the log's.
fn finish(result: std::io::Result<()>, failure: Option<RecordError>, log: &Path) -> Result<(), RecordError> {
    match failure {
        Some(failure) => Err(failure),
        None => result.map_err(|source| RecordError::Create { path: log.to_owned(), source }),
    }
}

fn end(source: &Recording) -> End {
    source.end().cloned().unwrap_or(End::Whole)
}
