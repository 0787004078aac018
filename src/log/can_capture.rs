//! A capture of the bus as a log: frames of candump, BLF or ASC, understood by DBC files and roles.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::can::{Counts, Protocol, RotorCommands};
use crate::signal::{Applied, Channel, GuardStep, Sensors};

use super::asc;
use super::blf;
use super::candump::{self, CandumpError, CandumpFrame};
use super::dataset::{Dataset, DatasetError};
use super::export::Collected;
use super::format::{FormatError, START, Start};
use super::limits;
use super::tables::Skipped;
use crate::signal::columns;

/// Why a capture cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// The file.
    #[error(transparent)]
    Candump(#[from] CandumpError),
    /// The file, of another format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The frames cannot make a log.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// No frame has a meaning.
    #[error("{path}: none of its {frames} frames carries a signal that the bench file names")]
    Meaningless {
        /// The file.
        path: PathBuf,
        /// Frames in it.
        frames: usize,
    },
}

/// What a capture amounted to.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct CaptureNotes {
    /// Frames in the file.
    pub frames: usize,
    /// Frames of other interfaces, when one was chosen.
    pub other_interfaces: usize,
    /// What became of those that carry sensors.
    pub sensors: Counts,
    /// What became of those that carry commands.
    pub commands: Counts,
    /// Which frames make the rows: `command`, or the sensor that came most often.
    pub rows_by: String,
    /// Rows left out because their stamp is not behind the one before.
    pub out_of_order: u64,
    /// Damaged parts of the file.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<Skipped>,
}

/// The format of a capture that begins so, as its users call it.
#[must_use]
pub fn format(start: &Start) -> Option<&'static str> {
    let is_candump = start.bytes.starts_with(b"(");
    let formats =
        [(is_candump, "candump"), (blf::recognises(start), blf::NAME), (asc::recognises(start), asc::NAME)];
    formats.into_iter().find(|(is, _)| *is).map(|(_, name)| name)
}

/// The frames of a capture, and what was left out.
fn frames(path: &Path) -> Result<(Vec<CandumpFrame>, Vec<Skipped>), CaptureError> {
    let file = |source| CandumpError::File { path: path.to_owned(), source };
    let mut begin = Vec::new();
    File::open(path).and_then(|file| file.take(START as u64).read_to_end(&mut begin)).map_err(file)?;
    let start = Start { bytes: &begin, path };
    if blf::recognises(&start) {
        return Ok(blf::read(path, &limits::read(path).map_err(file)?)?);
    }
    if asc::recognises(&start) {
        return Ok(asc::read(path, &limits::read(path).map_err(file)?)?);
    }
    Ok((candump::read(path)?, Vec::new()))
}

/// A frame with a meaning.
struct Event {
    stamp_ns: u64,
    /// Bits of the sensors that have a new value, or 0 for a command.
    updated: u32,
    sensors: Sensors,
    rotor: [f64; 2],
}

/// Reads a log of candump, BLF or ASC that speaks `protocol`: one row for each command frame, with what was measured since the one before;
/// without command frames, one for each frame of the sensor that came most often. Only frames of `interface` count, if
/// one is given.
///
/// # Errors
/// [`CaptureError`] with file and line.
pub fn read(
    path: &Path,
    protocol: &dyn Protocol,
    interface: Option<&str>,
) -> Result<(Dataset, CaptureNotes), CaptureError> {
    let (frames, skipped) = frames(path)?;
    let chosen = |it: &&CandumpFrame| interface.is_none_or(|wanted| it.interface == wanted);
    let (events, mut notes) = decode(frames.iter().filter(chosen), protocol);
    notes.frames = frames.len();
    notes.skipped = skipped;
    notes.other_interfaces = frames.iter().filter(|it| !chosen(it)).count();
    let most = Channel::ALL.into_iter().max_by_key(|field| {
        // The first of equals: `max_by_key` would take the last.
        let count = events.iter().filter(|event| event.updated & field.bit() != 0).count();
        (count, std::cmp::Reverse(*field))
    });
    let has_commands = events.iter().any(|event| event.updated == 0);
    let clock = if has_commands { None } else { most };
    notes.rows_by = clock.map_or_else(|| "command".to_owned(), |field| field.name().to_owned());
    let mut collected = Collected::new();
    for event in &events {
        if clock.map_or(event.updated == 0, |field| event.updated & field.bit() != 0) {
            let applied = Applied { rotor: event.rotor, ..Applied::default() };
            collected.push(&GuardStep::new(event.stamp_ns, &event.sensors, None, None, &applied));
        }
    }
    if events.is_empty() {
        return Err(CaptureError::Meaningless { path: path.to_owned(), frames: frames.len() });
    }
    notes.out_of_order = collected.out_of_order();
    let hash =
        super::csv::file_hash(path).map_err(|source| CandumpError::File { path: path.to_owned(), source })?;
    let wanted = |name: &str| !name.starts_with("guard_") && (has_commands || !columns::is_command(name));
    Ok((collected.dataset(path, hash, wanted)?, notes))
}

/// Every frame that carries a signal, with everything known when it came.
fn decode<'a>(
    frames: impl Iterator<Item = &'a CandumpFrame>,
    protocol: &dyn Protocol,
) -> (Vec<Event>, CaptureNotes) {
    let (mut of_sensors, mut of_commands) = protocol.capture_ends();
    let mut sensors = Sensors::default();
    let mut commands = RotorCommands::default();
    let mut events = Vec::new();
    for captured in frames {
        let Some(frame) = captured.frame.frame() else { continue };
        let stamp_ns = captured.frame.stamp_ns;
        // Whose commands they are a capture does not say.
        let (is_event, updated) = if of_commands.is_command(&frame) {
            (of_commands.receive(&frame, stamp_ns, &mut commands).updated != 0, 0)
        } else {
            let measured = of_sensors.receive(&frame, stamp_ns, &mut sensors).updated;
            (measured != 0, measured)
        };
        if is_event {
            events.push(Event { stamp_ns, updated, sensors, rotor: commands.rotor });
        }
    }
    let notes = CaptureNotes {
        frames: 0,
        other_interfaces: 0,
        sensors: of_sensors.counts(),
        commands: of_commands.counts(),
        rows_by: String::new(),
        out_of_order: 0,
        skipped: Vec::new(),
    };
    (events, notes)
}
