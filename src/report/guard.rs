//! What the guard did, in words.

use crate::guard::{Cause, State};
use crate::runtime::experiment::Ending;
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
