//! Hold, ramp, latch: period by period, and what leads there.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::AppliedFlags;

use crate::rig::{N, Rig, T, defaults};

#[test]
fn the_ladder_holds_ramps_and_latches() {
    let mut rig = Rig::armed(&defaults());
    let sequence = rig.command.sequence;
    let accepted = rig.command.rotor;
    for period in 1..=N {
        rig.now += T;
        rig.sense();
        let applied = rig.step(true);
        assert_eq!(
            (applied.rotor, applied.command_sequence),
            (accepted, sequence),
            "period {period} of the hold"
        );
        assert_eq!(applied.flags, AppliedFlags::HELD);
        assert_eq!(applied.misses, period - 1, "a quarter period late is not late");
        assert_eq!(applied.state, if period == 1 { State::Armed } else { State::Degraded } as u32);
    }
    rig.now += T;
    rig.sense();
    let applied = rig.step(true);
    assert_eq!((applied.rotor, applied.flags), (accepted.map(|u| 0.5 * u), AppliedFlags::RAMPING));
    assert_eq!((applied.state, applied.command_sequence), (State::FailsafeLatched as u32, sequence));
    // A controller that comes back is too late.
    let applied = rig.period();
    assert_eq!((applied.rotor, applied.flags, applied.command_sequence), ([0.0; 2], 0, 0));
    rig.run(500);
    assert_eq!((rig.state.state(), rig.last.rotor), (State::FailsafeLatched, [0.0; 2]));
    rig.ask(OperatorAct::Arm);
    rig.run(100);
    assert_eq!(rig.state.state(), State::FailsafeLatched, "a latch is not armed over");
    let none = u32::MAX;
    assert_eq!(
        rig.events(),
        [
            (State::Armed, State::Degraded, Cause::CommandMissing, none),
            (State::Degraded, State::FailsafeLatched, Cause::CommandMissing, none),
            (State::FailsafeLatched, State::FailsafeLatched, Cause::RequestRefused, none),
        ]
    );
}

#[test]
fn a_ramp_has_as_many_steps_as_it_should() {
    for (ramp_periods, shares) in [(0, vec![0.0]), (1, vec![0.0]), (4, vec![0.75, 0.5, 0.25, 0.0])] {
        let mut rig = Rig::armed(&GuardConfig { ramp_periods, ..defaults() });
        let accepted = rig.command.rotor;
        for _ in 0..N {
            rig.now += T;
            rig.sense();
            rig.step(false);
        }
        for share in shares {
            // Jitter of a fifth of a period either way.
            rig.now += if share == 0.5 { T - T / 5 } else { T + T / 5 };
            rig.sense();
            assert_eq!(rig.step(false).rotor, accepted.map(|u| u * share), "{ramp_periods} periods");
        }
    }
}

#[test]
fn a_ramp_is_cut_short_when_its_command_is_too_old() {
    let mut rig = Rig::armed(&GuardConfig { ramp_periods: 100, ..defaults() });
    rig.now += 120 * T;
    rig.sense();
    assert_eq!(rig.step(false).rotor, [0.0; 2]);
    assert_eq!(rig.state.cause(), Cause::GuardPaused);
}

#[test]
fn a_short_miss_degrades_and_recovers() {
    let mut rig = Rig::armed(&defaults());
    for _ in 0..3 {
        rig.now += T;
        rig.sense();
        rig.step(false);
    }
    assert_eq!((rig.state.state(), rig.state.cause()), (State::Degraded, Cause::CommandMissing));
    // The late one, then N clean periods.
    rig.run(N);
    assert_eq!(rig.state.state(), State::Degraded);
    assert_eq!(rig.last.rotor, rig.command.rotor);
    rig.period();
    assert_eq!((rig.state.state(), rig.state.cause()), (State::Armed, Cause::Recovered));
    assert_eq!(rig.last.misses, 0);
}

#[test]
fn a_short_time_to_live_cuts_the_hold() {
    let config = GuardConfig { command_time_to_live_s: Some(0.05), ..defaults() };
    let mut rig = Rig::armed(&config);
    let periods = rig.periods_to_zero(|rig| rig.command.sequence = 0);
    assert_eq!(periods, 4, "0.05 s are over in the third period");
    assert_eq!(rig.state.cause(), Cause::CommandExpired);
}

#[test]
fn a_guard_that_stood_still_does_not_go_on() {
    let mut rig = Rig::armed(&defaults());
    rig.now += u64::from(N) * T;
    rig.sense();
    rig.answer();
    assert_eq!(rig.step(true).state, State::Degraded as u32, "the hold's time itself is still in it");
    let mut rig = Rig::armed(&defaults());
    rig.now += 1_000_000_000;
    rig.sense();
    rig.answer();
    rig.step(true);
    assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, Cause::GuardPaused));
    rig.now += T;
    rig.sense();
    assert_eq!(rig.step(true).rotor, [0.0; 2]);
}

#[test]
fn scattered_misses_fill_the_bucket_and_rare_ones_do_not() {
    let trips = |every: u32| {
        let mut rig = Rig::armed(&defaults());
        for period in 1..1000 {
            rig.now += T;
            rig.sense();
            if period % every != 0 && period % every != 1 {
                rig.answer();
            }
            rig.step(true);
        }
        (rig.state.state() == State::FailsafeLatched, rig.state.cause())
    };
    // Two of four missing, over and over: one whole period overdue each time, then again on the late one.
    assert_eq!(trips(4), (true, Cause::TooManyMisses));
    assert!(!trips(20).0, "two of twenty leak away");
}

#[test]
fn the_bucket_has_the_size_that_is_written() {
    // From one fresh command to the next N - 1 periods, so that only the bucket can trip.
    let config = GuardConfig { bucket_limit: Some(3.0), bucket_leak: 0.0, ..defaults() };
    let mut rig = Rig::armed(&config);
    let mut missed = 0;
    while rig.state.state() != State::FailsafeLatched {
        missed += 1;
        assert!(missed < 10);
        rig.now += 2 * T;
        rig.sense();
        rig.answer();
        rig.step(true);
    }
    // Each double period is one miss of two periods: 2, 4.
    assert_eq!((missed, rig.state.cause()), (2, Cause::TooManyMisses));
    // It is empty after a disarm.
    rig.rearm();
}

#[test]
fn a_trip_from_outside_latches_in_every_state() {
    for armed in [false, true] {
        let mut rig = if armed { Rig::armed(&defaults()) } else { Rig::new(&defaults()) };
        let from = rig.state.state();
        rig.guard.trip(&mut rig.state, rig.now, Cause::BusDead);
        assert_eq!(rig.events(), [(from, State::FailsafeLatched, Cause::BusDead, u32::MAX)]);
        rig.run(2);
        assert_eq!((rig.last.state, rig.last.cause), (State::FailsafeLatched as u32, Cause::BusDead as u32));
        assert_eq!(rig.last.rotor, [0.0; 2]);
        // A second cause does not hide the first.
        rig.guard.trip(&mut rig.state, rig.now, Cause::Shutdown);
        assert_eq!(rig.state.cause(), Cause::BusDead);
    }
}
