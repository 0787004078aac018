//! Logs of other programs through the command line: columns that are guessed, mappings that combine and choose, parts and
//! rotors of a log, files that cannot be read, and inputs without end.

use std::path::Path;
use std::process::Output;

use rotorbench::log::csv;

use super::{json_schema, rotorbench};

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn at(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.at(name), content).expect("written");
        self.at(name)
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[track_caller]
fn refused(arguments: &[&str], words: &str) {
    let output = rotorbench(arguments);
    let said = said(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(words), "{said}");
    assert!(said.len() < 800, "a message that nobody reads: {said}");
}

/// A thrust stand with two motors: pulses in µs, rates in rpm, a battery that is read more rarely.
fn stand() -> String {
    let mut text =
        "Time (s),ESC 1 (µs),ESC 2 (µs),Motor 1 speed (rpm),Motor 2 speed (rpm),Voltage (V),phase,note\n"
            .to_owned();
    for row in 0..200 {
        let volts = if row % 10 == 0 { format!("{}", 12.5 - 0.001 * f64::from(row)) } else { String::new() };
        let (first, second) = (1300 + row / 50, 1400 - row / 50);
        text += &format!(
            "{},{first},{second},{},{},{volts},{},\n",
            f64::from(row) / 100.0,
            6000 + row,
            7000 - row,
            row / 100
        );
    }
    text
}

