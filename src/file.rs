//! Files that appear complete or not at all, and where in a file something is wrong.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

/// Line and column, from 1, of byte `at`.
#[must_use]
pub fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let column = before.get(line_start..).map_or(0, |line| line.chars().count());
    (before.matches('\n').count() + 1, column + 1)
}

/// The message on one line, however many it was written on.
#[must_use]
pub fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Place and message of a TOML error, in one line.
#[must_use]
pub fn toml_error(text: &str, error: &toml::de::Error) -> String {
    let reason = one_line(error.message());
    error.span().map_or(reason.clone(), |span| {
        let (line, column) = line_and_column(text, span.start);
        format!("line {line}, column {column}: {reason}")
    })
}

/// Writes `bytes` beside `path` and renames: what was there stays until the new file is complete.
///
/// # Errors
/// What the system says.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// The same for a file that is too long to hold in memory: `fill` writes it.
///
/// # Errors
/// What the system says, or `fill`.
pub fn write_atomically_with(
    path: &Path,
    fill: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
) -> io::Result<()> {
    if is_special(path) {
        // What /dev/stdout leads to may be a file that others have written to.
        let mut file = io::BufWriter::new(fs::OpenOptions::new().append(true).open(path)?);
        fill(&mut file)?;
        return file.flush();
    }
    let path = &target(path);
    let part = part_beside(path)?;
    let written = fs::File::create(&part).and_then(|file| {
        let mut file = io::BufWriter::new(file);
        fill(&mut file)?;
        file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
    });
    written.and_then(|()| fs::rename(&part, path)).inspect_err(|_| {
        // The first error is the one to tell; a leftover part file is harmless.
        let _ = fs::remove_file(&part);
    })
}

/// Whether a file could be written at `path`: for before the work whose result it is for.
///
/// # Errors
/// What the system says.
pub fn check_place(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Err(io::ErrorKind::IsADirectory.into());
    }
    if is_special(path) {
        // To open a pipe would wait for its reader.
        return Ok(());
    }
    let part = part_beside(&target(path))?;
    fs::File::create(&part)?;
    fs::remove_file(&part)
}

/// A device or a pipe: written to as it is. A file renamed over `/dev/null` would be the end of it, for everybody.
fn is_special(path: &Path) -> bool {
    let is_open_already =
        ["/dev/fd", "/dev/std", "/proc/"].iter().any(|start| path.to_string_lossy().starts_with(start));
    is_open_already || fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// The file behind a link, which stays one, also where that file is yet to be made.
fn target(path: &Path) -> PathBuf {
    let behind = |link: PathBuf| path.parent().map_or(link.clone(), |folder| folder.join(&link));
    path.canonicalize().unwrap_or_else(|_| fs::read_link(path).map_or_else(|_| path.to_owned(), behind))
}

/// The file that is written first.
fn part_beside(path: &Path) -> io::Result<PathBuf> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
    name.push(format!(".{}.part", std::process::id()));
    Ok(path.with_file_name(name))
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::{FileTypeExt, symlink};
    use std::process::Command;

    use super::*;

    #[test]
    fn a_link_and_a_pipe_stay_what_they_are() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("file"), "old").expect("written");
        symlink(at("file"), at("link")).expect("linked");
        symlink("nowhere yet", at("dangling")).expect("linked");
        let made = Command::new("mkfifo").arg(at("pipe")).status().expect("mkfifo is there");
        assert!(made.success());
        let reader = std::thread::spawn({
            let pipe = at("pipe");
            move || fs::read(pipe)
        });
        for place in ["link", "dangling", "pipe"] {
            check_place(&at(place)).expect("it can be written");
            write_atomically(&at(place), b"new").expect("written");
        }
        assert_eq!(fs::read(at("file")).expect("there"), b"new");
        assert_eq!(fs::read(at("nowhere yet")).expect("there"), b"new");
        assert!(at("link").is_symlink() && at("dangling").is_symlink(), "a link is no copy");
        assert!(fs::metadata(at("pipe")).expect("there").file_type().is_fifo());
        assert_eq!(reader.join().expect("no panic").expect("read"), b"new");
    }
}
