//! What a guess of a foreign log's columns says: a table to look at, and the mapping file that it makes.

use super::TextTable;
use crate::log::guess::{Certainty, GuessedColumn, is_divided_by_poles, possible_commands, rows_apart};
use crate::log::limits::shortened;
use crate::log::mapping::MappingConfig;
use crate::report::thresholds::THRESHOLDS;
use crate::session::GuessedLog;
use crate::signal::columns;
use crate::unit::short;

/// How sure a guess is, in words.
#[must_use]
pub fn certainty(of: Certainty) -> &'static str {
    match of {
        Certainty::Named => "its name says so",
        Certainty::UnitGuessed => "unit guessed from the values",
        Certainty::Electrical => "electrical: needs the number of pole pairs",
        Certainty::ByPoles => "electrical, divided by the poles that the stand was given",
        Certainty::Unknown => "not recognised",
        Certainty::Empty => "no numbers: left out",
        Certainty::Text => "not recognised, and holds text: left out",
        Certainty::Said => "as you say",
        Certainty::LeftOut => "left out, as you say",
    }
}

fn conversion(column: &GuessedColumn) -> String {
    let factor = if column.scale == 1.0 { String::new() } else { format!(" x {}", short(column.scale)) };
    let offset = if column.offset == 0.0 {
        String::new()
    } else {
        format!(" {} {}", if column.offset < 0.0 { "-" } else { "+" }, short(column.offset.abs()))
    };
    match (column.certainty, column.unit.as_str()) {
        (Certainty::Unknown, _) => "as it is".to_owned(),
        (Certainty::Empty | Certainty::Text | Certainty::LeftOut, _) => "-".to_owned(),
        (Certainty::Said, "") => "as it is".to_owned(),
        (_, "-") if column.scale == 1.0 && column.offset == 0.0 => "0 to 1".to_owned(),
        (_, "-") if column.scale == 1e-3 => "pulses of 1000 to 2000 µs".to_owned(),
        (_, "-") if column.scale == 1.0 / 255.0 => "8 bits, 0 to 255".to_owned(),
        (_, "-") if column.scale < THRESHOLDS.dshot_scale => "DShot, 48 to 2047".to_owned(),
        (_, "-") => format!("0 to 1{factor}{offset}"),
        (_, unit) => format!("{unit}{factor}{offset}"),
    }
}

/// The guess beside the first values of each column.
#[must_use]
pub fn text(guessed: &GuessedLog) -> String {
    let head = ["column", "becomes", "in", "how sure", "first values"].map(str::to_owned);
    let mut table = TextTable::new(head);
    for column in &guessed.columns {
        let samples: Vec<String> = column.samples.iter().map(|value| short(*value)).collect();
        table = table.row([
            column.column.clone(),
            if column.certainty.is_read() { column.signal.clone() } else { "-".to_owned() },
            conversion(column),
            certainty(column.certainty).to_owned(),
            samples.join(", "),
        ]);
    }
    let mut text = table.text();
    if let Some(name) = guessed.shipped {
        let rate = rate_by_poles(guessed).map(|it| format!(", and the rate from `{}`", it.column));
        text += &format!(
            "The shipped mapping `{name}` knows these columns and reads the same signals{}: `--mapping {name}` reads this log.\n",
            rate.unwrap_or_default()
        );
    }
    if guessed.mapping.time.is_none() {
        text += "No column looks like the time (stamps of date and time are not read): say which it is and what it comes in (s, ms, us), \
                 `--column 'COLUMN=time_s:ms'`, or write `period_s` into [time] of the mapping.\n";
    }
    if let Some(it) = guessed.columns.iter().find(|it| it.certainty == Certainty::Electrical) {
        let (column, signal) = (&it.column, &it.signal);
        text += &format!(
            "`{column}` is electrical, and {} pole pairs are assumed. Of a motor with 12 magnets: `--column '{column}={signal}:erpm/6'`\n",
            short(1.0 / it.scale)
        );
    }
    if let Some(angle) = guessed.mapping.signal.iter().find(|it| it.slope).and_then(|it| it.column.as_deref())
    {
        text += &format!(
            "No column holds the body's rate: the mapping takes the change of `{angle}` a second (`slope`), with the angle's noise in it. If a \
             gyro's column is there: `--column 'COLUMN={}:deg/s'`\n",
            columns::BODY_RATE
        );
    }
    text + &of_texts(&guessed.mapping.missing)
        + &of_levels(&guessed.columns)
        + &of_volts(guessed)
        + &of_rates(guessed)
        + &without_command(guessed)
}

