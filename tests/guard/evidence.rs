//! What an event says of what happened: its number, and which of several causes it names.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::Channel;

use crate::rig::{N, Rig, T, defaults};

/// Value of the first event of this cause.
fn evidence(rig: &mut Rig, cause: Cause) -> f64 {
    let event = rig.state.take_events().find(|event| event.cause == cause as u32);
    event.unwrap_or_else(|| panic!("no event: {cause}")).value
}

/// A step with new sensors and a new command, changed by `fault`.
fn step(rig: &mut Rig, span_ns: u64, fault: impl FnOnce(&mut Rig)) {
    rig.now += span_ns;
    rig.sense();
    rig.answer();
    fault(rig);
    rig.step(true);
}

#[test]
fn what_is_too_old_or_too_early_is_told_in_seconds() {
    let near =
        |value: f64, seconds: f64| assert!((value - seconds).abs() < 1e-9, "{value} s, not {seconds} s");
    let mut rig = Rig::armed(&defaults());
    step(&mut rig, T, |rig| rig.ask_code(OperatorAct::Arm as u32, rig.now - 1_500_000_000));
    near(evidence(&mut rig, Cause::RequestStale), 1.5);
    step(&mut rig, T, |rig| rig.command.stamp_ns = rig.now + 3 * T);
    near(evidence(&mut rig, Cause::CommandFromFuture), 0.06);
    step(&mut rig, T, |rig| rig.command.stamp_ns = rig.now - 500_000_000);
    near(evidence(&mut rig, Cause::CommandExpired), 0.5);
    let mut rig = Rig::armed(&defaults());
    step(&mut rig, 700_000_000, |_| ());
    near(evidence(&mut rig, Cause::GuardPaused), 0.7);
}

#[test]
fn what_is_counted_is_told_as_a_number() {
    let mut rig = Rig::armed(&defaults());
    step(&mut rig, T, |rig| rig.ask_code(9, rig.now));
    assert_eq!(evidence(&mut rig, Cause::RequestUnknown), 9.0);
    step(&mut rig, T, |rig| rig.ask(OperatorAct::Arm));
    assert_eq!(evidence(&mut rig, Cause::RequestRefused), f64::from(OperatorAct::Arm as u32));
    step(&mut rig, T, |rig| rig.sensors.body_rate.value = 21.5);
    assert_eq!(evidence(&mut rig, Cause::SignalOutOfRange), 21.5);

    // One clean period after a miss, which only the bucket remembers.
    let config = GuardConfig { bucket_limit: Some(3.0), bucket_leak: 0.0, ..defaults() };
    let mut rig = Rig::armed(&config);
    while rig.state.state() != State::FailsafeLatched {
        step(&mut rig, T, |rig| rig.sensors.battery_voltage.value = 70.0);
        let is_full = rig.state.state() == State::FailsafeLatched;
        step(&mut rig, T, |_| ());
        assert!(is_full || rig.state.state() != State::FailsafeLatched, "only a miss fills it");
    }
    assert_eq!(
        evidence(&mut rig, Cause::TooManyMisses),
        3.0,
        "the third one, at the limit and not beyond it"
    );

    let mut rig = Rig::armed(&defaults());
    for _ in 0..6 {
        rig.now += T;
        rig.sense();
        rig.step(false);
    }
    assert_eq!(rig.state.state(), State::FailsafeLatched);
    let latched = rig.state.take_events().last().expect("the latch");
    assert_eq!((latched.cause, latched.value), (Cause::CommandMissing as u32, 5.0), "periods missed");
}

/// What makes an end comes before what is only a warning; of two of a kind the first one stands.
#[test]
fn the_worst_is_named_and_of_equals_the_first() {
    // A late command degrades; a signal lost in the same step ends the run.
    let mut rig = Rig::armed(&defaults());
    let before = rig.sensors.body_rate;
    for period in 1..=N + 1 {
        assert_ne!(rig.state.state(), State::FailsafeLatched, "period {period}");
        rig.now += T;
        rig.sense();
        rig.sensors.body_rate = before;
        if period < N {
            rig.answer();
        }
        rig.step(true);
    }
    let last = rig.events().pop().expect("an event");
    let subject = Channel::BodyRate.subject();
    assert_eq!(last, (State::Degraded, State::FailsafeLatched, Cause::SignalStale, subject));

    // Two signals lost at once: the first in the table. And a pause of the guard says more than what it made stale.
    for (span_ns, cause, subject) in
        [(T, Cause::SignalStale, Channel::BodyRate.subject()), (8 * T, Cause::GuardPaused, u32::MAX)]
    {
        let mut rig = Rig::armed(&defaults());
        let (rate, speed) = (rig.sensors.body_rate, rig.sensors.propeller_rate);
        while rig.state.state() != State::FailsafeLatched {
            step(&mut rig, span_ns, |rig| {
                (rig.sensors.body_rate, rig.sensors.propeller_rate) = (rate, speed)
            });
        }
        let last = rig.events().pop().expect("an event");
        assert_eq!((last.2, last.3), (cause, subject));
    }
}
