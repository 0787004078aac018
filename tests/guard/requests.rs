//! What an operator can ask for, and when it is obeyed.

use rotorbench::guard::{Cause, OperatorAct, State};
use rotorbench::signal::{Channel, Sample};

use crate::rig::{Rig, T, defaults};

#[test]
fn arming_needs_good_signals_fresh_commands_and_an_act() {
    let mut rig = Rig::new(&defaults());
    rig.run(100);
    assert_eq!(
        (rig.state.state(), rig.state.cause()),
        (State::Disarmed, Cause::None),
        "good for long, but nobody asked"
    );
    rig.ask(OperatorAct::Arm);
    assert_eq!(rig.period().state, State::PreArm as u32);
    // 0.2 s of good checks are 10 periods.
    for _ in 0..9 {
        let applied = rig.period();
        assert_eq!(
            (applied.state, applied.rotor, applied.command_sequence),
            (State::PreArm as u32, [0.0; 2], 0)
        );
    }
    assert_eq!(rig.period().state, State::Armed as u32);
    let armed = (State::Disarmed, State::PreArm, Cause::OperatorArm, u32::MAX);
    assert_eq!(rig.events(), [armed, (State::PreArm, State::Armed, Cause::ChecksPassed, u32::MAX)]);
}

#[test]
fn one_bad_value_begins_the_checks_again_and_the_time_runs_out() {
    let mut rig = Rig::new(&defaults());
    rig.run(3);
    rig.ask(OperatorAct::Arm);
    rig.run(9);
    rig.now += T;
    rig.sense();
    rig.answer();
    rig.sensors.battery_voltage.value = 70.0;
    assert_eq!(rig.step(true).state, State::PreArm as u32);
    rig.run(9);
    assert_eq!(rig.state.state(), State::PreArm);
    rig.period();
    assert_eq!(rig.state.state(), State::Armed);

    let mut rig = Rig::new(&defaults());
    rig.run(1);
    rig.ask(OperatorAct::Arm);
    for period in 0..102 {
        rig.now += T;
        rig.sense();
        rig.answer();
        rig.sensors.propeller_rate[1] = Sample::never();
        rig.step(true);
        // 2 s are 100 periods.
        assert_eq!(rig.state.state() == State::PreArm, period < 100, "period {period}");
    }
    assert_eq!(
        rig.events()[1],
        (State::PreArm, State::Disarmed, Cause::SignalNever, Channel::PropellerRate2.subject())
    );

    // Without a controller there is nothing to arm.
    let mut rig = Rig::new(&defaults());
    rig.now += T;
    rig.sense();
    rig.step(false);
    rig.ask(OperatorAct::Arm);
    for _ in 0..110 {
        rig.now += T;
        rig.sense();
        rig.step(false);
    }
    assert_eq!(rig.events()[1], (State::PreArm, State::Disarmed, Cause::CommandMissing, u32::MAX));
}

#[test]
fn requests_are_obeyed_once_in_time_and_where_the_table_has_them() {
    let mut rig = Rig::new(&defaults());
    rig.run(2);
    // From before this guard's life: left over in shared memory.
    rig.ask_code(OperatorAct::Arm as u32, 900_000_000);
    rig.period();
    rig.ask_code(OperatorAct::Stop as u32, 900_000_000);
    rig.period();
    rig.ask_code(7, rig.now);
    rig.period();
    rig.ask(OperatorAct::Disarm);
    rig.period();
    let refused = |cause| (State::Disarmed, State::Disarmed, cause, u32::MAX);
    assert_eq!(
        rig.events(),
        [Cause::RequestStale, Cause::RequestStale, Cause::RequestUnknown, Cause::RequestRefused].map(refused)
    );
    assert_eq!(rig.state.refusals(Cause::RequestStale), 2);
    rig.run(60);
    // Older than a second, and as far in the future.
    for stamp in [rig.now - 1_000_000_001, rig.now + 2 * 1_000_000_000] {
        rig.ask_code(OperatorAct::Arm as u32, stamp);
        rig.period();
        assert_eq!(rig.state.state(), State::Disarmed);
    }
    rig.ask_code(OperatorAct::Arm as u32, rig.now + T - 1_000_000_000);
    rig.period();
    assert_eq!(rig.state.state(), State::PreArm, "a second old to the nanosecond");
    // The same request lies there for ever; it is not obeyed again.
    rig.ask(OperatorAct::Disarm);
    rig.run(30);
    assert_eq!(rig.state.state(), State::Disarmed);
    assert_eq!(rig.state.cause(), Cause::OperatorDisarm);
    // A stop is obeyed however old, once the guard lives.
    rig.run(100);
    rig.ask_code(OperatorAct::Stop as u32, 1_000_000_000 + 2 * T);
    rig.period();
    assert_eq!((rig.state.state(), rig.state.cause()), (State::EmergencyStop, Cause::OperatorStop));
}

