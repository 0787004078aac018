//! What `replay` says.

use crate::runtime::replay::ReplayResult;

/// The verdicts on controller and guard, what of the guard's events came again, how many records were lost, and where the
/// recording is cut off.
#[must_use]
pub fn text(
    [controller, guard]: [&ReplayResult; 2],
    (equal_events, lost): (u64, u64),
    cut_off: Option<&str>,
) -> String {
    let mut text = verdict(controller, "controller", "step") + &verdict(guard, "guard", "period");
    text += &format!("guard: {equal_events} events equal\n");
    if lost > 0 {
        text += &format!("the recorder lost {lost} records\n");
    }
    if let Some(cut_off) = cut_off {
        text += &format!("the recording is cut off {cut_off}\n");
    }
    text
}

fn verdict(verdict: &ReplayResult, who: &str, step: &str) -> String {
    let mut text = format!("{who}: {} {step}s equal, bit for bit\n", verdict.equal);
    if verdict.unknown > 0 {
        text += &format!(
            "{who}: {} {step}s cannot be replayed: their beginning is not in the recording, or records were lost\n",
            verdict.unknown
        );
    }
    if let Some(first) = &verdict.first_difference {
        text += &format!(
            "{who}: first difference at {step} {} ({:.6} s): `{}` was {}, is {} now\n",
            first.sequence,
            first.time_s,
            first.difference.field,
            first.difference.recorded,
            first.difference.replayed
        );
    }
    text
}
