//! DataFlash logs of ArduPilot (`.bin`). A log describes its messages itself: their fields (`FMT`), units and multipliers
//! (`FMTU`, `UNIT`, `MULT`). Each kind of message is a table, `ATT`; where several sensors write one kind, each has its own,
//! `IMU[0]`. Texts are left out.
//!
//! What concerns the motors is there once more in the motors' own order, by the parameters of the log: `RCOU.motor[0]`, the
//! command 0 to 1, and the tables `motor[0]` of what their ESCs report.
//!
//! Source: `libraries/AP_Logger/` of ArduPilot, `LogStructure.h` and README.

mod message;
mod motors;

use std::collections::HashMap;

use super::format::{FormatError, LogFormat, ReadRequest, Start};
use super::tables::{Column, Table, Tables};
use crate::cancel;
use message::{Contents, FORMAT, FieldKind, Format, HEAD, HEAD_LENGTH};
use motors::Motors;

/// The format.
#[derive(Debug, Clone, Copy)]
pub struct DataFlash;

const NAME: &str = "ArduPilot DataFlash";

/// The message that describes the messages that describe messages: the first of every log.
const FIRST: &[u8] = &[HEAD[0], HEAD[1], FORMAT, FORMAT, 89, b'F', b'M', b'T'];

/// Parameters that say what a motor's command is.
const ABOUT: &[&str] =
    &["MOT_PWM_TYPE", "MOT_PWM_MIN", "MOT_PWM_MAX", "SERVO_BLH_POLES", "LOG_BITMASK", "SCHED_LOOP_RATE"];

impl LogFormat for DataFlash {
    fn name(&self) -> &'static str {
        NAME
    }

    fn recognises(&self, start: &Start) -> bool {
        start.bytes.windows(FIRST.len()).any(|bytes| bytes == FIRST)
    }

    fn mapping(&self) -> Option<&'static str> {
        Some(include_str!("../mappings/dataflash.toml"))
    }

    fn read(&self, request: &ReadRequest) -> Result<Tables, FormatError> {
        if let Some(part) = request.part.filter(|part| *part != 1) {
            return Err(FormatError::Part { path: request.path.to_owned(), part, parts: 1 });
        }
        let mut tables = Tables { part: Some((1, 1)), ..Tables::default() };
        // What describes a message may stand behind it.
        let mut contents = Contents::new();
        each_message(request.bytes, |piece, at| match piece {
            Piece::Message(kind, body) => {
                let learnt = contents.learn(kind, body);
                if !learnt {
                    tables.skip("damaged_format", "", at as u64);
                }
                contents.format(kind).map(|format| format.length)
            }
            Piece::Unknown(kind) => contents.format(kind).map(|format| format.length),
            Piece::Damaged => None,
        });
        let mut filling = Filling::new(&contents, request.wants);
        each_message(request.bytes, |piece, at| match piece {
            Piece::Message(kind, body) => {
                let format = contents.format(kind)?;
                filling.take(kind, format, body);
                Some(format.length)
            }
            Piece::Unknown(kind) => contents.format(kind).map(|format| format.length),
            Piece::Damaged => {
                tables.skip("damaged_bytes", "", at as u64);
                None
            }
        });
        for name in filling.without_time {
            tables.skip("no_time", &name, 0);
        }
        tables.tables = filling.tables;
        let texts = contents.texts.iter().map(|text| ("MSG".to_owned(), text.clone()));
        let parameters = ABOUT.iter().filter_map(|name| {
            contents.parameters.get(*name).map(|value| ((*name).to_owned(), value.to_string()))
        });
        tables.about = texts.chain(parameters).collect();
        if tables.tables.iter().all(|table| table.time.is_empty()) {
            return Err(FormatError::Damaged {
                path: request.path.to_owned(),
                format: NAME,
                byte: 0,
                reason: "no message can be read that has numbers and a time".to_owned(),
            });
        }
        Ok(tables)
    }
}

/// What [`each_message`] finds.
enum Piece<'a> {
    /// The head of a message of this type: how long is it?
    Unknown(u8),
    /// A whole message: its type, and the bytes behind its head.
    Message(u8, &'a [u8]),
    /// A byte that belongs to none.
    Damaged,
}

/// Goes through the messages of a log. `visit` gets what stands at a place, and says how long messages of a type are.
fn each_message(bytes: &[u8], mut visit: impl FnMut(Piece, usize) -> Option<usize>) {
    // Chips are written in pages: what is left of the last one is empty.
    let end = bytes.iter().rposition(|byte| *byte != 0 && *byte != 0xff).map_or(0, |last| last + 1);
    let (mut at, mut count, mut lost) = (0, 0_u32, false);
    while at < end {
        count = count.wrapping_add(1);
        if count.is_multiple_of(4_096) {
            cancel::check();
        }
        let rest = bytes.get(at..).unwrap_or_default();
        let length = match rest {
            [first, second, kind, ..] if [*first, *second] == HEAD => visit(Piece::Unknown(*kind), at),
            _ => None,
        };
        // The first message behind damage must be followed by another one: its head may be numbers of a damaged one.
        let followed = |length: usize| {
            let next = rest.get(length..).unwrap_or_default();
            !lost || at + length >= end || next.starts_with(&HEAD)
        };
        let whole = length.filter(|length| followed(*length)).and_then(|length| rest.get(..length));
        match whole.and_then(|message| message.get(HEAD_LENGTH..)).zip(rest.get(2)) {
            Some((body, kind)) => {
                visit(Piece::Message(*kind, body), at);
                at += HEAD_LENGTH + body.len();
                lost = false;
            }
            None => {
                visit(Piece::Damaged, at);
                at += 1;
                lost = true;
            }
        }
    }
}

