use std::path::Path;

use super::*;

/// Bytes of a log, written by rules of their own.
#[derive(Clone)]
struct Log(Vec<u8>);

/// Letters, filled up with zeros.
fn letters(text: &str, size: usize) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(size, 0);
    bytes
}

impl Log {
    /// A log that has described how it describes messages: their fields, units and multipliers.
    fn new() -> Self {
        let mut log = Self(Vec::new());
        log.describe(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
        log.describe(1, 44, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds");
        log.describe(2, 76, "UNIT", "QbZ", "TimeUS,Id,Label");
        log.describe(3, 20, "MULT", "Qbd", "TimeUS,Id,Mult");
        log.describe(4, 31, "PARM", "QNf", "TimeUS,Name,Value");
        for (id, label) in
            [(b's', "s"), (b'q', "rpm"), (b'v', "V"), (b'#', "instance"), (b'-', ""), (b'Y', "us")]
        {
            log.message(2, &[&0_u64.to_le_bytes(), &[id], &letters(label, 64)]);
        }
        for (id, number) in [(b'-', 0.0), (b'F', 1e-6), (b'B', f64::from(0.01_f32)), (b'0', 1.0)] {
            log.message(3, &[&0_u64.to_le_bytes(), &[id], &f64::to_le_bytes(number)]);
        }
        log
    }

    fn message(&mut self, kind: u8, fields: &[&[u8]]) -> &mut Self {
        self.0.extend([0xa3, 0x95, kind]);
        fields.iter().for_each(|field| self.0.extend_from_slice(field));
        self
    }

    fn describe(&mut self, kind: u8, length: u8, name: &str, format: &str, columns: &str) {
        self.message(
            0x80,
            &[&[kind, length], &letters(name, 4), &letters(format, 16), &letters(columns, 64)],
        );
    }

    fn units(&mut self, kind: u8, units: &str, multipliers: &str) {
        self.message(1, &[&0_u64.to_le_bytes(), &[kind], &letters(units, 16), &letters(multipliers, 16)]);
    }

    fn parameter(&mut self, name: &str, value: f32) {
        self.message(4, &[&0_u64.to_le_bytes(), &letters(name, 16), &value.to_le_bytes()]);
    }

    /// What an ESC reports: rates, and volts in hundredths.
    fn esc(&mut self, time: u64, esc: u8, rate: f32, volts: i16, millivolts: u16) -> &mut Self {
        self.message(
            9,
            &[
                &time.to_le_bytes(),
                &[esc],
                &rate.to_le_bytes(),
                &volts.to_le_bytes(),
                &millivolts.to_le_bytes(),
            ],
        )
    }

    /// A log of two ESCs and their outputs.
    fn of_escs() -> Self {
        let mut log = Self::new();
        log.describe(9, 20, "ESC", "QBfcH", "TimeUS,Instance,RPM,Volt,Low");
        log.units(9, "s#qvv", "F-0BB");
        log.describe(10, 15, "RCOU", "QHH", "TimeUS,C1,C2");
        log.units(10, "sYY", "F--");
        log.parameter("SERVO1_FUNCTION", 34.0);
        log.parameter("SERVO2_FUNCTION", 33.0);
        log
    }

    fn read(&self) -> Result<Tables, FormatError> {
        let wants = |_: &str, _: &str| true;
        DataFlash.read(&ReadRequest {
            path: Path::new("00000001.BIN"),
            bytes: &self.0,
            part: None,
            wants: &wants,
        })
    }
}

fn table<'a>(tables: &'a Tables, name: &str) -> &'a Table {
    tables.tables.iter().find(|it| it.name == name).unwrap_or_else(|| panic!("no {name}"))
}

fn column<'a>(tables: &'a Tables, name: &str, column: &str) -> (&'a [f64], Option<&'static str>) {
    let column = table(tables, name).columns.iter().find(|it| it.name == column).expect("the column");
    (&column.values, column.unit)
}

#[test]
fn messages_become_rows_in_units() {
    let mut log = Log::of_escs();
    let tables = log
        .esc(1_000_000, 0, 3_000.5, 1_612, 1_599)
        .esc(1_100_000, 1, -1.0, 0, 7)
        .esc(1_200_000, 0, 0.0, -1, 0)
        .read();
    let tables = tables.expect("a log");
    assert_eq!(table(&tables, "ESC[0]").time, [1.0, 1.2]);
    assert_eq!(table(&tables, "ESC[1]").time, [1.1]);
    assert_eq!(column(&tables, "ESC[0]", "RPM"), (&[3_000.5, 0.0][..], Some("rpm")));
    // Divided once, though both the letter of the format and the multiplier say hundredths.
    assert_eq!(column(&tables, "ESC[0]", "Volt"), (&[16.12, -0.01][..], Some("V")));
    assert_eq!(column(&tables, "ESC[0]", "Low"), (&[15.99, 0.0][..], Some("V")));
    assert!(tables.skipped.is_empty(), "{:?}", tables.skipped);
}

