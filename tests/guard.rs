//! The guard alone: its table, every cause, the ladder period by period, and a million random steps.

use std::collections::BTreeSet;

use rotorbench::guard::{
    Cause, Guard, GuardConfig, GuardState, OperatorAct, Signal, SignalConfig, State, TRANSITIONS, Trigger,
};
use rotorbench::signal::{Applied, AppliedFlags, Command, GuardEvent, Health, Request, Sample, Sensors};

/// [ns] 50 Hz.
const T: u64 = 20_000_000;
/// N of the default at 50 Hz: 0.1 s.
const N: u32 = 5;

/// A guard with live, ever changing sensors and a controller that answers them.
struct Rig {
    guard: Guard,
    state: GuardState,
    now: u64,
    sensors: Sensors,
    command: Command,
    request: Request,
    last: Applied,
}

impl Rig {
    fn new(config: &GuardConfig) -> Self {
        Self {
            guard: config.build(0.02).expect("valid"),
            state: GuardState::new(),
            now: 1_000_000_000,
            sensors: Sensors::default(),
            command: Command { rotor: [0.46, 0.47], ..Command::default() },
            request: Request::default(),
            last: Applied::default(),
        }
    }

    /// A rig that is armed and spun up.
    fn armed(config: &GuardConfig) -> Self {
        let mut rig = Self::new(config);
        rig.run(3);
        rig.ask(OperatorAct::Arm);
        rig.run(60);
        assert_eq!(rig.state.state(), State::Armed, "{:?}", rig.state.cause());
        assert_eq!(rig.last.rotor, rig.command.rotor);
        rig.state.take_events().for_each(drop);
        rig
    }

    /// New values of every signal, now.
    fn sense(&mut self) {
        let count = self.sensors.body_rate.count.wrapping_add(1);
        let good = |value: f64| Sample::good(value + 1e-3 * f64::from(count % 97), self.now, count);
        self.sensors = Sensors {
            sequence: self.sensors.sequence + 1,
            stamp_ns: self.now,
            body_rate: good(0.0),
            body_angle: good(0.0),
            battery_voltage: good(12.0),
            propeller_rate: [good(600.0), good(610.0)],
            current: [good(5.0); 2],
            thrust: [good(6.0); 2],
            ..Sensors::default()
        };
    }

    /// A new command that answers them.
    fn answer(&mut self) {
        self.command.sequence += 1;
        self.command.stamp_ns = self.now;
        self.command.sensors_sequence = self.sensors.sequence;
    }

    fn step(&mut self, command: bool) -> Applied {
        let newest = command.then_some(&self.command);
        let request = (self.request.sequence > 0).then_some(&self.request);
        self.last = self.guard.step(&mut self.state, self.now, &self.sensors, newest, request);
        self.last
    }

    /// One healthy period.
    fn period(&mut self) -> Applied {
        self.now += T;
        self.sense();
        self.answer();
        self.step(true)
    }

    fn run(&mut self, periods: u32) {
        for _ in 0..periods {
            self.period();
        }
    }

    /// A request made now, seen with the next step.
    fn ask(&mut self, act: OperatorAct) {
        self.ask_code(act as u32, self.now);
    }

    fn ask_code(&mut self, act: u32, stamp_ns: u64) {
        self.request = Request { sequence: self.request.sequence + 1, stamp_ns, act, reserved: 0 };
    }

    /// Periods of `fault` until both rotors get zero, at most 200.
    fn periods_to_zero(&mut self, mut fault: impl FnMut(&mut Self)) -> u32 {
        for periods in 1..200 {
            self.now += T;
            self.sense();
            self.answer();
            fault(self);
            if self.step(true).rotor == [0.0, 0.0] {
                return periods;
            }
        }
        panic!("the rotors go on turning");
    }

    fn events(&mut self) -> Vec<(State, State, Cause, u32)> {
        let read = |event: GuardEvent| {
            let state = |code| State::from_code(code).expect("a state");
            (
                state(event.from),
                state(event.to),
                Cause::from_code(event.cause).expect("a cause"),
                event.subject,
            )
        };
        self.state.take_events().map(read).collect()
    }
}

fn defaults() -> GuardConfig {
    GuardConfig::default()
}

