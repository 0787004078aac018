//! What reading a foreign log came across: what was left out, cut or merged, and where.

use std::collections::BTreeMap;

use serde::Serialize;

use super::narrow_range::NarrowRange;
use super::tables::Skipped;

/// Places shown of each kind of oddity.
const PLACES: usize = 5;

/// How often something happened, and the first lines where.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Occurrences {
    /// How often.
    pub count: usize,
    /// The first lines of the file where it happened.
    pub first_lines: Vec<u64>,
}

impl Occurrences {
    pub(crate) fn add(&mut self, line: u64) {
        self.count += 1;
        if self.first_lines.len() < PLACES {
            self.first_lines.push(line);
        }
    }
}

/// A signal that was read from another column than the first that it may come from.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Instead {
    /// Its name.
    pub signal: String,
    /// The column that was read.
    pub read: String,
    /// The column before it in the mapping, which reads nothing but 0.
    pub dead: String,
}

/// What reading a foreign log came across.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Notes {
    /// The file began with a byte order mark.
    pub byte_order_mark: bool,
    /// Rows under the header, remarks apart.
    pub rows: usize,
    /// Lines that are remarks.
    pub remarks: usize,
    /// The first of them, or its beginning.
    pub first_remark: Option<String>,
    /// Rows with fewer cells than the header.
    pub short_rows: Occurrences,
    /// Rows with more cells than the header; the surplus is not read.
    pub long_rows: Occurrences,
    /// Lines that say the header again, left out.
    pub repeated_header: Occurrences,
    /// Lines behind the last row that have fewer cells than the header, text and no number in them: not read.
    pub text_behind: Occurrences,
    /// The last line has no end: its last cell may have been cut in writing, and is left out.
    pub cut_cell: Occurrences,
    /// Cells of text in columns that are only carried along, by column; they count as missing.
    pub texts: BTreeMap<String, Occurrences>,
    /// Rows left out because they have no time.
    pub without_time: Occurrences,
    /// Rows with the time of the row before: they fill its empty cells.
    pub repeated_time: Occurrences,
    /// Cells left out because the row of the same time has another value there.
    pub conflicting_cells: Occurrences,
    /// Rows left out because their time lies before that of an earlier row.
    pub backward_time: Occurrences,
    /// Cells cut to the mapping's `clamp`, by signal.
    pub clamped: BTreeMap<String, Occurrences>,
    /// Commands whose `clamp` ends before the log does, while the rate goes on.
    pub narrow_ranges: Vec<NarrowRange>,
    /// Cells left out because they are outside the mapping's `valid`, by signal.
    pub invalid: BTreeMap<String, Occurrences>,
    /// Signals of the mapping whose optional column is absent.
    pub absent: Vec<String>,
    /// Signals that were read from another column, for the first one reads nothing but 0.
    pub instead: Vec<Instead>,
    /// Columns of the file that the mapping does not use.
    pub unused_columns: Vec<String>,
    /// Which log of the file was read, and of how many.
    pub part: Option<(usize, usize)>,
    /// Rows left out because the mapping's `where` does not hold.
    pub not_chosen: usize,
    /// [s] the furthest that a value of a slower clock was moved to a row of the fastest.
    pub greatest_shift_s: f64,
    /// Bytes and rows that the format's reader left out.
    pub skipped: Vec<Skipped>,
    /// What the file says of itself.
    pub about: Vec<(String, String)>,
}
