//! Why a log cannot be used at all.

use super::Finding;
use crate::log::Dataset;
use crate::signal::columns::is_propeller_rate;

/// A log, or what it lacks, that no fit can start from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScreeningError {
    /// A column that cannot be what its name says: whatever is fitted to it would be taken for physics.
    #[error("{0}")]
    Column(Box<Finding>),
    /// A log whose rotors and body have no row that counts.
    #[error("{log}: nothing to compare: no row counts ({})", .reasons.join(", "))]
    NothingScored {
        /// The log.
        log: String,
        /// Codes of what was found.
        reasons: Vec<&'static str>,
    },
    /// No log has what any block of a model needs.
    #[error(
        "nothing to compare: a rotor needs its command and its rate (`command_1` with `propeller_rate_1_rad_s`), the body \
         needs `body_rate_rad_s` with the rates or commands of both rotors or with `torque_command_nm`; {}", .held.join("; ")
    )]
    NothingInCommon {
        /// What each log holds.
        held: Vec<String>,
        /// Formats of other programs in which those came that hold no rotor's rate.
        formats: Vec<&'static str>,
    },
}

impl ScreeningError {
    /// What none of the logs has, beside what each of them holds instead.
    #[must_use]
    pub fn nothing_in_common(logs: &[&Dataset]) -> Self {
        let held = |log: &&Dataset| format!("{} holds {}", log.source_name(), columns(log));
        let has_rate = |log: &Dataset| log.names().any(|it| is_propeller_rate(it) && log.has(it));
        let without = logs.iter().filter(|log| !has_rate(log));
        let formats = without.map(|log| log.format()).filter(|format| !format.is_empty());
        Self::NothingInCommon { held: logs.iter().map(held).collect(), formats: formats.collect() }
    }
}

fn columns(log: &Dataset) -> String {
    let name = |name| {
        let empty = !log.column(name).unwrap_or(&[]).iter().any(|value| value.is_finite());
        if empty { format!("`{name}` (without a value)") } else { format!("`{name}`") }
    };
    let mut names: Vec<String> = Vec::new();
    let mut all = log.names().peekable();
    while let Some(first) = all.next() {
        let (mut last, said) = (first, name(first));
        while let Some(next) =
            all.next_if(|next| follows(last, next) && name(next) == said.replace(first, next))
        {
            last = next;
        }
        // Of two each stands for itself.
        let is_run = last != first && !follows(first, last);
        let others = if last == first { String::new() } else { name(last) };
        names.push(match (is_run, others.is_empty()) {
            (true, _) => format!("{said} to {others}"),
            (false, false) => format!("{said}, {others}"),
            (false, true) => said,
        });
    }
    if names.is_empty() { "nothing but time".to_owned() } else { names.join(", ") }
}

/// Whether a column is the next one of a numbered kind: `command_2` behind `command_1`.
fn follows(name: &str, next: &str) -> bool {
    let parts = |name: &str| {
        let place = name.split('_').position(|part| part.parse::<usize>().is_ok())?;
        let number: usize = name.split('_').nth(place)?.parse().ok()?;
        let others: Vec<String> = name
            .split('_')
            .enumerate()
            .filter(|(at, _)| *at != place)
            .map(|(_, part)| part.to_owned())
            .collect();
        Some((others, number))
    };
    let (Some((kind, number)), Some((other, next))) = (parts(name), parts(next)) else { return false };
    kind == other && number.checked_add(1) == Some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_without_a_value_differ_from_those_with_one() {
        let mut log = Dataset::new("a.csv", "", vec![0.0, 1.0]).expect("time rises");
        log.insert("command_1", vec![0.6; 2]).expect("fits");
        log.insert("current_1_a", vec![f64::NAN; 2]).expect("fits");
        let ScreeningError::NothingInCommon { held, .. } = ScreeningError::nothing_in_common(&[&log]) else {
            panic!("another error");
        };
        assert_eq!(held, ["a.csv holds `command_1`, `current_1_a` (without a value)"]);
    }

    #[test]
    fn three_and_more_columns_of_a_kind_are_said_by_their_ends() {
        let said = |without: &str| {
            let mut log = Dataset::new("a.csv", "", vec![0.0, 1.0]).expect("time rises");
            for name in ["command_1", "command_2", "command_3", "current_1_a", "current_2_a", "command_5"] {
                log.insert(name, vec![if name == without { f64::NAN } else { 0.6 }; 2]).expect("fits");
            }
            columns(&log)
        };
        assert_eq!(said(""), "`command_1` to `command_3`, `current_1_a`, `current_2_a`, `command_5`");
        let one_empty = said("command_2");
        assert!(
            one_empty.starts_with("`command_1`, `command_2` (without a value), `command_3`, "),
            "{one_empty}"
        );
    }
}
