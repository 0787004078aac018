//! What a guess of a foreign log's columns says: a table to look at, and the mapping file that it makes.

use super::TextTable;
use crate::log::guess::{Certainty, GuessedColumn, possible_command};
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
        Certainty::Unknown => "not recognised",
        Certainty::Empty => "no numbers: left out",
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
        (Certainty::Empty | Certainty::LeftOut, _) => "-".to_owned(),
        (Certainty::Said, "") => "as it is".to_owned(),
        (_, "-") if column.scale == 1.0 && column.offset == 0.0 => "0 to 1".to_owned(),
        (_, "-") if column.scale == 1e-3 => "pulses of 1000 to 2000 µs".to_owned(),
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
        text += &format!(
            "The shipped mapping `{name}` knows these columns, reads the same signals, and names the shaft torque, too: `--mapping {name}` \
             reads this log.\n"
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
    text + &without_command(guessed)
}

/// What to do where no command was recognised; nothing where there is one.
fn without_command(guessed: &GuessedLog) -> String {
    let drives = |name: &str| columns::is_command(name) || name == columns::TORQUE_COMMAND;
    if guessed.mapping.signal.iter().any(|signal| drives(&signal.name)) {
        return String::new();
    }
    match possible_command(&guessed.columns) {
        Some((column, unit)) => format!(
            "No command was recognised. If `{column}` is it: `--column '{column}=command_1:{unit}'`\n"
        ),
        None => {
            "No command was recognised. Say which column it is and what it comes in (-, %, us, ms, dshot): \
                 `--column 'COLUMN=command_1:%'`\n"
                .to_owned()
        }
    }
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
    text += toml::to_string(&layout)?.replace("signal = []\n", "").trim_end();
    if guessed.mapping.time.is_none() {
        text += "\n\n# No column looked like the time (dates are not read): name one of seconds, or write in its place period_s = 0.01 (a row each\n# 0.01 s), or levels = true (each row is a level of a thrust stand, read off or averaged once the rotor had settled).\n[time]\ncolumn = \"?\"\nunit = \"s\"";
    }
    for signal in &guessed.mapping.signal {
        let column = guessed.columns.iter().find(|it| it.signal == signal.name);
        text += "\n\n";
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
    use super::*;
    use crate::cancel::Cancel;
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
        let said = text(&guessed("t (s),Foo,eRPM\n0,10,42000\n0.1,20,63000\n"));
        assert!(said.contains("`--column 'COLUMN=command_1:%'`"), "{said}");
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
}
