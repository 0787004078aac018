//! How much of an input is read before it is refused: a log that cannot be one must not take the memory of the machine.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

/// [bytes] longest file that is read whole.
pub(super) const LONGEST_FILE: u64 = 4 << 30;
/// [bytes] most that is read of what has no length, as a pipe.
const LONGEST_STREAM: u64 = 256 << 20;
/// Most columns of a table: a log of sixteen rotors has some hundred.
pub(crate) const MOST_COLUMNS: usize = 4_096;
/// Characters of a cell or a name that a message shows.
const SHOWN_CHARACTERS: usize = 40;

/// Reads a file whole.
///
/// # Errors
/// What the system says, or that there is more of it than a log may have.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let found = file.metadata()?;
    let most = if found.is_file() { LONGEST_FILE } else { LONGEST_STREAM };
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

    #[test]
    fn long_texts_are_cut_between_characters() {
        assert_eq!(shortened("short"), "short");
        assert_eq!(shortened(&"é".repeat(50)), format!("{}...", "é".repeat(40)));
    }
}
