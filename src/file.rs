//! Files that appear complete or not at all, and where in a file something is wrong.

use std::fmt;
use std::fs::{self, Permissions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{FileTypeExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Line and column, from 1, of byte `at`.
#[must_use]
pub fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let column = before.get(line_start..).map_or(0, |line| line.chars().count());
    (before.matches('\n').count() + 1, column + 1)
}

/// The message on one line, however many it was written on.
fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Place and message of a TOML error, in one line.
#[must_use]
pub fn toml_error(text: &str, error: &toml::de::Error) -> String {
    let reason = toml_reason(text, error);
    error.span().map_or(reason.clone(), |span| {
        let (line, column) = line_and_column(text, span.start);
        format!("line {line}, column {column}: {reason}")
    })
}

/// The message of a TOML error in one line, with what was probably meant where it is known.
#[must_use]
pub fn toml_reason(text: &str, error: &toml::de::Error) -> String {
    let reason = one_line(error.message());
    match error.span().and_then(|span| decimal_comma(text, span.start)) {
        Some(number) => format!("{reason}; a decimal comma? write {number}"),
        None => reason,
    }
}

/// The number with a decimal point, where one with a comma is written about byte `at`: all that stands behind the equals sign.
fn decimal_comma(text: &str, at: usize) -> Option<String> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |newline| newline + 1);
    let line = text.get(start..)?.lines().next()?;
    let value = line.split('#').next()?.split_once('=')?.1.trim();
    let (whole, fraction) = value.split_once(',')?;
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let unsigned = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    (digits(unsigned) && digits(fraction)).then(|| format!("{whole}.{fraction}"))
}

/// Which file a text is that is read for a bench file or a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingsKind {
    /// A bench file.
    Bench,
    /// A model.
    Model,
    /// What the columns of a log mean.
    Mapping,
    /// No settings: rows of columns, as a log has.
    Log,
}

/// Where people name the mapping of a log: what an error points at where one is missing or stands in another place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MappingPlace {
    /// An option of a command.
    #[default]
    Option,
    /// A key of a bench in the plan of a fleet.
    Plan,
}

impl fmt::Display for MappingPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Option => "`--mapping`",
            Self::Plan => "`mapping = \"FILE\"` of the bench in the plan",
        })
    }
}

/// Which of them a text is: a TOML by the tables at its top that only one kind has, a log by the columns of its first line; `None` = no
/// telling.
#[must_use]
pub fn settings_kind(text: &str) -> Option<SettingsKind> {
    const BENCH: [&str; 9] = [
        "period_s",
        "trigger",
        "model",
        "real_time",
        "shared_memory",
        "controller",
        "guard",
        "bus",
        "emulator",
    ];
    const MODEL: [&str; 2] = ["actuator", "body"];
    const MAPPING: [&str; 2] = ["signal", "time"];
    let Ok(table) = text.parse::<toml::Table>() else {
        let line = text.lines().next().unwrap_or_default();
        return (line.contains([',', ';', '\t']) && !line.contains('=')).then_some(SettingsKind::Log);
    };
    let has = |keys: &[&str]| keys.iter().any(|key| table.contains_key(*key));
    match (has(&BENCH), has(&MODEL), has(&MAPPING)) {
        (true, false, false) => Some(SettingsKind::Bench),
        (false, true, false) => Some(SettingsKind::Model),
        (false, false, true) => Some(SettingsKind::Mapping),
        _ => None,
    }
}

/// [byte] longest file of settings that is read: a bench, a model, a mapping, a DBC file.
const LONGEST_SETTINGS: u64 = 16 << 20;