/// What is to be asked of voltages that move as what is asked for does.
fn of_volts(guessed: &GuessedLog) -> String {
    let drives = |name: &str| columns::is_command(name) || name == columns::TORQUE_COMMAND;
    let has_command = guessed.mapping.signal.iter().any(|signal| drives(&signal.name));
    let of = |it: &GuessedColumn, volts: f64| {
        let column = &it.column;
        let battery = columns::BATTERY_VOLTAGE;
        let mut text = match it.signal == battery {
            false => format!(
                "`{column}` goes to 0, as no battery does that turns a motor: it is not taken for the battery's. If it is: \
                 `--column '{column}={battery}:V'`. "
            ),
            true if has_command => return String::new(),
            true => format!("`{column}` goes in steps, as a command does rather than a battery. "),
        };
        if !has_command {
            text += &format!(
                "If it is what the motor was given, it is the command: in the mapping `name = \"command_1\"`, `column = \"{column}\"`, \
                 `unit = \"-\"`, `scale = {}` (1 / {}, its greatest)",
                short(1.0 / volts),
                short(volts)
            );
        }
        text.trim_end().to_owned() + "\n"
    };
    guessed
        .columns
        .iter()
        .filter(|it| it.certainty != Certainty::Said)
        .filter_map(|it| Some(of(it, it.asked_volts?)))
        .collect()
}

/// What becomes of text in columns of numbers.
fn of_texts(missing: &[String]) -> String {
    if missing.is_empty() {
        return String::new();
    }
    let cells: Vec<String> = missing.iter().map(|cell| format!("`{}`", shortened(cell))).collect();
    format!(
        "Cells of text in columns of numbers count as missing (`missing` in the mapping): {}\n",
        cells.join(", ")
    )
}

/// What to do where the rows are so far apart that each may be a level of a thrust stand.
fn of_levels(guessed: &[GuessedColumn]) -> String {
    let is_of_rotor =
        |it: &GuessedColumn| columns::is_command(&it.signal) || columns::is_propeller_rate(&it.signal);
    let step = rows_apart(guessed).filter(|_| guessed.iter().any(is_of_rotor));
    match step.filter(|step| *step > THRESHOLDS.slow_rows) {
        Some(step) => format!(
            "Rows are {} s apart. If each is a level at which the rotor had settled (a thrust stand's table), the mapping has \
             `levels = true` in [time], in place of `column` and `unit`\n",
            short((10.0 * step).round() / 10.0)
        ),
        None => String::new(),
    }
}

/// The electrical speed of a stand in whose log no rate was recognised.
fn rate_by_poles(guessed: &GuessedLog) -> Option<&GuessedColumn> {
    let has_rate = guessed.columns.iter().any(|it| columns::is_propeller_rate(&it.signal));
    let by_poles = |it: &&GuessedColumn| is_divided_by_poles(&it.column) && !it.reads_zero;
    guessed.columns.iter().find(by_poles).filter(|_| !has_rate)
}

