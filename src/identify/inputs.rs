//! From logs to rotors: which logs hold one, and whether their battery can take part.

use super::IdentifySettings;
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::quantile;
use crate::log::Cells;
use crate::model::Model;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::{Finding, ScreenedLog};
use crate::signal::columns;

/// [V] what the battery had at its best, where that is more than the template's has when full.
pub(crate) fn fuller_battery(logs: &[ScreenedLog], template: &Model) -> Option<f64> {
    let cells = logs.iter().filter_map(|log| log.dataset().cells(columns::BATTERY_VOLTAGE));
    let readings: Vec<Cells> = cells.map(|cells| cells.for_once()).collect();
    // A glitch of the reading is not the battery.
    let best = quantile(readings.iter().flatten().copied(), THRESHOLDS.best_voltage)?;
    (best > THRESHOLDS.fuller_battery * template.actuator.full_voltage)
        .then_some((10.0 * best).round() / 10.0)
}

/// The battery had `volts` [V], more than is taken for full.
pub(crate) fn above_full(volts: f64, settings: &IdentifySettings) -> Finding {
    let full = settings.template.actuator.full_voltage;
    Finding::new("battery_above_full_voltage", columns::BATTERY_VOLTAGE)
        .with("voltage_v", volts)
        .with("full_voltage_v", full)
        .with("full_voltage_from", settings.full_voltage_from())
}

/// Every log's part of every rotor asked for.
pub(crate) fn rotor_logs(
    logs: &[ScreenedLog],
    settings: &IdentifySettings,
    warnings: &mut Vec<Finding>,
) -> Vec<RotorLog> {
    let mut rotors = Vec::new();
    let mut of_standing = Vec::new();
    for log in logs {
        warnings.extend(log.column_findings().cloned());
        for rotor in settings.rotors.iter().filter_map(|number| log.rotor(*number)) {
            // A rotor that stood all the time has nothing to say, and nothing is to be said of it beside others.
            if rotor.turns() {
                warnings.extend(rotor.findings().cloned());
            } else {
                of_standing.extend(rotor.findings().cloned());
            }
            rotors.extend(rotor.scored().next().map(|_| rotor.data().clone()));
        }
    }
    // Of a rotor that stood only where nothing else is known to be wrong.
    if rotors.is_empty() && warnings.is_empty() {
        warnings.append(&mut of_standing);
    }
    rotors
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
    let without = rotors.iter().filter(|rotor| rotor.voltage.is_none()).map(|rotor| rotor.source());
    let without: Vec<String> = without.collect();
    if !without.is_empty() {
        warnings.push(Finding::new("battery_not_logged", columns::BATTERY_VOLTAGE).with("logs", without));
        return false;
    }
    let ranges = rotors.iter().filter_map(|rotor| rotor.voltage.as_deref().map(bounds));
    let (low, high) =
        ranges.fold((f64::INFINITY, f64::NEG_INFINITY), |all, own| (all.0.min(own.0), all.1.max(own.1)));
    if low >= high {
        warnings.push(Finding::new("battery_constant", columns::BATTERY_VOLTAGE).with("voltage_v", low));
        return false;
    }
    true
}