/// Reads a file of settings whole, if it is no longer than one may be: `/dev/zero` in its place must not take the memory of the
/// machine.
///
/// # Errors
/// What the system says, or that there is more of it.
pub fn read_settings(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    fs::File::open(path)?.take(LONGEST_SETTINGS + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST_SETTINGS {
        return Err(io::Error::new(
            io::ErrorKind::FileTooLarge,
            "more than 16 MiB, which no file of settings has",
        ));
    }
    Ok(bytes)
}

/// The same of a text.
///
/// # Errors
/// As [`read_settings`], and that it is not UTF-8.
pub fn read_settings_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read_settings(path)?)
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "not UTF-8 text"))
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
        let file = fs::OpenOptions::new().append(true).open(path)?;
        if !is_open_already(path) && file.metadata()?.file_type().is_file() {
            // What was a device or a pipe a moment ago is somebody's file now.
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let mut file = io::BufWriter::new(file);
        fill(&mut file)?;
        return file.flush();
    }
    let path = &target(path);
    // Removed with the value, unless it becomes the file.
    let part = part_beside(path)?;
    let mut file = io::BufWriter::new(part.as_file());
    fill(&mut file)?;
    file.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()?;
    part.persist(path).map(drop).map_err(|error| error.error)
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
    part_beside(&target(path))?.close()
}

/// Whether a file is at `path` that a result written there would replace. A link that leads nowhere is one, too: who made
/// it meant something by it.
#[must_use]
pub fn is_there(path: &Path) -> bool {
    !is_special(path) && path.symlink_metadata().is_ok()
}

/// A device or a pipe: written to as it is. A file renamed over `/dev/null` would be the end of it, for everybody.
fn is_special(path: &Path) -> bool {
    is_open_already(path)
        || fs::metadata(path).is_ok_and(|found| {
            let kind = found.file_type();
            kind.is_fifo() || kind.is_char_device() || kind.is_block_device() || kind.is_socket()
        })
}

/// A name of what some process has open.
fn is_open_already(path: &Path) -> bool {
    ["/dev/fd", "/dev/std", "/proc/"].iter().any(|start| path.to_string_lossy().starts_with(start))
}

/// The file behind a link, which stays one, also where that file is yet to be made.
fn target(path: &Path) -> PathBuf {
    let behind = |link: PathBuf| path.parent().map_or(link.clone(), |folder| folder.join(&link));
    path.canonicalize().unwrap_or_else(|_| fs::read_link(path).map_or_else(|_| path.to_owned(), behind))
}

/// The file that is written first: a new one with a name that nobody can foresee, so that nobody can put a link in its
/// way. With the access that any new file has.
fn part_beside(path: &Path) -> io::Result<NamedTempFile> {
    let mut name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?.to_owned();
    name.push(".");
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    tempfile::Builder::new()
        .prefix(&name)
        .suffix(".part")
        .rand_bytes(RANDOM_LETTERS)
        .permissions(Permissions::from_mode(0o666))
        .tempfile_in(folder)
        // Its error names the part file, and people know the file.
        .map_err(|error| error.kind().into())
}

/// Of the name of a part file: 62^12 names.
const RANDOM_LETTERS: usize = 12;

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::process::Command;

    use super::*;

    #[test]
    fn settings_without_end_are_refused() {
        let error = read_settings_text(Path::new("/dev/zero")).expect_err("without end");
        assert!(error.to_string().contains("more than 16 MiB"), "{error}");
    }

    /// A link at each name that the process has ever used for a part file: none of them leads to a loss.
    #[test]
    fn nobody_can_put_a_link_in_the_way_of_a_part_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("victim"), "precious").expect("written");
        symlink(at("victim"), at(&format!("a.csv.{}.part", std::process::id()))).expect("linked");
        let mut names = Vec::new();
        for text in ["one", "two"] {
            write_atomically_with(&at("a.csv"), |file| {
                let found = fs::read_dir(folder.path()).expect("a folder").flatten();
                let name = |it: fs::DirEntry| it.file_name().to_string_lossy().into_owned();
                let parts = found.map(name).filter(|it| it.len() > "a.csv.000000.part".len());
                names.extend(parts.filter(|it| it.ends_with(".part")));
                file.write_all(text.as_bytes())
            })
            .expect("written");
        }
        assert_eq!(fs::read_to_string(at("victim")).expect("there"), "precious");
        assert_eq!(fs::read_to_string(at("a.csv")).expect("there"), "two");
        assert_eq!(fs::metadata(at("a.csv")).expect("there").permissions().mode() & 0o600, 0o600);
        assert!(names.len() == 2 && names[0] != names[1], "{names:?}");
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 3, "a part file was left");
    }

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
