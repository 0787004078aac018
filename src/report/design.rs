//! What `design` says: its answer, notes and proposals in words.

mod answer;
mod page;

use std::fmt::Write as _;

use super::number;
use crate::control::ControllerKind;
use crate::control::design::{Advice, Improvement, Margins};
use crate::control::thresholds::THRESHOLDS;

pub use answer::Design;
pub use page::{page, tables};

/// The answer as text, for a terminal.
#[must_use]
pub fn text(design: &Design) -> String {
    let mut text = String::new();
    tables(design).iter().for_each(|table| text += &format!("{}\n", table.text()));
    let said = [
        ("refused", &design.refusal),
        ("note", &design.note),
        ("warning", &design.warning),
        ("advice", &design.advice),
    ];
    for (what, sentence) in said {
        if let Some(sentence) = sentence {
            let _ = writeln!(text, "{what}: {sentence}");
        }
    }
    text
}

/// That the answer is of another controller than the bench has.
#[must_use]
pub fn pid_on_an_emc_bench() -> String {
    "--pid-margins makes a PID, and the bench's own controller is EMC; --controller pid says that it is meant"
        .to_owned()
}

/// That a loop is stable and of no use: what is left of a push fades with a time constant [s], by the eigenvalue beside it.
#[must_use]
pub fn sluggish(kind: ControllerKind, (fades_s, slowest): (f64, f64), margins: &Margins) -> String {
    let instead = match kind {
        ControllerKind::Emc => "take a larger γ_0, or smaller α and α_c",
        ControllerKind::Pid => "ask for smaller margins, or give larger gains",
    };
    format!(
        "the loop is stable and of little use: what a push leaves behind fades with a time constant of {} s (eigenvalue \
         1 - {:.1e}), at a bandwidth of {:.2} rad/s; {instead}",
        number(fades_s, 3),
        1.0 - slowest,
        margins.bandwidth_rad_s
    )
}

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
