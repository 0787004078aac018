//! The header of a CSV text: the names of its columns, and where its rows begin.

use super::limits::not_names;
use crate::signal::columns;

/// The names of the columns.
#[derive(Debug, Clone)]
pub(super) struct CsvHeader {
    pub names: Vec<String>,
    /// Which of them is time.
    pub time_at: usize,
}

impl CsvHeader {
    /// The header of bytes that begin with a plain line, and where that ends.
    pub(super) fn of_plain(bytes: &[u8]) -> Option<(Self, usize)> {
        let text = without_mark(bytes);
        let body = plain_body(text)?;
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
        let names: Vec<String> = reader.headers().ok()?.iter().map(str::to_owned).collect();
        let time_at = names.iter().position(|name| name == columns::TIME)?;
        let is_table = not_names(names.iter().map(String::as_str)).is_none();
        is_table.then_some((Self { names, time_at }, bytes.len() - body.len()))
    }
}

/// The bytes without the mark of their order, which some write before a text.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes)
}

/// The text behind its header. That is the first line, unless it is empty or goes on behind a quote: then nothing is plain.
pub(super) fn plain_body(text: &[u8]) -> Option<&[u8]> {
    let body = memchr::memchr(b'\n', text).map_or(&[][..], |end| &text[end + 1..]);
    let header = text[..text.len() - body.len()].trim_ascii_end();
    (!header.is_empty() && memchr::memchr2(b'"', b'\r', header).is_none()).then_some(body)
}
