//! What leaves: limit, slew, spin-up, swings, and its number.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::AppliedFlags;

use crate::rig::{Rig, T, defaults};

#[test]
fn nothing_beyond_the_limits_leaves() {
    let mut rig = Rig::armed(&GuardConfig { slew_per_s: 1000.0, ..defaults() });
    rig.command.rotor = [7.0, -7.0];
    let applied = rig.period();
    assert_eq!((applied.rotor, applied.flags), ([0.9, 0.0], AppliedFlags::LIMITED));
    assert_eq!((rig.guard.limits().maximum, rig.guard.limits().slew_per_s), (0.9, 1000.0));
    rig.command.rotor = [0.9, 0.0];
    assert_eq!(rig.period().flags, 0, "the limit itself is within");
}

#[test]
fn the_slew_is_limited_both_ways_by_time_and_not_by_calls() {
    let mut rig = Rig::armed(&GuardConfig { slew_per_s: 1.0, ..defaults() });
    let [first, second] = rig.last.rotor;
    rig.command.rotor = [0.8, 0.1];
    // Four calls in one period slew no further than one.
    for quarter in 1..=4_u32 {
        rig.now += T / 4;
        rig.sense();
        rig.answer();
        let applied = rig.step(true);
        let moved = 0.005 * f64::from(quarter);
        assert!(
            (applied.rotor[0] - first - moved).abs() < 1e-12
                && (applied.rotor[1] - second + moved).abs() < 1e-12
        );
        assert_eq!(applied.flags, AppliedFlags::SLEWED);
    }
    // A late call slews one period's worth and no more.
    rig.now += 3 * T;
    rig.sense();
    rig.answer();
    assert!((rig.step(true).rotor[0] - first - 0.04).abs() < 1e-12);
}

#[test]
fn the_spin_up_rises_to_the_limit() {
    let mut rig = Rig::new(&GuardConfig { slew_per_s: 1000.0, arm_checks_s: 0.0, ..defaults() });
    rig.run(2);
    rig.ask(OperatorAct::Arm);
    while rig.state.state() != State::Armed {
        rig.period();
    }
    rig.command.rotor = [0.9, 0.9];
    let armed_at = rig.now;
    for _ in 0..30 {
        let applied = rig.period();
        let share = ((rig.now - armed_at) as f64 / 0.5e9).min(1.0);
        assert!((applied.rotor[0] - 0.9 * share).abs() < 1e-12, "{} after {share}", applied.rotor[0]);
        assert_eq!(applied.flags, if share < 1.0 { AppliedFlags::LIMITED } else { 0 });
    }
    let mut rig = Rig::new(&GuardConfig { slew_per_s: 1000.0, spin_up_s: 0.0, ..defaults() });
    rig.run(2);
    rig.ask(OperatorAct::Arm);
    while rig.state.state() != State::Armed {
        rig.period();
    }
    assert_eq!(rig.last.rotor, rig.command.rotor, "no spin-up");
}

#[test]
fn a_controller_that_swings_from_limit_to_limit_is_stopped() {
    for (high, low, slew_per_s) in [(2.0, -1.0, 1000.0), (0.9, 0.0, 1000.0), (0.8, 0.1, 10.0)] {
        let mut rig = Rig::armed(&GuardConfig { slew_per_s, ..defaults() });
        let mut swings = 0;
        while rig.state.state() == State::Armed && swings < 100 {
            swings += 1;
            rig.command.rotor = [0.45, if swings % 2 == 0 { high } else { low }];
            rig.period();
        }
        assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, Cause::Oscillation));
        // The first is no swing yet, ten are the limit, and the 0.2 s leak less than one.
        assert!((11..=14).contains(&swings), "{swings} swings of {low}..{high}");
    }
    // Slow swings, and one that stays at a limit, are a controller at work.
    let mut rig = Rig::armed(&defaults());
    for period in 0..2000 {
        rig.command.rotor = [if period % 100 < 50 { 0.9 } else { 0.0 }, 0.95];
        rig.period();
    }
    assert_eq!(rig.state.state(), State::Armed);
    // What it had counted is forgotten with the next arming.
    for swing in 0..9 {
        rig.command.rotor = [if swing % 2 == 0 { 0.9 } else { 0.0 }, 0.5];
        rig.period();
    }
    rig.ask(OperatorAct::Disarm);
    rig.period();
    rig.command.rotor = [0.5, 0.5];
    rig.ask(OperatorAct::Arm);
    rig.run(60);
    for swing in 0..9 {
        rig.command.rotor = [if swing % 2 == 0 { 0.9 } else { 0.0 }, 0.5];
        rig.period();
        assert_eq!(rig.state.state(), State::Armed);
    }
}

#[test]
fn applied_counts_and_stamps_every_step() {
    let mut rig = Rig::new(&defaults());
    for count in 1..=5 {
        let applied = rig.period();
        assert_eq!((applied.sequence, applied.stamp_ns), (count, rig.now));
    }
}