#[test]
fn the_table_is_what_is_written() {
    let mut seen = BTreeSet::new();
    for (from, trigger, to) in TRANSITIONS {
        assert!(seen.insert((*from as u32, format!("{trigger:?}"))), "two ways out of {from} by {trigger:?}");
        assert_eq!(from.next(*trigger), Some(*to));
    }
    let pairs = State::ALL.into_iter().flat_map(|state| Trigger::ALL.map(|trigger| (state, trigger)));
    let taken = pairs.filter(|(state, trigger)| state.next(*trigger).is_some()).count();
    assert_eq!(taken, TRANSITIONS.len(), "every transition is in the table once, and no other exists");
    // What the words of the table promise.
    for (from, trigger, to) in TRANSITIONS {
        if *to == State::Armed {
            assert!(matches!(
                (from, trigger),
                (State::PreArm, Trigger::ChecksPassed) | (State::Degraded, Trigger::Recover)
            ));
        }
        if *to == State::PreArm {
            assert_eq!((*from, *trigger), (State::Disarmed, Trigger::Arm));
        }
        if matches!(from, State::FailsafeLatched | State::EmergencyStop) {
            assert!(matches!(trigger, Trigger::Disarm | Trigger::Stop), "a latch is left by {trigger:?}");
            assert!(!to.is_active() && *to != State::PreArm);
        }
    }
    assert!(
        State::ALL.iter().all(|state| *state == State::EmergencyStop || state.next(Trigger::Stop).is_some())
    );
}

#[test]
fn codes_and_words_are_one_to_one() {
    for (code, state) in (0..).zip(State::ALL) {
        assert_eq!((state as u32, State::from_code(code)), (code, Some(state)));
    }
    for (code, (cause, words)) in (0..).zip(Cause::ALL) {
        assert_eq!((cause as u32, Cause::from_code(code)), (code, Some(cause)));
        assert_eq!(cause.to_string(), words);
    }
    for (code, signal) in (0..).zip(Signal::ALL) {
        assert_eq!((signal as u32, Signal::from_code(code)), (code, Some(signal)));
    }
    for act in [OperatorAct::Arm, OperatorAct::Disarm, OperatorAct::Stop] {
        assert_eq!(OperatorAct::from_code(act as u32), Some(act));
    }
    assert_eq!(State::from_code(6), None);
    assert_eq!(Cause::from_code(Cause::COUNT as u32), None);
    assert_eq!(Signal::from_code(Signal::COUNT as u32), None);
    assert_eq!((OperatorAct::from_code(0), OperatorAct::from_code(4)), (None, None));
    let words =
        |texts: Vec<String>| texts.iter().filter(|text| !text.is_empty()).collect::<BTreeSet<_>>().len();
    assert_eq!(words(State::ALL.map(|state| state.to_string()).to_vec()), 6);
    assert_eq!(words(Signal::ALL.map(|signal| signal.to_string()).to_vec()), Signal::COUNT);
    assert_eq!(words(Cause::ALL.map(|(cause, _)| cause.to_string()).to_vec()), Cause::COUNT);
}

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
        (State::PreArm, State::Disarmed, Cause::SignalNever, Signal::PropellerRate2 as u32)
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
        rig.ask(OperatorAct::Disarm);
        rig.period();
        rig.ask(OperatorAct::Arm);
        rig.run(60);
        assert_eq!(rig.state.state(), State::Armed);
    }
}

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
        assert!(rig.events().iter().all(|event| event.3 == Signal::BodyRate as u32), "{name}");
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
    let poke = |sensors: &mut Sensors, signal: Signal| match signal {
        Signal::BodyRate => sensors.body_rate.value = f64::INFINITY,
        Signal::BodyAngle => sensors.body_angle.value = f64::INFINITY,
        Signal::BatteryVoltage => sensors.battery_voltage.value = f64::INFINITY,
        Signal::PropellerRate1 => sensors.propeller_rate[0].value = f64::INFINITY,
        Signal::PropellerRate2 => sensors.propeller_rate[1].value = f64::INFINITY,
        Signal::Current1 => sensors.current[0].value = f64::INFINITY,
        Signal::Current2 => sensors.current[1].value = f64::INFINITY,
        Signal::Thrust1 => sensors.thrust[0].value = f64::INFINITY,
        Signal::Thrust2 => sensors.thrust[1].value = f64::INFINITY,
    };
    let all = SignalConfig { required: Some(true), ..SignalConfig::default() };
    let everything = GuardConfig { body_angle: all, current: all, thrust: all, ..defaults() };
    let by_default =
        [Signal::BodyRate, Signal::BatteryVoltage, Signal::PropellerRate1, Signal::PropellerRate2];
    for (config, required) in [(defaults(), by_default.to_vec()), (everything, Signal::ALL.to_vec())] {
        for signal in Signal::ALL {
            let mut rig = Rig::armed(&config);
            for _ in 0..100 {
                rig.now += T;
                rig.sense();
                rig.answer();
                poke(&mut rig.sensors, signal);
                rig.step(true);
            }
            let failed = rig.state.state() == State::FailsafeLatched;
            assert_eq!(failed, required.contains(&signal), "{signal}");
            if failed {
                let (_, _, cause, subject) = rig.events()[0];
                assert_eq!((cause, subject), (Cause::SignalNotANumber, signal as u32));
            }
        }
    }
}

