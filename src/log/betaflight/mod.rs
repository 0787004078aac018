//! Blackbox logs of Betaflight and its relatives (Cleanflight, INAV, Rotorflight, ...). Each flight of a file begins with a
//! header of text that names every field of its frames and how it is packed and predicted; nothing here knows a firmware's
//! list of fields. Main frames are the table without a name; `slow` and `gps` have clocks of their own.
//!
//! Source: the firmware's writer, `src/main/blackbox/` of Betaflight and INAV.

mod bits;
mod frames;
mod header;
mod interval;
mod scale;

use super::format::{FormatError, LogFormat, ReadRequest, Start};
use super::tables::{Column, Table, Tables};
use super::thresholds::THRESHOLDS;
use frames::{FrameReader, FrameSink};
use header::{FlightHeader, FrameFields, MARKER};
use scale::Scale;

/// Lines of the header that a reader of the answer may need.
const ABOUT: &[&str] = &[
    "Firmware type",
    "Firmware revision",
    "Firmware date",
    "Board information",
    "Craft name",
    "Log start datetime",
    "looptime",
    "motorOutput",
    "motor_poles",
];

/// The format.
#[derive(Debug, Clone, Copy)]
pub struct Betaflight;

const NAME: &str = "Betaflight blackbox";

impl LogFormat for Betaflight {
    fn name(&self) -> &'static str {
        NAME
    }

    fn recognises(&self, start: &Start) -> bool {
        // Dumps of a flash chip may begin with the end of a flight that is overwritten.
        !flights(start.bytes).is_empty()
    }

    fn mapping(&self) -> Option<&'static str> {
        Some(include_str!("../mappings/betaflight.toml"))
    }

    fn read(&self, request: &ReadRequest) -> Result<Tables, FormatError> {
        let starts = flights(request.bytes);
        let count = starts.len();
        let damaged = |byte: usize, reason: String| FormatError::Damaged {
            path: request.path.to_owned(),
            format: NAME,
            byte: byte as u64,
            reason,
        };
        let part = match request.part {
            Some(part) => part,
            None if count == 1 => 1,
            None => only_flight(request, &starts).map_err(|lengths| {
                if lengths.iter().any(|length| *length > 0.0) {
                    FormatError::Parts { path: request.path.to_owned(), lengths }
                } else {
                    damaged(0, format!("none of its {count} flights has frames that can be read"))
                }
            })?,
        };
        let start = part.checked_sub(1).and_then(|index| starts.get(index).copied());
        let start =
            start.ok_or_else(|| FormatError::Part { path: request.path.to_owned(), part, parts: count })?;
        let bytes = flight(request.bytes, &starts, part - 1);
        let header = FlightHeader::parse(bytes).map_err(|reason| damaged(start, reason))?;
        let mut reader = Reader::new(&header, start, bytes.len(), request.wants);
        let read = FrameReader::new(&header, bytes).read(&mut reader);
        read.map_err(|reason| damaged(start + header.length, reason))?;
        let mut tables = reader.tables();
        if tables.tables.first().is_none_or(|main| main.time.is_empty()) {
            return Err(damaged(start + header.length, "no frame can be read".to_owned()));
        }
        tables.part = Some((part, count));
        Ok(tables)
    }
}

/// Where the headers of the flights begin.
fn flights(bytes: &[u8]) -> Vec<usize> {
    let mut starts = Vec::new();
    let mut at = 0;
    while let Some(rest) = bytes.get(at..) {
        let Some(next) = rest.iter().position(|byte| *byte == b'H') else { break };
        at += next;
        if bytes.get(at..).is_some_and(|rest| rest.starts_with(MARKER)) {
            starts.push(at);
        }
        at += 1;
    }
    starts
}

/// The bytes of one of the flights that begin at `starts`.
fn flight<'a>(bytes: &'a [u8], starts: &[usize], index: usize) -> &'a [u8] {
    let start = starts.get(index).copied().unwrap_or(bytes.len());
    let end = starts.get(index + 1).copied().unwrap_or(bytes.len());
    bytes.get(start..end).unwrap_or_default()
}

/// The one flight with frames: others are of motors that were armed and never ran. Else how long each is [s].
fn only_flight(request: &ReadRequest, starts: &[usize]) -> Result<usize, Vec<f64>> {
    let length = |index: usize| {
        let bytes = flight(request.bytes, starts, index);
        let mut span = Span::default();
        if let Ok(header) = FlightHeader::parse(bytes) {
            // A flight that ends early is as long as what can be read.
            let _ = FrameReader::new(&header, bytes).read(&mut span);
        }
        span.seconds()
    };
    let lengths: Vec<f64> = (0..starts.len()).map(length).collect();
    let mut flown = lengths.iter().enumerate().filter(|(_, length)| **length > 0.0);
    match (flown.next(), flown.next()) {
        (Some((index, _)), None) => Ok(index + 1),
        _ => Err(lengths),
    }
}

/// The first and the last time of a flight.
#[derive(Default)]
struct Span(Option<(i64, i64)>);

impl Span {
    /// [s]
    fn seconds(&self) -> f64 {
        self.0.map_or(0.0, |(first, last)| seconds(last.saturating_sub(first)).max(0.0))
    }
}

impl FrameSink for Span {
    fn main(&mut self, microseconds: i64, _: &[i32]) -> Result<(), String> {
        self.0 = Some((self.0.map_or(microseconds, |(first, _)| first), microseconds));
        Ok(())
    }

    fn slow(&mut self, _: &[i32]) -> Result<(), String> {
        Ok(())
    }

