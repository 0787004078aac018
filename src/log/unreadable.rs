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

/// MATLAB's `save -v4`, which Simulink and dSPACE tools write, too.
const MATLAB_4: (&str, &str) =
    ("a MATLAB file of version 4", "write its columns with MATLAB's `writetable(array2table(X), 'log.csv')`");

/// Whether a file begins with a matrix as MATLAB's version 4 writes it, in either byte order: five numbers (kind, rows, columns, whether
/// it is complex, letters of the name and a zero), then the name.
fn is_matlab_4(bytes: &[u8]) -> bool {
    let number = |at: usize, is_big: bool| -> Option<u32> {
        let four: [u8; 4] = bytes.get(4 * at..4 * at + 4)?.try_into().ok()?;
        Some(if is_big { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) })
    };
    [(false, 0), (true, 1000)].into_iter().any(|(is_big, order)| {
        let numbers: Option<Vec<u32>> = (0..5).map(|at| number(at, is_big)).collect();
        let Some(&[kind, _, _, complex, letters]) = numbers.as_deref() else { return false };
        // Tens: the type of the values; ones: full, text or sparse.
        let is_kind = kind.checked_sub(order).is_some_and(|kind| kind <= 52 && kind % 10 <= 2);
        let name = bytes.get(20..20 + (letters.min(64) as usize)).and_then(|name| name.split_last());
        let is_name = name.is_some_and(|(end, name)| {
            let is_letter = |letter: &u8| letter.is_ascii_alphanumeric() || *letter == b'_';
            *end == 0 && name.first().is_some_and(u8::is_ascii_alphabetic) && name.iter().all(is_letter)
        });
        is_kind && complex <= 1 && (2..=64).contains(&letters) && is_name
    })
}

/// What programs write that say each row as an object.
const JSON: (&str, &str) = (
    "JSON, which is not read",
    "where each line is an object, pandas makes a CSV of it: `read_json('LOG', lines=True).to_csv('log.csv')`",
);

/// Whether the first line that is not empty begins as an object of JSON does.
fn is_json(start: &Start) -> bool {
    let text = start.bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(start.bytes);
    text.trim_ascii_start().starts_with(b"{")
}

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
    let known = known.or_else(|| is_matlab_4(start.bytes).then_some(MATLAB_4));
    known.or_else(|| is_json(start).then_some(JSON)).or_else(|| is_toml(start).then_some(TOML)).or_else(
        || {
            (start.bytes.first() == Some(&CRAZYFLIE)).then_some((
                "a log of Crazyflie's micro-SD deck",
                "write it as CSV with `cfusdlog.py` of the Crazyflie firmware",
            ))
        },
    )
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
        let matlab = |kind: [u8; 4], order: fn(u32) -> [u8; 4]| {
            let numbers = [500_u32, 3, 0, 5].map(order);
            [&kind[..], &numbers.concat(), b"data\0", &[0; 64]].concat()
        };
        let of_version_4 = Some("a MATLAB file of version 4");
        assert_eq!(what(&matlab([0; 4], u32::to_le_bytes)), of_version_4);
        assert_eq!(what(&matlab(1010_u32.to_be_bytes(), u32::to_be_bytes)), of_version_4);
        assert_eq!(what(&matlab([7, 7, 7, 7], u32::to_le_bytes)), None);
        assert_eq!(what(&[0; 64]), None);
        for json in [&b"{\"rpm\":0,\"t\":1.7}\n{\"rpm\":1,\"t\":1.8}\n"[..], b"\xef\xbb\xbf\n {\n\"t\": []}"]
        {
            assert!(what(json).is_some_and(|it| it.starts_with("JSON")));
        }
        assert_eq!(what(b"# a remark\n"), None);
        assert_eq!(what(b"time_s,a\n"), None);
        assert_eq!(what(b""), None);
    }
}