#[test]
fn the_required_signals_are_told_with_their_times() {
    let required: Vec<(Signal, u64)> = defaults().build(0.02).expect("valid").requirements().collect();
    let hold = 100_000_000;
    let expected = [
        (Signal::BodyRate, hold),
        (Signal::BatteryVoltage, 1_000_000_000),
        (Signal::PropellerRate1, hold),
        (Signal::PropellerRate2, hold),
    ];
    assert_eq!(required, expected);
}

#[test]
fn limits_of_a_signal_are_inclusive_and_its_times_its_own() {
    let body_rate = SignalConfig {
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
    // Half of 0.3 s is worth a warning, the whole is too much; the ramp's two periods follow.
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
        // Each new refusal is counted, the first of a kind told.
        assert!(rig.state.refusals(cause) >= 1);
        let events = rig.events();
        assert_eq!(events[0], (State::Armed, State::Armed, cause, u32::MAX), "{name}");
        let told = events.iter().filter(|event| event.0 == event.1 && event.2 == cause).count();
        assert_eq!(told, 1, "{name}");
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
    rig.ask(OperatorAct::Disarm);
    rig.period();
    rig.ask(OperatorAct::Arm);
    rig.run(60);
    assert_eq!(rig.state.state(), State::Armed);
}

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

#[test]
fn events_are_numbered_and_what_does_not_fit_is_counted() {
    let mut rig = Rig::new(&defaults());
    rig.run(1);
    for _ in 0..70 {
        rig.ask_code(9, rig.now);
        rig.period();
    }
    assert_eq!(rig.state.dropped_events(), 6);
    let numbers: Vec<u64> = rig.state.take_events().map(|event| event.sequence).collect();
    assert_eq!(numbers, (1..=64).collect::<Vec<_>>());
    assert_eq!(rig.state.take_events().count(), 0);
    // The ring goes round.
    for _ in 0..40 {
        rig.ask_code(9, rig.now);
        rig.period();
    }
    let events: Vec<GuardEvent> = rig.state.take_events().collect();
    assert_eq!((events.len(), events[0].sequence, events[39].sequence), (40, 71, 110));
    assert_eq!((events[0].value, events[0].cause), (9.0, Cause::RequestUnknown as u32));
    assert_eq!(rig.state.refusals(Cause::RequestUnknown), 110);
    assert_eq!(GuardState::default(), GuardState::new());
}

#[test]
fn applied_counts_and_stamps_every_step() {
    let mut rig = Rig::new(&defaults());
    for count in 1..=5 {
        let applied = rig.period();
        assert_eq!((applied.sequence, applied.stamp_ns), (count, rig.now));
    }
}

#[test]
fn settings_are_checked_at_the_door_by_name() {
    let refused = |text: &str| {
        let config: GuardConfig = toml::from_str(text).expect("TOML");
        config.build(0.02).expect_err(text).to_string()
    };
    for (text, name) in [
        ("hold_s = 0.0", "guard hold_s is 0: it must be above 0 and at most 10"),
        ("hold_s = nan", "guard hold_s is NaN"),
        ("rotor_maximum = 1.1", "guard rotor_maximum is 1.1"),
        ("rotor_maximum = 0.0", "guard rotor_maximum is 0"),
        ("slew_per_s = -1.0", "guard slew_per_s is -1"),
        ("spin_up_s = -0.1", "guard spin_up_s"),
        ("bucket_leak = -0.1", "guard bucket_leak"),
        ("bucket_limit = 0.0", "guard bucket_limit"),
        ("arm_checks_s = -1.0", "guard arm_checks_s"),
        ("arm_checks_s = 3.0", "guard arm_timeout_s is 2: it must be from arm_checks_s"),
        ("request_time_to_live_s = 0.0", "guard request_time_to_live_s"),
        ("ramp_periods = 1001", "guard ramp_periods"),
        ("swing_limit = 0", "guard swing_limit"),
        ("command_time_to_live_s = 0.01", "guard command_time_to_live_s is 0.01: it must be from one period"),
        (
            "[body_rate]\nminimum = 30.0",
            "guard body_rate maximum is 20: it must be a number not below the minimum",
        ),
        ("[thrust]\nminimum = nan", "guard thrust 1 minimum"),
        ("[propeller_rate]\nstale_after_s = 0.0", "guard propeller_rate 1 stale_after_s"),
        ("[current]\nfrozen_after_s = -1.0", "guard current 1 frozen_after_s"),
    ] {
        let sentence = refused(text);
        assert!(sentence.starts_with(name), "{text}: {sentence}");
    }
    assert!(defaults().build(0.0).is_err() && defaults().build(f64::NAN).is_err());
    assert!(toml::from_str::<GuardConfig>("hold = 1.0").is_err(), "unknown names are refused");
    assert!(defaults().build(10.0).is_ok() && defaults().build(1e-5).is_ok());
}

#[test]
fn the_hold_is_whole_periods_at_every_rate() {
    for (period_s, periods) in [(0.02, 5), (0.03, 4), (0.005, 20), (0.001, 100), (0.2, 1)] {
        let guard = defaults().build(period_s).expect("valid");
        assert_eq!((guard.hold_periods(), guard.ramp_periods()), (periods, 2), "{period_s} s");
        let life = f64::from(periods + 1) * period_s * 1e9;
        assert!((guard.time_to_live_ns() as f64 - life).abs() < 2.0);
    }
}

/// A small generator, repeatable from its seed on every machine.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) % sides
    }

    fn unit(&mut self) -> f64 {
        self.roll(1 << 40) as f64 / (1_u64 << 40) as f64
    }
}

