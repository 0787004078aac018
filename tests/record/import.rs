//! Foreign logs: every kind of bad habit, read without inventing anything, refused with the place.

use std::path::{Path, PathBuf};

use super::{json_schema, rotorbench};
use rotorbench::log::{Dataset, ForeignError, Mapping, Notes, csv, mapped};

const MAPPING: &str = r##"
comment = "#"
missing = ["---"]
[time]
column = "t"
unit = "ms"
[[signal]]
name = "command_1"
column = "esc"
unit = "%"
clamp = [0.0, 1.0]
[[signal]]
name = "propeller_rate_1_rad_s"
column = "speed"
unit = "rpm"
valid = [0.0, 5000.0]
[[signal]]
name = "raw"
column = "esc"
scale = 2.0
offset = 1.0
"##;

fn mapping(text: &str) -> Mapping {
    Mapping::parse(text, Path::new("m.toml")).expect("a good mapping")
}

fn read(text: &str) -> Result<(Dataset, Notes), ForeignError> {
    mapped::parse(text.as_bytes(), Path::new("f.csv"), &mapping(MAPPING), None)
}

fn column<'a>(log: &'a Dataset, name: &str) -> &'a [f64] {
    log.column(name).expect("a column with values")
}

#[test]
fn cells_become_signals_in_si() {
    let (log, notes) = read("t,esc,speed\n0,10,60\n500,20,120\n").expect("a good log");
    assert_eq!(log.time(), [0.0, 0.5]);
    assert_eq!(column(&log, "command_1"), [0.1, 0.2]);
    let turn = std::f64::consts::TAU;
    assert!((column(&log, "propeller_rate_1_rad_s")[1] - 2.0 * turn).abs() < 1e-12);
    assert_eq!(column(&log, "raw"), [21.0, 41.0]);
    assert_eq!((notes.rows, notes.short_rows.count), (2, 0));
}

#[test]
fn bad_habits_are_read_and_counted() {
    let text = "\u{feff}t, esc ,speed,other\r\n\
                0,10,60,x\r\n\
                # a remark\r\n\
                \r\n\
                10,,60\r\n\
                20,30\r\n\
                ,30,60,x\r\n\
                20,30,90,x\r\n\
                20,31,90,x\r\n\
                15,30,60,x\r\n\
                30,---,nan,x\r\n\
                40,250,99999999,x,surplus\r\n";
    let (log, notes) = read(text).expect("bad habits, no errors");
    assert!(notes.byte_order_mark);
    assert_eq!(log.time(), [0.0, 0.01, 0.02, 0.03, 0.04]);
    let command = column(&log, "command_1");
    assert_eq!((command[0], command[2], command[4]), (0.1, 0.3, 1.0));
    assert!(command[1].is_nan() && command[3].is_nan(), "an empty cell stays empty");
    let rate = column(&log, "propeller_rate_1_rad_s");
    assert!(
        (rate[2] - 90.0 * std::f64::consts::TAU / 60.0).abs() < 1e-12,
        "the row of the same time filled it"
    );
    assert!(rate[4].is_nan(), "not a measurement");
    assert_eq!(notes.remarks, 1);
    assert_eq!((notes.short_rows.count, notes.short_rows.first_lines.as_slice()), (2, [5, 6].as_slice()));
    assert_eq!((notes.without_time.count, notes.without_time.first_lines.as_slice()), (1, [7].as_slice()));
    assert_eq!(notes.repeated_time.count, 2);
    assert_eq!(notes.conflicting_cells.count, 2, "command and raw of line 9");
    assert_eq!((notes.backward_time.count, notes.backward_time.first_lines.as_slice()), (1, [10].as_slice()));
    assert_eq!(notes.long_rows.count, 1);
    assert_eq!(notes.clamped["command_1"].count, 1);
    assert_eq!(notes.invalid["propeller_rate_1_rad_s"].count, 1);
    assert_eq!(notes.unused_columns, ["other"]);
}

/// A logger that was started anew into the same file, and one that was killed while it wrote: `12` may have been `1234`.
#[test]
fn a_header_that_comes_again_and_a_cell_that_was_cut() {
    let text = "t,esc,speed\n0,10,60\n10,10,61\nt,esc,speed\n20,10,62\n30,10,6";
    let (log, notes) = read(text).expect("a log all the same");
    assert_eq!(log.time(), [0.0, 0.01, 0.02, 0.03]);
    assert_eq!(
        (notes.repeated_header.count, notes.repeated_header.first_lines.as_slice()),
        (1, [4].as_slice())
    );
    assert_eq!((notes.cut_cell.count, notes.cut_cell.first_lines.as_slice()), (1, [6].as_slice()));
    let rates = column(&log, "propeller_rate_1_rad_s");
    assert!(rates[2].is_finite() && rates[3].is_nan(), "{rates:?}");
    assert_eq!(column(&log, "command_1")[3], 0.1, "what stands before it was written whole");
    let (_, notes) = read("t,esc,speed\n0,10,60\n10,10,61\n").expect("a good log");
    assert_eq!((notes.repeated_header.count, notes.cut_cell.count), (0, 0));
    // A time that was cut is no time, and a remark at the end cuts nothing.
    let (log, notes) = read("t,esc,speed\n0,10,60\n10,10,61\n2").expect("a log all the same");
    assert_eq!((log.len(), notes.cut_cell.count), (2, 1));
    let (_, notes) = read("t,esc,speed\n0,10,60\n10,10,61\n# the end").expect("a good log");
    assert_eq!(notes.cut_cell.count, 0);
}

