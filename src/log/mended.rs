//! A guess that somebody mends: what a column becomes, and in which unit it comes.

use super::guess::{Certainty, GuessedColumn, meant_by, own_name, said_unit};
use super::signals::{log_signal, rotor_of};
use crate::signal::columns;
use crate::unit::{UNITS, Unit, UnitError};

/// Why a guess cannot be mended so.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MendError {
    /// No such column.
    #[error("there is no column `{column}`; there are {present}")]
    Column {
        /// What was asked for.
        column: String,
        /// The columns that are there.
        present: String,
    },
    /// A name that no signal can have.
    #[error(
        "column `{column}`: `{signal}` is no name of a signal: names are of small letters, digits and `_`"
    )]
    Signal {
        /// The column.
        column: String,
        /// What it was to become.
        signal: String,
    },
    /// A unit that does not measure the signal.
    #[error("column `{column}`")]
    Unit {
        /// The column.
        column: String,
        /// What is wrong with it.
        source: UnitError,
    },
    /// An electrical rate without the pole pairs.
    #[error(
        "column `{column}`: `{unit}` is electrical: say the motor's pole pairs, half of its magnets, as `erpm/7`, from `erpm/1` to \
         `erpm/24`"
    )]
    PolePairs {
        /// The column.
        column: String,
        /// What was said.
        unit: String,
    },
    /// A unit of a channel that is only carried along.
    #[error(
        "column `{column}`: `{signal}` is no signal of the log format: it is carried along as it is, without a unit{}",
        meant.as_ref().map_or_else(String::new, |meant| format!("; meant: `{meant}`?"))
    )]
    Own {
        /// The column.
        column: String,
        /// What it was to become.
        signal: String,
        /// The signal that was meant, perhaps.
        meant: Option<String>,
    },
    /// A form that no command comes in.
    #[error("column `{column}`: `{signal}` does not come in `{unit}`; a command comes in {}", forms())]
    Command {
        /// The column.
        column: String,
        /// What it was to become.
        signal: String,
        /// What was said.
        unit: String,
    },
}

/// How a column's numbers become a signal: `(cell * scale + offset)` in `unit`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// What it is called: the unit, or of a command the form it comes in.
    pub name: &'static str,
    /// Unit of what scale and offset make of it.
    pub unit: &'static str,
    /// Factor.
    pub scale: f64,
    /// Added after the factor.
    pub offset: f64,
}

const fn conversion(name: &'static str, unit: &'static str, scale: f64, offset: f64) -> Conversion {
    Conversion { name, unit, scale, offset }
}

/// Forms that commands come in: 0 to 1, percent, pulses of 1000 to 2000 µs, the same in ms, DShot of 48 to 2047, a duty of 8 bits.
const COMMANDS: [Conversion; 6] = [
    conversion("-", "-", 1.0, 0.0),
    conversion("%", "%", 1.0, 0.0),
    conversion("us", "-", 1e-3, -1.0),
    conversion("ms", "-", 1.0, -1.0),
    conversion("dshot", "-", 1.0 / 1999.0, -48.0 / 1999.0),
    conversion("8bit", "-", 1.0 / 255.0, 0.0),
];

/// Electrical revolutions a minute of a motor with so many pole pairs.
const ELECTRICAL: [Conversion; 24] = [
    electrical("erpm/1", 1.0),
    electrical("erpm/2", 2.0),
    electrical("erpm/3", 3.0),
    electrical("erpm/4", 4.0),
    electrical("erpm/5", 5.0),
    electrical("erpm/6", 6.0),
    electrical("erpm/7", 7.0),
    electrical("erpm/8", 8.0),
    electrical("erpm/9", 9.0),
    electrical("erpm/10", 10.0),
    electrical("erpm/11", 11.0),
    electrical("erpm/12", 12.0),
    electrical("erpm/13", 13.0),
    electrical("erpm/14", 14.0),
    electrical("erpm/15", 15.0),
    electrical("erpm/16", 16.0),
    electrical("erpm/17", 17.0),
    electrical("erpm/18", 18.0),
    electrical("erpm/19", 19.0),
    electrical("erpm/20", 20.0),
    electrical("erpm/21", 21.0),
    electrical("erpm/22", 22.0),
    electrical("erpm/23", 23.0),
    electrical("erpm/24", 24.0),
];

