use std::path::Path;

use super::encoding::{differences, hybrid, split_streams};
use super::number::Physical;
use super::*;

/// A description in Thrift's compact protocol.
#[derive(Default)]
struct Written(Vec<u8>);

impl Written {
    fn varint(mut self, mut number: u64) -> Self {
        while number > 0x7f {
            self.0.push(number as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
        self
    }

    /// Each field with its whole number: writers mostly give the step from the one before.
    fn head(mut self, number: u64, kind: u8) -> Self {
        self.0.push(kind);
        self.varint(2 * number)
    }

    fn integer(self, number: u64, value: u64) -> Self {
        self.head(number, 6).varint(2 * value)
    }

    fn text(self, number: u64, text: &str) -> Self {
        let mut done = self.head(number, 8).varint(text.len() as u64);
        done.0.extend(text.as_bytes());
        done
    }

    fn list(self, number: u64, elements: &[Self]) -> Self {
        let mut done = self.head(number, 9);
        done.0.push(0xf0 | 12);
        let mut done = done.varint(elements.len() as u64);
        elements.iter().for_each(|element| done.0.extend(&element.0));
        done
    }

    fn structure(self, number: u64, inner: Self) -> Self {
        let mut done = self.head(number, 12);
        done.0.extend(inner.0);
        done
    }

    fn end(mut self) -> Self {
        self.0.push(0);
        self
    }
}

/// A column of a file: name, physical type, whether values may be missing, and its pages.
struct Col {
    name: &'static str,
    physical: u64,
    optional: bool,
    pages: Vec<u8>,
}

/// A page, with what stands before it.
fn page(kind: u64, values: u64, encoding: u64, body: &[u8]) -> Vec<u8> {
    let (number, inner) = if kind == 2 {
        (7, Written::default().integer(1, values).integer(2, 0).end())
    } else {
        (5, Written::default().integer(1, values).integer(2, encoding).integer(3, 3).integer(4, 3).end())
    };
    let size = body.len() as u64;
    let header = Written::default().integer(1, kind).integer(2, size).integer(3, size);
    let mut page = header.structure(number, inner).end().0;
    page.extend(body);
    page
}

/// A file of one group of rows.
fn file(columns: &[Col], rows: u64) -> Vec<u8> {
    let mut bytes = b"PAR1".to_vec();
    let mut schema = vec![Written::default().text(4, "schema").integer(5, columns.len() as u64).end()];
    let mut chunks = Vec::new();
    for column in columns {
        let element = Written::default().integer(1, column.physical).integer(3, u64::from(column.optional));
        schema.push(element.text(4, column.name).end());
        let place = Written::default()
            .integer(4, 0)
            .integer(7, column.pages.len() as u64)
            .integer(9, bytes.len() as u64);
        chunks.push(Written::default().integer(2, 0).structure(3, place.end()).end());
        bytes.extend(&column.pages);
    }
    let group = Written::default().list(1, &chunks).integer(3, rows).end();
    let description =
        Written::default().integer(1, 1).list(2, &schema).integer(3, rows).list(4, &[group]).end().0;
    bytes.extend(&description);
    bytes.extend((description.len() as u32).to_le_bytes());
    bytes.extend(b"PAR1");
    bytes
}

fn doubles(values: &[f64]) -> Vec<u8> {
    page(0, values.len() as u64, 0, &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())
}

/// Time, a rate from a dictionary with the second value missing, and a text.
fn columns() -> Vec<Col> {
    let dictionary: Vec<u8> = [7_i32, -9].into_iter().flat_map(i32::to_le_bytes).collect();
    // Levels 1 0 1 1 as bits, then places 1 0 0: the first packed, in a group of eight, the rest as a run.
    let levels = [2, 0, 0, 0, 0b11, 0b1101];
    let places = [1, 0b11, 0b001];
    let mut rate = page(2, 2, 0, &dictionary);
    rate.extend(page(0, 4, 8, &[&levels[..], &places[..]].concat()));
    vec![
        Col { name: "time_s", physical: 5, optional: false, pages: doubles(&[0.0, 0.25, 0.5, 0.75]) },
        Col { name: "rate", physical: 1, optional: true, pages: rate },
        Col { name: "phase", physical: 6, optional: false, pages: Vec::new() },
    ]
}

fn read(bytes: &[u8]) -> Result<Tables, FormatError> {
    Parquet.read(&ReadRequest { path: Path::new("a.parquet"), bytes, part: None, wants: &|_, _| true })
}

fn codes(tables: &Tables) -> Vec<(&str, &str)> {
    tables.skipped.iter().map(|it| (it.code, it.subject.as_str())).collect()
}

#[test]
fn columns_of_numbers_are_a_table() {
    let tables = read(&file(&columns(), 4)).expect("a good file");
    let [table] = &tables.tables[..] else { panic!("one table: {tables:?}") };
    assert_eq!((table.name.as_str(), &table.time[..]), ("", &[0.0, 0.25, 0.5, 0.75][..]));
    assert_eq!(table.columns.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["time_s", "rate"]);
    let rate = &table.columns[1].values;
    assert!(rate[1].is_nan());
    assert_eq!((rate[0], rate[2], rate[3]), (-9.0, 7.0, 7.0));
    assert_eq!(codes(&tables), [("not_a_number", "phase")]);
}

#[test]
fn only_what_is_wanted_is_read() {
    let mut columns = columns();
    // Nobody looks at what is not wanted.
    columns[1].pages = vec![0xff; 9];
    let wants = |_: &str, column: &str| column == "time_s";
    let request =
        ReadRequest { path: Path::new("a.parquet"), bytes: &file(&columns, 4), part: None, wants: &wants };
    let tables = Parquet.read(&request).expect("a good column");
    assert_eq!((tables.tables[0].columns.len(), tables.skipped.len()), (1, 0));
}

#[test]
fn a_damaged_column_has_no_values() {
    let mut columns = columns();
    columns[1].pages = vec![0xff; 9];
    let tables = read(&file(&columns, 4)).expect("the other column is good");
    assert!(tables.tables[0].columns[1].values.iter().all(|value| value.is_nan()));
    assert_eq!(tables.tables[0].columns[1].values.len(), 4);
    assert_eq!(codes(&tables), [("not_a_number", "phase"), ("damaged_column", "rate")]);
}

#[test]
fn what_cannot_be_read_says_why() {
    let error = |bytes: &[u8]| read(bytes).expect_err("cannot be read").to_string();
    let bytes = file(&columns(), 4);
    let cut = &bytes[..bytes.len() - 1];
    assert_eq!(
        error(cut),
        format!(
            "a.parquet, byte {}: no Parquet log: its end is missing, where its columns are described",
            cut.len()
        )
    );
    // The file says how many rows it has, and has none of them.
    let huge = error(&file(&columns(), 1 << 40));
    assert!(huge.contains("1099511627776 rows of 2 columns"), "{huge}");
    let more = error(&file(&columns(), 5));
    assert!(more.contains("no rows of numbers"), "{more}");
    assert!(error(b"PARE").contains("encrypted"));
}

fn number(physical: Physical) -> NumberConversion {
    NumberConversion { physical, length: 0, scale: 0, per_second: None, is_unsigned: false, is_half: false }
}

/// The examples of the format's own description.
#[test]
fn encodings_read_as_the_format_describes_them() {
    let mut values = Vec::new();
    differences(&[8, 1, 5, 2, 2, 0], &number(Physical::I32), 5, &mut values).expect("example 1");
    assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 5.0]);
    values.clear();
    differences(&[8, 1, 8, 14, 3, 2, 0b1100_0000, 0b0011_1111], &number(Physical::I64), 8, &mut values)
        .expect("example 2");
    assert_eq!(values, [7.0, 5.0, 3.0, 1.0, 2.0, 3.0, 4.0, 5.0]);

