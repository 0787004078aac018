//! `arm`, `disarm`, `stop`: an operator's act on a running bench, and what became of it.

use std::time::Duration;

use super::ProcessError;
use super::thresholds::THRESHOLDS;
use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::{Cause, OperatorAct, State};
use crate::shm::{
    APPLIED, BenchMember, BenchPlace, GUARD_EVENTS, ProcessRole, Publisher, REQUEST, STOPS, ShmError,
    Subscriber, Waiter, guard_without_place, is_guarded, running_places,
};
use crate::signal::{Applied, GuardEvent, Request};

/// What became of an act.
#[derive(Debug, Clone, PartialEq)]
pub struct GuardAnswer {
    /// State of the guard afterwards.
    pub state: State,
    /// Whether it is what was asked for.
    pub obeyed: bool,
    /// Whether it was that before, so that the guard had nothing to do.
    pub was_so: bool,
    /// What the guard decided and refused meanwhile.
    pub events: Vec<GuardEvent>,
}

/// How often to look for the answer.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Asks the guard of a running bench, and waits for what it does.
///
/// # Errors
/// [`ProcessError::NotRunning`] when nobody guards the bench, [`ProcessError::Unanswered`] when who does cannot say so.
pub fn act(config: &BenchConfig, act: OperatorAct) -> Result<GuardAnswer, ProcessError> {
    check_is_there(config)?;
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Operator)?;
    let mut applied = bench.subscribe(&APPLIED)?;
    let mut events = bench.subscribe(&GUARD_EVENTS)?;
    let bell = bench.bell(Waiter::Guard)?;
    let mut requests =
        if act == OperatorAct::Stop { stop_place(&bench)? } else { bench.publish(&REQUEST)? };
    // First of all: a stop must not wait for a sign of life. A guard that is born later refuses it as too old.
    let sent_ns = clock::monotonic_ns();
    requests.send(&Request { sequence: 1, stamp_ns: sent_ns, act: act as u32, reserved: 0 });
    bell.ring();
    let before = running(&mut applied).ok_or_else(|| silent(config, bench.place()))?;
    let patience_s =
        THRESHOLDS.answer_s + if act == OperatorAct::Arm { config.guard.arm_timeout_s } else { 0.0 };
    let deadline_ns = sent_ns.saturating_add(clock::span_ns(patience_s));
    let mut answer = GuardAnswer { state: state(&before), obeyed: false, was_so: false, events: Vec::new() };
    while clock::monotonic_ns() < deadline_ns {
        // Ringing again costs nothing, and reaches a guard that had not opened the request yet.
        bell.ring();
        std::thread::sleep(LOOK_PERIOD);
        if let Some(applied) = applied.newest() {
            answer.state = state(&applied);
        }
        let mut refused = false;
        for event in std::iter::from_fn(|| events.next_in_order()).filter(|it| it.stamp_ns >= sent_ns) {
            refused |= is_refusal(&event);
            answer.events.push(event);
        }
        answer.obeyed = !refused && !answer.events.is_empty() && answer.state == wanted(act);
        if answer.obeyed || refused || answer.state == wanted(act) && state(&before) == wanted(act) {
            answer.obeyed = answer.state == wanted(act);
            // What was heard first may be what the guard did already: then it says so in an event, which may come a little later.
            std::thread::sleep(LOOK_PERIOD);
            let late = std::iter::from_fn(|| events.next_in_order()).filter(|it| it.stamp_ns >= sent_ns);
            answer.events.extend(late);
            let has_changed = answer.events.iter().any(|event| event.from != event.to);
            answer.was_so = answer.obeyed && state(&before) == wanted(act) && !has_changed;
            break;
        }
    }
    Ok(answer)
}

/// Waits for a sign of life of the guard, for two seconds.
///
/// # Errors
/// As [`act`].
pub fn require_guard(config: &BenchConfig) -> Result<(), ProcessError> {
    check_is_there(config)?;
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Monitor)?;
    let mut applied = bench.subscribe(&APPLIED)?;
    running(&mut applied).map(|_| ()).ok_or_else(|| silent(config, bench.place()))
}

/// What a guard says of a bench of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GuardLook {
    /// Its state.
    State(State),
    /// Something of the bench runs, and no guard: a recorder, a monitor.
    NoGuard,
    /// A guard may be there, and says nothing.
    Silent,
}

/// What the guards say of all benches that run on this machine, of this user and of this user's groups.
#[must_use]
pub fn look() -> Vec<(String, GuardLook)> {
    running_places().into_iter().map(|place| (place.bench().to_owned(), look_at(place))).collect()
}

fn look_at(place: BenchPlace) -> GuardLook {
    if !is_guarded(&place) {
        return GuardLook::NoGuard;
    }
    let joined =
        BenchMember::join_at(place, ProcessRole::Monitor).and_then(|bench| bench.subscribe(&APPLIED));
    match joined.ok().and_then(|mut applied| running(&mut applied)) {
        Some(applied) => GuardLook::State(state(&applied)),
        None => GuardLook::Silent,
    }
}

/// Refuses a bench that nobody ever made, and leaves nothing of it behind. One whose directory was removed while a process
/// guards it is made again: that process still hears what is asked of it.
fn check_is_there(config: &BenchConfig) -> Result<(), ProcessError> {
    let place = BenchPlace::of(&config.name, &config.shared_memory)?;
    if place.is_there() || guard_without_place(&place).is_some() {
        return Ok(());
    }
    Err(ProcessError::not_running(&config.name))
}

/// Why no guard answers.
fn silent(config: &BenchConfig, place: &BenchPlace) -> ProcessError {
    match guard_without_place(place) {
        Some(process_id) => ProcessError::Unanswered { bench: config.name.clone(), process_id },
        None => ProcessError::not_running(&config.name),
    }
}

/// The first place for a `stop` that no other process holds.
fn stop_place(bench: &BenchMember) -> Result<Publisher<Request>, ShmError> {
    let [first, others @ ..] = STOPS;
    let mut place = bench.publish(&first);
    for other in &others {
        if !matches!(place, Err(ShmError::Claimed { .. })) {
            break;
        }
        place = bench.publish(other);
    }
    place
}

fn wanted(act: OperatorAct) -> State {
    match act {
        OperatorAct::Arm => State::Armed,
        OperatorAct::Disarm => State::Disarmed,
        OperatorAct::Stop => State::EmergencyStop,
    }
}

/// A sign of life of the guard, if it gives one: the value a dead one left behind does not count.
fn running(applied: &mut Subscriber<Applied>) -> Option<Applied> {
    let start_ns = clock::monotonic_ns();
    while clock::monotonic_ns().saturating_sub(start_ns) < clock::span_ns(THRESHOLDS.silence_s) {
        if let Some(found) = applied.newest().filter(|it| it.stamp_ns >= start_ns) {
            return Some(found);
        }
        std::thread::sleep(LOOK_PERIOD);
    }
    None
}

fn state(applied: &Applied) -> State {
    State::from_code(applied.state).unwrap_or_default()
}

fn is_refusal(event: &GuardEvent) -> bool {
    let refusals = [Cause::RequestRefused, Cause::RequestStale, Cause::RequestUnknown];
    let checks_failed = event.from == State::PreArm as u32 && event.to == State::Disarmed as u32;
    checks_failed || refusals.iter().any(|cause| *cause as u32 == event.cause)
}
