use std::path::Path;

use super::*;

/// Bytes of a flight, written by rules of their own.
struct Flight(Vec<u8>);

const HEADER: &str = "H Product:Blackbox flight data recorder by Nicholas Sherlock\n\
    H Data version:2\n\
    H Field I name:loopIteration,time,vbatLatest,gyroADC[0],motor[0],motor[1],eRPM[0]\n\
    H Field I signed:0,0,0,1,0,0,0\n\
    H Field I predictor:0,0,9,0,11,5,0\n\
    H Field I encoding:1,1,3,0,1,0,1\n\
    H Field P predictor:6,2,1,3,3,3,1\n\
    H Field P encoding:9,0,0,0,0,0,0\n\
    H Field S name:flightModeFlags,stateFlags\n\
    H Field S signed:0,0\n\
    H Field S predictor:0,0\n\
    H Field S encoding:1,1\n\
    H Firmware revision:Betaflight 4.5.1 (77d01ba3b) STM32H743\n\
    H Craft name:bench\n\
    H I interval:32\n\
    H P interval:2\n\
    H gyro_scale:0x3f800000\n\
    H motorOutput:158,2047\n\
    H motor_poles:14\n\
    H vbatref:1650\n";

impl Flight {
    fn new() -> Self {
        Self(HEADER.as_bytes().to_vec())
    }

    fn unsigned(&mut self, mut value: u32) {
        while value > 127 {
            self.0.push((value % 128) as u8 + 128);
            value /= 128;
        }
        self.0.push(value as u8);
    }

    fn signed(&mut self, value: i32) {
        self.unsigned(if value < 0 { ((-(value + 1)) as u32) * 2 + 1 } else { value as u32 * 2 });
    }

    /// A main frame by itself: turn, time, volts below the reference, rate, first and second motor, electrical rate.
    fn intra(&mut self, turn: u32, time: u32, sag: u32, rate: i32, motors: [i32; 2], erpm: u32) -> &mut Self {
        self.0.push(b'I');
        self.unsigned(turn);
        self.unsigned(time);
        self.unsigned(sag);
        self.signed(rate);
        self.unsigned((motors[0] - 158) as u32);
        self.signed(motors[1] - motors[0]);
        self.unsigned(erpm);
        self
    }

    /// A frame of differences: of the time's slope, of volts, of the rate and of the motors to their means, of the rate.
    fn inter(&mut self, differences: [i32; 6]) -> &mut Self {
        self.0.push(b'P');
        for difference in differences {
            self.signed(difference);
        }
        self
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn read(&self) -> Result<Tables, FormatError> {
        read(&self.0, None)
    }
}

fn read(bytes: &[u8], part: Option<usize>) -> Result<Tables, FormatError> {
    Betaflight.read(&ReadRequest { path: Path::new("LOG.BBL"), bytes, part, wants: &|_, _| true })
}

fn column<'a>(tables: &'a Tables, table: &str, name: &str) -> &'a [f64] {
    let table = tables.tables.iter().find(|it| it.name == table).expect("the table");
    &table.columns.iter().find(|it| it.name == name).expect("the column").values
}

/// What was left out, by code.
fn skipped(tables: &Tables, code: &str) -> u64 {
    tables.skipped.iter().filter(|it| it.code == code).map(|it| it.count).sum()
}

const END: &[u8] = b"E\xffEnd of log\0";

