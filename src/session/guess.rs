//! What the columns of a foreign log may mean, for somebody to look at before anything is done with it.

use std::path::Path;

use serde::Serialize;

use super::open::{addressed, beginning, is_in_our_format};
use super::{Job, SessionError};
use crate::log::format::{FormatError, ReadRequest, Start};
use crate::log::formats::FORMATS;
use crate::log::guess::{GuessedColumn, guess, signals};
use crate::log::mapping::{Mapping, MappingConfig, SignalMapping, TimeConfig};
use crate::log::mended::mend;
use crate::log::signals::are_ours;
use crate::log::sniff::{SampledColumn, layout};
use crate::log::thresholds::THRESHOLDS;
use crate::log::{can_capture, limits, unreadable};
use crate::signal::columns;

/// A guess of what a foreign log's columns mean.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct GuessedLog {
    /// Each column.
    pub columns: Vec<GuessedColumn>,
    /// The mapping that they make; without a time where none was recognised.
    pub mapping: MappingConfig,
    /// Name of a shipped mapping whose columns are all here; `null` without one.
    pub shipped: Option<&'static str>,
}

/// Guesses what the columns of a log mean, of `LOG#2` those of the file; `None` where the log says itself what it is, or is no table.
///
/// # Errors
/// [`SessionError`] when it cannot be read.
pub fn guess_columns(path: &Path, job: &Job) -> Result<Option<GuessedLog>, SessionError> {
    job.run(|| {
        // The logs of a file have the same columns.
        let path = &addressed(path).0;
        let bytes = beginning(path);
        let start = Start { bytes: &bytes, path };
        if bytes.is_empty() || is_recording_or_capture(&start) || is_in_our_format(&start) {
            return Ok::<_, SessionError>(None);
        }
        let format = FORMATS.iter().find(|format| format.recognises(&start));
        if format.is_some_and(|format| format.mapping().is_some()) || unreadable::recognised(&start).is_some()
        {
            return Ok(None);
        }
        let all = limits::read(path).map_err(|source| FormatError::File { path: path.to_owned(), source })?;
        let Some(format) = format else {
            return Ok(if unreadable::is_binary(&start) { None } else { of_text(&all) });
        };
        let tables = format.read(&ReadRequest { path, bytes: &all, part: None, wants: &|_, _| true })?;
        let columns = tables.tables.iter().flat_map(|table| &table.columns);
        if are_ours(columns.clone().map(|column| column.name.as_str())) {
            return Ok(None);
        }
        let sampled = columns.map(|column| SampledColumn {
            name: column.name.clone(),
            values: column.values.iter().copied().take(THRESHOLDS.guess_rows).collect(),
            texts: Vec::new(),
        });
        Ok(Some(of_columns(&sampled.collect::<Vec<_>>(), MappingConfig::new(None, Vec::new()))))
    })
}

/// Whether a file says by its first bytes that it is a recording of ours or a capture of a bus.
fn is_recording_or_capture(start: &Start) -> bool {
    start.bytes.starts_with(b"\x89MCAP") || can_capture::format(start).is_some()
}

fn of_text(bytes: &[u8]) -> Option<GuessedLog> {
    let layout = layout(bytes)?;
    let mut mapping = MappingConfig::new(None, Vec::new());
    mapping.delimiter = layout.delimiter;
    mapping.decimal_comma = layout.decimal_comma;
    mapping.header = layout.header;
    mapping.comment = layout.comment;
    mapping.encoding = layout.encoding.to_ascii_lowercase();
    Some(of_columns(&layout.columns, mapping))
}

fn of_columns(columns: &[SampledColumn], mapping: MappingConfig) -> GuessedLog {
    let mut guessed = GuessedLog { columns: guess(columns), mapping, shipped: None };
    guessed.build_mapping();
    guessed
}

impl GuessedLog {
    /// Says what a column becomes: a signal in a unit (SI where none is said; of a command `-`, `%`, `us`, `ms`, `dshot` or `8bit`), a channel
    /// of its own without a unit, or nothing (`-`).
    ///
    /// # Errors
    /// [`SessionError::Mend`]; nothing is changed then.
    pub fn mend(&mut self, column: &str, signal: &str, unit: Option<&str>) -> Result<(), SessionError> {
        mend(&mut self.columns, column, signal, unit)?;
        self.build_mapping();
        Ok(())
    }

    /// The mapping that the columns make.
    fn build_mapping(&mut self) {
        let time = self.columns.iter().find(|it| it.signal == columns::TIME);
        self.mapping.time = time.map(|time| TimeConfig {
            column: Some(time.column.clone()),
            unit: time.unit.clone(),
            period_s: None,
            levels: false,
        });
        self.mapping.signal = signals(&self.columns);
        let read = self.columns.iter().filter(|it| it.certainty.is_read());
        let mut texts: Vec<String> = read.flat_map(|it| it.texts.iter().cloned()).collect();
        texts.sort_unstable();
        texts.dedup();
        self.mapping.missing = texts;
        let names: Vec<&str> = self.columns.iter().map(|it| it.column.as_str()).collect();
        let shipped = Mapping::shipped_for(&names, &self.mapping.signal);
        self.shipped = shipped.filter(|name| has_command_of(name, &self.mapping.signal));
    }
}

/// Whether a command is guessed of a column that this mapping reads as it: one whose column of commands is empty reads no command.
fn has_command_of(shipped: &str, guessed: &[SignalMapping]) -> bool {
    let Ok(mapping) = Mapping::load(shipped) else { return false };
    let reads = |it: &SignalMapping| {
        mapping.config.alternatives(&it.name).any(|(_, other)| other.columns() == it.columns())
    };
    guessed.iter().filter(|it| columns::is_command(&it.name)).any(reads)
}
