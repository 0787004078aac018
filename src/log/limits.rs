//! How much of an input is read before it is refused: a log that cannot be one must not take the memory of the machine.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use crate::cancel;

use super::thresholds::THRESHOLDS;

/// [bytes] longest file that is read whole.
pub(super) const LONGEST_FILE: u64 = THRESHOLDS.longest_file;
/// Most columns of a table.
pub(crate) const MOST_COLUMNS: usize = THRESHOLDS.most_columns;
/// [characters] longest name of a column.
const LONGEST_NAME: usize = THRESHOLDS.longest_name;
/// Characters of a cell or a name that a message shows.
const SHOWN_CHARACTERS: usize = 40;

/// Reads a file whole. What is no file may have nobody at its other end, as a pipe, or one who says nothing: that wait ends when the
/// work is cancelled.
///
/// # Errors
/// What the system says, or that there is more of it than a log may have.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    if fs::metadata(path)?.is_file() {
        return read_now(path);
    }
    let look = Duration::from_millis(THRESHOLDS.cancel_look);
    let (sender, receiver) = mpsc::channel();
    let place = path.to_owned();
    // Left behind where the work is cancelled: it reads on what comes of the pipe, which nobody takes.
    thread::Builder::new().name("input".to_owned()).spawn(move || sender.send(read_now(&place)))?;
    loop {
        match receiver.recv_timeout(look) {
            Ok(read) => return read,
            Err(RecvTimeoutError::Timeout) => cancel::check(),
            Err(RecvTimeoutError::Disconnected) => return Err(io::ErrorKind::UnexpectedEof.into()),
        }
    }
}

fn read_now(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let found = file.metadata()?;
    let most = if found.is_file() { LONGEST_FILE } else { THRESHOLDS.longest_stream };
    let too_long = || {
        let what = if found.is_file() {
            "longer than 4 GiB: cut it into parts"
        } else {
            "not a file, and without end"
        };
        io::Error::new(io::ErrorKind::FileTooLarge, what)
    };
    if found.is_file() && found.len() > most {
        return Err(too_long());
    }
    let mut bytes = Vec::with_capacity(usize::try_from(found.len()).unwrap_or(0));
    let read = file.take(most + 1).read_to_end(&mut bytes)?;
    if read as u64 > most { Err(too_long()) } else { Ok(bytes) }
}

/// Why these cannot be the names of a table's columns.
pub(crate) fn not_names<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> Option<String> {
    let count = names.len();
    if count > MOST_COLUMNS {
        return Some(format!("{count} columns; {MOST_COLUMNS} are the most"));
    }
    let mut long = names.filter(|name| name.len() > LONGEST_NAME && name.chars().count() > LONGEST_NAME);
    let long = long.next()?;
    let (length, begin) = (long.chars().count(), shortened(long));
    Some(format!("the name of a column has {length} characters ('{begin}'); {LONGEST_NAME} are the most"))
}

/// The beginning of a text, for a message.
#[must_use]
pub(crate) fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARACTERS) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_end_is_refused() {
        let error = read(Path::new("/dev/zero")).expect_err("without end");
        assert!(error.to_string().contains("without end"), "{error}");
    }

    /// A pipe that nobody writes to.
    #[test]
    fn a_wait_for_input_ends_when_it_is_cancelled() {
        let (reader, _writer) = io::pipe().expect("a pipe");
        let path = format!("/proc/self/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&reader));
        assert!(cancel::is_left_within(|| read(Path::new(&path)).is_ok()));
    }

    #[test]
    fn names_are_few_and_short_enough() {
        let long = "y".repeat(LONGEST_NAME + 1);
        let reason = not_names(["time_s", &long].into_iter()).expect("too long");
        assert!(reason.contains("257 characters") && reason.len() < 200, "{reason}");
        assert_eq!(not_names(["time_s", &long[1..]].into_iter()), None);
        assert!(not_names(vec!["a"; MOST_COLUMNS + 1].into_iter()).is_some());
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(shortened("short"), "short");
        assert_eq!(shortened(&"é".repeat(50)), format!("{}...", "é".repeat(40)));
    }
}
