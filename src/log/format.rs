//! What a format of logs is: one file for each, and a line in [`FORMATS`](super::formats::FORMATS).
//!
//! A format recognises its files by their first bytes and makes [`Tables`] of them. What their columns mean says a mapping:
//! the one that belongs to the format, or the user's own.

use std::path::{Path, PathBuf};

use super::tables::Tables;

/// [byte] So much of a file says of which format it is.
pub const START: usize = 4096;

/// How a file begins.
#[derive(Debug, Clone, Copy)]
pub struct Start<'a> {
    /// The first bytes, [`START`] at most.
    pub bytes: &'a [u8],
    /// Its name.
    pub path: &'a Path,
}

/// What is wanted of a file.
#[derive(Clone, Copy)]
pub struct ReadRequest<'a> {
    /// The file, for messages.
    pub path: &'a Path,
    /// Its content.
    pub bytes: &'a [u8],
    /// Which log of the file, from 1, where it holds several.
    pub part: Option<usize>,
    /// Whether a column is wanted, by the names of its table and its own. A reader may give more.
    pub wants: &'a dyn Fn(&str, &str) -> bool,
}

/// A format that logs of other programs come in.
pub trait LogFormat: Sync {
    /// Its name, as its users call it.
    fn name(&self) -> &'static str;

    /// Whether a file that begins so is of this format.
    fn recognises(&self, start: &Start) -> bool;

    /// The mapping that says what its columns mean, where the format itself says it: the text of a mapping file.
    fn mapping(&self) -> Option<&'static str>;

    /// Reads a file. Damaged bytes are skipped and counted where the format allows to find the next good ones; what was read
    /// before the file breaks off is kept.
    ///
    /// # Errors
    /// [`FormatError`] when nothing of it can be read, or it holds several logs and none was chosen.
    fn read(&self, request: &ReadRequest) -> Result<Tables, FormatError>;
}

/// Why a file of a known format cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The file system said no.
    #[error("{path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The bytes are not what the format says.
    #[error("{path}, byte {byte}: no {format} log: {reason}")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Name of the format.
        format: &'static str,
        /// Where, from the file's start.
        byte: u64,
        /// What is wrong there.
        reason: String,
    },
    /// A file of a kind that is known and not read.
    #[error("{path}: this is {what}; {instead}. What can be read: {readable}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What it seems to be.
        what: &'static str,
        /// What makes a log of it.
        instead: &'static str,
        /// Names of what can be read.
        readable: String,
    },
    /// A file of no known kind.
    #[error("{path}: no log that is known here: not text, and not one of {readable}")]
    Unknown {
        /// The file.
        path: PathBuf,
        /// Names of what can be read.
        readable: String,
    },
    /// The file is as the format says, and cannot be used here.
    #[error("{path}: {reason}")]
    Unusable {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Several logs, and none was chosen.
    #[error("{path}: holds {} logs ({}); choose one with --part 1 to {}", lengths.len(), spans(lengths), lengths.len())]
    Parts {
        /// The file.
        path: PathBuf,
        /// [s] how long each is.
        lengths: Vec<f64>,
    },
    /// A log that is not there.
    #[error("{path}: there is no part {part}; the file holds {parts}")]
    Part {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        part: usize,
        /// How many logs the file holds.
        parts: usize,
    },
}

/// Lengths of logs in words, the first few.
fn spans(lengths: &[f64]) -> String {
    const SHOWN: usize = 8;
    let shown = lengths.iter().take(SHOWN).map(|length| format!("{length:.1} s"));
    let more = (lengths.len() > SHOWN).then(|| "...".to_owned());
    shown.chain(more).collect::<Vec<_>>().join(", ")
}
