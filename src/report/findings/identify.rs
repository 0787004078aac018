//! Sentences for what `identify` finds, and for the steps of section III: a file for each part of it.

mod battery;
mod body;
mod commands;
mod fits;
mod steps;
mod template;

pub(crate) use steps::driven_by;
pub use steps::step;

use crate::screening::Finding;

/// What became of a step.
pub(crate) fn outcome(finding: &Finding) -> Option<String> {
    steps::sentence(finding)
}

/// The sentence of a finding of this room.
pub(crate) fn sentence(finding: &Finding) -> Option<String> {
    battery::sentence(finding)
        .or_else(|| commands::sentence(finding))
        .or_else(|| fits::sentence(finding))
        .or_else(|| template::sentence(finding))
        .or_else(|| body::sentence(finding))
        .or_else(|| steps::sentence(finding))
}
