//! The pages in which the values of a column lie.

use std::borrow::Cow;

use super::compression::expand;
use super::encoding::{by_dictionary, differences, hybrid, plain, split_streams, truths_in_runs};
use super::metadata::{Chunk, Leaf};
use super::number::{NumberConversion, Physical};
use super::thrift::Thrift;
use crate::cancel;
use crate::log::bytes::Bytes;

/// Kinds of pages.
const DATA: i64 = 0;
const DICTIONARY: i64 = 2;
const DATA_2: i64 = 3;

/// Encodings.
const PLAIN: i64 = 0;
const PLAIN_DICTIONARY: i64 = 2;
const RUNS: i64 = 3;
const DIFFERENCES: i64 = 5;
const RUNS_DICTIONARY: i64 = 8;
const SPLIT_STREAMS: i64 = 9;

/// What stands before a page.
#[derive(Debug, Clone, Copy, Default)]
struct PageHeader {
    kind: i64,
    expanded: usize,
    compressed: usize,
    /// Values, those that are missing among them.
    values: usize,
    encoding: i64,
    levels_encoding: i64,
    /// [byte] Of the second version: levels, which are not compressed.
    definition_levels: usize,
    repetition_levels: usize,
    is_plain: bool,
}

/// The `rows` values of a column in a chunk; not-a-number where there is none. `None` where it is damaged.
pub(super) fn read(
    bytes: &[u8],
    chunk: &Chunk,
    leaf: &Leaf,
    number: &NumberConversion,
    rows: usize,
) -> Option<Vec<f64>> {
    let mut bytes = Bytes::new(bytes.get(chunk.start..chunk.start.checked_add(chunk.length)?)?);
    let mut dictionary = Vec::new();
    let mut values = Vec::new();
    while values.len() < rows {
        cancel::check();
        let header = header(&mut bytes)?;
        let page = bytes.take(header.compressed)?;
        if header.kind == DICTIONARY {
            let page = expand(chunk.codec, page, header.expanded)?;
            dictionary.clear();
            plain(&page, number, header.values, &mut dictionary)?;
        } else if header.kind == DATA || header.kind == DATA_2 {
            if header.values > rows - values.len() {
                return None;
            }
            data(page, &header, chunk.codec, leaf, number, &dictionary, &mut values)?;
        }
    }
    Some(values)
}

fn header(bytes: &mut Bytes) -> Option<PageHeader> {
    let mut header = PageHeader::default();
    let mut thrift = Thrift::new(bytes.rest());
    thrift.fields(|thrift, field| {
        match field.number {
            1 => header.kind = thrift.integer()?,
            2 => header.expanded = thrift.size()?,
            3 => header.compressed = thrift.size()?,
            // Of a page of data, of a dictionary, of data in the second version.
            5 => values(thrift, &mut header, [1, 2, 3])?,
            7 => values(thrift, &mut header, [1, 0, 0])?,
            8 => values_2(thrift, &mut header)?,
            _ => return Some(false),
        }
        Some(true)
    })?;
    bytes.take(thrift.bytes.at())?;
    Some(header)
}

/// What a page says of its values: their number, encoding and that of their levels, by the numbers of these fields.
fn values(thrift: &mut Thrift, header: &mut PageHeader, numbers: [i16; 3]) -> Option<()> {
    thrift.fields(|thrift, field| {
        match numbers.iter().position(|number| *number == field.number) {
            Some(0) => header.values = thrift.size()?,
            Some(1) => header.encoding = thrift.integer()?,
            Some(2) => header.levels_encoding = thrift.integer()?,
            _ => return Some(false),
        }
        Some(true)
    })
}

/// The same in the second version.
fn values_2(thrift: &mut Thrift, header: &mut PageHeader) -> Option<()> {
    thrift.fields(|thrift, field| {
        match field.number {
            1 => header.values = thrift.size()?,
            4 => header.encoding = thrift.integer()?,
            5 => header.definition_levels = thrift.size()?,
            6 => header.repetition_levels = thrift.size()?,
            7 => header.is_plain = !field.truth()?,
            _ => return Some(false),
        }
        Some(true)
    })
}

fn data(
    page: &[u8],
    header: &PageHeader,
    codec: i64,
    leaf: &Leaf,
    number: &NumberConversion,
    dictionary: &[f64],
    values: &mut Vec<f64>,
) -> Option<()> {
    let width = u32::BITS - leaf.defined.leading_zeros();
    let Expanded { levels, values: bytes } = expanded(page, header, codec, width > 0)?;
    let mut is_there = Vec::new();
    if width > 0 {
        hybrid(&levels, width, header.values, |level, times| {
            is_there.extend(std::iter::repeat_n(level == leaf.defined, times));
            Some(())
        })?;
    }
    let missing = is_there.iter().filter(|it| !**it).count();
    let count = header.values - missing;
    if missing == 0 {
        return encoded(&bytes, header.encoding, number, count, dictionary, values);
    }
    let mut known = Vec::new();
    encoded(&bytes, header.encoding, number, count, dictionary, &mut known)?;
    let mut known = known.into_iter();
    let value = |it: bool| if it { known.next() } else { None };
    values.extend(is_there.into_iter().map(value).map(|value| value.unwrap_or(f64::NAN)));
    Some(())
}

/// A page as it was before compression.
struct Expanded<'a> {
    /// Which values are there.
    levels: Cow<'a, [u8]>,
    values: Cow<'a, [u8]>,
}

fn expanded<'a>(page: &'a [u8], header: &PageHeader, codec: i64, has_levels: bool) -> Option<Expanded<'a>> {
    if header.kind == DATA_2 {
        let mut bytes = Bytes::new(page);
        bytes.take(header.repetition_levels)?;
        let levels = bytes.take(header.definition_levels)?;
        let size = header.expanded.checked_sub(bytes.at())?;
        let values = expand(if header.is_plain { 0 } else { codec }, bytes.rest(), size)?;
        return Some(Expanded { levels: Cow::Borrowed(levels), values });
    }
    let whole = expand(codec, page, header.expanded)?;
    if !has_levels {
        return Some(Expanded { levels: Cow::Borrowed(&[]), values: whole });
    }
    let mut bytes = Bytes::new(&whole);
    let length = usize::try_from(bytes.u32()?).ok().filter(|_| header.levels_encoding == RUNS)?;
    let levels = bytes.take(length)?.to_vec();
    Some(Expanded { levels: Cow::Owned(levels), values: Cow::Owned(bytes.rest().to_vec()) })
}

fn encoded(
    bytes: &[u8],
    encoding: i64,
    number: &NumberConversion,
    count: usize,
    dictionary: &[f64],
    values: &mut Vec<f64>,
) -> Option<()> {
    let is_integer = matches!(number.physical, Physical::I32 | Physical::I64);
    match encoding {
        PLAIN => plain(bytes, number, count, values),
        PLAIN_DICTIONARY | RUNS_DICTIONARY => by_dictionary(bytes, dictionary, count, values),
        RUNS if number.physical == Physical::Truth => truths_in_runs(bytes, count, values),
        DIFFERENCES if is_integer => differences(bytes, number, count, values),
        SPLIT_STREAMS => split_streams(bytes, number, count, values),
        _ => None,
    }
}
