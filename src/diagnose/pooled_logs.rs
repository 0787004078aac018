//! Whether several logs can come from one bench. Fitted together, logs of two benches would give numbers that are true
//! of neither, and a missing effect that is the difference between them.

use super::battery_permutation::reads;
use super::block_builder::{Driver, body_stage, rotor_stage};
use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::error::DiagnoseError;
use crate::log::Dataset;
use crate::model::{Effect, Model, ModelError};

/// Two benches differ in a number by more than this factor: less is a battery, a temperature, a missing effect that
/// one experiment excites more than the other.
const FACTOR: f64 = 1.3;
/// Standard errors by which the numbers must differ, too.
const PLAINLY: f64 = 8.0;
/// One set of numbers for all logs must cost this many times the squared error of one set for each.
const COST: f64 = 2.0;
/// Most that a rotor's rate goes with the voltage: as the square with a drag that hardly grows; as the first power, or less, as
/// a rule. And how near the rates of two logs are known at a command that one of them may hardly have been at.
const POWER: f64 = 2.0;
const NEAR: f64 = 0.05;
/// Share of the voltage by which a supply was set to another.
const SET: f64 = 0.02;

/// Refuses logs that one set of the base's numbers cannot describe, where a set for each log can, and the supply's voltage
/// is no reason for it.
///
/// # Errors
/// [`DiagnoseError::DifferentBenches`] names the number and its values.
pub(crate) fn check(
    model: &Model,
    known: &[Effect],
    logs: &[Dataset],
    horizon: f64,
) -> Result<(), DiagnoseError> {
    if logs.len() < 2 {
        return Ok(());
    }
    for body in [false, true] {
        let stage = |logs: &[Dataset]| stage(model, logs, body, horizon);
        let Some(joint) = stage(logs)? else { continue };
        let joint = trial(model, known, &joint);
        let mut alone = Vec::new();
        for log in logs {
            if let Some(stage) = stage(std::slice::from_ref(log))? {
                alone.push((log, trial(model, known, &stage)));
            }
        }
        let separate: f64 = alone.iter().map(|(_, trial)| trial.fit.cost).sum();
        if joint.fit.cost > COST * separate
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

/// The block of some logs, judged on what it is fitted to.
fn stage(model: &Model, logs: &[Dataset], body: bool, horizon: f64) -> Result<Option<Stage>, ModelError> {
    let stage = if body {
        let equations = model.equations()?;
        body_stage(logs, logs, &Driver { equations: &equations, trial: None, stage: None }, horizon)?
    } else {
        rotor_stage(logs, logs)
    };
    Ok(stage.filter(|stage| stage.too_poor().is_none()))
}

/// Whether the logs may be of one bench whose supply was set to other voltages, of which the base knows nothing: the rotor is
/// faster at the higher one, by no more than a power of it that there are rotors of.
fn supply_explains(model: &Model, known: &[Effect], alone: &[(&Dataset, Trial)]) -> bool {
    if model.actuator.voltage_gain != 0.0 || known.iter().any(|law| reads(law) && model.has(&law.id)) {
        return false;
    }
    let commands = alone.iter().flat_map(|(log, _)| columns(log, &["command_1", "command_2"]));
    let Some(command) = mean(commands) else { return false };
    let each = alone.iter().map(|(log, trial)| {
        let volts = mean(columns(log, &["battery_voltage_v"]))?;
        Some((volts.ln(), trial.model.steady_rate(command).ln()))
    });
    let Some(each) = each.collect::<Option<Vec<_>>>() else { return false };
    let pairs =
        || each.iter().flat_map(|one| each.iter().map(move |other| (one.0 - other.0, one.1 - other.1)));
    let is_set = pairs().any(|(volts, _)| volts > SET);
    // Each pair comes in both orders; a voltage that has no logarithm is within no bounds.
    let mut risen = pairs().filter(|(volts, _)| volts.is_nan() || *volts >= 0.0);
    is_set && risen.all(|(volts, rates)| (-NEAR..=POWER * volts + NEAR).contains(&rates))
}

fn columns<'a>(log: &'a Dataset, names: &'a [&str]) -> impl Iterator<Item = f64> + 'a {
    let columns = names.iter().filter_map(|name| log.column(name)).flatten();
    columns.copied().filter(|value| value.is_finite())
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    (count > 0.0).then_some(sum / count)
}

fn trial(model: &Model, known: &[Effect], stage: &Stage) -> Trial {
    Plan {
        from: model,
        home: model,
        effects: Vec::new(),
        base: stage.base_parameters(model),
        known,
        without: None,
    }
    .run(stage)
}

/// The first number of those asked for in which two of the logs plainly differ.
fn differing(
    joint: &Trial,
    alone: &[(&Dataset, Trial)],
    is_asked: impl Fn(&str) -> bool,
) -> Option<DiagnoseError> {
    let value = |trial: &Trial, name: &str| {
        Some((trial.model.parameter(name)?, *trial.model.standard_errors.get(name)?))
    };
    for name in joint.names.iter().filter(|name| is_asked(name)) {
        for (index, (log, one)) in alone.iter().enumerate() {
            for (other_log, other) in &alone[index + 1..] {
                let (Some((a, a_error)), Some((b, b_error))) = (value(one, name), value(other, name)) else {
                    continue;
                };
                let apart = a.abs().max(b.abs()) > FACTOR * a.abs().min(b.abs()) || a * b < 0.0;
                if apart && (a - b).abs() > PLAINLY * a_error.hypot(b_error) {
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
