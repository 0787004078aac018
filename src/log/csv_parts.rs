//! A long plain CSV file, read a part at a time: its text need not lie in memory beside its numbers.

use std::fs::File;
use std::io::{self, Read as _};
use std::num::NonZeroUsize;
use std::path::Path;

use sha2::{Digest, Sha256};

use super::csv_blocks;
use super::csv_header::CsvHeader;
use super::limits::LONGEST_FILE;
use super::thresholds::THRESHOLDS;
use crate::threads::{both, limited, most};

/// [bytes] from which on a file is read in parts.
const LONG: u64 = 4 * PART as u64;
/// [bytes] of a part: some blocks for each core.
const PART: usize = 16 << 20;

/// What a file holds.
pub(super) struct Parts {
    pub header: CsvHeader,
    /// SHA-256 of all bytes.
    pub digest: Vec<u8>,
    pub columns: Vec<Vec<f64>>,
}

/// The columns of a long plain file; `None` of any other, which is for the reader that knows what it means, or what is wrong.
pub(super) fn read(path: &Path) -> Option<Parts> {
    let file = std::fs::metadata(path).ok()?.is_file().then(|| File::open(path))?.ok()?;
    let found = file.metadata().ok()?;
    let is_long = found.is_file() && (LONG..=LONGEST_FILE).contains(&found.len());
    // What cannot be read here cannot be read whole either, which says why.
    if is_long { in_parts(file, found.len(), PART).ok().flatten() } else { None }
}

/// Reads `length` bytes or more, `part` of them at a time.
fn in_parts(mut input: impl io::Read + Send, length: u64, part: usize) -> io::Result<Option<Parts>> {
    let mut read = |text: &mut Vec<u8>| input.by_ref().take(part as u64).read_to_end(text);
    let all = NonZeroUsize::new(most());
    // A part, and the next one, which is read meanwhile; the first `carried` bytes are of a line that begins in the part before.
    let (mut text, mut next) = (Vec::new(), Vec::new());
    let (mut fresh, mut carried) = (read(&mut text)?, 0);
    // A header longer than a part is none.
    let Some((header, mut start)) = CsvHeader::of_plain(lines(&text, fresh)) else { return Ok(None) };
    let mut columns = vec![Vec::new(); header.names.len()];
    let mut hash = Sha256::new();
    loop {
        let (whole, rest) = text.split_at(lines(&text, fresh).len());
        next.clear();
        next.extend_from_slice(rest);
        let hash_and_read = || {
            hash.update(&text[carried..]);
            if fresh == 0 { Ok(0) } else { read(&mut next) }
        };
        // That is soon done: all threads take numbers in.
        let body = whole.get(start..).unwrap_or_default();
        let take_in = || limited(all, || csv_blocks::append(body, &mut columns, header.time_at));
        let (read, taken) = both(hash_and_read, take_in);
        if taken.is_none() {
            return Ok(None);
        }
        if start > 0 {
            make_room(&mut columns, length, whole.len());
        }
        if fresh == 0 {
            break;
        }
        (start, carried, fresh) = (0, rest.len(), read?);
        std::mem::swap(&mut text, &mut next);
    }
    columns.iter_mut().for_each(Vec::shrink_to_fit);
    Ok(Some(Parts { header, digest: hash.finalize().to_vec(), columns }))
}

/// What of a text are whole lines. The last one may have no end; any other part goes up to the end of one.
fn lines(text: &[u8], fresh: usize) -> &[u8] {
    let end = if fresh == 0 { text.len() } else { memchr::memrchr(b'\n', text).map_or(0, |end| end + 1) };
    text.get(..end).unwrap_or_default()
}

/// Makes room in columns for as many rows as `length` bytes hold, if all are like the first `read`.
fn make_room(columns: &mut [Vec<f64>], length: u64, read: usize) {
    let times = THRESHOLDS.room * length as f64 / read.max(1) as f64;
    columns.iter_mut().for_each(|column| column.reserve((times * column.len() as f64) as usize));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::csv;

    fn parts(text: &str, part: usize) -> Option<Parts> {
        in_parts(text.as_bytes(), text.len() as u64, part).expect("memory can be read")
    }

    /// Parts that end within lines, at their ends and behind the whole text.
    #[test]
    fn a_file_in_parts_is_the_file_as_a_whole() {
        let rows: String = (0..300).map(|row| format!("{row},{}.25\r\n\n", row * 37 % 100)).collect();
        for text in [format!("\u{feff}time_s, a\r\n{rows}300,1"), format!("time_s, a\n{rows}")] {
            let whole = csv::parse(text.as_bytes(), Path::new("log.csv")).expect("a log");
            for part in [16, 20, 21, 22, 64, 1_000, 100_000] {
                let Parts { header, digest, columns } = parts(&text, part).expect("plain");
                assert_eq!(
                    (&header.names[..], header.time_at),
                    (&["time_s".to_owned(), "a".to_owned()][..], 0)
                );
                assert_eq!(digest, Sha256::digest(&text).to_vec());
                assert_eq!(columns[0], whole.time(), "{part}");
                assert_eq!(columns[1], whole.column("a").expect("there"), "{part}");
            }
        }
    }

    #[test]
    fn what_is_not_plain_is_left_to_the_reader_of_the_whole() {
        for text in ["", "a,b\n0,1\n", "time_s,a\n0,1\n1,x\n", "time_s,\"a\n\"\n0,1\n", "time_s,a\n0,1\n,2\n"]
        {
            assert!(parts(text, 10).is_none(), "{text:?}");
        }
    }

    /// A disk that fails in the middle is no end of the file.
    #[test]
    fn a_file_that_cannot_be_read_on_is_no_log() {
        struct Failing;
        impl io::Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("the disk"))
            }
        }
        let rows: String = (0..300).map(|row| format!("{row},1\n")).collect();
        let text = format!("time_s,a\n{rows}");
        for whole in [0, 100, 1_000] {
            let input = text.as_bytes()[..whole].chain(Failing);
            assert!(in_parts(input, text.len() as u64, 100).is_err(), "{whole}");
        }
    }
}