/// What to look at where the sensor of a rotor's rate reads nothing but 0, or a stand's electrical speed is the only rate.
fn of_rates(guessed: &GuessedLog) -> String {
    let is_rate = |it: &&GuessedColumn| columns::is_propeller_rate(&it.signal);
    let dead =
        guessed.columns.iter().filter(|it| it.reads_zero && (is_rate(it) || is_divided_by_poles(&it.column)));
    let dead: Vec<String> = dead.map(|it| format!("`{}`", it.column)).collect();
    if let Some(it) = guessed.columns.iter().find(|it| it.certainty == Certainty::ByPoles) {
        return format!(
            "The rate is that of `{column}`, for the other one reads 0. Such stands divide it by the pole pairs that their software was \
             given; if it was given none, of a motor with 14 magnets: `--column '{column}={signal}:erpm/7'`\n",
            column = it.column,
            signal = it.signal
        );
    }
    match rate_by_poles(guessed) {
        Some(it) => format!(
            "No rate of a rotor was recognised. If `{column}` is it, `--column '{column}=propeller_rate_1_rad_s:rpm'` where the stand's \
             software was given the motor's poles, else `erpm/7` of a motor with 14 magnets\n",
            column = it.column
        ),
        _ if guessed.columns.iter().any(|it| is_rate(&it) && it.reads_zero) => format!(
            "{} 0 in all rows that were looked at: no rate was measured there\n",
            if dead.len() > 1 {
                format!("{} read", dead.join(" and "))
            } else {
                format!("{} reads", dead.concat())
            }
        ),
        _ => String::new(),
    }
}

/// What to do where no command was recognised; nothing where there is one.
fn without_command(guessed: &GuessedLog) -> String {
    let drives = |name: &str| columns::is_command(name) || name == columns::TORQUE_COMMAND;
    if guessed.mapping.signal.iter().any(|signal| drives(&signal.name)) {
        return String::new();
    }
    let is_of_body = |name: &str| [columns::BODY_ANGLE, columns::BODY_RATE].contains(&name);
    let body = if guessed.mapping.signal.iter().any(|signal| is_of_body(&signal.name)) {
        "What turns a body may be made of several columns, in the mapping: `torque_command_nm` with `columns`, `combine = \"sum\"` and \
         `weights`\n"
    } else {
        ""
    };
    let asks = match possible_commands(&guessed.columns)[..] {
        [(column, unit), ref others @ ..] => {
            let others: Vec<String> = others.iter().take(3).map(|(other, _)| format!("`{other}`")).collect();
            let also = if others.is_empty() {
                String::new()
            } else {
                format!("; it may be {}, too", others.join(" or "))
            };
            format!(
                "No command was recognised. If `{column}` is it: `--column '{column}=command_1:{unit}'`{also}\n"
            )
        }
        [] => {
            "No command was recognised. Say which column it is and what it comes in (-, %, us, ms, dshot, 8bit): \
                 `--column 'COLUMN=command_1:%'`\n"
                .to_owned()
        }
    };
    asks + body
}

/// What to do with a guess.
#[must_use]
pub fn next_step(log: &str) -> String {
    format!(
        "A guess, on which nothing is read or fitted. Look at it, then\n  \
         rotorbench import {log} --write-mapping mapping.toml     (where the guess is wrong: --column 'NAME=SIGNAL:UNIT', or mend the file)\n  \
         rotorbench import {log} --mapping mapping.toml           (--mapping holds for every command that reads logs)\n"
    )
}

/// The mapping file of a guess; what is uncertain is said above its line.
///
/// # Errors
/// Never for what a guess holds.
pub fn mapping_file(guessed: &GuessedLog, log: &str) -> Result<String, toml::ser::Error> {
    let layout = MappingConfig { signal: Vec::new(), description: log.to_owned(), ..guessed.mapping.clone() };
    let mut text = String::from("# Guessed from names and values: check each signal, above all its unit.\n");
    let plain = toml::to_string(&layout)?;
    let has_signals = !guessed.mapping.signal.is_empty();
    text += (if has_signals { plain.replace("signal = []\n", "") } else { plain }).trim_end();
    if guessed.mapping.time.is_none() {
        text += "\n\n# No column looked like the time (dates are not read): name one of seconds, or write in its place period_s = 0.01 (a row each\n# 0.01 s), or levels = true (each row is a level of a thrust stand, read off or averaged once the rotor had settled).\n[time]\ncolumn = \"?\"\nunit = \"s\"";
    }
    for signal in &guessed.mapping.signal {
        let column = guessed.columns.iter().find(|it| it.signal == signal.name);
        text += "\n\n";
        if signal.slope {
            text += "# no column holds the body's rate: the change of its angle a second; the column of a gyro is better\n";
        }
        if let Some(column) = column.filter(|it| it.certainty != Certainty::Named) {
            text += &format!("# {}\n", certainty(column.certainty));
        }
        text += "[[signal]]\n";
        let is_electrical = column.is_some_and(|it| it.certainty == Certainty::Electrical);
        let lines = toml::to_string(signal)?;
        text += (if is_electrical { assumed(&lines, signal.scale) } else { lines }).trim_end();
    }
    Ok(text + "\n")
}

