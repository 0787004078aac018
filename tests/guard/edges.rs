//! Where a rule begins and ends, to the nanosecond. Every time of the guard is one of stamps, so each edge can be met.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::{AppliedFlags, Health, Sample};

use crate::rig::{N, Rig, T, defaults};

/// A command on its time-to-live is only missing; one nanosecond later it has expired, and the hold is cut.
#[test]
fn a_command_expires_after_its_time_to_live() {
    let config = GuardConfig { command_time_to_live_s: Some(0.05), ..defaults() };
    for (late_ns, state, cause) in
        [(0, State::Degraded, Cause::CommandMissing), (1, State::FailsafeLatched, Cause::CommandExpired)]
    {
        let mut rig = Rig::armed(&config);
        for span_ns in [2 * T, T / 2 + late_ns] {
            rig.now += span_ns;
            rig.sense();
            rig.step(false);
        }
        assert_eq!((rig.state.state(), rig.state.cause()), (state, cause), "{late_ns} ns late");
    }
}

/// A controller that goes on and answers none of the sensors since `deaf`: state and cause when it has been deaf for
/// `span_ns` since the first it left unanswered.
fn deaf_for(hold_s: f64, span_ns: u64) -> (State, Cause) {
    let mut rig = Rig::armed(&GuardConfig { hold_s, ..defaults() });
    let (deaf, cause) = (rig.command.sensors_sequence, rig.state.cause());
    let step = |rig: &mut Rig, now_ns| {
        rig.now = now_ns;
        rig.sense();
        rig.answer();
        rig.command.sensors_sequence = deaf;
        rig.step(true);
    };
    let first_ns = rig.now + T;
    for now_ns in (0..=span_ns).step_by(T as usize).map(|since_ns| first_ns + since_ns) {
        step(&mut rig, now_ns);
    }
    if !span_ns.is_multiple_of(T) {
        step(&mut rig, first_ns + span_ns);
    }
    assert!(rig.state.cause() == Cause::CommandAnswersOldSensors || rig.state.cause() == cause);
    (rig.state.state(), rig.state.cause())
}

/// As misses are counted: from the command before the first sensors that got no answer, a quarter period late is not late.
/// Half of the hold degrades, but never less than a period and a quarter.
#[test]
fn a_deaf_controller_is_warned_of_at_half_of_the_hold_and_stopped_at_the_whole() {
    let deaf = Cause::CommandAnswersOldSensors;
    let (half_ns, whole_ns) = (T * 3 / 2, T * 17 / 4);
    assert_eq!(deaf_for(0.1, half_ns).0, State::Armed);
    assert_eq!(deaf_for(0.1, half_ns + 1), (State::Degraded, deaf));
    assert_eq!(deaf_for(0.1, whole_ns).0, State::Degraded);
    assert_eq!(deaf_for(0.1, whole_ns + 1), (State::FailsafeLatched, deaf));
    assert_eq!(deaf_for(0.04, T / 4).0, State::Armed);
    assert_eq!(deaf_for(0.04, T / 4 + 1), (State::Degraded, deaf));
}

/// Commands may answer the same sensors again, and sensors as old as the last mark but one: not older.
#[test]
fn old_sensors_are_answered_up_to_the_mark_and_not_beyond() {
    let mut rig = Rig::new(&defaults());
    rig.period();
    let first = rig.sensors.sequence;
    // The guard marks the sensors of its first step, and then those of each sixth period (the time-to-live, N + 1).
    for period in 1..=2 * (N + 1) {
        rig.now += T;
        rig.sense();
        rig.answer();
        rig.command.sensors_sequence = first;
        rig.step(true);
        let refused = rig.state.refusals(Cause::CommandAnswersOldSensors);
        assert_eq!(refused, u64::from(period == 2 * (N + 1)), "in period {period}");
    }
}

#[test]
fn a_new_life_of_a_controller_begins_with_a_lower_sequence() {
    let mut rig = Rig::new(&defaults());
    rig.run(30);
    rig.now += T;
    rig.sense();
    // The same sequence again, though stamped later: repeated, not begun anew.
    rig.command.stamp_ns = rig.now;
    rig.step(true);
    assert_eq!(rig.state.refusals(Cause::CommandRepeated), 1);
}

/// From three quarters of a period without a fresh command the last one is held.
#[test]
fn a_command_is_held_from_three_quarters_of_a_period() {
    for (span_ns, flags) in [(T * 3 / 4 - 1, 0), (T * 3 / 4, AppliedFlags::HELD)] {
        let mut rig = Rig::armed(&defaults());
        rig.now += span_ns;
        rig.sense();
        assert_eq!(rig.step(false).flags, flags, "after {span_ns} ns");
    }
}

/// The spin-up begins when the checks have passed, not when somebody asked.
#[test]
fn the_spin_up_begins_at_arming() {
    let mut rig = Rig::new(&GuardConfig { slew_per_s: 1000.0, ..defaults() });
    rig.command.rotor = [0.9, 0.9];
    rig.run(2);
    rig.ask(OperatorAct::Arm);
    while rig.state.state() != State::Armed {
        assert_eq!(rig.last.rotor, [0.0; 2]);
        rig.period();
    }
    assert_eq!(rig.last.rotor, [0.0; 2], "nothing in its first step");
    // A fiftieth of 0.5 s in each period of 0.02 s, of 0.9.
    for period in 1..=25 {
        let applied = rig.period();
        assert!((applied.rotor[0] - 0.9 * 0.04 * f64::from(period)).abs() < 1e-12, "period {period}");
    }
}

