//! Rotors held against what the model makes of their commands: what is found, after how long, and what is never found.

use rotorbench::bench::BenchConfig;
use rotorbench::emulate::{HiddenConfig, Impulse, RotorFault, RotorFaultKind};
use rotorbench::guard::{Cause, GuardConfig, OperatorAct, State};
use rotorbench::model::{AddedEffect, Model};
use rotorbench::runtime::lockstep::{Interference, Lockstep};
use rotorbench::runtime::{controller_plant, emulate};
use rotorbench::signal::{Command, GuardEvent};

/// The built-in bench as `identify` found it.
const IDENTIFIED: &str = include_str!("identified.toml");

fn identified() -> Model {
    Model::parse(IDENTIFIED, "identified.toml".as_ref()).expect("a model")
}

/// The built-in bench, struck each ten seconds, its speeds held against the model.
fn bench(seed: u64) -> BenchConfig {
    let mut config = BenchConfig::default();
    config.emulator.seed = seed;
    config.emulator.impulse_period_s = 10.0;
    config.emulator.impulse = vec![
        Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.6 },
        Impulse { at_s: 6.0, duration_s: 0.05, torque: -0.6 },
    ];
    config.guard.speed_check.on = true;
    config
}

/// What an operator and a controller do, and what the guard said.
#[derive(Default)]
struct Story {
    acts: Vec<(u64, OperatorAct)>,
    /// From this slot on the controller commands nothing.
    nothing_from: Option<u64>,
    events: Vec<GuardEvent>,
}

impl Interference for Story {
    fn act(&mut self, slot: u64) -> Option<OperatorAct> {
        self.acts.iter().find(|(at, _)| *at == slot).map(|(_, act)| *act)
    }

    fn command(&mut self, slot: u64, command: Command) -> Option<Command> {
        let is_nothing = self.nothing_from.is_some_and(|from| slot >= from);
        Some(if is_nothing { Command { rotor: [0.0; 2], ..command } } else { command })
    }

    fn event(&mut self, event: &GuardEvent) {
        self.events.push(*event);
    }
}

/// Runs the bench for `seconds`; the state and the cause at its end, and [s] when the rotors were last commanded to turn.
fn run(config: &BenchConfig, model: &Model, seconds: f64, story: &mut Story) -> (State, Cause, f64) {
    let guard = config.guard.build_on(config.period_s, model).expect("a guard");
    let source = controller_plant::command_source(config).expect("a controller");
    let bench = Lockstep::new(emulate::emulator(config).expect("a plant"), source, config.period_s);
    let bench = bench.guarded(guard);
    let (mut state, mut end, mut turned) = (bench.start(), (0, 0), 0.0);
    for _ in 0..bench.slots(seconds) {
        let slot = bench.step(&mut state, story);
        end = (slot.applied.state, slot.applied.cause);
        if slot.applied.rotor != [0.0; 2] {
            turned = slot.time + config.period_s;
        }
    }
    (State::from_code(end.0).expect("a state"), Cause::from_code(end.1).expect("a cause"), turned)
}

fn armed_at_once() -> Story {
    Story { acts: vec![(0, OperatorAct::Arm)], ..Story::default() }
}

fn breaks(kind: RotorFaultKind, at_s: f64) -> RotorFault {
    RotorFault { rotor: 2, at_s, kind, lost: 0.3, command: 0.2 }
}

#[test]
fn a_rotor_that_breaks_is_stopped_within_0_3_s() {
    use RotorFaultKind::{BrokenPropeller, Desync, TurnsByItself};
    for kind in [BrokenPropeller, Desync, TurnsByItself] {
        for seed in 1..=10 {
            let mut config = bench(seed);
            // At rest, after an impulse, and while the body comes back from it.
            let at_s = 2.0 + 0.53 * seed as f64;
            config.emulator.fault = vec![breaks(kind, at_s)];
            let (state, cause, turned) = run(&config, &identified(), at_s + 1.0, &mut armed_at_once());
            assert_eq!((state, cause), (State::FailsafeLatched, Cause::SpeedWrong), "{kind:?}, seed {seed}");
            assert!(turned > at_s && turned - at_s <= 0.3, "{kind:?}, seed {seed}: {} s", turned - at_s);
            // Without the check nobody sees it.
            config.guard.speed_check.on = false;
            let (state, ..) = run(&config, &identified(), at_s + 0.3, &mut armed_at_once());
            assert_eq!(state, State::Armed, "{kind:?}, seed {seed}");
        }
    }
}

/// The subject is the rotor that is wrong, the value what it reported.
#[test]
fn the_event_names_the_rotor_and_what_it_reported() {
    for rotor in [1, 2] {
        let mut config = bench(1);
        config.emulator.fault = vec![RotorFault { rotor, ..breaks(RotorFaultKind::Desync, 3.0) }];
        let mut story = armed_at_once();
        run(&config, &identified(), 4.0, &mut story);
        let event = story.events.iter().find(|event| event.cause == Cause::SpeedWrong as u32);
        let event = event.expect("an event");
        let channel = rotorbench::signal::Channel::of_subject(event.subject).expect("a signal");
        assert_eq!(channel.label(), format!("propeller_rate {rotor}"));
        // Hover is 617 rad/s; a rotor without a motor has lost a good part of it, and not all.
        assert!((100.0..590.0).contains(&event.value), "{}", event.value);
    }
}

