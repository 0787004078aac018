//! Logs of whatever format, by one function: what a file is, its first bytes say.

use std::fs::{self, File};
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::error::{ChoiceError, SessionError};
use super::job::Job;
use super::modelled::Modelled;
use crate::bench::BenchConfig;
use crate::can::protocol;
use crate::identify;
use crate::log::can_capture::CaptureNotes;
use crate::log::csv::LogError;
use crate::log::format::{FormatError, LogFormat, ReadRequest, START, Start};
use crate::log::formats::{FORMATS, readable};
use crate::log::signals::{are_ours, of_rotor, rotor_of};
use crate::log::{
    Dataset, DatasetError, Mapping, Notes, can_capture, csv, export, limits, mapped, unreadable,
};
use crate::model::Model;
use crate::screening::ScreenedLog;
use crate::screening::summary::LogSummary;
use crate::signal::columns;
use crate::threads::both;

/// What may be said of logs beside their names: what their format needs, and which part of them counts. It holds for those
/// of several logs that can use it.
///
/// ```
/// use rotorbench::session::OpenConfig;
///
/// // Rotor 3 of the second flight in a blackbox, without its take-off.
/// let config = OpenConfig { part: Some(2), from_s: Some(5.0), rotors: vec![3], ..OpenConfig::default() };
/// # assert_eq!(config.mapping, None);
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpenConfig {
    /// What the columns of a foreign log mean: a mapping file, or the name of a shipped one.
    pub mapping: Option<String>,
    /// Which log of a file that holds several, from 1.
    pub part: Option<usize>,
    /// Bench file that says what the frames of a capture of the bus mean; without one the built-in bench does.
    pub bench: Option<PathBuf>,
    /// Only frames of this interface of a capture.
    pub interface: Option<String>,
    /// [s] only rows from this time on.
    pub from_s: Option<f64>,
    /// [s] only rows up to this time.
    pub to_s: Option<f64>,
    /// Only these rotors, from 1; the first becomes rotor 1 of the log, and so on. Empty = all, as they are.
    pub rotors: Vec<usize>,
    /// Whether rows of a log in our format are left out whose time is empty or goes back, and counted; else such a log is refused.
    pub leaves_out: bool,
}

/// A log, judged, and what reading it left out.
#[derive(Debug, Clone)]
pub struct Opened {
    /// The log.
    pub log: ScreenedLog,
    /// Name of the format that it came in.
    pub format: &'static str,
    /// What the reader of a foreign file left out, cut or merged.
    pub notes: Notes,
    /// What became of the frames of a capture.
    pub frames: Option<CaptureNotes>,
}

/// Opens a log of any format. `LOG#2` is the second log of a file that holds several.
///
/// In a program: `examples/read_log.rs`.
///
/// # Errors
/// [`SessionError`], from the reader of the format.
pub fn open(path: &Path, config: &OpenConfig, job: &Job) -> Result<Opened, SessionError> {
    opened(path, config, None, job)
}

/// The same through a mapping that is at hand, for a foreign log; `config` names none.
///
/// # Errors
/// [`SessionError`], from the reader of the format.
pub fn open_mapped(
    path: &Path,
    mapping: &Mapping,
    config: &OpenConfig,
    job: &Job,
) -> Result<Opened, SessionError> {
    opened(path, config, Some(mapping), job)
}

fn opened(
    path: &Path,
    config: &OpenConfig,
    mapping: Option<&Mapping>,
    job: &Job,
) -> Result<Opened, SessionError> {
    job.run(|| {
        let (path, part) = addressed(path);
        if path.as_os_str() == "paper" && !path.exists() {
            return Err(ChoiceError::Paper.into());
        }
        let Read { log, format, notes, frames } =
            read(&path, &OpenConfig { part: part.or(config.part), ..config.clone() }, mapping)?;
        if log.is_empty() {
            return Err(
                FormatError::Unusable { path, reason: "it has a header and no rows".to_owned() }.into()
            );
        }
        let log = chosen(log, config)?.into();
        Ok::<_, SessionError>(Opened { log, format, notes, frames })
    })
}

/// Opens several logs, each of any format.
///
/// ```
/// use rotorbench::{cancel::Cancel, session, session::{Job, OpenConfig}};
///
/// let cancel = Cancel::default();
/// let gone = session::open_all(&["gone.csv".into()], &OpenConfig::default(), &Job::unwatched(&cancel));
/// assert!(gone.is_err_and(|error| error.to_string().contains("gone.csv")));
/// ```
///
/// # Errors
/// [`SessionError`] of the first that cannot be read.
pub fn open_all(paths: &[PathBuf], config: &OpenConfig, job: &Job) -> Result<Vec<ScreenedLog>, SessionError> {
    paths.iter().map(|path| open(path, config, job).map(|opened| opened.log)).collect()
}

