//! Proposals for a controller's settings, in words.

use crate::control::design::{Advice, Improvement};
use crate::control::thresholds::THRESHOLDS;

/// A change of one knob, and what becomes better.
#[must_use]
pub fn advice(advice: &Advice) -> String {
    let Advice { knob, from, to, improvement, .. } = advice;
    let verb = if to > from { "raise" } else { "lower" };
    let why = match improvement {
        Improvement::SensitivityPeak { from, to } => {
            let calm = THRESHOLDS.nervous_peak;
            format!("the sensitivity peak falls from {from:.2} to {to:.2}, below {calm} is calm")
        }
        Improvement::Bandwidth { from_rad_s, to_rad_s, sensitivity_peak } => format!(
            "the bandwidth grows from {from_rad_s:.1} to {to_rad_s:.1} rad/s, and the sensitivity peak stays at \
             {sensitivity_peak:.2}"
        ),
    };
    format!("{verb} {knob} from {from:.3} to {to:.3}: {why}")
}