#[test]
fn frames_become_rows_in_units() {
    let mut flight = Flight::new();
    flight.intra(0, 5_000_000, 38, -90, [158, 200], 700).inter([250, -1, 10, 42, 2, 7]);
    let tables = flight
        .inter([0, 0, 0, 0, 0, 0])
        .bytes(b"S\x81\x01\x02")
        .intra(32, 5_008_000, 40, 5, [48, 48], 0)
        .read();
    let tables = tables.expect("a log");
    assert_eq!(tables.part, Some((1, 1)));
    assert_eq!(tables.tables[0].time, [5.0, 5.00025, 5.0005, 5.008]);
    // Every second turn is logged.
    assert_eq!(column(&tables, "", "loopIteration"), [0.0, 2.0, 4.0, 32.0]);
    assert_eq!(column(&tables, "", "vbatLatest"), [16.12, 16.11, 16.11, 16.1]);
    // The mean of -90 and -80 is -85, of -90 and -90 itself.
    assert_eq!(column(&tables, "", "gyroADC[0]"), [-90.0, -80.0, -85.0, 5.0]);
    let command = |throttle: f64| (throttle - 48.0) / 1_999.0;
    assert_eq!(column(&tables, "", "motor[0]"), [158.0, 200.0, 179.0, 48.0].map(command));
    assert_eq!(column(&tables, "", "motor[1]"), [200.0, 202.0, 201.0, 48.0].map(command));
    assert_eq!(column(&tables, "", "eRPM[0]"), [10_000.0, 10_100.0, 10_100.0, 0.0]);
    assert_eq!(column(&tables, "slow", "flightModeFlags"), [129.0]);
    assert_eq!(tables.tables[1].time, [5.0005]);
    assert!(tables.skipped.is_empty(), "{:?}", tables.skipped);
    let craft = ("Craft name".to_owned(), "bench".to_owned());
    assert!(tables.about.contains(&craft));
}

#[test]
fn nothing_behind_the_end_of_a_flight_is_read() {
    let mut flight = Flight::new();
    flight.intra(0, 10, 0, 0, [158, 158], 0).bytes(END).intra(32, 20, 0, 0, [158, 158], 0);
    assert_eq!(flight.read().expect("a log").tables[0].time.len(), 1);
}

#[test]
fn a_clock_of_32_bits_overflows_and_goes_on() {
    let mut flight = Flight::new();
    flight.intra(0, u32::MAX - 99, 0, 0, [158, 158], 0).inter([200, 0, 0, 0, 0, 0]).intra(
        32,
        300,
        0,
        0,
        [158, 158],
        0,
    );
    let time = flight.read().expect("a log").tables[0].time.clone();
    assert_eq!(time, [4_294.967_196, 4_294.967_396, 4_294.967_596]);
}

#[test]
fn a_stopped_motor_lies_below_the_lowest_output() {
    let mut flight = Flight::new();
    let tables = flight.intra(0, 10, 0, 0, [0, 0], 0).read().expect("a log");
    assert_eq!(column(&tables, "", "motor[0]"), [-48.0 / 1_999.0]);
}

#[test]
fn damage_costs_the_frames_up_to_the_next_whole_one() {
    let mut flight = Flight::new();
    flight
        .intra(0, 0, 0, 0, [158, 158], 0)
        .inter([100, 0, 0, 0, 0, 0])
        .bytes(&[0, 1, 2])
        .inter([0; 6])
        .inter([0; 6]);
    flight.intra(32, 3_200, 0, 0, [158, 158], 0).inter([100, 0, 0, 0, 0, 0]);
    let tables = flight.read().expect("a log");
    assert_eq!(tables.tables[0].time, [0.0, 0.0032, 0.0033]);
    // The frame in front of the damage cannot be distinguished from a damaged one: what follows it is no frame. It goes
    // with the three bytes.
    assert!(skipped(&tables, "damaged_bytes") >= 3, "{:?}", tables.skipped);
    assert_eq!(skipped(&tables, "frame_without_reference"), 2);
}

#[test]
fn one_frame_from_elsewhere_is_not_believed_and_two_are() {
    let mut flight = Flight::new();
    flight.intra(0, 0, 0, 0, [158, 158], 0).intra(32, 60_000_000, 0, 0, [158, 158], 0);
    flight.intra(64, 6_400, 0, 0, [158, 158], 0).inter([0; 6]);
    let tables = flight.read().expect("a log");
    assert_eq!(tables.tables[0].time, [0.0, 0.0064, 0.0064]);
    assert_eq!(skipped(&tables, "jump_in_time"), 1);

    let mut flight = Flight::new();
    flight.intra(0, 0, 0, 0, [158, 158], 0).intra(32, 60_000_000, 0, 0, [158, 158], 0);
    flight.intra(64, 60_003_200, 0, 0, [158, 158], 0);
    assert_eq!(flight.read().expect("a log").tables[0].time, [0.0, 60.0032]);
}

