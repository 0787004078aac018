//! What the demo learns from its own recording: where the model fails, which effect is missing, how far the error
//! falls with it.

use super::bench_run::DemoRun;
use crate::cli::CliError;
use crate::cli::usage_error::UsageError;
use crate::diagnose::{DiagnoseConfig, Diagnosis, Extension, Verdict};
use crate::log::Dataset;
use crate::model::Model;
use crate::session::{self, Job};
use crate::signal::columns;

/// [s] after arming: from here on nobody strikes the body, and the angle is moved.
const QUIET_FROM_S: f64 = 6.0;
/// [s] after arming: what is learned from ends, what it is tested on begins.
const LEARN_TO_S: f64 = 12.0;
/// [s] after arming: the end of the moves.
const TEST_TO_S: f64 = 18.0;

/// What was learned.
pub(super) struct Lesson {
    pub diagnosis: Diagnosis,
    pub extension: Option<Extension>,
}

/// Asks what the paper's model is missing. Only the log is looked at.
pub(super) fn learn(log: &Dataset, job: &Job) -> Result<Lesson, CliError> {
    let model = Model::paper();
    let armed = armed_at(log).ok_or(UsageError::NeverArmed)?;
    let part = |from: f64, to: f64| session::between(log, armed + from, armed + to);
    let (train, validate) = ([part(QUIET_FROM_S, LEARN_TO_S)?], [part(LEARN_TO_S, TEST_TO_S)?]);
    let config = DiagnoseConfig::default();
    let diagnosis = session::diagnose(&model, &train, &validate, &config, job)?;
    let extension = match diagnosis.verdict {
        Verdict::MissingEffect => {
            let logs = (&train[..], &validate[..]);
            Some(session::extend(&model, &diagnosis.effects, logs, &config, job)?.extension)
        }
        _ => None,
    };
    Ok(Lesson { diagnosis, extension })
}

/// [s] when a rotor was first commanded.
fn armed_at(log: &Dataset) -> Option<f64> {
    let commands = log.column(columns::COMMANDS[0])?;
    let row = commands.iter().position(|command| *command > 0.0)?;
    log.time().get(row).copied()
}

/// [rad] rms of measured angle minus reference while the angle is moved.
pub(super) fn tracking_error(run: &DemoRun) -> f64 {
    let armed = run.steps.iter().position(|step| step.applied.command_sequence > 0).unwrap_or(0);
    let begun_ns = run.steps.get(armed).map_or(0, |step| step.command.stamp_ns);
    let (mut sum, mut count) = (0.0, 0.0);
    for step in &run.steps {
        let time = crate::clock::span_s(step.command.stamp_ns.saturating_sub(begun_ns));
        if (QUIET_FROM_S..TEST_TO_S).contains(&time) {
            let error = step.sensors.body_angle.value - step.command.estimate.reference_angle;
            sum += error * error;
            count += 1.0;
        }
    }
    f64::sqrt(sum / f64::max(count, 1.0))
}