    fn gps(&mut self, _: Option<i64>, _: &[Option<i32>]) -> Result<(), String> {
        Ok(())
    }

    fn skip(&mut self, _: &'static str, _: &str, _: usize) {}
}

/// [s] from [µs].
fn seconds(microseconds: i64) -> f64 {
    microseconds as f64 / 1e6
}

/// A column being filled: where its number is in a frame.
struct Taken {
    place: usize,
    signed: bool,
    scale: Scale,
    column: Column,
}

impl Taken {
    fn push(&mut self, number: Option<i32>) {
        let wide =
            |number: i32| if self.signed { f64::from(number) } else { f64::from(number.cast_unsigned()) };
        self.column.values.push(number.map_or(f64::NAN, |number| self.scale.value(wide(number))));
    }
}

/// A table being filled.
#[derive(Default)]
struct Filling {
    time: Vec<f64>,
    taken: Vec<Taken>,
}

impl Filling {
    fn push(&mut self, time: f64, number: impl Fn(usize) -> Option<i32>) {
        self.time.push(time);
        for taken in &mut self.taken {
            taken.push(number(taken.place));
        }
    }

    fn numbers(&self) -> usize {
        self.time.len().saturating_mul(self.taken.len() + 1)
    }
}

/// Takes what is wanted of the frames.
struct Reader {
    main: Filling,
    slow: Filling,
    gps: Filling,
    tables: Tables,
    /// Where the flight begins in the file.
    start: usize,
    most_numbers: usize,
}

impl Reader {
    fn new(header: &FlightHeader, start: usize, length: usize, wants: &dyn Fn(&str, &str) -> bool) -> Self {
        let mut reader = Self {
            main: Filling::default(),
            slow: Filling::default(),
            gps: Filling::default(),
            tables: Tables::default(),
            start,
            most_numbers: length.saturating_mul(THRESHOLDS.blackbox_numbers),
        };
        for line in &header.damaged_lines {
            reader.skip("damaged_header_line", "", *line);
        }
        reader.main = reader.filling("", Some(&header.intra), wants, |name| scale::of_field(header, name));
        reader.slow = reader.filling("slow", header.slow.as_ref(), wants, |_| Some(Scale::RAW));
        reader.gps = reader.filling("gps", header.gps.as_ref(), wants, |_| Some(Scale::RAW));
        for key in ABOUT {
            if let Some(text) = header.text(key).filter(|text| !text.is_empty()) {
                reader.tables.about.push(((*key).to_owned(), text.to_owned()));
            }
        }
        reader
    }

    /// An empty table with the wanted columns of these fields. Those whose scale is not known are left out.
    fn filling(
        &mut self,
        table: &str,
        fields: Option<&FrameFields>,
        wants: &dyn Fn(&str, &str) -> bool,
        scale: impl Fn(&str) -> Option<Scale>,
    ) -> Filling {
        let mut filling = Filling::default();
        let Some(fields) = fields else { return filling };
        for (place, name) in fields.names.iter().enumerate() {
            if name == "time" || !wants(table, name) {
                continue;
            }
            let lost = fields.lost.get(place).copied().unwrap_or(false);
            let Some(scale) = scale(name).filter(|_| !lost) else {
                self.skip("no_scale_in_header", name, 0);
                continue;
            };
            let signed = fields.signed.get(place).copied().unwrap_or(true);
            let column = Column { name: name.clone(), unit: scale.unit, values: Vec::new() };
            filling.taken.push(Taken { place, signed, scale, column });
        }
        filling
    }

    /// Whether the file is still larger than what is made of it.
    fn check_size(&self) -> Result<(), String> {
        let numbers = self.main.numbers() + self.slow.numbers() + self.gps.numbers();
        if numbers > self.most_numbers {
            return Err(format!("its frames hold more than {} numbers a byte", THRESHOLDS.blackbox_numbers));
        }
        Ok(())
    }

    fn tables(mut self) -> Tables {
        // What came before the first main frame is as old as it.
        let first = self.main.time.first().copied().unwrap_or(f64::NAN);
        for (name, filling) in [("", self.main), ("slow", self.slow), ("gps", self.gps)] {
            if !name.is_empty() && (filling.time.is_empty() || filling.taken.is_empty()) {
                continue;
            }
            let time =
                filling.time.into_iter().map(|time| if time.is_nan() { first } else { time }).collect();
            let columns = filling.taken.into_iter().map(|taken| taken.column).collect();
            self.tables.tables.push(Table { columns, ..Table::new(name, time) });
        }
        self.tables
    }
}

impl FrameSink for Reader {
    fn main(&mut self, microseconds: i64, numbers: &[i32]) -> Result<(), String> {
        self.main.push(seconds(microseconds), |place| numbers.get(place).copied());
        self.check_size()
    }

    fn slow(&mut self, numbers: &[i32]) -> Result<(), String> {
        let last = self.main.time.last().copied().unwrap_or(f64::NAN);
        self.slow.push(last, |place| numbers.get(place).copied());
        self.check_size()
    }

    fn gps(&mut self, microseconds: Option<i64>, numbers: &[Option<i32>]) -> Result<(), String> {
        let last = self.main.time.last().copied().unwrap_or(f64::NAN);
        let time = microseconds.filter(|_| !last.is_nan()).map_or(last, seconds);
        self.gps.push(time, |place| numbers.get(place).copied().flatten());
        self.check_size()
    }

    fn skip(&mut self, code: &'static str, subject: &str, at: usize) {
        self.tables.skip(code, subject, (self.start + at) as u64);
    }
}

#[cfg(test)]
mod tests;
