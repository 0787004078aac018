//! The signals that a name nearly says, for who reads it to ask.

use super::{GuessedColumn, MEANINGS, Words, is_pulse, measures};
use crate::log::signals::{LOG_SIGNALS, MOST_ROTORS, log_signal, of_rotor};
use crate::log::thresholds::THRESHOLDS;
use crate::signal::columns;

/// The signal of the log format that is meant by a name that is none: misspelt, or in other words.
#[must_use]
pub fn meant_by(name: &str) -> Option<String> {
    if log_signal(name).is_some() {
        return None;
    }
    misspelt(name).or_else(|| in_other_words(name))
}

/// The nearest name, a few letters away, with the same number if any is said.
fn misspelt(name: &str) -> Option<String> {
    let digits = |text: &str| text.chars().filter(char::is_ascii_digit).collect::<String>();
    let number = digits(name);
    let names = LOG_SIGNALS.iter().filter(|known| known.name != columns::TIME).flat_map(|known| {
        let of_rotors = (1..=MOST_ROTORS).filter_map(|rotor| of_rotor(known.name, rotor));
        of_rotors.chain([known.name.to_owned()])
    });
    let near = names
        .filter(|known| number.is_empty() || digits(known) == number)
        .map(|known| (distance(name, &known), known))
        .min_by_key(|(letters, _)| *letters);
    let is_long = name.len() >= THRESHOLDS.misspelt_name;
    near.filter(|(letters, _)| is_long && *letters <= THRESHOLDS.misspelt_letters).map(|(_, known)| known)
}

fn in_other_words(name: &str) -> Option<String> {
    let words = Words::of(name);
    let meaning = MEANINGS.iter().find(|meaning| {
        let fits =
            words.unit_for(meaning).is_none_or(|unit| measures(unit, meaning.si) || is_pulse(meaning, unit));
        fits && meaning.is_named_by(&words)
    })?;
    let number = words.number.unwrap_or(1);
    let is_signal = meaning.signal != columns::TIME && (1..=MOST_ROTORS).contains(&number);
    let signal = columns::of_number(meaning.signal, number);
    // A probe and what the whole battery gives are no rotor's.
    let is_of_none = words.has_part_name || words.has("battery");
    (is_signal && !(is_of_none && signal != meaning.signal)).then_some(signal)
}

/// Whether a stand divided this column's turns of the field by the pole pairs that it was given.
#[must_use]
pub fn is_divided_by_poles(column: &str) -> bool {
    Words::of(column).is_by_poles()
}

/// The columns of a guess without a command that may be one, each with the unit that its name says it has.
#[must_use]
pub fn possible_commands(guessed: &[GuessedColumn]) -> Vec<(&str, &'static str)> {
    let is_free = |it: &&GuessedColumn| log_signal(&it.signal).is_none() && it.certainty.is_read();
    let unit = |it: &'_ GuessedColumn| may_be_command(&it.column);
    guessed.iter().filter(is_free).filter_map(|it| Some((it.column.as_str(), unit(it)?))).collect()
}

/// The unit in which a column that is read as no command may be one, by its name. A servo turns by pulses as an ESC does, and stands
/// turn motors on its outputs.
#[must_use]
pub fn may_be_command(column: &str) -> Option<&'static str> {
    let command = MEANINGS.iter().find(|it| it.signal == columns::ANY_COMMAND)?;
    let words = Words::of(column);
    let is_excluded = |word: &&&str| words.has(word) && **word != "servo";
    match words.unit {
        _ if command.without.iter().any(|word| is_excluded(&word)) => None,
        Some("%") => Some("%"),
        Some("us" | "µs") => Some("us"),
        _ => None,
    }
}

/// Letters to put in, take out or change, until one name is the other.
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (at, letter) in one.chars().enumerate() {
        let mut before = row[0];
        row[0] = at + 1;
        for (place, wanted) in other.iter().enumerate() {
            let changed = before + usize::from(letter != *wanted);
            before = row[place + 1];
            row[place + 1] = changed.min(before + 1).min(row[place] + 1);
        }
    }
    row[other.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_no_signal_is_one_that_was_meant() {
        for (name, signal) in [
            ("cmd_1", "command_1"),
            ("comand_2", "command_2"),
            ("command", "command_1"),
            ("command3", "command_3"),
            ("rotor_speed_1", "propeller_rate_1_rad_s"),
            ("propeler_rate_4_rad_s", "propeller_rate_4_rad_s"),
            ("vbat", "battery_voltage_v"),
            ("motor_electrical_speed_rpm", "propeller_rate_1_rad_s"),
            ("batery_voltage_v", "battery_voltage_v"),
        ] {
            assert_eq!(meant_by(name).as_deref(), Some(signal), "{name}");
        }
        for own in ["battery_current_a", "4n76_temp_c", "319a_temp"] {
            assert_eq!(meant_by(own), None, "{own}");
        }
        for own in ["command_1", "command_17", "phase", "note", "gas", "air_pressure", "my_rad_s"] {
            assert_eq!(meant_by(own), None, "{own}");
        }
    }
}