/// The lines of a signal whose factor is 1 / pole pairs, of which nobody has said how many there are.
fn assumed(lines: &str, scale: f64) -> String {
    let line = |line: &str| match line.split(' ').next() {
        Some("scale") => {
            format!("scale = {} # 1 / pole pairs: {} assumed, change it\n", short(scale), short(1.0 / scale))
        }
        _ => format!("{line}\n"),
    };
    lines.lines().map(line).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cancel::Cancel;
    use crate::log::Mapping;
    use crate::log::mapped::parse;
    use crate::session::{Job, guess_columns};

    fn guessed(text: &str) -> GuessedLog {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("log.csv");
        std::fs::write(&path, text).expect("written");
        let cancel = Cancel::default();
        guess_columns(&path, &Job::unwatched(&cancel)).expect("readable").expect("a table")
    }

    #[test]
    fn a_guess_without_a_command_asks_for_it() {
        let said = text(&guessed("t (s),Gas [%],eRPM\n0,10,42000\n0.1,20,63000\n"));
        let asks = "No command was recognised. If `Gas [%]` is it: `--column 'Gas [%]=command_1:%'`";
        assert!(said.contains(asks), "{said}");
        let servos = "Time (s),ESC signal (µs),Servo 1 (µs),Servo 3 (µs),Load (%),Motor Optical Speed (RPM)";
        let said = text(&guessed(&format!("{servos}\n0,,,1000,5,10\n0.1,,,1200,6,20\n")));
        let asks =
            "If `Servo 3 (µs)` is it: `--column 'Servo 3 (µs)=command_1:us'`; it may be `Load (%)`, too";
        assert!(said.contains(asks), "{said}");
        let said = text(&guessed("t (s),Foo,eRPM\n0,10,42000\n0.1,20,63000\n"));
        assert!(said.contains("`--column 'COLUMN=command_1:%'`"), "{said}");
        assert!(!said.contains("torque_command_nm"), "{said}");
        let said = text(&guessed("time,pitch,m1,m2\n0,1,10,20\n0.1,2,20,20\n"));
        assert!(
            said.contains("`torque_command_nm` with `columns`, `combine = \"sum\"` and `weights`"),
            "{said}"
        );
        let said = text(&guessed("t (s),throttle [%],eRPM\n0,10,42000\n0.1,20,63000\n"));
        assert!(!said.contains("No command"), "{said}");
    }

    #[test]
    fn pole_pairs_that_nobody_said_are_marked_as_assumed() {
        let guessed = guessed("t (s),throttle [%],eRPM\n0,10,42000\n0.1,20,63000\n");
        assert!(text(&guessed).contains("electrical: needs the number of pole pairs"), "{}", text(&guessed));
        let file = mapping_file(&guessed, "log.csv").expect("written");
        assert!(file.contains("\nscale = 0.142857 # 1 / pole pairs: 7 assumed, change it\n"), "{file}");
        assert!(toml::from_str::<MappingConfig>(&file).is_ok(), "{file}");
    }

    #[test]
    fn a_rate_that_no_sensor_counted_is_taken_from_the_electrical_one() {
        let stand = |optical: u32, electrical: u32| {
            let head = "Time (s),ESC signal (µs),Motor Electrical Speed (RPM),Motor Optical Speed (RPM)";
            text(&guessed(&format!(
                "{head}\n0,1000,{electrical},{optical}\n0.1,1200,{electrical},{optical}\n"
            )))
        };
        let said = stand(0, 3521);
        assert!(
            said.contains("The rate is that of `Motor Electrical Speed (RPM)`, for the other one reads 0."),
            "{said}"
        );
        let said = stand(0, 0);
        let none = "`Motor Electrical Speed (RPM)` and `Motor Optical Speed (RPM)` read 0 in all rows that were looked at";
        assert!(said.contains(none), "{said}");
        for electrical in [0, 3521] {
            let said = stand(3500, electrical);
            assert!(!said.contains("read 0") && !said.contains("The rate is"), "{said}");
        }
        let said = text(&guessed("Time (s),ESC (µs),Motor Electrical Speed (RPM)\n0,1000,10\n0.1,1200,20\n"));
        let asks = "`--column 'Motor Electrical Speed (RPM)=propeller_rate_1_rad_s:rpm'`";
        assert!(said.contains(asks), "{said}");
        // The shipped mapping takes it, and says so.
        let head = "Time (s),ESC (µs),Thrust (N),Voltage (V),Current (A),Motor Electrical Speed (RPM)";
        let said = text(&guessed(&format!("{head}\n0,1000,1,12,1,10\n0.1,1200,2,12,1,20\n")));
        let reads = "reads the same signals, and the rate from `Motor Electrical Speed (RPM)`: `--mapping rcbenchmark`";
        assert!(said.contains(reads) && said.contains(asks), "{said}");
    }

    #[test]
    fn a_rate_that_is_a_slope_is_said_and_marked() {
        let guessed = guessed("time,angle (deg),u (%)\n0,1,10\n0.1,2,20\n0.2,3,20\n");
        assert!(
            text(&guessed).contains("takes the change of `angle (deg)` a second (`slope`)"),
            "{}",
            text(&guessed)
        );
        let file = mapping_file(&guessed, "log.csv").expect("written");
        assert!(file.contains("# no column holds the body's rate"), "{file}");
        let config: MappingConfig = toml::from_str(&file).expect("a mapping");
        assert_eq!(config.signal.iter().filter(|it| it.slope).count(), 1);
    }

    #[test]
    fn a_voltage_that_was_given_is_asked_about() {
        let rows = |head: &str| {
            let row = |row: u32| format!("{},{},{}\n", f64::from(row) / 50.0, row / 20 * 3, row);
            guessed(&format!("{head}\n{}", (0..100).map(row).collect::<String>()))
        };
        let said = text(&rows("t (s),Voltaje (V),Speed (rad/s)"));
        let asks = "`Voltaje (V)` goes to 0, as no battery does that turns a motor: it is not taken for the battery's. If it is: \
                    `--column 'Voltaje (V)=battery_voltage_v:V'`. If it is what the motor was given, it is the command: in the mapping \
                    `name = \"command_1\"`, `column = \"Voltaje (V)\"`, `unit = \"-\"`, `scale = 0.0833333` (1 / 12, its greatest)\n";
        assert!(said.contains(asks), "{said}");
        let said = text(&rows("t (s),Voltaje (V),PWM"));
        assert!(said.contains("goes to 0") && !said.contains("command_1\""), "{said}");
    }

    /// What is written down reads the file that it was guessed of.
    #[test]
    fn a_guess_that_is_written_reads_its_own_file() {
        let log = "time_s,motor[0],flags,flags,rate (rpm)\n0,160,0,1,off\n1,200,ANGLE,1,20\n2,300,ANGLE,1,30,9\nbye\n";
        let guessed = guessed(log);
        let said = text(&guessed);
        assert!(said.contains("holds text: left out"), "{said}");
        assert!(said.contains("count as missing (`missing` in the mapping): `off`\n"), "{said}");
        let file = mapping_file(&guessed, "log.csv").expect("written");
        let mapping = Mapping::parse(&file, Path::new("m.toml")).expect("a mapping");
        let (log, notes) = parse(log.as_bytes(), Path::new("log.csv"), &mapping, None).expect("it reads");
        assert_eq!((log.len(), notes.text_behind.count), (3, 1));
    }

    #[test]
    fn rows_seconds_apart_are_asked_about() {
        let rows = |step: f64| {
            text(&guessed(&format!(
                "t (s),throttle [%],rpm\n0,10,420\n{step},20,630\n{},30,700\n",
                2.0 * step
            )))
        };
        assert!(rows(1.7).contains("Rows are 1.7 s apart. If each is a level"), "{}", rows(1.7));
        assert!(!rows(0.1).contains("apart"), "{}", rows(0.1));
    }
}
