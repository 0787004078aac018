use std::path::Path;

use super::*;
use crate::log::Mapping;
use crate::log::tables::Table;

/// A message of a log.
fn message(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = (body.len() as u16).to_le_bytes().to_vec();
    bytes.push(kind);
    bytes.extend_from_slice(body);
    bytes
}

/// A log of these messages.
fn log(messages: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"ULog\x01\x12\x35\x01\0\0\0\0\0\0\0\0".to_vec();
    bytes.extend(messages.concat());
    bytes
}

fn subscribe(id: u16, instance: u8, name: &str) -> Vec<u8> {
    let mut body = vec![instance];
    body.extend(id.to_le_bytes());
    body.extend(name.as_bytes());
    message(b'A', &body)
}

fn row(id: u16, stamp: u64, rest: &[u8]) -> Vec<u8> {
    let mut body = id.to_le_bytes().to_vec();
    body.extend(stamp.to_le_bytes());
    body.extend(rest);
    message(b'D', &body)
}

fn read(bytes: &[u8]) -> Result<Tables, FormatError> {
    Ulog.read(&ReadRequest { path: Path::new("a.ulg"), bytes, part: None, wants: &|_, _| true })
}

fn table<'a>(tables: &'a Tables, name: &str) -> &'a Table {
    tables
        .tables
        .iter()
        .find(|table| table.name == name)
        .unwrap_or_else(|| panic!("no table {name}: {tables:?}"))
}

fn column<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    &table.columns.iter().find(|column| column.name == name).expect(name).values
}

fn skipped(tables: &Tables) -> Vec<(&str, &str, u64)> {
    tables.skipped.iter().map(|it| (it.code, it.subject.as_str(), it.count)).collect()
}

/// Two instances of a battery, one row each every 100 ms.
fn batteries(rows: u64) -> Vec<Vec<u8>> {
    let mut messages = vec![
        message(b'F', b"battery:uint64_t timestamp;float voltage_v;uint8_t[3] cell;uint8_t _padding0;"),
        subscribe(4, 0, "battery"),
        subscribe(9, 1, "battery"),
    ];
    for index in 0..rows {
        for (id, volts) in [(4, 12.5_f32), (9, 7.25)] {
            let rest = [&volts.to_le_bytes()[..], &[1, 2, index as u8]].concat();
            messages.push(row(id, 100_000 * index, &rest));
        }
    }
    messages
}

#[test]
fn topics_are_tables_by_instance() {
    let tables = read(&log(&batteries(3))).expect("a good log");
    assert_eq!(
        tables.tables.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(),
        ["battery", "battery[1]"]
    );
    let second = table(&tables, "battery[1]");
    assert_eq!(second.time, [0.0, 0.1, 0.2]);
    assert_eq!(column(second, "voltage_v"), [7.25; 3]);
    assert_eq!(column(second, "cell[2]"), [0.0, 1.0, 2.0]);
    assert_eq!(second.columns.len(), 4);
    assert!(tables.skipped.is_empty(), "{:?}", tables.skipped);
}

#[test]
fn only_what_is_wanted_is_read() {
    let bytes = log(&batteries(3));
    let wants = |table: &str, column: &str| table == "battery[1]" && column == "voltage_v";
    let request = ReadRequest { path: Path::new("a.ulg"), bytes: &bytes, part: Some(1), wants: &wants };
    let tables = Ulog.read(&request).expect("a good log");
    assert_eq!((tables.tables.len(), tables.tables[0].columns.len()), (1, 1));
    let none = Ulog.read(&ReadRequest { part: Some(2), ..request });
    assert_eq!(none.expect_err("one log").to_string(), "a.ulg: there is no part 2; the file holds 1");
}