const fn electrical(name: &'static str, pole_pairs: f64) -> Conversion {
    conversion(name, "rpm", 1.0 / pole_pairs, 0.0)
}

/// The forms of commands, as they are written.
fn forms() -> String {
    COMMANDS.map(|form| format!("`{}`", form.name)).join(", ")
}

/// The units that a signal may come in, each once; none of a channel that is only carried along.
#[must_use]
pub fn conversions(signal: &str) -> Vec<Conversion> {
    let Some(known) = log_signal(signal) else { return Vec::new() };
    if columns::is_command(signal) {
        return COMMANDS.to_vec();
    }
    let mut found: Vec<&Unit> = Vec::new();
    for unit in UNITS.iter().filter(|unit| unit.si == known.unit && !unit.name.is_empty()) {
        if !found.iter().any(|it| (it.scale, it.offset) == (unit.scale, unit.offset)) {
            found.push(unit);
        }
    }
    let units = found.into_iter().map(|unit| conversion(unit.name, unit.name, 1.0, 0.0));
    // Of one pole pair it is `rpm` itself.
    units.chain(ELECTRICAL.into_iter().skip(1).filter(|_| is_rate_of_rotor(signal))).collect()
}

fn is_rate_of_rotor(signal: &str) -> bool {
    rotor_of(signal).is_some_and(|rotor| signal == columns::propeller_rate(rotor))
}

/// Whether a column comes so.
#[must_use]
pub fn is_in(column: &GuessedColumn, conversion: &Conversion) -> bool {
    let spelled = |name: &str| UNITS.iter().find(|unit| unit.name == name);
    let same = |a: &Unit, b: &Unit| (a.si, a.scale, a.offset) == (b.si, b.scale, b.offset);
    let is_same = spelled(&column.unit).zip(spelled(conversion.unit)).is_some_and(|(a, b)| same(a, b));
    is_same && (column.scale, column.offset) == (conversion.scale, conversion.offset)
}

/// Says what a column becomes: a signal in a unit (where none is said, the one that its name says, else SI), a channel of its own, or, as `-`, nothing. A column that was
/// to become the same is carried along instead.
///
/// # Errors
/// [`MendError`]; nothing is changed then.
pub fn mend(
    columns: &mut [GuessedColumn],
    column: &str,
    signal: &str,
    unit: Option<&str>,
) -> Result<(), MendError> {
    let Some(place) = columns.iter().position(|it| it.column == column) else {
        let present: Vec<String> = columns.iter().map(|it| format!("`{}`", it.column)).collect();
        return Err(MendError::Column { column: column.to_owned(), present: present.join(", ") });
    };
    if signal == "-" {
        let name = free(columns, place, "");
        put(&mut columns[place], name, ("", 1.0, 0.0), Certainty::LeftOut);
        return Ok(());
    }
    let plain = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_';
    if signal.is_empty() || !signal.chars().all(plain) {
        return Err(MendError::Signal { column: column.to_owned(), signal: signal.to_owned() });
    }
    let comes = comes_in(column, signal, unit)?;
    if let Some(other) = columns.iter().position(|it| it.signal == signal).filter(|it| *it != place) {
        let name = free(columns, other, signal);
        let certainty =
            if columns[other].certainty.is_read() { Certainty::Said } else { columns[other].certainty };
        put(&mut columns[other], name, ("", 1.0, 0.0), certainty);
    }
    put(&mut columns[place], signal.to_owned(), comes, Certainty::Said);
    Ok(())
}

