//! From logs to rotors: which logs hold one, and whether their battery can take part.

use super::{IdentifyError, IdentifySettings, quantized_voltage};
use crate::estimation::quantile::quantile;
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::duplicate_logs;
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog, bounds};
use crate::unit::short;

/// A battery above its full voltage by this share is another battery.
const FULLER: f64 = 1.05;

/// [V] what the battery had at its best, where that is more than the template's has when full.
pub(crate) fn fuller_battery(logs: &[Dataset], settings: &IdentifySettings) -> Option<f64> {
    let columns = logs.iter().filter_map(|log| log.column("battery_voltage_v"));
    // A glitch of the reading is not the battery.
    let best = quantile(columns.flatten().copied(), 0.99)?;
    (best > FULLER * settings.template.actuator.full_voltage).then_some((10.0 * best).round() / 10.0)
}

/// What to say where the battery had `volts` [V], more than is taken for full.
pub(crate) fn tell_of_fuller(volts: f64, settings: &IdentifySettings) -> String {
    let full = settings.template.actuator.full_voltage;
    let taken = format!("{volts:.1} V is taken as full, so that no command counts as more than all");
    if settings.full_voltage_given {
        return format!(
            "the battery had {volts:.1} V, more than the {full:.1} V that --full-voltage-v says it has when full: {taken}; is \
             `battery_voltage_v` the voltage of that battery, of all its cells?"
        );
    }
    format!(
        "the battery had {volts:.1} V, more than the template's full {full:.1} V: {taken}; say what this bench's battery has \
         with --full-voltage-v"
    )
}

/// Every log's part of every rotor asked for.
pub(crate) fn rotor_logs(
    logs: &[Dataset],
    settings: &IdentifySettings,
    warnings: &mut Vec<Finding>,
) -> Result<Vec<RotorLog>, IdentifyError> {
    let mut rotors = Vec::new();
    let mut of_standing = Vec::new();
    for log in logs {
        duplicate_logs::columns_in_other_units(log, warnings);
        for &rotor in &settings.rotors {
            let mut told = Vec::new();
            let found = RotorLog::of(log, rotor, &mut told)?;
            // A rotor that stood all the time has nothing to say, and nothing is to be said of it beside others.
            let stood = found.as_ref().is_some_and(|found| bounds(&found.command).1 < LEAST_COMMAND);
            if let Some(found) = found.as_ref().filter(|_| !stood) {
                found.hold_against(&settings.template, &mut told);
            }
            if stood {
                of_standing.append(&mut told)
            } else {
                warnings.append(&mut told)
            }
            rotors.extend(found.filter(|rotor| rotor.scored().next().is_some()));
        }
    }
    // Of a rotor that stood only where nothing else is known to be wrong.
    if rotors.is_empty() && warnings.is_empty() {
        warnings.append(&mut of_standing);
    }
    Ok(rotors)
}

/// Whether the battery takes part: everywhere, or nowhere. Says why it cannot where it was asked for.
pub(crate) fn uses_battery(
    rotors: &[RotorLog],
    settings: &IdentifySettings,
    warnings: &mut Vec<Finding>,
) -> bool {
    if !settings.battery || rotors.is_empty() {
        return false;
    }
    let without: Vec<&str> =
        rotors.iter().filter(|rotor| rotor.voltage.is_none()).map(|rotor| rotor.source.as_str()).collect();
    if !without.is_empty() {
        warnings.push(format!(
            "no column `battery_voltage_v` with a battery's voltage in {}: k_V cannot be identified, and g(u) and p are fitted \
             without the battery's part, so they hold for the charge at which the log was made, and p takes up how the \
             battery gives way under load",
            without.join(", ")
        ).into());
        return false;
    }
    let ranges = rotors.iter().filter_map(|rotor| rotor.voltage.as_deref().map(bounds));
    let (low, high) =
        ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |all, own| (all.0.min(own.0), all.1.max(own.1)));
    if low >= high {
        warnings.push(format!(
            "`battery_voltage_v` reads {} V throughout: k_V cannot be identified from a voltage that never moves, and g(u) and \
             p are fitted without it; they hold at that voltage if a supply held it, and if the reading froze, for the \
             charge at which the log was made, with p taking up how the battery gives way under load",
            short(low)
        ).into());
        return false;
    }
    for rotor in rotors {
        let Some(voltage) = rotor.voltage.as_deref() else { continue };
        let Some((from, to, volts)) = standing(&rotor.time, voltage) else { continue };
        let is_empty = |gap: &(f64, f64)| gap.1 - gap.0 > STANDS && from >= gap.0 && to <= gap.1;
        if let Some((from, to)) = rotor.voltage_gap.filter(is_empty) {
            warnings.push(format!(
                "{}: `battery_voltage_v` has no reading between {from:.1} and {to:.1} s: the one before is taken for all of that \
                 time, and k_V and g(u) are off by what the battery did meanwhile; leave that part of the log out",
                rotor.source
            ).into());
        } else if to - from > STANDS.max(quantized_voltage::longest_tread(&rotor.time, voltage)) {
            warnings.push(format!(
                "{}: `battery_voltage_v` reads exactly {} V from {from:.1} to {to:.1} s: if that reading froze, k_V and g(u) \
                 believe it and are off; leave that part of the log out",
                rotor.source,
                short(volts)
            ).into());
        }
    }
    true
}

/// [s] [s] [V] the longest time over which a voltage keeps its value.
fn standing(time: &[f64], voltage: &[f64]) -> Option<(f64, f64, f64)> {
    let rows: Vec<usize> = (0..voltage.len()).filter(|row| voltage[*row].is_finite()).collect();
    let spans = rows.chunk_by(|a, b| voltage[*a] == voltage[*b]).map(|run| {
        let (first, last) = (run[0], run[run.len() - 1]);
        (time[first], time[last], voltage[first])
    });
    spans.max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)))
}

/// [s] over which no battery under load keeps its voltage to the last digit.
const STANDS: f64 = 30.0;
