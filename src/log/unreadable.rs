//! Files that people have and that are no log here: what each is, and what makes a log of it.

use super::format::{START, Start};

/// A kind of file that is recognised and not read.
struct Kind {
    /// Its first bytes.
    begins: &'static [u8],
    /// How far from the start they stand.
    at: usize,
    what: &'static str,
    instead: &'static str,
}

const KINDS: &[Kind] = &[
    Kind {
        begins: b"MATLAB 5.0 MAT-file",
        at: 0,
        what: "a MATLAB file",
        instead: "write its columns with MATLAB's `writetable(T, 'log.csv')`",
    },
    Kind {
        begins: b"\x89HDF\r\n",
        at: 0,
        what: "an HDF5 file (MATLAB writes version 7.3 so)",
        instead: "write its columns as CSV or Parquet, as with pandas",
    },
    Kind {
        begins: b"SQLite format 3\0",
        at: 0,
        what: "an SQLite database (rosbag2 writes .db3 so)",
        instead: "write the topics as CSV, or record with `ros2 bag record -s mcap` and convert",
    },
    Kind {
        begins: b"version https://git-lfs.github.com/spec/",
        at: 0,
        what: "the pointer that Git LFS leaves in place of a file",
        instead: "fetch the file itself with `git lfs pull`",
    },
    Kind {
        begins: b"#ROSBAG V",
        at: 0,
        what: "a ROS 1 bag",
        instead: "write the topics as CSV with `rostopic echo -b FILE -p TOPIC`",
    },
    Kind {
        begins: b"PK\x03\x04",
        at: 0,
        what: "a ZIP archive (spreadsheets are .xlsx and .ods)",
        instead: "unpack it, or save the sheet as CSV",
    },
    Kind { begins: b"\x1f\x8b", at: 0, what: "compressed with gzip", instead: "unpack it with `gunzip`" },
    Kind {
        begins: b"\x28\xb5\x2f\xfd",
        at: 0,
        what: "compressed with zstd",
        instead: "unpack it with `unzstd`",
    },
    Kind { begins: b"BZh", at: 0, what: "compressed with bzip2", instead: "unpack it with `bunzip2`" },
    Kind { begins: b"\xfd7zXZ\0", at: 0, what: "compressed with xz", instead: "unpack it with `unxz`" },
    Kind { begins: b"\x7fELF", at: 0, what: "a program", instead: "name the log that it wrote" },
    Kind { begins: b"%PDF", at: 0, what: "a PDF", instead: "name the file with the numbers" },
];

/// First byte of a log of Crazyflie's micro-SD deck.
const CRAZYFLIE: u8 = 0xbc;

/// What is written in TOML is settings, each kind of which has its own option.
const TOML: (&str, &str) = (
    "TOML, not a log",
    "a bench file is named with --config, a mapping with --mapping, a model with --model",
);

/// Whether a file is TOML, by its name or by the lines that its beginning holds whole.
fn is_toml(start: &Start) -> bool {
    if start.path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml")) {
        return true;
    }
    let end = if start.bytes.len() < START { Some(start.bytes.len()) } else { last_line_end(start.bytes) };
    let whole = end.and_then(|end| std::str::from_utf8(&start.bytes[..end]).ok());
    whole.and_then(|text| toml::from_str::<toml::Table>(text).ok()).is_some_and(|table| !table.is_empty())
}

fn last_line_end(bytes: &[u8]) -> Option<usize> {
    bytes.iter().rposition(|byte| *byte == b'\n')
}

/// What a file is that no format reads, and what makes a log of it.
#[must_use]
pub fn recognised(start: &Start) -> Option<(&'static str, &'static str)> {
    let begins = |kind: &&Kind| start.bytes.get(kind.at..).is_some_and(|rest| rest.starts_with(kind.begins));
    let known = KINDS.iter().find(begins).map(|kind| (kind.what, kind.instead));
    known.or_else(|| is_toml(start).then_some(TOML)).or_else(|| {
        (start.bytes.first() == Some(&CRAZYFLIE)).then_some((
            "a log of Crazyflie's micro-SD deck",
            "write it as CSV with `cfusdlog.py` of the Crazyflie firmware",
        ))
    })
}

/// Whether a file is no text: a zero byte near its start is in no CSV of any encoding that is read here.
#[must_use]
pub fn is_binary(start: &Start) -> bool {
    start.bytes.contains(&0)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn known_files_are_named() {
        let what = |bytes: &[u8]| recognised(&Start { bytes, path: Path::new("log") }).map(|(what, _)| what);
        assert!(what(b"SQLite format 3\0 and more").is_some_and(|it| it.contains("rosbag2")));
        assert!(
            what(b"version https://git-lfs.github.com/spec/v1\n").is_some_and(|it| it.contains("Git LFS"))
        );
        assert!(what(b"\xbc\x02\x00").is_some_and(|it| it.contains("Crazyflie")));
        assert_eq!(what(b"# a bench\nname = \"x\"\n[guard]\nmisses = 3\n"), Some("TOML, not a log"));
        let named = recognised(&Start { bytes: b"[[", path: Path::new("m.toml") });
        assert_eq!(named.map(|it| it.0), Some("TOML, not a log"));
        assert_eq!(what(b"# a remark\n"), None);
        assert_eq!(what(b"time_s,a\n"), None);
        assert_eq!(what(b""), None);
    }
}
