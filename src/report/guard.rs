//! What the guard did, in words.

use crate::guard::{Cause, State};
use crate::runtime::experiment::Ending;
use crate::runtime::operator::GuardAnswer;
use crate::signal::{Channel, GuardEvent};

/// While an experiment waits.
pub const WAITS_FOR_ARM: &str =
    "waiting for the bench to be armed (`rotorbench arm`, in another terminal); Ctrl-C stops at any time";
/// Why `arm` did nothing.
pub const LATCHED: &str = "a latch is left by `rotorbench disarm` only; then `arm`";

/// A transition or a refusal of the guard.
#[must_use]
pub fn event(event: &GuardEvent) -> String {
    let name = |code| State::from_code(code).unwrap_or_default();
    let cause = Cause::from_code(event.cause).unwrap_or_default();
    let subject =
        Channel::of_subject(event.subject).map_or_else(String::new, |it| format!(" ({})", it.label()));
    if event.from == event.to {
        format!("{}: {cause}{subject}", name(event.to))
    } else {
        format!("{} -> {}: {cause}{subject}", name(event.from), name(event.to))
    }
}

/// What the guard decided and refused of what an operator asked for. That it refuses what is so already is no news.
#[must_use]
pub fn heard(answer: &GuardAnswer) -> Vec<String> {
    let is_news = |it: &&GuardEvent| !answer.was_so || it.cause != Cause::RequestRefused as u32;
    answer.events.iter().filter(is_news).map(event).collect()
}

/// The state that a bench is in after what an operator asked for.
#[must_use]
pub fn state(answer: &GuardAnswer) -> String {
    if answer.was_so { format!("already {}", answer.state) } else { answer.state.to_string() }
}

/// Why an experiment ended.
#[must_use]
pub fn ending(ending: &Ending) -> String {
    match ending {
        Ending::Complete => "complete".to_owned(),
        Ending::Stopped => "stopped by the operator".to_owned(),
        Ending::GuardClosed { state, cause } => format!("guard {state}: {cause}"),
        Ending::GuardSilent { after_s } => format!("nothing was heard of the bench's guard for {after_s} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_arm_an_armed_bench_is_no_refusal() {
        let armed = State::Armed as u32;
        let refused = GuardEvent {
            from: armed,
            to: armed,
            cause: Cause::RequestRefused as u32,
            ..GuardEvent::default()
        };
        let mut answer =
            GuardAnswer { state: State::Armed, obeyed: true, was_so: true, events: vec![refused] };
        assert_eq!((heard(&answer), state(&answer).as_str()), (vec![], "already armed"));
        answer.was_so = false;
        assert_eq!((heard(&answer).len(), state(&answer).as_str()), (1, "armed"));
    }
}
