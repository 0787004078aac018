//! What is measured: each fault of a signal, and what is no fault.

use rotorbench::guard::{Cause, GuardConfig, OperatorAct, SignalLimitsConfig, State};
use rotorbench::signal::{Channel, Health, Sample, Sensor, Sensors};

use crate::rig::{N, Rig, T, defaults};

/// Each fault of a signal, from the first bad sample to zero on both rotors.
#[test]
fn every_fault_of_a_signal_ends_in_zero_within_the_hold_and_two_periods() {
    type Fault = fn(&mut Sample, &Sample);
    let faults: [(&str, Fault, Cause); 9] = [
        ("silent", |sample, before| *sample = *before, Cause::SignalStale),
        ("frozen", |sample, before| sample.value = before.value, Cause::SignalFrozen),
        ("not a number", |sample, _| sample.value = f64::NAN, Cause::SignalNotANumber),
        ("flagged not a number", |sample, _| sample.health = Health::NOT_A_NUMBER, Cause::SignalNotANumber),
        ("too low", |sample, _| sample.value = -21.0, Cause::SignalOutOfRange),
        ("too high", |sample, _| sample.value = 21.0, Cause::SignalOutOfRange),
        ("flagged out of range", |sample, _| sample.health = Health::OUT_OF_RANGE, Cause::SignalOutOfRange),
        ("flagged frozen", |sample, _| sample.health = Health::FROZEN, Cause::SignalFrozen),
        ("counter", |sample, _| sample.health = Health::COUNTER, Cause::SignalCounter),
    ];
    let more: [(&str, Fault, Cause); 4] = [
        ("flagged stale", |sample, _| sample.health = Health::STALE, Cause::SignalStale),
        ("an unknown flag", |sample, _| sample.health = 1 << 30, Cause::SignalStale),
        ("gone", |sample, _| *sample = Sample::never(), Cause::SignalNever),
        ("stamped in the future", |sample, _| sample.stamp_ns += 10 * T, Cause::SignalStale),
    ];
    // As the bus leaves them: frames go on, each value is refused, the last good one stands with its stamp.
    let held: [(&str, Fault, Cause); 3] = [
        (
            "held, not a number",
            |sample, before| {
                *sample = Sample { count: sample.count, health: Health::NOT_A_NUMBER, ..*before }
            },
            Cause::SignalNotANumber,
        ),
        (
            "held, out of range",
            |sample, before| {
                *sample = Sample { count: sample.count, health: Health::OUT_OF_RANGE, ..*before }
            },
            Cause::SignalOutOfRange,
        ),
        (
            "held, counter",
            |sample, before| *sample = Sample { count: sample.count, health: Health::COUNTER, ..*before },
            Cause::SignalCounter,
        ),
    ];
    for (name, fault, cause) in faults.into_iter().chain(more).chain(held) {
        let mut rig = Rig::armed(&defaults());
        let before = rig.sensors.body_rate;
        let periods = rig.periods_to_zero(|rig| fault(&mut rig.sensors.body_rate, &before));
        println!("body rate {name}: zero after {periods} periods, hold limit {N}");
        assert!(periods <= N + 2, "{name}: {periods} periods");
        assert!(periods > 2, "{name}: cut without a hold, {periods} periods");
        assert_eq!(rig.state.state(), State::FailsafeLatched);
        assert_eq!(rig.state.cause(), cause, "{name}");
        assert!(rig.events().iter().all(|event| event.3 == Channel::BodyRate.subject()), "{name}");
    }
}

/// What the guard knows by its clock and no frame can carry: flagged for whoever reads the sensors.
#[test]
fn stale_and_frozen_signals_are_marked_for_their_readers() {
    let mut rig = Rig::armed(&defaults());
    let marks = |rig: &Rig| {
        let mut marked = rig.sensors;
        rig.guard.mark(&rig.state, rig.now, &mut marked);
        let unmarked = Sensors { body_rate: Sample { health: 0, ..marked.body_rate }, ..marked };
        assert_eq!(
            unmarked,
            Sensors { body_rate: Sample { health: 0, ..rig.sensors.body_rate }, ..rig.sensors }
        );
        marked.body_rate.health
    };
    assert_eq!(marks(&rig), 0);
    // Silent: marked once it is older than the hold, and not before.
    let before = rig.sensors.body_rate;
    for period in 1..=N + 2 {
        rig.now += T;
        rig.sense();
        rig.sensors.body_rate = before;
        rig.answer();
        rig.step(true);
        assert_eq!(marks(&rig), if period > N { Health::STALE } else { 0 }, "{period} periods");
    }
    rig.period();
    assert_eq!(marks(&rig), 0, "a new value is not stale");

    // Frozen: frames go on with the same value while the rotors turn.
    let mut rig = Rig::armed(&defaults());
    let before = rig.sensors.body_rate.value;
    let mut periods = 0;
    while marks(&rig) == 0 {
        periods += 1;
        assert!(periods <= N + 2, "never marked");
        rig.now += T;
        rig.sense();
        rig.sensors.body_rate.value = before;
        rig.answer();
        rig.step(true);
    }
    assert_eq!((marks(&rig), rig.state.cause()), (Health::FROZEN, Cause::SignalFrozen));
    rig.sensors.body_rate.value += 1e-3;
    assert_eq!(marks(&rig), 0, "another value is not frozen, even before the guard has looked at it");
}