fn put(
    column: &mut GuessedColumn,
    signal: String,
    (unit, scale, offset): (&str, f64, f64),
    certainty: Certainty,
) {
    unit.clone_into(&mut column.unit);
    (column.signal, column.scale, column.offset, column.certainty) = (signal, scale, offset, certainty);
}

/// The own name of a column beside the signals of the others, and one that is given away.
fn free(columns: &[GuessedColumn], place: usize, given: &str) -> String {
    let others = columns.iter().enumerate().filter(|(at, _)| *at != place).map(|(_, it)| it.signal.as_str());
    own_name(&columns[place].column, others.chain([given]))
}

/// Unit, factor and offset of a column that becomes `signal`.
fn comes_in<'a>(column: &str, signal: &str, unit: Option<&'a str>) -> Result<(&'a str, f64, f64), MendError> {
    let Some(known) = log_signal(signal) else {
        let own = || MendError::Own {
            column: column.to_owned(),
            signal: signal.to_owned(),
            meant: meant_by(signal),
        };
        return if unit.is_none_or(str::is_empty) { Ok(("", 1.0, 0.0)) } else { Err(own()) };
    };
    let word = unit.unwrap_or_else(|| said_unit(column, known.unit).unwrap_or(known.unit));
    let forms: &[Conversion] = if columns::is_command(signal) {
        &COMMANDS
    } else if is_rate_of_rotor(signal) {
        &ELECTRICAL
    } else {
        &[]
    };
    let form = forms.iter().find(|it| it.name == word);
    if let Some(form) = form {
        return Ok((form.unit, form.scale, form.offset));
    }
    match Unit::parse(word, known.unit) {
        Ok(_) => Ok((word, 1.0, 0.0)),
        Err(_) if columns::is_command(signal) => {
            let [column, signal, unit] = [column, signal, word].map(str::to_owned);
            Err(MendError::Command { column, signal, unit })
        }
        Err(_) if is_rate_of_rotor(signal) && word.to_ascii_lowercase().starts_with("erpm") => {
            Err(MendError::PolePairs { column: column.to_owned(), unit: word.to_owned() })
        }
        Err(source) => Err(MendError::Unit { column: column.to_owned(), source }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::guess::guess;
    use super::*;
    use crate::log::sniff::SampledColumn;

    fn stand() -> Vec<GuessedColumn> {
        let column = |name: &str, values: &[f64]| SampledColumn {
            name: name.to_owned(),
            values: values.to_vec(),
            ..SampledColumn::default()
        };
        guess(&[
            column("Time (s)", &[0.0, 0.01]),
            column("ESC (µs)", &[1000.0, 1500.0]),
            column("Speed", &[700.0, 710.0]),
            column("Optical Speed (rpm)", &[7000.0, 7100.0]),
            column("note", &[f64::NAN, f64::NAN]),
        ])
    }

    fn column<'a>(columns: &'a [GuessedColumn], name: &str) -> &'a GuessedColumn {
        columns.iter().find(|it| it.column == name).expect("a column")
    }

    #[test]
    fn a_unit_that_the_name_says_is_the_first_that_is_offered() {
        let values = vec![100.0, 700.0];
        let mut columns =
            guess(&[SampledColumn { name: "Load cell [gf]".to_owned(), values, ..SampledColumn::default() }]);
        for (unit, wanted) in [(None, "gf"), (Some("N"), "N")] {
            mend(&mut columns, "Load cell [gf]", "thrust_1_n", unit).expect("mended");
            assert_eq!(columns[0].unit, wanted);
        }
    }

    #[test]
    fn what_is_said_replaces_the_guess_and_a_signal_is_given_once() {
        let mut columns = stand();
        let signal = "propeller_rate_1_rad_s";
        let other = if column(&columns, "Speed").signal == signal { "Optical Speed (rpm)" } else { "Speed" };
        let had = columns.iter().find(|it| it.signal == signal).expect("guessed").column.clone();
        mend(&mut columns, other, signal, Some("rpm")).expect("mended");
        let said = column(&columns, other);
        assert_eq!(
            (said.signal.as_str(), said.unit.as_str(), said.certainty),
            (signal, "rpm", Certainty::Said)
        );
        assert_ne!(column(&columns, &had).signal, signal, "it is carried along");
        mend(&mut columns, "ESC (µs)", "command_2", Some("dshot")).expect("mended");
        let command = column(&columns, "ESC (µs)");
        assert_eq!((command.unit.as_str(), command.scale), ("-", 1.0 / 1999.0));
        let is = |it: &&Conversion| is_in(command, it);
        assert_eq!(
            conversions("command_2").iter().filter(is).map(|it| it.name).collect::<Vec<_>>(),
            ["dshot"]
        );
        mend(&mut columns, other, "-", None).expect("left out");
        assert!(!column(&columns, other).certainty.is_read());
        mend(&mut columns, other, "my_speed", None).expect("carried along");
        assert_eq!(column(&columns, other).signal, "my_speed");
        // A column's own name may be given to another, too.
        mend(&mut columns, other, "note", None).expect("carried along");
        let named = |name: &str| columns.iter().filter(|it| it.signal == name).count();
        assert_eq!((named("note"), named("note_2")), (1, 1));
    }

    #[test]
    fn an_electrical_rate_comes_in_pole_pairs() {
        let rate = "propeller_rate_1_rad_s";
        let mut columns = guess(&[SampledColumn {
            name: "eRPM".to_owned(),
            values: vec![42_000.0],
            ..SampledColumn::default()
        }]);
        let shown = |columns: &[GuessedColumn]| -> Vec<&str> {
            conversions(rate).iter().filter(|it| is_in(&columns[0], it)).map(|it| it.name).collect()
        };
        assert_eq!(shown(&columns), ["erpm/7"], "as it is guessed");
        mend(&mut columns, "eRPM", rate, Some("erpm/6")).expect("mended");
        assert_eq!((columns[0].unit.as_str(), columns[0].scale), ("rpm", 1.0 / 6.0));
        assert_eq!(shown(&columns), ["erpm/6"]);
        for unit in ["erpm", "eRPM/x", "erpm/25"] {
            let refused = mend(&mut columns, "eRPM", rate, Some(unit)).expect_err("no pole pairs");
            assert!(refused.to_string().contains("half of its magnets"), "{refused}");
        }
        assert!(conversions("body_rate_rad_s").iter().all(|it| !it.name.starts_with("erpm")));
    }

    #[test]
    fn what_cannot_be_is_refused_and_changes_nothing() {
        let mut columns = stand();
        let before = columns.clone();
        for (name, signal, unit) in [
            ("gone", "command_1", None),
            ("Speed", "Not a name", None),
            ("Speed", "", None),
            ("Speed", "propeller_rate_1_rad_s", Some("V")),
            ("Speed", "propeller_rate_1_rad_s", Some("us")),
            ("Speed", "my_speed", Some("rpm")),
        ] {
            assert!(mend(&mut columns, name, signal, unit).is_err(), "{name}, {signal}, {unit:?}");
        }
        assert_eq!(columns, before);
        let mut said = |signal, unit| {
            mend(&mut columns, "Speed", signal, Some(unit)).expect_err("cannot be").to_string()
        };
        assert!(
            said("command", "%").ends_with("without a unit; meant: `command_1`?"),
            "{}",
            said("command", "%")
        );
        assert!(said("my_own", "%").ends_with("without a unit"));
        assert!(
            said("command_1", "percent").ends_with("comes in `-`, `%`, `us`, `ms`, `dshot`, `8bit`"),
            "{}",
            said("command_1", "percent")
        );
        assert_eq!(conversions("my_speed"), []);
        let rates = conversions("propeller_rate_3_rad_s");
        assert!(rates.iter().any(|it| it.name == "rpm") && !rates.iter().any(|it| it.name == "RPM"));
    }
}
