//! What the demo learns from its own recording: where the model fails, which effect is missing, how far the error
//! falls with it.

use super::Flown;
use crate::cli::CliError;
use crate::diagnose::{DiagnoseConfig, Diagnosis, Extension, Verdict};
use crate::log::Dataset;
use crate::model::Model;
use crate::report::findings::sentences;
use crate::report::{Bars, Mark, Page, Table, number};
use crate::session::{self, Job};

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
    let armed = armed_at(log).ok_or_else(|| CliError::new("the demo's guard was never open"))?;
    let train = [part(log, armed + QUIET_FROM_S, armed + LEARN_TO_S)];
    let validate = [part(log, armed + LEARN_TO_S, armed + TEST_TO_S)];
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
    let commands = log.column("command_1")?;
    let row = commands.iter().position(|command| *command > 0.0)?;
    log.time().get(row).copied()
}

fn part(log: &Dataset, from: f64, to: f64) -> Dataset {
    let row = |at: f64| log.time().partition_point(|time| *time < at);
    log.slice(row(from)..row(to))
}

/// [rad] rms of measured angle minus reference while the angle is moved.
pub(super) fn tracking_error(flown: &Flown) -> f64 {
    let armed = flown.steps.iter().position(|step| step.applied.command_sequence > 0).unwrap_or(0);
    let begun_ns = flown.steps.get(armed).map_or(0, |step| step.command.stamp_ns);
    let (mut sum, mut count) = (0.0, 0.0);
    for step in &flown.steps {
        let time = crate::clock::span_s(step.command.stamp_ns.saturating_sub(begun_ns));
        if (QUIET_FROM_S..TEST_TO_S).contains(&time) {
            let error = step.sensors.body_angle.value - step.command.estimate.reference_angle;
            sum += error * error;
            count += 1.0;
        }
    }
    f64::sqrt(sum / f64::max(count, 1.0))
}

/// The story in a few lines of text.
pub(super) fn text(lesson: &Lesson, hidden: &str) -> String {
    let diagnosis = &lesson.diagnosis;
    let error = &diagnosis.error;
    let mut lines = vec![format!("hidden in the emulator: {hidden}")];
    lines.push(match diagnosis.verdict {
        Verdict::MissingEffect => {
            format!("found missing: {}{}", diagnosis.effects.join(", "), alternatives(diagnosis))
        }
        _ => crate::report::verdict::sentence(diagnosis, ""),
    });
    lines.push(format!(
        "held-out error: {} -> {} rad/s, noise floor {} ({})",
        number(error.base.validate, 3),
        number(error.extended.validate, 3),
        number(error.noise_floor, 3),
        error.measure
    ));
    lines.join("\n")
}

fn alternatives(diagnosis: &Diagnosis) -> String {
    if diagnosis.alternatives.is_empty() {
        return String::new();
    }
    let sets: Vec<String> = diagnosis.alternatives.iter().map(|set| set.join(" + ")).collect();
    format!(" (these data cannot tell it from {})", sets.join("; "))
}

/// Writes the lesson into the report.
pub(super) fn tell(page: &mut Page, lesson: &Lesson, hidden: &str) {
    let diagnosis = &lesson.diagnosis;
    page.heading("The model fails, and why");
    let mark = if diagnosis.verdict == Verdict::MissingEffect { Mark::Good } else { Mark::Warning };
    page.verdict(mark, text(lesson, hidden).replace('\n', ". "));
    let mut parameters = Table::new(["parameter", "found", "standard error", "unit"]);
    for (name, found) in &diagnosis.parameters {
        let error = found.standard_error.map_or_else(|| "-".to_owned(), |error| number(error, 2));
        parameters = parameters.row([name.clone(), number(found.value, 4), error, found.unit.clone()]);
    }
    if !parameters.is_empty() {
        page.table(parameters);
    }
    let error = &diagnosis.error;
    page.bars(
        Bars::new("Held-out error", "rad/s")
            .bar("the paper's model", error.base.validate, Mark::Bad)
            .bar("its own parameters refitted", error.refitted.validate, Mark::Warning)
            .bar("with what was missing", error.extended.validate, Mark::Good)
            .level("noise floor", error.noise_floor),
    );
    page.list(sentences(&diagnosis.findings));
}
