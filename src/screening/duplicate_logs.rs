//! Which logs have a part in the result, and why the others have none.

use std::borrow::Cow;

use super::excitation::FEWEST_JUMPS;
use super::rotor_data::RotorLog;
use crate::log::{Dataset, LOG_SIGNALS};
use crate::screening::Finding;
use crate::signal::ROTORS;
use crate::unit::UNITS;

/// The logs without copies of one of them, which would count twice and make the errors too small.
pub(crate) fn without_copies<'a>(logs: &'a [Dataset], warnings: &mut Vec<Finding>) -> Cow<'a, [Dataset]> {
    let first_of = |at: usize| logs[..at].iter().find(|before| is_copy(before, &logs[at]));
    let copies: Vec<usize> = (0..logs.len()).filter(|&at| first_of(at).is_some()).collect();
    for &at in &copies {
        if let Some(first) = first_of(at) {
            let (copy, first) = (logs[at].source_name(), first.source_name());
            warnings.push(
                format!("{copy}: not used: it holds the same as {first}, and would count twice").into(),
            );
        }
    }
    if copies.is_empty() {
        return Cow::Borrowed(logs);
    }
    logs.iter().enumerate().filter(|(at, _)| !copies.contains(at)).map(|(_, log)| log.clone()).collect()
}

/// The logs to validate on without those that were fitted to, whose error says nothing of other logs, and without copies
/// of one another.
pub(crate) fn without_seen<'a>(
    logs: &[Dataset],
    validation: &'a [Dataset],
    warnings: &mut Vec<Finding>,
) -> Cow<'a, [Dataset]> {
    let seen = |log: &Dataset| logs.iter().find(|seen| is_copy(seen, log));
    if !validation.iter().any(|log| seen(log).is_some()) {
        return without_copies(validation, warnings);
    }
    for (log, seen) in validation.iter().filter_map(|log| Some((log, seen(log)?))) {
        let (name, seen) = (log.source_name(), seen.source_name());
        let same = if name == seen {
            "it was".to_owned()
        } else {
            format!("it holds the same as {seen}, which was")
        };
        warnings.push(
            format!("{name}: not validated on: {same} fitted to, and its error says nothing of other logs")
                .into(),
        );
    }
    let fresh: Vec<Dataset> = validation.iter().filter(|log| seen(log).is_none()).cloned().collect();
    Cow::Owned(without_copies(&fresh, warnings).into_owned())
}

fn is_copy(one: &Dataset, other: &Dataset) -> bool {
    !one.sha256().is_empty() && one.sha256() == other.sha256()
}

/// Says so where a column is another unit's spelling of one that the log lacks.
pub(crate) fn tell_of_units(log: &Dataset, warnings: &mut Vec<Finding>) {
    for signal in LOG_SIGNALS.iter().filter(|signal| log.column(signal.name).is_none()) {
        let suffix = format!("_{}", signal.unit.to_lowercase().replace(' ', "").replace('/', "_"));
        let Some(stem) = signal.name.strip_suffix(suffix.as_str()) else { continue };
        for column in log.names().filter(|column| *column != signal.name) {
            if column == stem {
                warnings.push(format!(
                    "{}: `{column}` is not read, for its name does not say its unit: the log format has `{}` for {}; name it \
                     so if it is in {}, else import it with its unit",
                    log.source_name(),
                    signal.name,
                    signal.meaning,
                    signal.unit
                ).into());
            }
            let Some(unit) = column.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_')) else {
                continue;
            };
            let spelled = unit.replace('_', "/");
            let fits =
                |it: &&crate::unit::Unit| it.si == signal.unit && it.name.eq_ignore_ascii_case(&spelled);
            if let Some(unit) = UNITS.iter().find(fits) {
                warnings.push(format!(
                    "{}: `{column}` is not read: the log format has `{}` for {}, in {}; import it with unit `{}`",
                    log.source_name(),
                    signal.name,
                    signal.meaning,
                    signal.unit,
                    unit.name
                ).into());
            }
        }
    }
}

/// Why each of `logs` that has no part in the result has none. `rotors` are what was read of all of them, `bodies` the
/// names of those that the body was seen in, `in_vain` what kept it from being seen in others.
pub(crate) fn idle(
    logs: &[Dataset],
    rotors: &[RotorLog],
    bodies: &[String],
    in_vain: &[String],
) -> Vec<String> {
    let mut said = Vec::new();
    for log in logs {
        let name = log.source_name();
        let of_rotor = format!("{name}, rotor ");
        let mine: Vec<&RotorLog> = rotors.iter().filter(|it| it.source.starts_with(&of_rotor)).collect();
        if mine.iter().any(|rotor| has_a_part(rotor)) || bodies.iter().any(|body| body == name) {
            continue;
        }
        let of_body = format!("{name}: ");
        let in_vain = in_vain.iter().find_map(|sentence| sentence.strip_prefix(&of_body));
        said.push(format!("{name}: not used: {}", reason(log, &mine, in_vain)));
    }
    said
}

fn has_a_part(rotor: &RotorLog) -> bool {
    let thrust = rotor.thrust.as_ref().is_some_and(|thrust| thrust.iter().any(|thrust| thrust.is_finite()));
    thrust || rotor.jumps().len() >= FEWEST_JUMPS || !rotor.steady().is_empty()
}

fn reason(log: &Dataset, rotors: &[&RotorLog], in_vain: Option<&str>) -> String {
    if log.is_empty() {
        return "it has a header and no rows".to_owned();
    }
    let pair = |rotor: usize| {
        let names = [format!("command_{rotor}"), format!("propeller_rate_{rotor}_rad_s")];
        names.iter().all(|name| log.column(name).is_some())
    };
    if let Some(in_vain) = in_vain {
        return in_vain.to_owned();
    }
    if !pair(1) && !pair(2) {
        let empty = |name: &&str| log.column(name).is_none();
        let names: Vec<String> =
            log.names().map(|name| format!("{name}{}", if empty(&name) { " (empty)" } else { "" })).collect();
        let holds = if names.is_empty() { "nothing but time".to_owned() } else { names.join(", ") };
        let any = |name: fn(usize) -> String| (1..=ROTORS).any(|rotor| log.column(&name(rotor)).is_some());
        if any(|rotor| format!("propeller_rate_{rotor}_rad_s")) && !any(|rotor| format!("command_{rotor}")) {
            return format!(
                "the commands are missing: it has no command_N beside its propeller_rate_N_rad_s; it holds {holds}"
            );
        }
        return format!("it has no command_N with a propeller_rate_N_rad_s beside it; it holds {holds}");
    }
    let samples: usize = rotors.iter().map(|rotor| rotor.scored().count()).sum();
    if samples == 0 {
        return "no rate was measured while a rotor ran under a known command".to_owned();
    }
    let seconds = log.time().last().zip(log.time().first()).map_or(0.0, |(last, first)| last - first);
    format!(
        "{samples} usable samples over {} s are too few, or nothing is excited in them: k_V and g(u) ask for levels or \
         slow ramps of 5 s after settling, the pole for {FEWEST_JUMPS} jumps of the command at least",
        crate::unit::short((100.0 * seconds).round() / 100.0)
    )
}