#[test]
fn nothing_is_invented_across_a_hole() {
    let mut text = "t,esc,speed\n".to_owned();
    for row in (0..100).chain(200..300) {
        text += &format!("{},10,{}\n", row * 10, 100 + row % 7);
    }
    let (log, _) = read(&text).expect("a good log");
    assert_eq!(log.len(), 200);
    assert_eq!(log.holes().len(), 1);
    assert!((log.holes()[0].length - 1.01).abs() < 1e-9);
}

#[test]
fn a_file_of_several_logs_asks_which() {
    let mut text = "t,esc,speed\n".to_owned();
    for part in 0..2 {
        for row in 0..30 {
            text += &format!("{},{},60\n", row * 10, 10 + part);
        }
    }
    assert_eq!(
        read(&text).expect_err("two logs").to_string(),
        "f.csv, line 32: time goes back from 0.29 s to 0 s and goes on from there: 2 logs in one file; choose one \
         with --part 1 to 2"
    );
    let mapping = mapping(MAPPING);
    let path = Path::new("f.csv");
    let (second, notes) = mapped::parse(text.as_bytes(), path, &mapping, Some(2)).expect("the second");
    assert_eq!(second.len(), 30);
    assert_eq!(column(&second, "command_1")[0], 0.11);
    assert_eq!(notes.part, Some((2, 2)));
    let error = mapped::parse(text.as_bytes(), path, &mapping, Some(3)).expect_err("no third");
    assert_eq!(error.to_string(), "f.csv: there is no part 3; the file holds 2");
}

#[test]
fn other_alphabets_separators_and_missing_headers() {
    let text = r#"
encoding = "windows-1252"
delimiter = ";"
decimal_comma = true
skip_lines = 2
[time]
period_s = 0.5
[[signal]]
name = "body_angle_rad"
column = "Winkel (°)"
unit = "°"
"#;
    let bytes = b"Pr\xfcfstand\r\n\r\nWinkel (\xb0);x\r\n180,0;1\r\n90,0;1\r\n";
    let (log, _) = mapped::parse(bytes, Path::new("f.csv"), &mapping(text), None).expect("a good log");
    assert_eq!(log.time(), [0.0, 0.5]);
    assert!((column(&log, "body_angle_rad")[0] - std::f64::consts::PI).abs() < 1e-12);

    let text = "header = false\n[time]\ncolumn = \"#1\"\n[[signal]]\nname = \"raw\"\ncolumn = \"#2\"\n";
    let (log, _) =
        mapped::parse(b"0,5\n1,6\n", Path::new("f.csv"), &mapping(text), None).expect("a good log");
    assert_eq!(column(&log, "raw"), [5.0, 6.0]);
}

#[test]
fn refusals_name_the_place() {
    let cases = [
        (
            "t,esc,speed\n0,1,1\n1,x,1\n",
            "f.csv, line 3, column `esc`: `x` is not a number (if it means no value, name it in the mapping's \
             `missing`)",
        ),
        (
            "t,esc,speed\nlater,1,1\n",
            "f.csv, line 2, column `t`: `later` is not a number (if it means no value, name it in the mapping's \
             `missing`)",
        ),
        (
            "t,speed\n0,1\n",
            "f.csv: no column `esc` (for `command_1` of the mapping `m.toml`); the header reads `t`, `speed`",
        ),
        (
            "t,esc,esc,speed\n0,1,1,1\n",
            "f.csv: more than one column `esc` (for `command_1` of the mapping `m.toml`); the header reads `t`, `esc`, `esc`, `speed`",
        ),
        ("t,esc,speed\n", "f.csv: no row holds a time and a value"),
        ("t,esc,speed\n0,,\n", "f.csv: no row holds a time and a value"),
    ];
    for (text, message) in cases {
        assert_eq!(read(text).expect_err(message).to_string(), message);
    }
    let latin = mapped::parse(b"t,esc,speed\n0,1,\xb0\n", Path::new("f.csv"), &mapping(MAPPING), None);
    assert_eq!(
        latin.expect_err("not UTF-8").to_string(),
        "f.csv: the bytes are not UTF-8 text; set `encoding` in the mapping"
    );
}