#[test]
fn a_guess_is_shown_and_becomes_a_mapping_that_reads_the_log() {
    let folder = Folder::new();
    let log = folder.write("stand.csv", stand());
    let shown = rotorbench(&["import", &log]);
    assert_eq!(shown.status.code(), Some(0), "{}", said(&shown));
    assert!(said(&shown).contains("propeller_rate_2_rad_s") && said(&shown).contains("--write-mapping"));
    let guess: serde_json::Value =
        json_schema::answer("import-guess", &rotorbench(&["import", &log, "--json"]).stdout);
    let certainty = |column: usize| guess["columns"][column]["certainty"].as_str().map(str::to_owned);
    assert_eq!(guess["columns"][1]["signal"], "command_1");
    assert_eq!(
        [certainty(1), certainty(6), certainty(7)].map(Option::unwrap_or_default),
        ["named", "unknown", "empty"]
    );
    refused(&["import", &log, "-o", &folder.at("out.csv")], "no log is written on a guess");

    let mapping = folder.at("m.toml");
    assert_eq!(rotorbench(&["import", &log, "--write-mapping", &mapping]).status.code(), Some(0));
    let done = rotorbench(&["import", &log, "--mapping", &mapping, "-o", &folder.at("out.csv")]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let read = csv::read(Path::new(&folder.at("out.csv"))).expect("our own log");
    assert!((read.column("command_1").expect("there")[0] - 0.3).abs() < 1e-12);
    let rate = read.column("propeller_rate_2_rad_s").expect("there")[1];
    assert!((rate - 6999.0 * std::f64::consts::TAU / 60.0).abs() < 1e-9, "{rate}");
    refused(&["import", &folder.at("out.csv"), "--write-mapping", &mapping, "--force"], "nothing is guessed");
}

#[test]
fn mappings_combine_columns_and_choose_rows() {
    let folder = Folder::new();
    let log = folder.write("stand.csv", stand());
    let mapping = folder.write(
        "m.toml",
        "where = \"phase == 1\"\n[time]\ncolumn = \"Time (s)\"\n\
         [[signal]]\nname = \"command_1\"\ncolumns = [\"ESC 1 (µs)\", \"ESC 2 (µs)\"]\ncombine = \"mean\"\nunit = \"-\"\n\
         scale = 0.001\noffset = -1.0\n\
         [[signal]]\nname = \"difference\"\ncolumns = [\"ESC 2 (µs)\", \"ESC 1 (µs)\"]\ncombine = \"difference\"\n\
         [[signal]]\nname = \"sum\"\ncolumns = [\"ESC 2 (µs)\", \"ESC 1 (µs)\"]\ncombine = \"sum\"\n",
    );
    let out = folder.at("out.csv");
    let done = rotorbench(&["import", &log, "--mapping", &mapping, "-o", &out]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let read = csv::read(Path::new(&out)).expect("our own log");
    assert_eq!((read.len(), read.time()[0]), (100, 1.0));
    assert!((read.column("command_1").expect("there")[0] - 0.35).abs() < 1e-12);
    assert_eq!(read.column("difference").expect("there")[0], 96.0);
    assert_eq!(read.column("sum").expect("there")[0], 2700.0);
    let nothing =
        folder.write("n.toml", std::fs::read_to_string(&mapping).expect("there").replace("== 1", "== 7"));
    refused(&["import", &log, "--mapping", &nothing], "no row holds a time and a value");
}

/// A logger that writes each command a row late: its column is moved up, within each log of the file, and the rest stays.
#[test]
fn a_column_that_is_written_late_is_moved_up() {
    let folder = Folder::new();
    let rows = |from: i32| -> String {
        (0..60).map(|row| format!("{}.5,0.{},{}\n", row, from + row, 100 + row)).collect()
    };
    let log = folder.write("late.csv", format!("t,u,w\n{}{}", rows(10), rows(30)));
    let signal = |name: &str, column: &str, unit: &str, more: &str| {
        format!("[[signal]]\nname = \"{name}\"\ncolumn = \"{column}\"\nunit = \"{unit}\"\n{more}")
    };
    let command = signal("command_1", "u", "-", "rows_later = 2\n");
    let rate = signal("propeller_rate_1_rad_s", "w", "rad/s", "");
    let mapping = folder.write("m.toml", format!("[time]\ncolumn = \"t\"\n{command}{rate}"));
    let out = folder.at("out.csv");
    let done = rotorbench(&["import", &log, "--mapping", &mapping, "--part", "1", "-o", &out]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let read = csv::read(Path::new(&out)).expect("our own log");
    let (commands, rates) = (read.column("command_1"), read.column("propeller_rate_1_rad_s").expect("there"));
    let commands = commands.expect("there");
    assert_eq!((read.len(), commands[0], commands[57], rates[0], rates[59]), (60, 0.12, 0.69, 100.0, 159.0));
    assert!(
        commands[58..].iter().all(|it| it.is_nan()),
        "none comes from the file's next log: {:?}",
        &commands[55..]
    );
}

/// A name that is no mapping is a mistake, also where the log is one of ours and needs none.
#[test]
fn a_mapping_that_is_not_there_is_refused_for_every_log() {
    let folder = Folder::new();
    let log = folder.write("ours.csv", "time_s,command_1\n0,0.1\n0.1,0.2\n0.2,0.3\n");
    let done = rotorbench(&["import", &log, "--mapping", "rcbenchmark"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    refused(&["import", &log, "--mapping", "NONSENSE"], "no mapping `NONSENSE`");
}

#[test]
fn channels_with_clocks_of_their_own_are_put_together() {
    let folder = Folder::new();
    // The battery has 20 stamps of its own beside 200 of the rate; behind its end its cells are empty.
    let mut text = "t,w,t_b,v\n".to_owned();
    for row in 0..200 {
        let own = if row < 20 {
            format!("{},{}", 0.1 * f64::from(row) + 0.002, 12.0 + f64::from(row))
        } else {
            ",".to_owned()
        };
        text += &format!("{},{},{own}\n", f64::from(row) / 100.0, 600 + row);
    }
    let log = folder.write("clocks.csv", text);
    let mapping = folder.write(
        "m.toml",
        "[time]\ncolumn = \"t\"\n[[signal]]\nname = \"propeller_rate_1_rad_s\"\ncolumn = \"w\"\nunit = \"rad/s\"\n\
         [[signal]]\nname = \"battery_voltage_v\"\ncolumn = \"v\"\ntime_column = \"t_b\"\nunit = \"V\"\n",
    );
    let done = rotorbench(&["import", &log, "--mapping", &mapping, "-o", &folder.at("out.csv"), "--json"]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let notes: serde_json::Value = json_schema::answer("import", &done.stdout);
    assert_eq!(notes["notes"]["without_time"]["count"], 0, "a clock that ends lacks nothing");
    let read = csv::read(Path::new(&folder.at("out.csv"))).expect("our own log");
    let volts = read.column("battery_voltage_v").expect("there");
    assert_eq!(read.len(), 200);
    for row in 0..20 {
        assert_eq!(volts[10 * row], 12.0 + row as f64, "moved by 2 ms to the row that is nearest");
    }
    assert_eq!(volts.iter().filter(|value| value.is_finite()).count(), 20);
}

#[test]
fn rotors_and_spans_are_chosen() {
    let folder = Folder::new();
    let mut text = "time_s,command_1,command_2,command_3,command_4,propeller_rate_3_rad_s\n".to_owned();
    for row in 0..100 {
        text += &format!("{},0.1,0.2,0.3,0.4,{}\n", f64::from(row) / 10.0, 600 + row);
    }
    let log = folder.write("quad.csv", text);
    let out = folder.at("out.csv");
    let done = rotorbench(&["import", &log, "--rotors", "3,1", "--from-s", "2", "--to-s", "2.5", "-o", &out]);
    assert_eq!(done.status.code(), Some(0), "{}", said(&done));
    let read = csv::read(Path::new(&out)).expect("our own log");
    assert_eq!(read.time(), [2.0, 2.1, 2.2, 2.3, 2.4, 2.5]);
    assert_eq!(read.names().collect::<Vec<_>>(), ["command_2", "command_1", "propeller_rate_1_rad_s"]);
    assert_eq!(read.column("command_1").expect("there")[0], 0.3);
    refused(&["import", &log, "--rotor", "5"], "no rotor 5; it holds 1, 2, 3, 4");
    refused(&["identify", "--log", &log, "--rotor", "5"], "no rotor 5; it holds 1, 2, 3, 4");
    refused(&["compare", "--log", &log, "--from-s", "20"], "it goes from 0 s to 9.9 s");
}

#[test]
fn what_cannot_be_read_is_named_with_what_helps() {
    let folder = Folder::new();
    for (content, words) in [
        (&b"MATLAB 5.0 MAT-file, Platform"[..], "writetable"),
        (b"SQLite format 3\0", "rosbag2"),
        (b"version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
        (b"PK\x03\x04", "save the sheet as CSV"),
        (b"\xbc\x02\0\0", "Crazyflie"),
        (b"\0\x01\x02\x03", "no log that is known here"),
    ] {
        let log = folder.write("log.bin", content);
        refused(&["diagnose", "--log", &log], words);
        refused(&["import", &log], words);
    }
}

#[test]
fn inputs_without_end_or_measure_are_refused() {
    let folder = Folder::new();
    refused(&["compare", "--log", "/dev/zero"], "without end");
    refused(&["import", "/dev/zero"], "without end");
    let wide = folder.write("wide.csv", "time_s,".to_owned() + &"a,".repeat(1_000_000) + "\n0\n");
    refused(&["compare", "--log", &wide], "4096 are the most");
    let long = folder.write("long.csv", "time_s,a\n0,".to_owned() + &"x".repeat(20_000_000) + "\n");
    refused(&["compare", "--log", &long], "is not a number");
}
