//! Whether several logs can come from one bench. Fitted together, logs of two benches would give numbers that are true
//! of neither, and a missing effect that is the difference between them.

use super::battery_permutation::reads;
use super::block_builder::{Driver, body_split, rotor_split};
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::error::DiagnoseError;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::mean_of;
use crate::log::Dataset;
use crate::model::{Effect, Model, ModelError};
use crate::screening::ScreenedLog;
use crate::signal::columns;

/// Refuses logs that one set of the base's numbers cannot describe, where a set for each log can, and the supply's voltage
/// is no reason for it.
///
/// # Errors
/// [`DiagnoseError::DifferentBenches`] names the number and its values.
pub(crate) fn check(
    model: &Model,
    known: &[Effect],
    logs: &[ScreenedLog],
    horizon: f64,
) -> Result<(), DiagnoseError> {
    if logs.len() < 2 {
        return Ok(());
    }
    for body in [false, true] {
        let split = |logs: &[ScreenedLog]| split(model, logs, body, horizon);
        let Some(joint) = split(logs)? else { continue };
        let joint = fitted(model, known, &joint);
        let mut alone = Vec::new();
        for log in logs {
            if let Some(split) = split(std::slice::from_ref(log))? {
                alone.push((log, fitted(model, known, &split)));
            }
        }
        let separate: f64 = alone.iter().map(|(_, fitted)| fitted.fit.cost).sum();
        if joint.fit.cost > THRESHOLDS.pooled_cost * separate
            && let Some(error) = differing(&joint, &alone, |_| true)
        {
            let in_curve = |name: &str| name.starts_with("steady_rate");
            let is_curve = differing(&joint, &alone, |name| !in_curve(name)).is_none();
            if body || !is_curve || !supply_explains(model, known, &alone) {
                return Err(error);
            }
        }
    }
    Ok(())
}

/// The block of some logs, validated on what it is fitted to.
fn split(
    model: &Model,
    logs: &[ScreenedLog],
    body: bool,
    horizon: f64,
) -> Result<Option<DataSplit>, ModelError> {
    let split = if body {
        let equations = model.equations()?;
        body_split(logs, logs, &Driver { equations: &equations, fitted: None, split: None }, horizon)?
    } else {
        rotor_split(logs, logs)
    };
    Ok(split.filter(|split| split.insufficient_data().is_none()))
}

/// Whether the logs may be of one bench whose supply was set to other voltages, of which the base knows nothing, or by a k_V alone,
/// which is another law: the rotor is faster at the higher one, by no more than a power of it that there are rotors of.
fn supply_explains(model: &Model, known: &[Effect], alone: &[(&ScreenedLog, CandidateFit)]) -> bool {
    if known.iter().any(|law| reads(law) && model.has(&law.id)) {
        return false;
    }
    let commands = alone.iter().flat_map(|(log, _)| columns(log.dataset(), &columns::COMMANDS));
    let Some(command) = mean(commands) else { return false };
    let each = alone.iter().map(|(log, fitted)| {
        let volts = mean(columns(log.dataset(), &[columns::BATTERY_VOLTAGE]))?;
        let actuator = &fitted.model.actuator;
        let lost = actuator.voltage_gain * (actuator.full_voltage - volts);
        Some((volts.ln(), (fitted.model.steady_rate(command) - lost).ln()))
    });
    let Some(each) = each.collect::<Option<Vec<_>>>() else { return false };
    let pairs =
        || each.iter().flat_map(|one| each.iter().map(move |other| (one.0 - other.0, one.1 - other.1)));
    let is_set = pairs().any(|(volts, _)| volts > THRESHOLDS.supply_differs);
    // Each pair comes in both orders; a voltage that has no logarithm is within no bounds.
    let mut risen = pairs().filter(|(volts, _)| volts.is_nan() || *volts >= 0.0);
    is_set
        && risen.all(|(volts, rates)| {
            (-THRESHOLDS.rate_uncertainty
                ..=THRESHOLDS.most_voltage_power * volts + THRESHOLDS.rate_uncertainty)
                .contains(&rates)
        })
}

fn columns<'a>(log: &'a Dataset, names: &'a [&str]) -> impl Iterator<Item = f64> + 'a {
    let columns = names.iter().filter_map(|name| log.column(name)).flatten();
    columns.copied().filter(|value| value.is_finite())
}

/// The mean of what was measured; `None` where nothing was.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    Some(mean_of(values)).filter(|mean| mean.is_finite())
}

fn fitted(model: &Model, known: &[Effect], split: &DataSplit) -> CandidateFit {
    Candidate {
        from: model,
        nominal: model,
        effects: Vec::new(),
        base: split.base_parameters(model),
        known,
        without: None,
    }
    .run(split)
}

/// The first number of those wanted in which two of the logs plainly differ.
fn differing(
    joint: &CandidateFit,
    alone: &[(&ScreenedLog, CandidateFit)],
    is_wanted: impl Fn(&str) -> bool,
) -> Option<DiagnoseError> {
    let value = |fitted: &CandidateFit, name: &str| {
        Some((fitted.model.parameter(name)?, *fitted.model.standard_errors.get(name)?))
    };
    for name in joint.names.iter().filter(|name| is_wanted(name)) {
        for (index, (log, one)) in alone.iter().enumerate() {
            for (other_log, other) in &alone[index + 1..] {
                let (Some((a, a_error)), Some((b, b_error))) = (value(one, name), value(other, name)) else {
                    continue;
                };
                let apart =
                    a.abs().max(b.abs()) > THRESHOLDS.benches_differ * a.abs().min(b.abs()) || a * b < 0.0;
                if apart && (a - b).abs() > THRESHOLDS.benches_differ_errors * a_error.hypot(b_error) {
                    return Some(DiagnoseError::DifferentBenches {
                        parameter: name.clone(),
                        log: log.source_name().to_owned(),
                        value: a,
                        other_log: other_log.source_name().to_owned(),
                        other: b,
                    });
                }
            }
        }
    }
    None
}