/// Random commands, mostly good; remembers the stamp of each that could be let through.
fn random_command(rig: &mut Rig, dice: &mut Dice) {
    let before = rig.command;
    rig.answer();
    rig.command.rotor = [dice.unit() * 1.2 - 0.1, dice.unit()];
    match dice.roll(24) {
        0 => rig.command.rotor[0] = f64::NAN,
        1 => rig.command.rotor[1] = f64::NEG_INFINITY,
        2 => rig.command.stamp_ns += dice.roll(3 * T),
        3 => rig.command.stamp_ns -= dice.roll(10 * T),
        4 => rig.command.sequence = dice.roll(rig.command.sequence + 1),
        5 => rig.command.sensors_sequence = dice.roll(rig.command.sensors_sequence + 3),
        6 | 7 => rig.command = before,
        8 => rig.command.rotor = [1e300, -1e300],
        9 => rig.command = Command { stamp_ns: rig.now, ..before },
        _ => {}
    }
}

fn random_sensors(rig: &mut Rig, dice: &mut Dice) {
    let before = rig.sensors;
    rig.sense();
    let sample = match dice.roll(4) {
        0 => &mut rig.sensors.body_rate,
        1 => &mut rig.sensors.battery_voltage,
        2 => &mut rig.sensors.propeller_rate[0],
        _ => &mut rig.sensors.body_angle,
    };
    match dice.roll(40) {
        0 => sample.value = f64::NAN,
        1 => sample.value = 1e9,
        2 => sample.health = 1 << dice.roll(7),
        3 => sample.stamp_ns -= dice.roll(12 * T),
        4 => sample.stamp_ns += dice.roll(12 * T),
        5 => rig.sensors = before,
        _ => {}
    }
}