#[test]
fn every_required_signal_is_watched_and_no_other() {
    let all = SignalLimitsConfig { required: Some(true), ..SignalLimitsConfig::default() };
    let mut everything = defaults();
    for sensor in Sensor::ALL {
        if let Some(settings) = everything.of_mut(sensor) {
            *settings = all;
        }
    }
    let by_default =
        [Channel::BodyRate, Channel::BatteryVoltage, Channel::PropellerRate1, Channel::PropellerRate2];
    for (config, required) in [(defaults(), by_default.to_vec()), (everything, Channel::WATCHED.to_vec())] {
        for signal in Channel::WATCHED {
            let mut rig = Rig::armed(&config);
            for _ in 0..100 {
                rig.now += T;
                rig.sense();
                rig.answer();
                signal.of_mut(&mut rig.sensors).value = f64::INFINITY;
                rig.step(true);
            }
            let failed = rig.state.state() == State::FailsafeLatched;
            assert_eq!(failed, required.contains(&signal), "{signal}");
            if failed {
                let (_, _, cause, subject) = rig.events()[0];
                assert_eq!((cause, subject), (Cause::SignalNotANumber, signal.subject()));
            }
        }
    }
}

/// Whether a sensor is missing from the start or falls silent, nothing but its flag follows where it is not required.
#[test]
fn an_optional_signal_that_never_came_or_falls_silent_neither_blocks_nor_trips() {
    let config = defaults();
    let required: Vec<Channel> = config.build(0.02).expect("valid").requirements().map(|it| it.0).collect();
    for is_silent in [false, true] {
        let mut rig = Rig::new(&config);
        let mut last = rig.sensors;
        for period in 0..1000 {
            if period == 3 {
                rig.ask(OperatorAct::Arm);
            }
            rig.now += T;
            rig.sense();
            for channel in Channel::WATCHED.into_iter().filter(|channel| !required.contains(channel)) {
                let before = if is_silent { *channel.of(&last) } else { Sample::never() };
                if period > 0 || !is_silent {
                    *channel.of_mut(&mut rig.sensors) = before;
                }
            }
            last = rig.sensors;
            rig.answer();
            rig.step(true);
            assert!(period < 60 || rig.state.state() == State::Armed, "{period}: {:?}", rig.state.cause());
        }
        let mut marked = rig.sensors;
        rig.guard.mark(&rig.state, rig.now, &mut marked);
        let stale = if is_silent { Health::STALE } else { Health::NEVER };
        assert_eq!(marked.esc_temperature.map(|sample| sample.health), [stale; 2]);
    }
}

#[test]
fn the_required_signals_are_told_with_their_times() {
    let required: Vec<(Channel, u64)> = defaults().build(0.02).expect("valid").requirements().collect();
    let hold = 100_000_000;
    let expected = [
        (Channel::BodyRate, hold),
        (Channel::BatteryVoltage, 1_000_000_000),
        (Channel::PropellerRate1, hold),
        (Channel::PropellerRate2, hold),
    ];
    assert_eq!(required, expected);
}

#[test]
fn limits_of_a_signal_are_inclusive_and_its_times_its_own() {
    let body_rate = SignalLimitsConfig {
        minimum: Some(-1.0),
        maximum: Some(1.0),
        stale_after_s: Some(0.3),
        frozen_after_s: Some(0.0),
        required: None,
    };
    let mut rig = Rig::armed(&GuardConfig { body_rate, ..defaults() });
    for limit in [-1.0, 1.0] {
        for _ in 0..40 {
            rig.now += T;
            rig.sense();
            rig.answer();
            rig.sensors.body_rate.value = limit;
            rig.step(true);
            assert_eq!(rig.state.state(), State::Armed, "{limit} is within, and never frozen");
        }
    }
    // Half of 0.3 s degrades, the whole is too much; the ramp's two periods follow.
    let before = rig.sensors.body_rate;
    let mut degraded_after = 0;
    let periods = rig.periods_to_zero(|rig| {
        rig.sensors.body_rate = before;
        degraded_after += u32::from(rig.state.state() == State::Armed);
    });
    assert_eq!((degraded_after, periods), (8, 17));
}

#[test]
fn a_value_may_stand_still_while_no_rotor_is_commanded() {
    let mut rig = Rig::armed(&defaults());
    let still = |rig: &mut Rig| {
        rig.now += T;
        rig.sense();
        rig.answer();
        rig.sensors.body_rate.value = 0.5;
        rig.sensors.propeller_rate[0].value = 0.0;
        rig.step(true);
    };
    rig.command.rotor = [0.0; 2];
    for _ in 0..100 {
        still(&mut rig);
    }
    assert_eq!(rig.state.state(), State::Armed);
    rig.command.rotor = [0.0, 0.1];
    for _ in 0..6 {
        still(&mut rig);
        assert_eq!(rig.state.state(), State::Armed);
    }
    still(&mut rig);
    still(&mut rig);
    assert_eq!((rig.state.state(), rig.state.cause()), (State::FailsafeLatched, Cause::SignalFrozen));
}