#[test]
fn a_pause_that_the_log_tells_of_is_believed() {
    let mut flight = Flight::new();
    flight.intra(0, 0, 0, 0, [158, 158], 0).bytes(b"E\x0e");
    flight.unsigned(320_000);
    flight.unsigned(60_000_000);
    let tables = flight.intra(320_000, 60_000_100, 0, 0, [158, 158], 0).read().expect("a log");
    assert_eq!(tables.tables[0].time, [0.0, 60.0001]);
    assert!(tables.skipped.is_empty(), "{:?}", tables.skipped);
}

#[test]
fn a_file_holds_several_flights() {
    let mut flown = Flight::new();
    flown.intra(0, 0, 0, 0, [158, 158], 0).intra(32, 2_000_000, 0, 7, [158, 158], 0).bytes(END);
    let mut armed = Flight::new();
    armed.bytes(END);
    let two = [flown.0.clone(), armed.0.clone(), flown.0.clone()].concat();
    assert_eq!(
        read(&two, None).expect_err("which?").to_string(),
        "LOG.BBL: holds 3 logs (2.0 s, 0.0 s, 2.0 s); choose one with --part 1 to 3"
    );
    assert_eq!(read(&two, Some(3)).expect("the third").part, Some((3, 3)));
    assert_eq!(
        read(&two, Some(4)).expect_err("no fourth").to_string(),
        "LOG.BBL: there is no part 4; the file holds 3"
    );
    assert_eq!(
        read(&two, Some(0)).expect_err("no zeroth").to_string(),
        "LOG.BBL: there is no part 0; the file holds 3"
    );
    let empty = read(&two, Some(2)).expect_err("no frames").to_string();
    assert!(empty.ends_with("no Betaflight blackbox log: no frame can be read"), "{empty}");
    // Of one that was only armed and one that flew, there is no question.
    let one = [armed.0, flown.0].concat();
    assert_eq!(read(&one, None).expect("the second").part, Some((2, 2)));
}

#[test]
fn a_scale_that_the_header_lacks_costs_the_column_only() {
    let text = HEADER.replace("H motor_poles:14\n", "").replace("H vbatref:1650\n", "");
    let mut flight = Flight(text.into_bytes());
    let tables = flight.intra(0, 10, 0, 0, [158, 158], 0).read().expect("a log");
    let names: Vec<&str> = tables.tables[0].columns.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["loopIteration", "gyroADC[0]", "motor[0]", "motor[1]"]);
    let subjects: Vec<&str> = tables.skipped.iter().map(|it| it.subject.as_str()).collect();
    assert_eq!(subjects, ["vbatLatest", "eRPM[0]"]);
}

#[test]
fn frames_that_ask_for_too_much_memory_are_refused() {
    let names: Vec<String> = (0..500).map(|index| format!("debug[{index}]")).collect();
    let zeros = vec!["0"; 500].join(",");
    let nothing = vec!["9"; 500].join(",");
    let text = format!(
        "H Product:Blackbox\nH Field I name:time,{}\nH Field I predictor:0,{zeros}\nH Field I encoding:1,{nothing}\n",
        names.join(",")
    );
    let mut bytes = text.into_bytes();
    bytes.extend(b"I\x05".repeat(10_000));
    let error = read(&bytes, None).expect_err("1 MB for 4 kB").to_string();
    assert!(error.ends_with("its frames hold more than 8 numbers a byte"), "{error}");
}

#[test]
fn only_what_is_wanted_is_kept() {
    let mut flight = Flight::new();
    flight.intra(0, 10, 0, 0, [158, 158], 0).bytes(b"S\x01\x02").intra(32, 20, 0, 0, [158, 158], 0);
    let wants = |table: &str, name: &str| table.is_empty() && name == "motor[1]";
    let request = ReadRequest { path: Path::new("LOG.BBL"), bytes: &flight.0, part: None, wants: &wants };
    let tables = Betaflight.read(&request).expect("a log").tables;
    assert_eq!(tables.len(), 1);
    assert_eq!(tables[0].columns.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["motor[1]"]);
}