/// What a log is like: its rate, its holes, its channels, its rotors and its body; and what in it can hardly be what its name says,
/// beside a model of its bench.
///
/// # Errors
/// [`SessionError::Cancelled`].
pub fn summarize(log: &ScreenedLog, model: &Model, job: &Job) -> Result<LogSummary, SessionError> {
    job.run(|| {
        let beside = || {
            let logs = Modelled::of(std::slice::from_ref(log), &[]).train;
            identify::mistaken_and_lacking(&logs, model).concat()
        };
        let (mut summary, beside) = both(|| LogSummary::of(log), beside);
        let beside: Vec<_> = beside.into_iter().filter(|it| !summary.findings.contains(it)).collect();
        summary.findings.extend(beside);
        Ok::<_, SessionError>(summary)
    })
}

/// Saves a log in our format: its file appears whole or not at all.
///
/// # Errors
/// What the system says.
pub fn save_log(log: &Dataset, path: &Path) -> Result<(), SessionError> {
    Ok(csv::write(log, path)?)
}

/// The rotors that logs have commands or rates of, from 1.
#[must_use]
pub fn rotors(logs: &[ScreenedLog]) -> Vec<usize> {
    rotors_of(logs.iter().map(ScreenedLog::raw))
}

/// Refuses rotors that none of the logs has.
///
/// # Errors
/// [`ChoiceError::Rotor`] names the first, and what there is.
pub fn require_rotors(logs: &[ScreenedLog], rotors: &[usize]) -> Result<(), SessionError> {
    let present = self::rotors(logs);
    let missing = rotors.iter().find(|rotor| !present.contains(rotor));
    match (missing, logs.first()) {
        (Some(&rotor), Some(log)) => {
            Err(ChoiceError::Rotor { log: log.source_name().to_owned(), rotor, present }.into())
        }
        _ => Ok(()),
    }
}

