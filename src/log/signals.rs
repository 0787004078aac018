//! The signals that the log format knows, by the names of their columns.

use crate::signal::{Channel, columns};

/// A signal of the log format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LogSignal {
    /// Column name, unit included.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub meaning: &'static str,
}

const fn signal(name: &'static str, unit: &'static str, meaning: &'static str) -> LogSignal {
    LogSignal { name, unit, meaning }
}

/// Signals of the log format that are not measured by a sensor; they come first.
const UNMEASURED: [LogSignal; 4] = [
    signal(columns::TIME, "s", "time"),
    signal(columns::COMMANDS[0], "-", "command of rotor 1, 0 to 1"),
    signal(columns::COMMANDS[1], "-", "command of rotor 2, 0 to 1"),
    signal(columns::TORQUE_COMMAND, "N m", "commanded torque"),
];

/// The signals that the log format knows; other columns are carried along under their own names.
pub const LOG_SIGNALS: &[LogSignal] = &log_signals();

const fn log_signals() -> [LogSignal; UNMEASURED.len() + Channel::LOG_SIGNALS.len()] {
    let mut signals = [UNMEASURED[0]; UNMEASURED.len() + Channel::LOG_SIGNALS.len()];
    let mut place = 0;
    while place < signals.len() {
        signals[place] = if place < UNMEASURED.len() {
            UNMEASURED[place]
        } else {
            let channel = Channel::LOG_SIGNALS[place - UNMEASURED.len()];
            signal(channel.column(), channel.unit(), channel.meaning())
        };
        place += 1;
    }
    signals
}

/// Most rotors of one machine.
pub const MOST_ROTORS: usize = 16;

/// The signal of the log format with this name. Of rotors there may be more than the two of a bench: `command_4` is the
/// command of the fourth.
#[must_use]
pub fn log_signal(name: &str) -> Option<&'static LogSignal> {
    LOG_SIGNALS.iter().find(|known| known.name == name).or_else(|| {
        let of_first = of_rotor(name, 1)?;
        LOG_SIGNALS.iter().find(|known| known.name == of_first)
    })
}

/// Whether a table with these columns is in our own format: the time under our name, and another signal of ours. Programs of others
/// call their time `time_s`, too.
#[must_use]
pub fn are_ours<'a>(names: impl Iterator<Item = &'a str> + Clone) -> bool {
    let mut signals = names.clone().filter(|name| *name != columns::TIME);
    names.clone().any(|name| name == columns::TIME) && signals.any(|name| log_signal(name).is_some())
}

/// The name that the same signal has on rotor `number`; `None` where it is no rotor's.
#[must_use]
pub fn of_rotor(name: &str, number: usize) -> Option<String> {
    let (stem, rotor, rest) = rotor_parts(name)?;
    (1..=MOST_ROTORS).contains(&rotor).then(|| format!("{stem}_{number}{rest}"))
}

/// Which rotor a signal of the log format is of, from 1.
#[must_use]
pub fn rotor_of(name: &str) -> Option<usize> {
    let (_, rotor, _) = rotor_parts(name)?;
    log_signal(name).map(|_| rotor)
}

/// `command_4` as `command`, 4 and nothing; `current_4_a` as `current`, 4 and `_a`.
fn rotor_parts(name: &str) -> Option<(&str, usize, &str)> {
    name.match_indices('_').find_map(|(at, _)| {
        let digits = name[at + 1..].bytes().take_while(u8::is_ascii_digit).count();
        let (number, rest) = name[at + 1..].split_at(digits);
        let is_whole = rest.is_empty() || rest.starts_with('_');
        number.parse().ok().filter(|_| is_whole).map(|number| (&name[..at], number, rest))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_of_our_name_alone_makes_no_log_of_ours() {
        let ours = |names: &[&str]| are_ours(names.iter().copied());
        assert!(ours(&["time_s", "note", "command_3"]));
        assert!(!ours(&["time_s", "commanded_deg_s", "feedback_deg_s"]));
        assert!(!ours(&["t", "command_1"]) && !ours(&["time_s"]));
    }

    #[test]
    fn signals_of_further_rotors_are_known() {
        assert_eq!(log_signal("command_4").map(|it| it.unit), Some("-"));
        assert_eq!(log_signal("propeller_rate_12_rad_s").map(|it| it.unit), Some("rad/s"));
        for unknown in ["command_17", "command_0", "command_x", "command", "phase_2", "body_rate_2_rad_s"] {
            assert_eq!(log_signal(unknown), None, "{unknown}");
        }
        assert_eq!(
            (rotor_of("current_3_a"), rotor_of("body_rate_rad_s"), rotor_of("phase_2")),
            (Some(3), None, None)
        );
        assert_eq!(of_rotor("current_3_a", 1).as_deref(), Some("current_1_a"));
    }
}