#[test]
fn a_million_random_steps_break_no_promise() {
    let mut reached = BTreeSet::new();
    let mut causes = BTreeSet::new();
    for seed in 1..=60_u64 {
        let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let config = GuardConfig {
            rotor_maximum: 0.3 + 0.7 * dice.unit(),
            slew_per_s: 0.5 + 30.0 * dice.unit(),
            ramp_periods: dice.roll(6) as u32,
            hold_s: 0.02 + 0.2 * dice.unit(),
            command_time_to_live_s: (dice.roll(2) == 0).then(|| 0.02 + 0.3 * dice.unit()),
            arm_checks_s: 0.1 * dice.unit(),
            bucket_limit: (dice.roll(3) == 0).then_some(2.0),
            bucket_leak: 0.1 + 0.4 * dice.unit(),
            swing_limit: 2 + dice.roll(9) as u32,
            ..defaults()
        };
        let mut rig = Rig::new(&config);
        // Calm seeds reach deep into flight, wild ones never stop failing.
        let calm = 1 + seed % 5 * 40;
        // Stamps of the commands by sequence; a restarted controller begins again.
        let mut stamps = std::collections::BTreeMap::new();
        let mut arm_asked = false;
        for _ in 0..20_000 {
            let before = (rig.state.state(), rig.last);
            let pace = [T, T, T, T, T / 3, T + T / 5, 2 * T, 30 * T];
            let step = if dice.roll(calm) > 0 { T } else { pace[dice.roll(8) as usize] };
            rig.now += step;
            let asked = dice.roll(20 + 2 * calm);
            if asked < 6 {
                let stamp = if dice.roll(4) == 0 { rig.now - dice.roll(1_000_000_000) } else { rig.now };
                rig.ask_code([1, 1, 1, 2, 2, 3][asked as usize], stamp);
            } else if matches!(rig.state.state(), State::FailsafeLatched | State::EmergencyStop)
                && dice.roll(40) == 0
            {
                rig.ask(OperatorAct::Disarm);
            } else if rig.state.state() == State::Disarmed && dice.roll(10) == 0 {
                rig.ask(OperatorAct::Arm);
            } else {
                rig.request.sequence = 0;
            }
            if dice.roll(calm) > 0 {
                rig.sense();
                rig.answer();
            } else {
                random_sensors(&mut rig, &mut dice);
                random_command(&mut rig, &mut dice);
            }
            stamps.insert(rig.command.sequence, rig.command.stamp_ns);
            let request = (rig.request.sequence > 0).then_some(rig.request.act);
            let heard = dice.roll(calm + 9) > 0;
            let applied = rig.step(heard);
            let state = rig.state.state();
            reached.insert(state as u32);
            causes.extend(rig.state.take_events().map(|event| event.cause));

            for (now, then) in applied.rotor.iter().zip(before.1.rotor) {
                assert!(*now >= 0.0 && *now <= config.rotor_maximum, "{now} leaves, seed {seed}");
                let change = config.slew_per_s * step.min(T) as f64 * 1e-9;
                assert!(now - then <= change + 1e-12, "{then} to {now} in {step} ns, seed {seed}");
            }
            let turning = applied.rotor != [0.0, 0.0];
            let ramping = applied.flags & AppliedFlags::RAMPING != 0;
            assert!(!turning || state.is_active() || (state == State::FailsafeLatched && ramping));
            if turning {
                let age = rig.now.saturating_sub(stamps[&applied.command_sequence]);
                let life = rig.guard.time_to_live_ns();
                let ramp = u64::from(config.ramp_periods) * T;
                assert!(age <= life + if ramping { ramp } else { 0 }, "a command of {age} ns, seed {seed}");
            }
            if ramping {
                assert!(
                    applied.rotor.iter().zip(before.1.rotor).all(|(now, then)| *now <= then),
                    "a ramp goes down"
                );
            }
            arm_asked |= request == Some(OperatorAct::Arm as u32);
            if before.0 == State::Disarmed && state != State::Disarmed && state != State::EmergencyStop {
                assert!(arm_asked, "left `disarmed` towards {state} by itself, seed {seed}");
            }
            if matches!(before.0, State::FailsafeLatched | State::EmergencyStop) {
                let acknowledged = request == Some(OperatorAct::Disarm as u32);
                let stopped = state == State::EmergencyStop;
                assert!(
                    state == before.0 || acknowledged || stopped,
                    "{} to {state} by itself, seed {seed}",
                    before.0
                );
                assert!(!state.is_active() && state != State::PreArm);
            }
            if state == State::Disarmed {
                arm_asked = false;
            }
        }
    }
    assert_eq!(reached.len(), 6, "every state was visited");
    for cause in [
        Cause::CommandMissing,
        Cause::CommandExpired,
        Cause::CommandRepeated,
        Cause::CommandNotANumber,
        Cause::CommandFromFuture,
        Cause::CommandAnswersOldSensors,
        Cause::CommandAheadOfSensors,
        Cause::SignalStale,
        Cause::SignalOutOfRange,
        Cause::SignalNotANumber,
        Cause::TooManyMisses,
        Cause::Oscillation,
        Cause::GuardPaused,
    ] {
        assert!(causes.contains(&(cause as u32)), "{cause} never happened");
    }
}
