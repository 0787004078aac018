//! Sentences for what `identify` finds, and for the steps of section III: a file for each part of it.

mod battery;
mod body;
mod columns;
mod commands;
mod fits;
mod steps;
mod template;

pub(crate) use steps::driven_by;
pub use steps::step;

use crate::identify::Part;
use crate::screening::Finding;

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    battery::sentence(finding)
        .or_else(|| commands::sentence(finding))
        .or_else(|| columns::sentence(finding))
        .or_else(|| fits::sentence(finding))
        .or_else(|| template::sentence(finding))
        .or_else(|| body::sentence(finding))
        .or_else(|| steps::sentence(finding))
}

/// What became of a step, with what is kept of the template for it.
#[must_use]
pub fn outcome(part: &Part) -> String {
    let kept = match part.finding.code {
        "no_thrust" => "; the template's curve is kept",
        "inertia_not_significant" | "no_torque_moves_body" => "; the template's J is kept",
        _ => "",
    };
    format!("{}{kept}", super::text(&part.finding))
}

/// Why nothing can be identified: first the logs without a part, then what each step lacks.
pub(super) fn nothing(reasons: &[Finding], steps: &[Part]) -> String {
    let (unused, rest): (Vec<_>, Vec<_>) = reasons.iter().partition(|it| it.code == "log_not_used");
    let steps = steps.iter().map(|part| format!("{}: {}", step(part.step), super::text(&part.finding)));
    let lines =
        unused.into_iter().map(super::sentence).chain(steps).chain(rest.into_iter().map(super::sentence));
    format!("nothing can be identified:\n  {}", lines.collect::<Vec<String>>().join("\n  "))
}
