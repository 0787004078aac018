//! Whether several logs can come from one bench. Fitted together, logs of two benches would give numbers that are true
//! of neither, and a missing effect that is the difference between them.

use super::plan::Plan;
use super::prepare::{Driver, body_stage, rotor_stage};
use super::run::DiagnoseError;
use super::stage::Stage;
use super::trial::Trial;
use crate::model::{Effect, Model, ModelError};
use crate::record::Dataset;

/// Two benches differ in a number by more than this factor: less is a battery, a temperature, a missing effect that
/// one experiment excites more than the other.
const FACTOR: f64 = 1.3;
/// Standard errors by which the numbers must differ, too.
const PLAINLY: f64 = 8.0;
/// One set of numbers for all logs must cost this many times the squared error of one set for each.
const COST: f64 = 2.0;

/// Refuses logs that one set of the base's numbers cannot describe, where a set for each log can.
///
/// # Errors
/// [`DiagnoseError::DifferentBenches`] names the number and its values.
pub(super) fn check(
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
            && let Some(error) = differing(&joint, &alone)
        {
            return Err(error);
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

/// The number in which two of the logs differ most, if they plainly do.
fn differing(joint: &Trial, alone: &[(&Dataset, Trial)]) -> Option<DiagnoseError> {
    let value = |trial: &Trial, name: &str| {
        Some((trial.model.parameter(name)?, *trial.model.standard_errors.get(name)?))
    };
    for name in &joint.names {
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
