//! What a controller sends: freshness, not liveness.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::signal::Command;

use crate::rig::{N, Rig, T, defaults};

/// Each way in which a command can be wrong, on and on, while everything else is well.
#[test]
fn every_wrong_command_is_refused_by_cause_and_ends_in_zero() {
    type Fault = fn(&mut Rig, Command);
    let faults: [(&str, Fault, Cause); 10] = [
        ("not a number", |rig, _| rig.command.rotor[1] = f64::NAN, Cause::CommandNotANumber),
        ("infinite", |rig, _| rig.command.rotor[0] = f64::INFINITY, Cause::CommandNotANumber),
        ("from the future", |rig, _| rig.command.stamp_ns = rig.now + T + 1, Cause::CommandFromFuture),
        ("expired", |rig, _| rig.command.stamp_ns = rig.now - 6 * T - 1, Cause::CommandExpired),
        ("unstamped", |rig, _| rig.command.stamp_ns = 0, Cause::CommandExpired),
        ("repeated", |rig, before| rig.command.sequence = before.sequence, Cause::CommandRepeated),
        ("a lower sequence", |rig, _| rig.command.sequence = 1, Cause::CommandRepeated),
        ("the same stamp", |rig, before| rig.command.stamp_ns = before.stamp_ns, Cause::CommandRepeated),
        ("sensors to come", |rig, _| rig.command.sensors_sequence += 1, Cause::CommandAheadOfSensors),
        (
            "sensors before",
            |rig, before| rig.command.sensors_sequence = before.sensors_sequence - 1,
            Cause::CommandAnswersOldSensors,
        ),
    ];
    for (name, fault, cause) in faults {
        let mut rig = Rig::armed(&defaults());
        let before = rig.command;
        let periods = rig.periods_to_zero(|rig| {
            rig.command.sequence = rig.command.sequence.max(before.sequence) + 1;
            fault(rig, before);
        });
        println!("command {name}: zero after {periods} periods, hold limit {N}");
        assert!(periods <= N + 2 && periods > 2, "{name}: {periods} periods");
        assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, cause), "{name}");
        // Each new refusal is counted, the first of a kind is an event.
        assert!(rig.state.refusals(cause) >= 1);
        let events = rig.events();
        assert_eq!(events[0], (State::Armed, State::Armed, cause, u32::MAX), "{name}");
        let events = events.iter().filter(|event| event.0 == event.1 && event.2 == cause).count();
        assert_eq!(events, 1, "{name}");
    }
}

#[test]
fn a_command_on_the_edge_of_its_time_goes_through() {
    let mut rig = Rig::armed(&defaults());
    rig.now += T;
    rig.sense();
    rig.answer();
    rig.command.stamp_ns = rig.now + T;
    rig.command.rotor = [0.47, 0.46];
    assert_eq!(rig.step(true).rotor, [0.47, 0.46], "a period of grace for stamps");

    let mut rig = Rig::armed(&GuardConfig { hold_s: 0.3, ..defaults() });
    for _ in 0..2 {
        rig.now += T;
        rig.sense();
        rig.step(false);
    }
    rig.answer();
    rig.command.rotor = [0.47, 0.46];
    rig.now += 12 * T;
    rig.sense();
    assert_eq!(rig.step(true).rotor, [0.47, 0.46], "14 periods of 16 it may live");
    assert_eq!(rig.guard.time_to_live_ns(), 16 * T);
}

#[test]
fn alive_is_not_fresh() {
    // A controller that goes on counting and stamping, and has gone deaf.
    let mut rig = Rig::armed(&defaults());
    let deaf = rig.command.sensors_sequence;
    let periods = rig.periods_to_zero(|rig| rig.command.sensors_sequence = deaf);
    assert!(periods <= N + 2, "{periods} periods");
    assert!(periods > N, "cut without a hold, {periods} periods");
    assert_eq!(rig.state.cause(), Cause::CommandAnswersOldSensors);

    // One that answers, later and later: the sensors it answers are older than a command may be.
    let mut rig = Rig::armed(&defaults());
    let start = rig.command.sensors_sequence;
    let mut steps = 0;
    rig.periods_to_zero(|rig| {
        steps += 1;
        rig.command.sensors_sequence = start + steps / 4;
    });
    assert_eq!(rig.state.cause(), Cause::CommandAnswersOldSensors);

    // One that lags by two periods, for ever, is fresh.
    let mut rig = Rig::armed(&defaults());
    for _ in 0..300 {
        rig.now += T;
        rig.sense();
        rig.answer();
        rig.command.sensors_sequence -= u64::from(rig.command.sensors_sequence > 63) * 2;
        rig.step(true);
    }
    assert_eq!(rig.state.state(), State::Armed);
}

#[test]
fn a_restarted_controller_rejoins_only_while_the_rotors_stand() {
    let mut rig = Rig::new(&defaults());
    rig.run(30);
    rig.command.sequence = 0;
    rig.ask(OperatorAct::Arm);
    rig.run(60);
    assert_eq!(rig.state.state(), State::Armed, "a new life before arming");
    rig.command.sequence = 0;
    rig.run(N + 2);
    assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, Cause::CommandRepeated));
    rig.ask(OperatorAct::Disarm);
    rig.period();
    rig.ask(OperatorAct::Arm);
    rig.run(60);
    assert_eq!(rig.state.state(), State::Armed, "and after");
}