#[test]
fn stop_and_disarm_mean_zero_in_the_same_step() {
    for (act, end) in [(OperatorAct::Stop, State::EmergencyStop), (OperatorAct::Disarm, State::Disarmed)] {
        let mut rig = Rig::armed(&defaults());
        rig.ask(act);
        let applied = rig.period();
        assert_eq!((applied.rotor, applied.command_sequence, applied.flags), ([0.0; 2], 0, 0));
        assert_eq!(applied.state, end as u32);
        rig.run(50);
        assert_eq!((rig.state.state(), rig.last.rotor), (end, [0.0; 2]));
        rig.ask(OperatorAct::Arm);
        rig.run(60);
        // A stop is latched: `disarm` first, then `arm`.
        assert_eq!(rig.state.state() == State::Armed, act == OperatorAct::Disarm);
        rig.rearm();
    }
}

/// A word that was said before a latch and arrives after it was said of another situation: it neither undoes the latch nor,
/// once somebody has, arms.
#[test]
fn a_word_from_before_a_latch_is_refused_after_it() {
    let latched = || {
        let mut rig = Rig::armed(&defaults());
        rig.guard.trip(&mut rig.state, rig.now, Cause::BusDead);
        rig.period();
        rig.state.take_events().for_each(drop);
        // The latch is a period old.
        let latched_ns = rig.now - T;
        (rig, latched_ns)
    };
    let (mut rig, latched_ns) = latched();
    for act in [OperatorAct::Disarm, OperatorAct::Arm] {
        rig.ask_code(act as u32, latched_ns - 1);
        rig.period();
        assert_eq!(
            (rig.state.state(), rig.state.cause()),
            (State::FailsafeLatched, Cause::BusDead),
            "{act:?}"
        );
    }
    assert_eq!(rig.state.refusals(Cause::RequestStale), 2);
    rig.ask_code(OperatorAct::Disarm as u32, latched_ns);
    rig.period();
    assert_eq!(rig.state.state(), State::Disarmed, "said when it was latched");
    rig.ask_code(OperatorAct::Arm as u32, latched_ns - 1);
    rig.run(60);
    assert_eq!(rig.state.state(), State::Disarmed, "armed by a word from before the latch");
    assert_eq!(rig.state.refusals(Cause::RequestStale), 3);
    rig.ask(OperatorAct::Arm);
    rig.run(60);
    assert_eq!(rig.state.state(), State::Armed);

    // A stop is a latch of its own, and is itself obeyed however old.
    let (mut rig, latched_ns) = latched();
    rig.ask_code(OperatorAct::Stop as u32, latched_ns - 1);
    rig.period();
    assert_eq!(rig.state.state(), State::EmergencyStop);
    let stopped_ns = rig.now;
    rig.ask_code(OperatorAct::Disarm as u32, stopped_ns - 1);
    rig.period();
    assert_eq!(rig.state.state(), State::EmergencyStop, "from between the latch and the stop");
    rig.ask_code(OperatorAct::Disarm as u32, stopped_ns);
    rig.period();
    assert_eq!(rig.state.state(), State::Disarmed);
}
