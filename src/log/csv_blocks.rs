//! The numbers of a plain CSV text, in blocks of lines on every core.
//!
//! Plain is a text without quotes whose lines end as lines do and whose cells are numbers. Of any other, nothing is read here: the
//! reader that goes row by row knows what it means, or says what is wrong with it and where.

use memchr::{memchr, memchr_iter};

use crate::cancel;
use crate::threads::{spread, spread_out};

/// [bytes] of a block, about: some milliseconds of work, so that no thread waits long for another's last one.
const BLOCK: usize = 1 << 20;

/// The columns of a text behind its header, of which there are `columns`; the cells of column `time` may not be empty. `None`
/// where it is not plain.
pub(super) fn columns(body: &[u8], columns: usize, time: usize) -> Option<Vec<Vec<f64>>> {
    let mut found = vec![Vec::new(); columns];
    append(body, &mut found, time)?;
    Some(found)
}

/// The same, behind what the columns hold already; where it is not plain, what is behind that means nothing.
pub(super) fn append(body: &[u8], columns: &mut [Vec<f64>], time: usize) -> Option<()> {
    let blocks = blocks(body);
    let rows: Option<Vec<usize>> = spread(&blocks, |block| rows(block)).into_iter().collect();
    let rows = rows?;
    let fresh: usize = rows.iter().sum();
    // Each block gets its own rows of every column.
    let with_rows = |column: &mut Vec<f64>| {
        let held = column.len();
        column.resize(held + fresh, 0.0);
        held
    };
    // Memory is laid out when it is first written to, which takes as long as some of the numbers.
    let held = spread_out(columns.iter_mut().collect(), with_rows);
    let mut left: Vec<&mut [f64]> =
        columns.iter_mut().zip(held).filter_map(|(column, held)| column.get_mut(held..)).collect();
    let mut parts = Vec::with_capacity(blocks.len());
    for (block, rows) in blocks.iter().zip(&rows) {
        let cut = left.into_iter().filter_map(|column| column.split_at_mut_checked(*rows));
        let (part, rest): (Vec<&mut [f64]>, Vec<&mut [f64]>) = cut.unzip();
        left = rest;
        parts.push((*block, part));
    }
    let done = spread_out(parts, |(block, mut part)| fill(block, &mut part, time));
    done.into_iter().collect()
}

/// Whole lines, a megabyte each, about.
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
        // What is left of the line; nothing behind its last cell.
        let mut left = Some(line);
        for column in columns.iter_mut() {
            let value = match left {
                Some(cells) => {
                    let (value, length) = decimal(cells).or_else(|| any_number(cells))?;
                    left = cells.get(length + 1..);
                    value
                }
                None => f64::NAN,
            };
            *column.get_mut(row)? = value;
        }
        let has_time = columns.get(time)?.get(row)?.is_finite();
        if left.is_some() || !has_time {
            return None;
        }
    }
    Some(())
}

/// Powers of ten that a number holds exactly.
const TENS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The first cell's number and how long the cell is, where it is a plain decimal of few digits: the quotient of two numbers that are
/// held exactly is the nearest number to it, which is what any reader gives (Clinger 1990).
fn decimal(cells: &[u8]) -> Option<(f64, usize)> {
    let begin = usize::from(cells.first() == Some(&b'-'));
    let (mut at, mut mantissa, mut digits, mut point) = (begin, 0_u64, 0, None);
    while let Some(byte) = cells.get(at).filter(|byte| **byte != b',') {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            // Zeros in front are none.
            digits += usize::from(mantissa > 0);
        } else if *byte == b'.' && point.is_none() {
            point = Some(at);
        } else {
            return None;
        }
        at += 1;
    }
    let length = at - begin - usize::from(point.is_some());
    let behind = point.map_or(0, |point| at - point - 1);
    // No more digits than a mantissa has room for, whatever they are.
    if length == 0 || digits > 19 || mantissa > 1 << f64::MANTISSA_DIGITS {
        return None;
    }
    let value = mantissa as f64 / TENS.get(behind)?;
    Some((if begin == 1 { -value } else { value }, at))
}

/// The same of any cell.
fn any_number(cells: &[u8]) -> Option<(f64, usize)> {
    let length = memchr(b',', cells).unwrap_or(cells.len());
    let text = std::str::from_utf8(cells.get(..length)?.trim_ascii()).ok()?;
    Some((number(text)?, length))
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

    /// To the last digit: short and long ones, the greatest and the smallest, and what is no decimal.
    #[test]
    fn numbers_are_those_that_the_standard_library_reads() {
        let mut texts: Vec<String> = [
            "0",
            "-0",
            "007",
            ".5",
            "5.",
            "-.25",
            "1e3",
            "-2.5E-7",
            "+4",
            "9007199254740993",
            "123456789012345678901",
        ]
        .map(str::to_owned)
        .into();
        let mut seed = 1_u64;
        for digits in 0..2_000 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value =
                f64::from_bits(seed >> 2 | 1 << 61) * if seed.is_multiple_of(3) { -1.0 } else { 1e-3 };
            texts.push(format!("{value}"));
            texts.push(format!("{:.*}", digits % 24, value % 1e6));
            texts.push(format!("{}", (value % 1e6).fract()));
        }
        for text in &texts {
            let expected = text.parse::<f64>().expect("a number").to_bits();
            let found = columns(format!("{text},7\n").as_bytes(), 2, 0).expect("plain");
            assert_eq!((found[0][0].to_bits(), found[1][0]), (expected, 7.0), "{text}");
        }
    }

    #[test]
    fn what_is_not_plain_is_left_alone() {
        for text in [
            "0,\"1\"\n",
            "0,.\n",
            "0,-\n",
            "0,1.2.3\n",
            "0,1\r1,2\n",
            "0,x\n",
            "0,1,2\n",
            ",1\n",
            " \n",
            "0,\u{b5}\n",
            "0,inf\n",
        ] {
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
