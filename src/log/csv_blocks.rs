//! The numbers of a plain CSV text, in blocks of lines on every core.
//!
//! Plain is a text without quotes whose lines end as lines do and whose cells are numbers. Of any other, nothing is read here: the
//! reader that goes row by row knows what it means, or says what is wrong with it and where.

use memchr::{memchr, memchr_iter};

use crate::cancel;
use crate::threads::{spread, spread_out};

/// [bytes] of a block, about: some ten milliseconds of work.
const BLOCK: usize = 4 << 20;

/// The columns of a text behind its header, of which there are `columns`; the cells of column `time` may not be empty. `None`
/// where it is not plain.
pub(super) fn columns(body: &[u8], columns: usize, time: usize) -> Option<Vec<Vec<f64>>> {
    let blocks = blocks(body);
    let rows: Option<Vec<usize>> = spread(&blocks, |block| rows(block)).into_iter().collect();
    let rows = rows?;
    let mut found = vec![vec![0.0; rows.iter().sum()]; columns];
    // Each block gets its own rows of every column.
    let mut left: Vec<&mut [f64]> = found.iter_mut().map(Vec::as_mut_slice).collect();
    let mut parts = Vec::with_capacity(blocks.len());
    for (block, rows) in blocks.iter().zip(&rows) {
        let cut = left.into_iter().filter_map(|column| column.split_at_mut_checked(*rows));
        let (part, rest): (Vec<&mut [f64]>, Vec<&mut [f64]>) = cut.unzip();
        left = rest;
        parts.push((*block, part));
    }
    let done = spread_out(parts, |(block, mut part)| fill(block, &mut part, time));
    done.into_iter().collect::<Option<()>>()?;
    Some(found)
}

/// Whole lines, some megabytes each.
fn blocks(mut body: &[u8]) -> Vec<&[u8]> {
    let mut blocks = Vec::new();
    while !body.is_empty() {
        let about = BLOCK.min(body.len());
        let end = memchr(b'\n', &body[about..]).map_or(body.len(), |line| about + line + 1);
        let (block, rest) = body.split_at(end);
        blocks.push(block);
        body = rest;
    }
    blocks
}

/// The lines of a block, without what ends them.
fn lines(block: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut from = 0;
    let ends = memchr_iter(b'\n', block).chain((block.last() != Some(&b'\n')).then_some(block.len()));
    ends.map(move |end| {
        let line = &block[from..end];
        from = end + 1;
        line.strip_suffix(b"\r").unwrap_or(line)
    })
}

/// How many rows a block holds: lines that are not empty.
fn rows(block: &[u8]) -> Option<usize> {
    cancel::check();
    let is_line_end = |at: usize| block.get(at + 1) == Some(&b'\n');
    let is_plain = memchr(b'"', block).is_none() && memchr_iter(b'\r', block).all(is_line_end);
    is_plain.then(|| lines(block).filter(|line| !line.is_empty()).count())
}

/// Writes the numbers of a block into its rows of each column.
fn fill(block: &[u8], columns: &mut [&mut [f64]], time: usize) -> Option<()> {
    cancel::check();
    for (row, line) in lines(block).filter(|line| !line.is_empty()).enumerate() {
        let mut cells = line.split(|byte| *byte == b',');
        for column in columns.iter_mut() {
            let cell = cells.next().unwrap_or_default();
            let text = std::str::from_utf8(cell.trim_ascii()).ok()?;
            *column.get_mut(row)? = number(text)?;
        }
        let has_time = columns.get(time)?.get(row)?.is_finite();
        if cells.next().is_some() || !has_time {
            return None;
        }
    }
    Some(())
}

/// A cell's number; an empty cell is a missing value. `None` when it is neither.
pub(super) fn number(cell: &str) -> Option<f64> {
    if cell.is_empty() || cell.eq_ignore_ascii_case("nan") {
        return Some(f64::NAN);
    }
    cell.parse().ok().filter(|value: &f64| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_cells_are_those_of_the_text() {
        let found = columns(b"0,1\r\n\r\n1, 2.5 \n\n2\n3,nan", 2, 0).expect("plain");
        assert_eq!(found[0], [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(found[1][..2], [1.0, 2.5]);
        assert!(found[1][2].is_nan() && found[1][3].is_nan());
        assert_eq!(columns(b"", 3, 0).expect("plain"), [const { Vec::<f64>::new() }; 3]);
    }

    #[test]
    fn what_is_not_plain_is_left_alone() {
        for text in ["0,\"1\"\n", "0,1\r1,2\n", "0,x\n", "0,1,2\n", ",1\n", " \n", "0,\u{b5}\n", "0,inf\n"] {
            assert_eq!(columns(text.as_bytes(), 2, 0), None, "{text:?}");
        }
    }

    #[test]
    fn blocks_end_with_lines_and_miss_nothing() {
        let text: String = (0..700_000).map(|row| format!("{row},{}.5\n", row * 7 % 1_000)).collect();
        assert!(blocks(text.as_bytes()).len() > 2);
        let found = columns(text.as_bytes(), 2, 0).expect("plain");
        let expected = (0..700_000).map(|row| (f64::from(row), f64::from(row * 7 % 1_000) + 0.5));
        assert!(found[0].iter().zip(&found[1]).map(|(time, value)| (*time, *value)).eq(expected));
    }
}
