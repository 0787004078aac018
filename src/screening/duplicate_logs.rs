//! Which logs have a part in the result, and why the others have none: copies, columns that are missing, nothing excited.

use super::excitation::FEWEST_JUMPS;
use super::rotor_data::RotorLog;
use super::screened_log::ScreenedLog;
use crate::log::Dataset;
use crate::log::guess::meant_by;
use crate::log::signals::MOST_ROTORS;
use crate::screening::Finding;
use crate::signal::columns;

/// The logs without copies of one of them, which would count twice and make the errors too small.
pub(crate) fn without_copies(logs: &[ScreenedLog], warnings: &mut Vec<Finding>) -> Vec<ScreenedLog> {
    let mut kept: Vec<ScreenedLog> = Vec::new();
    for log in logs {
        match kept.iter().find(|before| is_copy(before, log)) {
            Some(first) => {
                warnings.push(not_used(log.raw(), "duplicate").with("same_as", first.source_name()));
            }
            None => kept.push(log.clone()),
        }
    }
    kept
}

/// The logs to validate on without those that were fitted to, whose error says nothing of other logs, and without copies
/// of one another.
pub(crate) fn without_seen(
    logs: &[ScreenedLog],
    validation: &[ScreenedLog],
    warnings: &mut Vec<Finding>,
) -> Vec<ScreenedLog> {
    let seen = |log: &ScreenedLog| logs.iter().find(|seen| is_copy(seen, log));
    for (log, seen) in validation.iter().filter_map(|log| Some((log, seen(log)?))) {
        let finding = Finding::new("validation_log_was_fitted", "").of(log.source_name());
        warnings.push(finding.with("same_as", seen.source_name()));
    }
    let fresh: Vec<ScreenedLog> = validation.iter().filter(|log| seen(log).is_none()).cloned().collect();
    without_copies(&fresh, warnings)
}

/// Whether two logs are the same rows of one file. Two parts or flights of one recording are two logs.
pub(super) fn is_copy(one: &ScreenedLog, other: &ScreenedLog) -> bool {
    let [one, other] = [one.raw(), other.raw()];
    let ends = |log: &Dataset| (log.time().first().copied(), log.time().last().copied());
    !one.sha256().is_empty() && one.sha256() == other.sha256() && ends(one) == ends(other)
}

/// A log that has no part in the result, and why.
fn not_used(log: &Dataset, reason: &'static str) -> Finding {
    Finding::new("log_not_used", "").of(log.source_name()).with("reason", reason)
}

/// Why each of `logs` that has no part in the result has none. `rotors` are what was read of all of them, `bodies` the
/// names of those that the body was seen in, `in_vain` what kept it from being seen in others.
pub(crate) fn idle(
    logs: &[ScreenedLog],
    rotors: &[RotorLog],
    bodies: &[String],
    in_vain: &[Finding],
) -> Vec<Finding> {
    let mut found = Vec::new();
    for log in logs.iter().map(ScreenedLog::raw) {
        let name = log.source_name();
        let mine: Vec<&RotorLog> = rotors.iter().filter(|it| it.file == name).collect();
        if mine.iter().any(|rotor| has_a_part(rotor)) || bodies.iter().any(|body| body == name) {
            continue;
        }
        found.push(reason(log, &mine, in_vain.iter().find(|finding| finding.log == name)));
    }
    found
}

fn has_a_part(rotor: &RotorLog) -> bool {
    let thrust = rotor.thrust.as_ref().is_some_and(|thrust| thrust.iter().any(|thrust| thrust.is_finite()));
    thrust || rotor.jumps().len() >= FEWEST_JUMPS || !rotor.steady().is_empty()
}

fn reason(log: &Dataset, rotors: &[&RotorLog], in_vain: Option<&Finding>) -> Finding {
    if log.is_empty() {
        return not_used(log, "no_rows");
    }
    if let Some(in_vain) = in_vain {
        return not_used(log, "body_not_seen").because(in_vain.clone());
    }
    let has = |name: String| log.has(&name);
    let (command, rate) = (columns::command, columns::propeller_rate);
    let mut numbers = 1..=MOST_ROTORS;
    if !numbers.clone().any(|rotor| has(command(rotor)) && has(rate(rotor))) {
        let without_commands =
            numbers.clone().any(|rotor| has(rate(rotor))) && !numbers.any(|rotor| has(command(rotor)));
        let empty = log.names().filter(|name| !log.has(name)).map(str::to_owned);
        return not_used(log, if without_commands { "no_commands" } else { "no_rotor_columns" })
            .with("columns", log.names().map(str::to_owned).collect::<Vec<String>>())
            .with("empty_columns", empty.collect::<Vec<String>>())
            .with("format", log.format());
    }
    let samples: usize = rotors.iter().map(|rotor| rotor.scored().count()).sum();
    if samples == 0 {
        let (dead, instead) = dead_rates(log);
        return not_used(log, "no_rate_under_command").with("dead", dead).with("instead", instead);
    }
    let seconds = log.time().last().zip(log.time().first()).map_or(0.0, |(last, first)| last - first);
    let finding = not_used(log, "not_excited").rows(samples).with("seconds", seconds);
    finding.with("fewest_jumps", FEWEST_JUMPS)
}

/// The rates that read nothing but 0, and the columns of no signal that move and may be meant for them.
fn dead_rates(log: &Dataset) -> (Vec<String>, Vec<String>) {
    let is_dead = |name: &&str| {
        columns::is_propeller_rate(name)
            && log.column(name).is_some_and(|values| values.iter().all(|it| it.is_nan() || *it == 0.0))
    };
    let dead: Vec<String> = log.names().filter(is_dead).map(str::to_owned).collect();
    let is_meant = |name: &&str| meant_by(name).is_some_and(|signal| dead.contains(&signal));
    let moves = |name: &&str| {
        log.column(name).is_some_and(|values| values.iter().any(|it| it.is_finite() && *it != 0.0))
    };
    let instead = log.names().filter(is_meant).filter(moves).map(str::to_owned).collect();
    (dead, instead)
}

#[cfg(test)]
mod tests {
    use super::super::requirements::repeated;
    use super::*;

    #[test]
    fn flights_of_one_file_are_logs_of_their_own_for_every_command() {
        let flight = |hash: &str, from: f64| -> ScreenedLog {
            Dataset::new("f.bbl", hash, vec![from, from + 1.0]).expect("time rises").into()
        };
        let (first, second) = ([flight("1", 0.0)], [flight("1", 5.0)]);
        let mut findings = Vec::new();
        assert_eq!(without_seen(&first, &second, &mut findings).len(), 1);
        assert!(findings.is_empty() && repeated(&first, &second).is_empty());
        assert!(without_seen(&first, &first, &mut findings).is_empty());
        assert_eq!(
            (findings[0].code, repeated(&first, &first)[0].code),
            ("validation_log_was_fitted", "log_fitted_and_validated")
        );
        // What no file holds has no hash: the same times do not make two logs one.
        assert_eq!(without_copies(&[flight("", 0.0), flight("", 0.0)], &mut findings).len(), 2);
        assert!(repeated(&[flight("", 0.0)], &[flight("", 0.0)]).is_empty());
    }
}