/// `esc_status` with three ESCs in which the third is not there. Row `i` is news of ESC `i % 2`, which drives motor `1 - i % 2`.
fn escs() -> Vec<Vec<u8>> {
    let mut messages = vec![
        message(
            b'F',
            b"esc_report:uint64_t timestamp;int32_t esc_rpm;uint8_t actuator_function;uint8_t[3] _padding0;",
        ),
        message(b'F', b"esc_status:uint64_t timestamp;esc_report[3] esc;"),
        subscribe(0, 0, "esc_status"),
    ];
    let mut reports = [[0_u8; 16]; 3];
    for index in 0..4_u8 {
        let esc = usize::from(index % 2);
        let stamp = 1_000_000 * u64::from(index + 1);
        reports[esc][..8].copy_from_slice(&(stamp - 1000).to_le_bytes());
        reports[esc][8..12].copy_from_slice(&(-i32::from(index)).to_le_bytes());
        reports[esc][12] = 102 - index % 2;
        messages.push(row(0, stamp, &reports.concat()));
    }
    messages
}

#[test]
fn each_esc_has_its_own_clock_and_the_name_of_its_motor() {
    let tables = read(&log(&escs())).expect("a good log");
    let first = table(&tables, "esc_status.motor[1]");
    assert_eq!((&first.time[..], column(first, "esc_rpm")), (&[0.999, 2.999][..], &[0.0, -2.0][..]));
    let second = table(&tables, "esc_status.motor[0]");
    assert_eq!((&second.time[..], column(second, "esc_rpm")), (&[1.999, 3.999][..], &[-1.0, -3.0][..]));
    assert_eq!(
        tables.tables.len(),
        2,
        "the topic itself has no other column, and the third ESC is not there"
    );
    assert_eq!(skipped(&tables), [("never_updated", "esc_status.esc[2]", 1)]);
}

#[test]
fn without_stamps_of_their_own_escs_have_the_topics_clock() {
    let definition = message(b'F', b"esc_report:uint64_t timestamp;int32_t esc_rpm;");
    let topic = message(b'F', b"esc_status:uint64_t timestamp;uint8_t count;esc_report[2] esc;");
    let report = |rpm: i32| [&[0; 8][..], &rpm.to_le_bytes()].concat();
    let data = row(0, 5_000_000, &[&[2][..], &report(700), &report(0)].concat());
    let tables = read(&log(&[definition, topic, subscribe(0, 0, "esc_status"), data])).expect("a good log");
    let first = table(&tables, "esc_status.motor[0]");
    assert_eq!((&first.time[..], column(first, "esc_rpm")), (&[5.0][..], &[700.0][..]));
    assert_eq!(skipped(&tables), [("never_updated", "esc_status.motor[1]", 1)]);
}

#[test]
fn the_attitude_has_angles() {
    let definition = message(b'F', b"vehicle_attitude:uint64_t timestamp;float[4] q;");
    // 30 degrees about the forward axis.
    let (sine, cosine) = (15_f32.to_radians().sin(), 15_f32.to_radians().cos());
    let q: Vec<u8> = [cosine, sine, 0.0, 0.0].into_iter().flat_map(f32::to_le_bytes).collect();
    let tables =
        read(&log(&[definition, subscribe(0, 0, "vehicle_attitude"), row(0, 0, &q)])).expect("a good log");
    let attitude = table(&tables, "vehicle_attitude");
    // The quaternion is of single precision.
    assert!((column(attitude, "roll")[0] - 30_f64.to_radians()).abs() < 1e-7);
    assert!(column(attitude, "pitch")[0].abs() < 1e-7 && column(attitude, "yaw")[0].abs() < 1e-7);
    assert_eq!(attitude.columns.last().and_then(|column| column.unit), Some("rad"));
}

#[test]
fn damage_costs_only_what_it_hits() {
    let mut messages = batteries(20);
    messages[10] = vec![0xff; 40];
    let bytes = log(&messages);
    let tables = read(&bytes).expect("most of it is good");
    assert_eq!((table(&tables, "battery").time.len(), table(&tables, "battery[1]").time.len()), (20, 19));
    assert_eq!(skipped(&tables), [("damaged_bytes", "", 1)]);
    // A row that is too short by a byte, between good messages; and a message of a kind that is not there yet.
    let mut messages = batteries(20);
    messages[10] = row(9, 0, &[0; 6]);
    messages[20] = message(b'Z', b"new");
    let tables = read(&log(&messages)).expect("most of it is good");
    assert_eq!(skipped(&tables), [("damaged_message", "D", 1), ("unknown_message", "Z", 1)]);
    assert_eq!((table(&tables, "battery").time.len(), table(&tables, "battery[1]").time.len()), (20, 18));
}

