//! Logs of whatever format, by one function: what a file is, its first bytes say.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::{Job, SessionError};
use crate::bench::BenchConfig;
use crate::can::Roles;
use crate::log::can_capture::CaptureNotes;
use crate::log::{Dataset, Mapping, Notes, can_capture, csv, export, mapped_csv};

/// A log's file, and what its format may need beside it.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The file.
    pub path: &'a Path,
    /// What the columns of a foreign CSV mean: a mapping file, or the name of a shipped one.
    pub mapping: Option<&'a str>,
    /// Which log of a foreign file, from 1, where time begins anew inside it.
    pub part: Option<usize>,
    /// Bench file that says what the frames of a candump log mean; without one the built-in bench does.
    pub bench: Option<&'a Path>,
    /// Only frames of this interface of a candump log.
    pub interface: Option<&'a str>,
}

impl<'a> From<&'a Path> for Source<'a> {
    fn from(path: &'a Path) -> Self {
        Self { path, mapping: None, part: None, bench: None, interface: None }
    }
}

/// A log, and what reading it left out.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The log.
    pub log: Dataset,
    /// What the reader of a foreign file left out, cut or merged.
    pub notes: Notes,
    /// What became of the frames of a capture.
    pub frames: Option<CaptureNotes>,
}

/// How a file begins.
enum Format {
    Recording,
    Candump,
    Csv,
}

/// Opens a log: a recording of ours, a candump log, a CSV in our format, or with a mapping any other CSV.
///
/// # Errors
/// [`SessionError`], from the reader of the format.
pub fn open(source: &Source, job: &Job) -> Result<Opened, SessionError> {
    job.run(|| read(source))
}

/// Opens logs that say for themselves what they are.
///
/// # Errors
/// [`SessionError`] of the first that cannot be read.
pub fn open_all(paths: &[PathBuf], job: &Job) -> Result<Vec<Dataset>, SessionError> {
    paths.iter().map(|path| open(&Source::from(path.as_path()), job).map(|opened| opened.log)).collect()
}

fn read(source: &Source) -> Result<Opened, SessionError> {
    let path = source.path;
    if let Some(mapping) = source.mapping {
        let (log, notes) = mapped_csv::read(path, &Mapping::load(mapping)?, source.part)?;
        return Ok(Opened { log, notes, frames: None });
    }
    let plain = |log| Opened { log, notes: Notes::default(), frames: None };
    match format(path) {
        Format::Recording => Ok(plain(export::dataset(path)?)),
        Format::Candump => {
            let config = BenchConfig::load(source.bench)?;
            let roles = Roles::build(&config.bus, config.period_s)?;
            let (log, frames) = can_capture::read(path, &roles, source.interface)?;
            Ok(Opened { frames: Some(frames), ..plain(log) })
        }
        Format::Csv => Ok(plain(csv::read(path)?)),
    }
}

/// What the first bytes say. What cannot be read twice, as a pipe, or at all is left to the reader of our own format.
fn format(path: &Path) -> Format {
    let mut start = [0; 8];
    let is_file = fs::metadata(path).is_ok_and(|found| found.is_file());
    let length = if is_file { File::open(path).and_then(|mut file| file.read(&mut start)) } else { Ok(0) };
    match start.get(..length.unwrap_or(0)) {
        Some([0x89, b'M', b'C', b'A', b'P', ..]) => Format::Recording,
        Some([b'(', ..]) => Format::Candump,
        _ => Format::Csv,
    }
}
