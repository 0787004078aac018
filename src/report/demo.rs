//! What `demo` says, on the terminal and on its page.

use std::path::Path;

use super::findings::sentences;
use super::{Axis, Bars, Mark, Page, Plot, Series, TextTable, Tone, number};
use crate::clock;
use crate::diagnose::{Diagnosis, Verdict};
use crate::emulate::Impulse;
use crate::runtime::control::ControlSummary;
use crate::signal::{ControlStep, StateEstimate};

/// Before the second run.
pub const AGAIN: &str = "the same run, with it in the controller:";
/// The user did not wait.
pub const INTERRUPTED: &str = "interrupted before the story's end: there is no report";

/// No run came to its end: nothing can be compared, and the report, if there is one, ends before it.
#[must_use]
pub fn held_up(page: Option<&Path>) -> String {
    let report = page
        .map_or_else(|| "There is no report".to_owned(), |page| format!("{} ends before it", page.display()));
    format!(
        "no run came to its end: something holds this machine up for longer than the guard waits (`rotorbench jitter` \
         measures it). {report}; try again when the machine has less to do."
    )
}

/// The guard ended a run because the machine stood still for longer than it holds a command [s].
#[must_use]
pub fn stood_still(hold_s: f64) -> String {
    format!("the machine stood still for longer than the guard holds a command, {hold_s} s: it ended the run")
}

/// The line that is written over while the bench runs.
#[must_use]
pub fn live_line(bar: &str, now_s: f64, estimate: &StateEstimate, applied: [f64; 2]) -> String {
    format!(
        "{bar} {now_s:4.1} s  angle {:+.3} rad (wanted {:+.3})  disturbance {:+.3} N m  u {:.3} {:.3}",
        estimate.body_angle, estimate.reference_angle, estimate.disturbance_torque, applied[0], applied[1],
    )
}

/// What an event of the guard says, so long [s] after the controller's first step.
#[must_use]
pub fn guard_line(after_s: f64, event: &crate::signal::GuardEvent, has_ended: bool) -> String {
    let ended = if has_ended { " (as meant: the controller has ended)" } else { "" };
    format!("{after_s:6.2} s  guard: {}{ended}", super::guard::event(event))
}

/// The angle, and the disturbance with its estimate, with the impulses on the body.
#[must_use]
pub fn pictures(steps: &[ControlStep], impulses: &[Impulse]) -> (Plot, Plot) {
    let begun_ns = steps.first().map_or(0, |step| step.command.stamp_ns);
    let seconds = |step: &ControlStep| clock::span_s(step.command.stamp_ns.saturating_sub(begun_ns));
    let column = |of: fn(&ControlStep) -> f64| -> Vec<f64> { steps.iter().map(of).collect() };
    let time: Vec<f64> = steps.iter().map(seconds).collect();
    let axis = || Axis::new("time", "s");
    let angle = Plot::new("Angle", axis(), Axis::new("body angle", "rad"))
        .group("time")
        .series(
            Series::line("measured", &time, &column(|step| step.sensors.body_angle.value))
                .tone(Tone::Measured),
        )
        .series(
            Series::line("estimated", &time, &column(|step| step.command.estimate.body_angle))
                .tone(Tone::Model),
        )
        .series(
            Series::line("reference", &time, &column(|step| step.command.estimate.reference_angle))
                .tone(Tone::Quiet)
                .dashed(),
        );
    let torque = Plot::new("Disturbance estimate", axis(), Axis::new("torque", "N m")).group("time").series(
        Series::line("estimated by EMC", &time, &column(|step| step.command.estimate.disturbance_torque))
            .tone(Tone::Model),
    );
    let strike =
        |plot: Plot, impulse: &Impulse| plot.span("impulse", impulse.at_s, impulse.at_s + impulse.duration_s);
    (impulses.iter().fold(angle, strike), impulses.iter().fold(torque, strike))
}

