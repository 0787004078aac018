//! What `replay` says.

use super::files;
use crate::runtime::replay::ReplayResult;
use crate::session::Replayed;

/// The verdicts on controller and guard, what of the guard's events came again, how many records were lost, and where the
/// recording is cut off.
#[must_use]
pub fn text(replayed: &Replayed) -> String {
    let Replayed { controller, guard, equal_events, lost, end } = replayed;
    let mut text = verdict(controller, "controller", "step") + &verdict(guard, "guard", "period");
    if guard.starts > 0 {
        text += &format!("guard: {equal_events} events equal\n");
    }
    if *lost > 0 {
        text += &format!("the recorder lost {lost} records\n");
    }
    if let Some(cut_off) = files::cut_off(end) {
        text += &format!("the recording is {cut_off}\n");
    }
    text
}

fn verdict(verdict: &ReplayResult, who: &str, step: &str) -> String {
    if verdict.starts == 0 && verdict.unknown > 0 {
        return format!(
            "{who}: not replayed: none of its {} {step}s follows a start of it in the recording, and in which state it was is \
             not known; begin to record before it starts\n",
            verdict.unknown
        );
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::End;

    fn text(results: [&ReplayResult; 2], equal_events: u64) -> String {
        let [controller, guard] = results.map(Clone::clone);
        super::text(&Replayed { controller, guard, equal_events, lost: 0, end: End::Whole })
    }

    #[test]
    fn a_recording_begun_late_is_not_called_equal() {
        let late = ReplayResult { unknown: 304, ..ReplayResult::default() };
        let whole = ReplayResult { equal: 500, starts: 1, ..ReplayResult::default() };
        let said = text([&late, &late], 0);
        assert!(
            said.starts_with("controller: not replayed: none of its 304 steps follows a start"),
            "{said}"
        );
        assert!(!said.contains("equal"), "{said}");
        assert!(text([&late, &whole], 3).ends_with("guard: 3 events equal\n"));
        // One that has stopped and begun again is replayed from there.
        let again = ReplayResult { unknown: 4, ..whole };
        assert!(text([&again, &again], 0).contains("controller: 4 steps cannot be replayed"));
    }
}