fn rotors_of<'a>(logs: impl Iterator<Item = &'a Dataset>) -> Vec<usize> {
    let mut found: Vec<usize> = logs.flat_map(Dataset::names).filter_map(rotor_of).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// A file and which log of it, where `FILE#N` is no file itself.
pub(crate) fn addressed(path: &Path) -> (PathBuf, Option<usize>) {
    let text = path.to_str().filter(|_| !path.exists());
    let parts = text.and_then(|text| text.rsplit_once('#'));
    match parts.and_then(|(file, number)| Some((file, number.parse().ok()?))) {
        Some((file, number)) => (PathBuf::from(file), Some(number)),
        None => (path.to_owned(), None),
    }
}

/// A log as it was read, and what was left out.
struct Read {
    log: Dataset,
    format: &'static str,
    notes: Notes,
    frames: Option<CaptureNotes>,
}

fn read(path: &Path, config: &OpenConfig, at_hand: Option<&Mapping>) -> Result<Read, SessionError> {
    // Asked for also where a log of ours needs none: a name that is no mapping is a mistake.
    let mapping = said(config, at_hand)?;
    let bytes = beginning(path);
    let start = Start { bytes: &bytes, path };
    if bytes.is_empty() && fs::metadata(path).is_ok_and(|found| found.is_file()) {
        return Err(
            FormatError::Unusable { path: path.to_owned(), reason: "the file is empty".to_owned() }.into()
        );
    }
    if start.bytes.starts_with(b"\x89MCAP") {
        return Ok(plain(export::dataset(path)?, "recording"));
    }
    if let Some(format) = can_capture::format(&start) {
        let bench = BenchConfig::load(config.bench.as_deref())?;
        let spoken = protocol(&bench.bus, bench.period_s)?;
        let (log, frames) = can_capture::read(path, &*spoken, config.interface.as_deref())?;
        return Ok(Read { frames: Some(frames), ..plain(log, format) });
    }
    if let Some(format) = FORMATS.iter().find(|format| format.recognises(&start)) {
        return tabular(path, *format, mapping, config);
    }
    if let Some((what, instead)) = unreadable::recognised(&start) {
        return Err(
            FormatError::Unreadable { path: path.to_owned(), what, instead, readable: readable() }.into()
        );
    }
    if unreadable::is_binary(&start) {
        return Err(FormatError::Unknown { path: path.to_owned(), readable: readable() }.into());
    }
    match mapping {
        Some(mapping) if !is_in_our_format(&start) || has_columns(&start, &mapping) => {
            let (log, notes) = mapped::read(path, &mapping, config.part)?;
            Ok(Read { notes, ..plain(log, "mapped CSV") })
        }
        _ => ours(path, &start, config),
    }
}

/// A log in our format; where that is asked for without the rows that cannot be put in time.
fn ours(path: &Path, start: &Start, config: &OpenConfig) -> Result<Read, SessionError> {
    match csv::read(path) {
        Err(LogError::RowWithoutTime { .. } | LogError::Dataset(DatasetError::Time { .. }))
            // Of a header that goes on behind what was read, not all names are known.
            if config.leaves_out && start.bytes.contains(&b'\n') =>
        {
            let mapping = Mapping::ours(header(start).iter().map(String::as_str));
            let (log, notes) = mapped::read(path, &mapping, config.part)?;
            Ok(Read { notes, ..plain(log, "CSV") })
        }
        read => Ok(plain(read?, "CSV")),
    }
}

/// The names in the first line of a text.
fn header(start: &Start) -> Vec<String> {
    let line = start.bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let line = String::from_utf8_lossy(line);
    line.trim_start_matches('\u{feff}').split(',').map(|name| name.trim().to_owned()).collect()
}

/// What the user says of foreign columns.
fn said(config: &OpenConfig, at_hand: Option<&Mapping>) -> Result<Option<Mapping>, SessionError> {
    match (at_hand, &config.mapping) {
        (Some(mapping), _) => Ok(Some(mapping.clone())),
        (None, Some(name)) => Ok(Some(Mapping::load(name)?)),
        (None, None) => Ok(None),
    }
}

/// A log of which nothing was left out.
fn plain(log: Dataset, format: &'static str) -> Read {
    Read { log, format, notes: Notes::default(), frames: None }
}

/// A log of tables, through the format's own mapping or the user's.
fn tabular(
    path: &Path,
    format: &dyn LogFormat,
    given: Option<Mapping>,
    config: &OpenConfig,
) -> Result<Read, SessionError> {
    let mapping = match (given, format.mapping()) {
        (Some(mapping), _) => Some(mapping),
        (None, Some(text)) => Some(Mapping::parse(text, Path::new(format.name()))?),
        (None, None) => None,
    };
    let bytes = limits::read(path).map_err(|source| FormatError::File { path: path.to_owned(), source })?;
    let wants = |table: &str, column: &str| mapping.as_ref().is_none_or(|it| it.wants(table, column));
    let tables = format.read(&ReadRequest { path, bytes: &bytes, part: config.part, wants: &wants })?;
    // Without any mapping the columns have our own names.
    let names = || tables.tables.iter().flat_map(|table| &table.columns).map(|column| column.name.as_str());
    let mapping = mapping.unwrap_or_else(|| Mapping::ours(names()));
    let (log, notes) = mapped::assemble(&tables, &bytes, path, &mapping)?;
    Ok(Read { notes, ..plain(log.of_format(format.name()), format.name()) })
}

/// Whether a text begins with a header of ours: a mapping for other logs is not for it.
fn is_ours(start: &Start) -> bool {
    header(start).iter().any(|name| name == columns::TIME)
}

/// Whether a text is in our own format: another column has a name of ours beside the time, which programs of others call `time_s`, too.
pub(super) fn is_in_our_format(start: &Start) -> bool {
    // Of a header that goes on behind what was read, not all names are known.
    let goes_on = !start.bytes.contains(&b'\n');
    is_ours(start) && (goes_on || are_ours(header(start).iter().map(String::as_str)))
}

/// Whether a text begins with a header that has all columns of a mapping: what the user said of it holds, whatever it is named like.
fn has_columns(start: &Start, mapping: &Mapping) -> bool {
    let skipped = mapping.config.skip_lines;
    let line = start.bytes.split(|byte| *byte == b'\n').nth(skipped).unwrap_or_default();
    let line = String::from_utf8_lossy(line);
    let header = line.trim_start_matches('\u{feff}').split(mapping.config.delimiter);
    let names: Vec<&str> = header.map(|name| name.trim().trim_matches('"')).collect();
    mapping.columns().all(|column| names.contains(&column))
}

/// The first bytes of a file; none of what cannot be read twice, as a pipe, or at all: that is left to the reader of our own
/// format.
pub(super) fn beginning(path: &Path) -> Vec<u8> {
    let mut bytes = Vec::new();
    if fs::metadata(path).is_ok_and(|found| found.is_file()) {
        // What cannot be read here cannot be read below either, which says why.
        let _ = File::open(path).and_then(|file| file.take(START as u64).read_to_end(&mut bytes));
    }
    bytes
}

/// The rows and rotors that were asked for.
fn chosen(log: Dataset, config: &OpenConfig) -> Result<Dataset, SessionError> {
    let log = only_rotors(log, &config.rotors)?;
    if config.from_s.is_none() && config.to_s.is_none() {
        return Ok(log);
    }
    let (from, to) = (config.from_s.unwrap_or(f64::NEG_INFINITY), config.to_s.unwrap_or(f64::INFINITY));
    let last = log.time().partition_point(|time| *time <= to);
    part(&log, (from, to), last)
}

/// A part of a log that is at hand, judged by itself: its rows from one time on and before another [s], so that two parts that
/// meet share none.
///
/// # Errors
/// [`SessionError::Choice`] where there is no such row.
pub fn between(log: &Dataset, from_s: f64, to_s: f64) -> Result<ScreenedLog, SessionError> {
    let last = log.time().partition_point(|time| *time < to_s);
    Ok(part(log, (from_s, to_s), last)?.into())
}

/// The rows from a time [s] on, before row `last`.
fn part(log: &Dataset, (from, to): (f64, f64), last: usize) -> Result<Dataset, SessionError> {
    let first = log.time().partition_point(|time| *time < from);
    if first >= last {
        let ends = log.time().first().zip(log.time().last());
        let (start, end) = ends.map_or((f64::NAN, f64::NAN), |(start, end)| (*start, *end));
        return Err(ChoiceError::Span { log: log.source_name().to_owned(), from, to, start, end }.into());
    }
    Ok(log.slice(first..last))
}

/// The log with these rotors alone, in this order, numbered from 1.
fn only_rotors(log: Dataset, rotors: &[usize]) -> Result<Dataset, SessionError> {
    if rotors.is_empty() {
        return Ok(log);
    }
    let present = rotors_of(std::iter::once(&log));
    if let Some(rotor) = rotors.iter().find(|rotor| !present.contains(rotor)) {
        let rotor = *rotor;
        return Err(ChoiceError::Rotor { log: log.source_name().to_owned(), rotor, present }.into());
    }
    let name = |column: &str| match rotor_of(column) {
        None => Some(column.to_owned()),
        Some(rotor) => {
            let place = rotors.iter().position(|wanted| *wanted == rotor)?;
            of_rotor(column, place + 1)
        }
    };
    Ok(log.renamed(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cancel::Cancel;

    /// A foreign log whose clock happens to be named as ours: the mapping that was given for its columns counts, and is not for a log
    /// of ours beside it.
    #[test]
    fn a_mapping_holds_for_a_log_whose_time_is_named_as_ours() {
        let mapping = "[time]\ncolumn = \"time_s\"\nunit = \"s\"\n[[signal]]\nname = \"command_1\"\ncolumn = \"duty\"\nunit = \"%\"\n";
        let mapping = Mapping::parse(mapping, Path::new("m.toml")).expect("a mapping");
        let at = |bytes: &[u8]| {
            let start = Start { bytes, path: Path::new("log.csv") };
            (is_ours(&start), has_columns(&start, &mapping))
        };
        assert_eq!(at(b"\xef\xbb\xbftime_s, \"duty\" ,x\r\n0,1,2\n"), (true, true));
        assert_eq!(at(b"time_s,command_1\n0,1\n"), (true, false));
        assert_eq!(at(b"t,duty\n0,1\n"), (false, false));
    }

    #[test]
    fn rows_that_cannot_be_put_in_time_are_left_out_where_that_is_asked_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.csv");
        let row = |number: u32| format!("{},0.4,{number}\n", 0.02 * f64::from(number));
        let rows: String = (0..30).map(row).collect();
        let text = format!("time_s,command_1,own\n{rows}0.2,0.4,99\n,0.4,98\n{}", row(30));
        fs::write(&path, text).expect("written");
        let cancel = Cancel::default();
        let read = |leaves_out: bool| {
            open(&path, &OpenConfig { leaves_out, ..OpenConfig::default() }, &Job::unwatched(&cancel))
        };
        let refused = read(false).expect_err("a row without a time").to_string();
        assert!(refused.ends_with("(`import` leaves out rows without one, and says which)"), "{refused}");
        let Opened { log, notes, .. } = read(true).expect("a log all the same");
        assert_eq!((notes.backward_time.count, notes.without_time.count), (1, 1));
        assert_eq!(log.raw().column("own").map(<[f64]>::len), Some(31));
        assert_eq!(log.raw().time().last(), Some(&0.6));
    }
}