#[test]
fn motors_have_their_own_order() {
    let mut log = Log::of_escs();
    let pulses = |first: u16, second: u16| [first.to_le_bytes(), second.to_le_bytes()].concat();
    log.esc(1_000_000, 0, 3_000.5, 0, 0).message(10, &[&1_000_000_u64.to_le_bytes(), &pulses(1_250, 2_000)]);
    let tables = log.read().expect("a log");
    // Output 1 drives motor 2.
    assert_eq!(column(&tables, "RCOU", "C1"), (&[1_250.0][..], Some("us")));
    assert_eq!(column(&tables, "RCOU", "motor[0]"), (&[1.0][..], Some("-")));
    assert_eq!(column(&tables, "RCOU", "motor[1]"), (&[0.25][..], Some("-")));
    assert_eq!(column(&tables, "motor[1]", "RPM").0, [3_000.5]);
    assert!(!tables.tables.iter().any(|it| it.name == "motor[0]"), "its ESC reports nothing");
}

#[test]
fn damage_costs_the_messages_it_touches() {
    let mut log = Log::of_escs();
    log.esc(1_000_000, 0, 1.0, 0, 0)
        .esc(2_000_000, 0, 2.0, 0, 0)
        .esc(3_000_000, 0, 3.0, 0, 0)
        .esc(4_000_000, 0, 4.0, 0, 0);
    let length = log.0.len();
    // The head of the second is broken, and looks like one in the middle of its numbers.
    log.0[length - 60] = 0;
    log.0[length - 50..length - 47].copy_from_slice(&[0xa3, 0x95, 9]);
    log.0.extend([0; 300]);
    let tables = log.read().expect("a log");
    assert_eq!(column(&tables, "ESC[0]", "RPM").0, [1.0, 3.0, 4.0]);
    let damaged = &tables.skipped[0];
    assert_eq!(
        (damaged.code, damaged.count, damaged.first_byte),
        ("damaged_bytes", 20, (length - 60) as u64)
    );
    // What breaks off is left out.
    log.0.truncate(length - 1);
    assert_eq!(column(&log.read().expect("a log"), "ESC[0]", "RPM").0, [1.0, 3.0]);
}

#[test]
fn the_first_description_of_a_message_holds() {
    let mut log = Log::of_escs();
    log.esc(1_000_000, 0, 1.0, 0, 0);
    log.describe(9, 20, "ESC", "QBfcH", "TimeUS,Instance,RPN,Volt,Low");
    log.describe(11, 99, "ODD", "QB", "TimeUS,X");
    let tables = log.esc(2_000_000, 0, 2.0, 0, 0).read().expect("a log");
    assert_eq!(column(&tables, "ESC[0]", "RPM").0, [1.0, 2.0]);
    assert_eq!((tables.skipped[0].code, tables.skipped[0].count), ("damaged_format", 2));
}

#[test]
fn a_message_without_time_and_a_log_without_messages() {
    let mut log = Log::new();
    assert_eq!(
        Log(log.0[..89].to_vec()).read().expect_err("nothing").to_string(),
        "00000001.BIN, byte 0: no ArduPilot DataFlash log: no message can be read that has numbers and a time"
    );
    log.describe(9, 8, "OLD", "fB", "X,Y");
    let tables = log.message(9, &[&1_f32.to_le_bytes(), &[1]]).read().expect("units have a time");
    assert_eq!((tables.skipped[0].code, tables.skipped[0].subject.as_str()), ("no_time", "OLD"));
    let request = ReadRequest { path: Path::new("1.BIN"), bytes: &log.0, part: Some(2), wants: &|_, _| true };
    let error = DataFlash.read(&request).expect_err("one log only").to_string();
    assert_eq!(error, "1.BIN: there is no part 2; the file holds 1");
}

#[test]
fn only_what_is_wanted_is_kept() {
    let mut log = Log::of_escs();
    log.esc(1_000_000, 0, 1.0, 0, 0);
    let wants = |table: &str, name: &str| table == "motor[1]" && name == "RPM";
    let request = ReadRequest { path: Path::new("1.BIN"), bytes: &log.0, part: Some(1), wants: &wants };
    let tables = DataFlash.read(&request).expect("a log").tables;
    assert_eq!((tables.len(), tables[0].columns.len()), (1, 1));
}

#[test]
fn a_log_is_recognised() {
    let start = |bytes: &[u8]| DataFlash.recognises(&Start { bytes, path: Path::new("1.BIN") });
    assert!(start(&Log::new().0));
    assert!(!start(&[0xa3, 0x95, 9]));
}