/// The bucket leaks by time, not by steps: half a period takes half of what a period takes.
#[test]
fn the_bucket_leaks_by_time() {
    // A warning of one period fills 1.0, and 0.5 leak in a clean period.
    let config = GuardConfig { bucket_limit: Some(1.75), bucket_leak: 0.5, ..defaults() };
    for (clean_ns, trips) in [(vec![T / 2], true), (vec![T / 2; 2], false), (vec![T], false)] {
        let mut rig = Rig::armed(&config);
        let mut step = |span_ns, volts: Option<f64>| {
            rig.now += span_ns;
            rig.sense();
            rig.answer();
            rig.sensors.battery_voltage.value = volts.unwrap_or(rig.sensors.battery_voltage.value);
            rig.step(true);
            rig.state.cause()
        };
        step(T, Some(70.0));
        for span_ns in &clean_ns {
            step(*span_ns, None);
        }
        assert_eq!(step(T, Some(70.0)) == Cause::TooManyMisses, trips, "after {clean_ns:?}");
    }
}

/// Of the swings a third of the limit leaks away in a second; and from a limit to the middle and back is none.
#[test]
fn swings_leak_and_go_from_limit_to_limit() {
    let mut rig = Rig::armed(&GuardConfig { slew_per_s: 1000.0, ..defaults() });
    let swing = |rig: &mut Rig, count: u32| {
        for _ in 0..count {
            rig.command.rotor = if rig.command.rotor == [0.9; 2] { [0.0; 2] } else { [0.9; 2] };
            rig.period();
        }
        rig.state.state()
    };
    // Ten commands are nine swings, each but the first after a leak of 0.067: 8.47 are left; a second later 5.13.
    assert_eq!(swing(&mut rig, 10), State::Armed);
    rig.run(50);
    // Six more are 5.6 in all, the sixth beyond ten.
    assert_eq!(swing(&mut rig, 5), State::Armed);
    assert_eq!(swing(&mut rig, 1), State::Armed, "judged in the step after");
    rig.period();
    assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, Cause::Oscillation));

    let mut rig = Rig::armed(&GuardConfig { slew_per_s: 1000.0, ..defaults() });
    for period in 0..400 {
        rig.command.rotor =
            [if period % 2 == 0 { 0.9 } else { 0.5 }, if period % 2 == 0 { 0.0 } else { 0.5 }];
        rig.period();
    }
    assert_eq!(rig.state.state(), State::Armed);
}

/// The ramp ends at once when its command has outlived its time and the ramp's own.
#[test]
fn a_ramp_is_for_commands_of_the_hold_and_no_older() {
    let config = GuardConfig { ramp_periods: 100, ..defaults() };
    let lives_ns = u64::from(N + 1 + 100) * T;
    for (span_ns, share) in [(lives_ns, 0.99), (lives_ns + 1, 0.0)] {
        let mut rig = Rig::armed(&config);
        let accepted = rig.command.rotor;
        rig.now = rig.command.stamp_ns + span_ns;
        rig.sense();
        assert_eq!(rig.step(false).rotor, accepted.map(|command| command * share), "after {span_ns} ns");
        assert_eq!(rig.state.cause(), Cause::GuardPaused);
    }
}

/// A signal is good for half of the time it may be silent, and bad for the other half; frozen likewise to the nanosecond.
#[test]
fn a_signal_is_warned_of_at_half_of_its_time_and_lost_at_the_whole() {
    let state = |span_ns: u64| {
        let mut rig = Rig::armed(&defaults());
        let before = rig.sensors.body_rate;
        let last_ns = rig.now + span_ns;
        while rig.now < last_ns {
            rig.now = last_ns.min(rig.now + T);
            rig.sense();
            rig.answer();
            rig.sensors.body_rate = before;
            rig.step(true);
        }
        rig.state.state()
    };
    let hold_ns = u64::from(N) * T;
    assert_eq!([hold_ns / 2, hold_ns / 2 + 1].map(state), [State::Armed, State::Degraded]);
    assert_eq!([hold_ns, hold_ns + 1].map(state), [State::Degraded, State::FailsafeLatched]);
}

/// A signal that never came says so by its flag or by having no stamp; either is enough.
#[test]
fn a_signal_that_never_came_is_known_by_its_flag_or_its_stamp() {
    for (stamp_ns, health) in [(0, 0), (1, Health::NEVER)] {
        let mut rig = Rig::armed(&defaults());
        rig.now += T;
        rig.sense();
        rig.answer();
        let stamp_ns = stamp_ns * rig.now;
        rig.sensors.body_rate = Sample { stamp_ns, health, ..rig.sensors.body_rate };
        rig.step(true);
        assert_eq!(rig.state.cause(), Cause::SignalNever, "stamp {stamp_ns}, health {health}");
    }
}