    let mut packed = Vec::new();
    let each = |value, times| {
        packed.extend(std::iter::repeat_n(value, times));
        Some(())
    };
    hybrid(&[0b11, 0b1000_1000, 0b1100_0110, 0b1111_1010, 6, 5], 3, 11, each).expect("packed, then a run");
    assert_eq!(packed, [0, 1, 2, 3, 4, 5, 6, 7, 5, 5, 5]);

    values.clear();
    let split = [0xaa, 0x00, 0xa3, 0xbb, 0x11, 0xb4, 0xcc, 0x22, 0xc5, 0xdd, 0x33, 0xd6];
    split_streams(&split, &number(Physical::F32), 3, &mut values).expect("three floats");
    let floats = [[0xaa, 0xbb, 0xcc, 0xdd], [0x00, 0x11, 0x22, 0x33], [0xa3, 0xb4, 0xc5, 0xd6]];
    assert_eq!(values, floats.map(|bytes| f64::from(f32::from_le_bytes(bytes))));
}

#[test]
fn values_become_numbers() {
    let half = NumberConversion::half();
    let halves = [0x3c00_u16, 0xc000, 0x7bff, 0x0001, 0xfc00];
    let expected = [1.0, -2.0, 65504.0, 2_f64.powi(-24), f64::NEG_INFINITY];
    assert_eq!(halves.map(|bits| half.value(&bits.to_le_bytes())), expected);
    let decimal = NumberConversion { length: 3, scale: 2, ..number(Physical::Bytes) };
    assert_eq!(decimal.value(&[0xff, 0xff, 0x85]), -1.23);
    let stamp = NumberConversion { per_second: Some(1_000_000_000), ..number(Physical::I64) };
    assert_eq!(stamp.value(&1_700_000_000_250_000_000_i64.to_le_bytes()), 1_700_000_000.25);
    let unsigned = NumberConversion { is_unsigned: true, ..number(Physical::I32) };
    assert_eq!(unsigned.value(&(-1_i32).to_le_bytes()), 4_294_967_295.0);
}

#[test]
fn blocks_of_lz4_copy_from_themselves() {
    // One letter, ten more from one place before, and a last one.
    let block = [0x16, b'a', 1, 0, 0x10, b'b'];
    assert_eq!(compression::expand(7, &block, 12).as_deref(), Some(&b"aaaaaaaaaaab"[..]));
    assert_eq!(compression::expand(7, &block, 11), None);
    assert_eq!(compression::expand(7, &[0x16, b'a', 2, 0], 11), None, "before the first");
}