#[test]
fn a_log_that_breaks_off_is_read_up_to_there() {
    let bytes = log(&batteries(20));
    let tables = read(&bytes[..bytes.len() - 3]).expect("most of it is good");
    assert_eq!((table(&tables, "battery").time.len(), table(&tables, "battery[1]").time.len()), (20, 19));
    assert_eq!(skipped(&tables), [("cut_off", "", 1)]);
    let error = read(&bytes[..20]).expect_err("nothing is in it");
    assert_eq!(error.to_string(), "a.ulg, byte 0: no PX4 ULog log: no topic in it has a row");
}

#[test]
fn data_that_were_appended_are_read() {
    let mut messages = batteries(5);
    let flags = |first: u8, offset: u64| {
        let mut body = [0; 40];
        body[8] = first;
        body[16..24].copy_from_slice(&offset.to_le_bytes());
        message(b'B', &body)
    };
    messages.insert(0, flags(1, 0));
    let broken = row(4, 0, &[0; 7]);
    messages.push(broken[..9].to_vec());
    let offset = log(&messages).len() as u64;
    messages[0] = flags(1, offset);
    messages.extend(batteries(7).into_iter().skip(3));
    let tables = read(&log(&messages)).expect("a good log");
    assert_eq!(table(&tables, "battery").time.len(), 12);
    messages[0] = flags(2, 0);
    let error = read(&log(&messages)).expect_err("of a later kind").to_string();
    assert!(error.contains("incompatible"), "{error}");
}

#[test]
fn what_a_log_claims_of_itself_costs_nothing() {
    let nested = message(b'F', b"a:uint64_t timestamp;a[60000] a;");
    let large = message(b'F', b"b:uint64_t timestamp;float[4000000000] x;");
    let endless = message(b'F', b"c:uint64_t timestamp;none[100] x;");
    let none = message(b'F', b"none:");
    let mut messages = vec![nested, large, endless, none];
    messages.extend(batteries(1));
    messages.extend([subscribe(1, 0, "a"), subscribe(2, 0, "b"), subscribe(3, 0, "c"), row(1, 0, &[0; 40])]);
    let tables = read(&log(&messages)).expect("the batteries are good");
    assert_eq!(skipped(&tables), [("unusable_definition", "a", 1), ("unusable_definition", "b", 1)]);
}

#[test]
fn what_the_log_says_of_itself_is_kept() {
    let keyed = |kind: u8, key: &str, value: &[u8]| {
        message(kind, &[&[key.len() as u8], key.as_bytes(), value].concat())
    };
    let mut messages = batteries(1);
    messages.extend([
        keyed(b'I', "char[7] ver_hw", b"PX4_V5X"),
        keyed(b'P', "int32_t SDLOG_PROFILE", &17_i32.to_le_bytes()),
        message(b'O', &40_u16.to_le_bytes()),
    ]);
    let tables = read(&log(&messages)).expect("a good log");
    let about: Vec<_> = tables.about.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
    assert_eq!(about, [("ver_hw", "PX4_V5X"), ("SDLOG_PROFILE", "17")]);
    assert_eq!(skipped(&tables), [("logger_dropout", "", 1)]);
}

#[test]
fn the_mapping_is_one_and_names_what_is_there() {
    let mapping = Mapping::parse(Ulog.mapping().expect("a text"), Path::new("ulog")).expect("a mapping");
    assert!(mapping.wants("esc_status.motor[7]", "esc_rpm") && mapping.wants("vehicle_attitude", "roll"));
    assert!(!mapping.wants("esc_status.esc[0]", "esc_rpm"));
}

#[test]
fn places_that_nothing_fills_are_no_columns() {
    let definition = message(b'F', b"motors:uint64_t timestamp;float[3] control;");
    let row = |values: [f32; 3]| row(0, 0, &values.map(f32::to_le_bytes).concat());
    let rows = [row([0.5, f32::NAN, f32::NAN]), row([0.5, 0.25, f32::NAN])];
    let tables = read(&log(&[definition, subscribe(0, 0, "motors"), rows.concat()])).expect("a good log");
    let names: Vec<&str> = tables.tables[0].columns.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["control[0]", "control[1]"]);
}