proptest::proptest! {
    /// Whatever bytes come, the reader answers or refuses; it never panics.
    #[test]
    fn any_bytes_are_answered(bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..400)) {
        let _ = mapped::parse(&bytes, Path::new("f.csv"), &mapping(MAPPING), None);
    }

    /// The same for what looks like a log.
    #[test]
    fn any_cells_are_answered(rows in proptest::collection::vec("[-0-9.e,#nax\" ]{0,20}", 0..30)) {
        let text = format!("t,esc,speed\n{}\n", rows.join("\n"));
        if let Ok((log, _)) = read(&text) {
            proptest::prop_assert!(log.time().windows(2).all(|pair| pair[0] < pair[1]));
        }
    }
}

#[test]
fn the_command_keeps_what_was_there_when_it_refuses() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    std::fs::write(at("m.toml"), MAPPING).expect("written");
    std::fs::write(at("bad.csv"), "t,esc,speed\n0,1,oops\n").expect("written");
    std::fs::write(at("out.csv"), "precious").expect("written");
    let refused =
        rotorbench(&["import", &at("bad.csv"), "--mapping", &at("m.toml"), "-o", &at("out.csv"), "--force"]);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("bad.csv, line 2, column `speed`: `oops` is not a number"), "{said}");
    assert_eq!(std::fs::read_to_string(at("out.csv")).expect("there"), "precious");

    std::fs::write(at("good.csv"), "t,esc,speed\n0,1,60\n10,1,61\n20,1,60\n").expect("written");
    let done = rotorbench(&[
        "import",
        &at("good.csv"),
        "--mapping",
        &at("m.toml"),
        "-o",
        &at("out.csv"),
        "--json",
        "--force",
    ]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let report: serde_json::Value = json_schema::answer("import", &done.stdout);
    assert_eq!(report["findings"]["samples"], 3);
    assert_eq!(csv::read(Path::new(&at("out.csv"))).expect("our own log").len(), 3);
    for (arguments, words) in [
        (vec!["import", "nowhere.csv", "--mapping", "rcbenchmark"], "nowhere.csv: No such file"),
        (vec!["import", &at("good.csv"), "--mapping", "nowhere"], "no mapping `nowhere`"),
        (vec!["import", &at("good.csv"), "-o", &at("guessed.csv")], "no log is written on a guess"),
        (vec!["compare", "--log", &at("good.csv")], "the header has no column `time_s`"),
    ] {
        let refused = rotorbench(&arguments);
        assert_eq!(refused.status.code(), Some(2));
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(said.contains(words), "{said}");
    }
}

/// The shared data, or one visible line that they are not here.
fn shared(file: &str) -> Option<PathBuf> {
    let folder =
        std::env::var_os("ROTORBENCH_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = folder.join(file);
    if path.exists() {
        return Some(path);
    }
    // Past the test harness's capture, so that it is seen.
    use std::io::Write as _;
    let _ = writeln!(
        std::io::stderr(),
        "absent: {} (set ROTORBENCH_DATA); this check did not run",
        path.display()
    );
    None
}

#[test]
fn a_vendors_thrust_stand_log() {
    let Some(path) = shared("motor_step_bench/so_v5_time_constant.csv") else { return };
    let (log, notes) =
        mapped::read(&path, &Mapping::load("rcbenchmark").expect("shipped"), None).expect("a vendor's log");
    assert!(notes.byte_order_mark);
    assert_eq!((log.len(), notes.remarks), (8409, 15));
    let raw = column(&log, "esc_signal");
    let command = column(&log, "command_1");
    for (raw, command) in raw.iter().zip(command) {
        assert!((command - ((raw - 48.0) / 1999.0).max(0.0)).abs() < 1e-12);
    }
    let findings = rotorbench::screening::summary::LogSummary::of(&log.clone().into());
    // Counted independently with numpy: 34 intervals over 2.5 medians (22.3 ms), 31 of them over 60 ms.
    assert_eq!(findings.holes.len(), 34);
    assert_eq!(findings.holes.iter().filter(|hole| hole.length_s > 0.06).count(), 31);
    assert!(findings.holes.iter().filter(|hole| hole.at_step.is_some()).count() >= 14);
    assert!(!findings.standstill_starts_s.is_empty());
    assert!(findings.findings.iter().any(|it| it.code == "starts_from_standstill"));
    // Found independently: 15 holes lie where a command stepped or up to 0.16 s behind.
    let hidden =
        findings.findings.iter().find(|it| it.code == "transient_behind_hole").expect("hidden steps");
    assert_eq!(hidden.count("holes"), 15);
}