/// Where a column's numbers come from.
struct Source {
    kind: FieldKind,
    /// Bytes from the first field's.
    at: usize,
    /// Which of several samples.
    index: usize,
    divisor: f64,
    /// Whether it is a pulse that commands a motor.
    command: bool,
}

/// A table being filled.
struct Target {
    /// Which of the tables.
    table: usize,
    /// Where time is, and what its number is divided by to be in seconds.
    time: (FieldKind, usize, f64),
    sources: Vec<Source>,
}

/// Puts messages into tables.
struct Filling<'a> {
    contents: &'a Contents,
    wants: &'a dyn Fn(&str, &str) -> bool,
    motors: Motors,
    tables: Vec<Table>,
    /// By the type of a message and the number of the sensor: what is made of it.
    targets: HashMap<(u8, Option<u8>), Vec<Target>>,
    /// Names of messages that have no time.
    without_time: Vec<String>,
}

impl<'a> Filling<'a> {
    fn new(contents: &'a Contents, wants: &'a dyn Fn(&str, &str) -> bool) -> Self {
        Self {
            contents,
            wants,
            motors: Motors::new(&contents.parameters),
            tables: Vec::new(),
            targets: HashMap::new(),
            without_time: Vec::new(),
        }
    }

    fn take(&mut self, kind: u8, format: &Format, body: &[u8]) {
        let instance = format.instance().and_then(|at| body.get(at)).copied();
        let key = (kind, instance);
        if !self.targets.contains_key(&key) {
            let targets = self.begin(format, instance);
            self.targets.insert(key, targets);
        }
        let number = |kind: FieldKind, at: usize, index: usize| {
            body.get(at..).and_then(|bytes| kind.number(bytes, index)).unwrap_or(f64::NAN)
        };
        for target in self.targets.get(&key).into_iter().flatten() {
            let Some(table) = self.tables.get_mut(target.table) else { continue };
            let (kind, at, divisor) = target.time;
            table.time.push(number(kind, at, 0) / divisor);
            for (source, column) in target.sources.iter().zip(&mut table.columns) {
                let value = number(source.kind, source.at, source.index) / source.divisor;
                column.values.push(if source.command { self.motors.command(value) } else { value });
            }
        }
    }

    /// Begins the tables of a kind of message of one sensor, as far as they are wanted.
    fn begin(&mut self, format: &Format, instance: Option<u8>) -> Vec<Target> {
        let name = match instance {
            Some(instance) => format!("{}[{instance}]", format.name),
            None => format.name.clone(),
        };
        let mut targets: Vec<Target> = self.target(format, &name).into_iter().collect();
        // Before there were instances, each ESC had a message of its own.
        let esc = match format.name.strip_prefix("ESC") {
            Some("") => instance,
            Some(number) if instance.is_none() => {
                number.parse().ok().and_then(|number: u8| number.checked_sub(1))
            }
            _ => None,
        };
        if let Some(motor) = esc.and_then(|esc| self.motors.of_esc(esc)) {
            targets.extend(self.target(format, &format!("motor[{motor}]")));
        }
        targets
    }

    /// Begins one table, where a column of it is wanted.
    fn target(&mut self, format: &Format, name: &str) -> Option<Target> {
        let (mut columns, mut sources) = (Vec::new(), Vec::new());
        let mut add = |name: String, unit, source| {
            columns.push(Column { name, unit, values: Vec::new() });
            sources.push(source);
        };
        let mut time = None;
        for (place, field) in format.fields.iter().enumerate() {
            let (unit, divisor) = self.contents.scale(format, place);
            let at = field.at;
            match field.name.as_str() {
                "TimeUS" => time = Some((field.kind, at, 1e6)),
                "TimeMS" => time = time.or(Some((field.kind, at, 1e3))),
                own if matches!(field.kind, FieldKind::Samples) => {
                    for index in 0..field.kind.length() / 2 {
                        let own = format!("{own}[{index}]");
                        if (self.wants)(name, &own) {
                            add(own, unit, Source { kind: field.kind, at, index, divisor, command: false });
                        }
                    }
                }
                own if !matches!(field.kind, FieldKind::Text(_)) && (self.wants)(name, own) => {
                    let source = Source { kind: field.kind, at, index: 0, divisor, command: false };
                    add(own.to_owned(), unit, source);
                }
                _ => {}
            }
        }
        for (motor, output) in self.motors.commands().filter(|_| name == "RCOU") {
            let field = format.fields.iter().find(|field| field.name == output);
            let own = format!("motor[{motor}]");
            if let Some(field) = field.filter(|_| (self.wants)(name, &own)) {
                let source = Source { kind: field.kind, at: field.at, index: 0, divisor: 1.0, command: true };
                add(own, Some("-"), source);
            }
        }
        if columns.is_empty() {
            return None;
        }
        let Some(time) = time else {
            if !self.without_time.iter().any(|other| other == name) {
                self.without_time.push(name.to_owned());
            }
            return None;
        };
        self.tables.push(Table { columns, ..Table::new(name, Vec::new()) });
        Some(Target { table: self.tables.len() - 1, time, sources })
    }
}

#[cfg(test)]
mod tests;
