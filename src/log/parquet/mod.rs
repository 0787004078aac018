//! Parquet: columns of plain numbers, as notebooks write them. One table without a name.
//!
//! Its time is the column `time_s`, where there is one; else the mapping says which column it is. Stamps are given in seconds
//! since 1970, truth values as 0 and 1. What is no number, or has several values in a row, is left out.

mod compression;
mod encoding;
mod metadata;
mod number;
mod pages;
#[cfg(test)]
mod tests;
mod thrift;

use super::format::{FormatError, LogFormat, ReadRequest, Start};
use super::limits::MOST_COLUMNS;
use super::tables::{Column, Table, Tables};
use crate::signal::columns;
use metadata::{Leaf, Metadata};
use number::NumberConversion;

/// Apache Parquet.
pub struct Parquet;

/// Column whose values are the table's time.
const TIME: &str = columns::TIME;

/// Bytes behind the description: its length and the format's mark.
const END: usize = 8;

/// Values that are read of one file, 0.8 GB.
const MOST_VALUES: usize = 100_000_000;

impl LogFormat for Parquet {
    fn name(&self) -> &'static str {
        "Parquet"
    }

    fn recognises(&self, start: &Start) -> bool {
        start.bytes.starts_with(b"PAR1") || start.bytes.starts_with(b"PARE")
    }

    fn mapping(&self) -> Option<&'static str> {
        None
    }

    fn read(&self, request: &ReadRequest) -> Result<Tables, FormatError> {
        let unusable = |reason: String| FormatError::Unusable { path: request.path.to_owned(), reason };
        if request.bytes.starts_with(b"PARE") || request.bytes.ends_with(b"PARE") {
            return Err(unusable("is encrypted; write it without".to_owned()));
        }
        if let Some(part) = request.part.filter(|part| *part != 1) {
            return Err(FormatError::Part { path: request.path.to_owned(), part, parts: 1 });
        }
        let damaged = |byte: usize, reason: &str| FormatError::Damaged {
            path: request.path.to_owned(),
            format: self.name(),
            byte: byte as u64,
            reason: reason.to_owned(),
        };
        let (at, description) = description(request.bytes).ok_or_else(|| {
            damaged(request.bytes.len(), "its end is missing, where its columns are described")
        })?;
        let metadata = Metadata::parse(description)
            .ok_or_else(|| damaged(at, "the description of its columns is damaged"))?;
        let mut tables = Tables { about: about(&metadata), ..Tables::default() };
        let leaves = chosen(&metadata, request.wants, &mut tables);
        if let Some(reason) = refused(&metadata, &leaves) {
            return Err(unusable(reason));
        }
        let columns = read_columns(request.bytes, &metadata, &leaves, &mut tables);
        if columns.iter().all(|column| column.is_empty()) {
            return Err(damaged(0, "it has no rows of numbers that could be read"));
        }
        tables.tables.push(table(&leaves, columns, request.wants));
        Ok(tables)
    }
}

/// Where the description of the columns lies.
fn description(bytes: &[u8]) -> Option<(usize, &[u8])> {
    let (rest, end) = bytes.split_last_chunk::<END>()?;
    let (length, mark) = end.split_first_chunk()?;
    let start = rest.len().checked_sub(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    Some((start, rest.get(start..)?)).filter(|_| mark == b"PAR1")
}

fn about(metadata: &Metadata) -> Vec<(String, String)> {
    let writer = Some(&metadata.created_by).filter(|writer| !writer.is_empty());
    writer.map(|writer| ("created_by".to_owned(), writer.chars().take(100).collect())).into_iter().collect()
}

/// A column to be read.
struct Chosen<'a> {
    place: usize,
    leaf: &'a Leaf,
    number: NumberConversion,
}

/// The columns that are wanted, and the time; what cannot be read is counted.
fn chosen<'a>(
    metadata: &'a Metadata,
    wants: &dyn Fn(&str, &str) -> bool,
    tables: &mut Tables,
) -> Vec<Chosen<'a>> {
    let mut chosen = Vec::new();
    for (place, leaf) in metadata.leaves.iter().enumerate() {
        if !wants("", &leaf.name) && leaf.name != TIME {
            continue;
        }
        let first =
            metadata.groups.first().and_then(|group| group.chunks.get(place)).map_or(0, |chunk| chunk.start);
        match leaf.number {
            _ if leaf.is_repeated => tables.skip("several_values_in_a_row", &leaf.name, first as u64),
            None => tables.skip("not_a_number", &leaf.name, first as u64),
            Some(number) => chosen.push(Chosen { place, leaf, number }),
        }
    }
    chosen
}

/// Why the columns cannot be read, without looking at their values.
fn refused(metadata: &Metadata, leaves: &[Chosen]) -> Option<String> {
    let columns = leaves.len();
    if columns > MOST_COLUMNS {
        return Some(format!("has {columns} columns of numbers; up to {MOST_COLUMNS} can be read"));
    }
    let rows = metadata.groups.iter().try_fold(0_usize, |sum, group| sum.checked_add(group.rows));
    if rows.and_then(|rows| rows.checked_mul(columns)).is_none_or(|values| values > MOST_VALUES) {
        let rows = rows.map_or_else(|| "too many".to_owned(), |rows| rows.to_string());
        return Some(format!(
            "says that it has {rows} rows of {columns} columns; {MOST_VALUES} values can be read at once: choose fewer columns"
        ));
    }
    let chunks = leaves
        .iter()
        .flat_map(|leaf| metadata.groups.iter().filter_map(|group| group.chunks.get(leaf.place)));
    let name = chunks.filter_map(|chunk| compression::unread(chunk.codec)).next()?;
    Some(format!("is compressed with {name}; write it with snappy, zstd, gzip or lz4_raw"))
}

/// The values of the columns, group by group. A damaged column of a group has no values there; a group of which nothing can be
/// read is left out.
fn read_columns(bytes: &[u8], metadata: &Metadata, leaves: &[Chosen], tables: &mut Tables) -> Vec<Vec<f64>> {
    let mut columns: Vec<Vec<f64>> = leaves.iter().map(|_| Vec::new()).collect();
    for group in &metadata.groups {
        let read =
            |it: &Chosen| pages::read(bytes, group.chunks.get(it.place)?, it.leaf, &it.number, group.rows);
        let read: Vec<Option<Vec<f64>>> = leaves.iter().map(read).collect();
        let any = read.iter().any(Option::is_some);
        for ((values, it), column) in read.into_iter().zip(leaves).zip(&mut columns) {
            let start = group.chunks.get(it.place).map_or(0, |chunk| chunk.start) as u64;
            match values {
                Some(values) if column.is_empty() => *column = values,
                Some(values) => column.extend(values),
                None if any => {
                    column.resize(column.len() + group.rows, f64::NAN);
                    tables.skip("damaged_column", &it.leaf.name, start);
                }
                None => tables.skip("damaged_rows", &it.leaf.name, start),
            }
        }
    }
    columns
}

fn table(leaves: &[Chosen], values: Vec<Vec<f64>>, wants: &dyn Fn(&str, &str) -> bool) -> Table {
    let clock = leaves.iter().position(|it| it.leaf.name == TIME);
    let time = clock.and_then(|place| values.get(place).cloned()).unwrap_or_default();
    let wanted = leaves.iter().zip(values).filter(|(it, _)| wants("", &it.leaf.name));
    let column = |(it, values): (&Chosen, Vec<f64>)| Column {
        name: it.leaf.name.clone(),
        unit: it.number.unit(),
        values,
    };
    Table { columns: wanted.map(column).collect(), ..Table::new("", time) }
}