/// The page as far as the first run goes.
#[must_use]
pub fn first_page(summary: &ControlSummary, (angle, torque): (Plot, Plot), guard: Vec<String>) -> Page {
    let (angle_error, timing) = (&summary.angle, &summary.timing);
    let table = TextTable::new(["", "value", "unit"])
        .row(["angle error, rms", &format!("{:.4}", angle_error.rms), "rad"])
        .row(["angle error, greatest", &format!("{:.4}", angle_error.greatest), "rad"])
        .row(["periods with the guard open", &angle_error.count.to_string(), ""])
        .row(["command out after due, p99", &format!("{:.0}", timing.response.p99_us), "µs"])
        .row(["slots skipped", &timing.skipped.to_string(), ""]);
    let mut page = Page::new("rotorbench demo");
    page.heading("The loop holds the angle")
        .paragraph(
            "An emulated bench in a process of its own, the controller in this one, shared memory between \
             them, the guard in front of the rotors. Somebody strikes the body twice; then the angle is moved.",
        )
        .table(table)
        .plot(angle)
        .plot(torque)
        .paragraph("What the guard said, seconds after the controller's first step:")
        .list(guard);
    page
}

/// That no second run came to its end.
pub fn nothing_to_compare(page: &mut Page) {
    page.heading("The controller with it").paragraph(
        "Each run with the extended model in the controller was ended by the guard before its time, because this machine \
         stood still for longer than the guard waits: there is nothing to compare.",
    );
}

/// The tracking errors [rad] before and after, and the share of a run in which the guard held commands, where it matters.
#[must_use]
pub fn better_text([before, after]: [f64; 2], degraded: Option<f64>) -> Vec<String> {
    let fall = format!("tracking error with it in the controller: {before:.4} -> {after:.4} rad rms");
    std::iter::once(fall).chain(degraded.map(late)).collect()
}

fn late(degraded: f64) -> String {
    format!(
        "This machine was late: for {:.0} % of a run the guard was degraded and held commands, which is in these errors, too.",
        100.0 * degraded
    )
}

/// The same run, with what was learned in the controller.
pub fn better(
    page: &mut Page,
    [before, after]: [f64; 2],
    degraded: Option<f64>,
    (angle, torque): (Plot, Plot),
) {
    degraded.map(late).into_iter().for_each(|late| {
        page.paragraph(late);
    });
    page.heading("The controller with it")
        .paragraph(
            "The same run again, with the extended model in the controller, which now cancels what it knows.",
        )
        .bars(
            Bars::new("Tracking error, rms, while the angle is moved", "rad")
                .bar("the paper's model", before, Mark::Bad)
                .bar("the extended model", after, Mark::Good),
        )
        .plot(angle)
        .plot(torque);
}

/// What was learned, in a few lines.
#[must_use]
pub fn lesson_text(diagnosis: &Diagnosis, hidden: &str) -> String {
    let error = &diagnosis.error;
    let mut lines = vec![format!("hidden in the emulator: {hidden}")];
    lines.push(match diagnosis.verdict {
        Verdict::MissingEffect => {
            format!("found missing: {}{}", super::verdict::missing(diagnosis, ""), alternatives(diagnosis))
        }
        _ => super::verdict::sentence(diagnosis, ""),
    });
    lines.push(format!(
        "held-out error: {} -> {} rad/s, noise floor {} ({})",
        number(error.base.validate, 3),
        number(error.extended.validate, 3),
        number(error.noise_floor, 3),
        super::measure::measure(&error.measure)
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
pub fn lesson(page: &mut Page, diagnosis: &Diagnosis, hidden: &str) {
    page.heading("The model fails, and why");
    let mark = if diagnosis.verdict == Verdict::MissingEffect { Mark::Good } else { Mark::Warning };
    page.verdict(mark, lesson_text(diagnosis, hidden).replace('\n', ". "));
    let mut parameters = TextTable::new(["parameter", "found", "standard error", "unit"]);
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