#[test]
fn a_rotor_that_turns_without_a_command_keeps_the_bench_from_being_armed() {
    let mut config = bench(3);
    config.emulator.fault = vec![breaks(RotorFaultKind::TurnsByItself, 4.0)];
    let at = |seconds: f64| (seconds / config.period_s).round() as u64;
    let mut story = Story {
        acts: vec![(0, OperatorAct::Arm), (at(3.0), OperatorAct::Disarm), (at(8.0), OperatorAct::Arm)],
        ..Story::default()
    };
    let (state, cause, turned) = run(&config, &identified(), 12.0, &mut story);
    assert_eq!((state, cause), (State::Disarmed, Cause::TurnsUncommanded));
    assert!(turned < 3.1, "never armed again: {turned} s");
}

#[test]
fn a_rotor_that_turns_while_the_controller_commands_it_to_stand_is_latched() {
    let mut config = bench(4);
    let at = |seconds: f64| (seconds / config.period_s).round() as u64;
    let zero = || Story { nothing_from: Some(at(2.0)), ..armed_at_once() };
    let (state, ..) = run(&config, &identified(), 8.0, &mut zero());
    assert_eq!(state, State::Armed, "standing as commanded is no fault");
    config.emulator.fault = vec![breaks(RotorFaultKind::TurnsByItself, 5.0)];
    let (state, cause, _) = run(&config, &identified(), 5.3, &mut zero());
    assert_eq!((state, cause), (State::FailsafeLatched, Cause::TurnsUncommanded));
}

/// A share of the 100 hours of `tools/soak speeds`: the demo's impulses and moves, with and without effects that the model knows, with
/// telemetry from fast to rare.
#[test]
fn a_rotor_that_follows_its_model_is_never_stopped() {
    for seed in 1..=8 {
        for telemetry_hz in [200.0, 50.0, 20.0] {
            let mut config = bench(100 + seed);
            config.emulator.sensors.propeller_rate.rate_hz = telemetry_hz;
            config.guard.propeller_rate.stale_after_s = Some(1.0);
            let (state, cause, _) = run(&config, &identified(), 30.0, &mut armed_at_once());
            assert_eq!(state, State::Armed, "seed {seed}, {telemetry_hz} Hz: {cause}");
        }
    }
}

/// The laws of the model run beside the bench: with them its rotors follow, without them they do not.
#[test]
fn effects_of_the_model_are_reckoned_with() {
    let mut config = bench(9);
    for hidden in ["transport_delay:delay=0.06", "motor_heating:gain=0.08,time_constant=3"] {
        config.emulator.hidden.push(HiddenConfig::parse(hidden).expect("an effect"));
    }
    let mut model = identified();
    let (state, cause, _) = run(&config, &model, 30.0, &mut armed_at_once());
    assert_eq!((state, cause), (State::FailsafeLatched, Cause::SpeedWrong), "as if nothing were hidden");
    let of = |it: &HiddenConfig| AddedEffect { id: it.effect.clone(), parameters: it.parameters.clone() };
    model.effects = config.emulator.hidden.iter().map(of).collect();
    let (state, cause, _) = run(&config, &model, 30.0, &mut armed_at_once());
    assert_eq!(state, State::Armed, "{cause}");
}

#[test]
fn a_model_that_nobody_identified_here_is_refused() {
    let config: GuardConfig = toml::from_str("[speed_check]\non = true").expect("TOML");
    let refused = |model: &Model| config.build_on(0.02, model).expect_err("refused").to_string();
    assert!(refused(&Model::paper()).contains("no log was identified for"));
    assert!(refused(&Model { rotor_error: None, ..identified() }).contains("no `rotor_error`"));
    let without = Model { standard_errors: std::collections::BTreeMap::new(), ..identified() };
    assert!(refused(&without).contains("no standard error"));
    let sentence = config.build(0.02).expect_err("refused").to_string();
    assert!(sentence.contains("without the bench's model"), "{sentence}");
    let band: GuardConfig = toml::from_str("[speed_check]\nband = 0.5").expect("TOML");
    assert!(band.build(0.02).expect_err("refused").to_string().starts_with("guard speed_check.band is 0.5"));
}

/// What `check` says: 30 % of the thrust is seen, and how much less.
#[test]
fn what_is_seen_at_hover_is_said() {
    let config: GuardConfig = toml::from_str("[speed_check]\non = true").expect("TOML");
    let check = config.build_on(0.02, &identified()).expect("a guard").speed_check().expect("a check");
    // A propeller that has lost 30 % turns 6.7 % faster: see src/emulate/rotor_fault.rs.
    assert!((0.01..0.06).contains(&check.share), "{check:?}");
    assert!(config.build_on(0.02, &identified()).expect("a guard").speed_check().is_some());
    assert_eq!(GuardConfig::default().build(0.02).expect("a guard").speed_check(), None);
}
