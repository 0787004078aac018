//! The control room in closed loop on a plant of the test's own (shares no code with `emulate` or `model`):
//! promised margins against measured ones, known physics against unknown, no allocation in any step.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::collections::VecDeque;
use std::f64::consts::TAU;

use nalgebra::Complex;
use rotorbench::control::design::{Compensator, DiscreteLoop, LoopPlant, advise, pid_by_margins};
use rotorbench::control::{
    AnyController, Compensation, ControlError, Controller, ControllerConfig, ControllerKind, EmcConfig,
    MoveConfig, PidConfig, PlantParameters, ReferenceConfig,
};
use rotorbench::guard::{GuardConfig, GuardState, OperatorAct, State};
use rotorbench::signal::{Applied, Command, Reference, Request, Sample, Sensors};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes to the system allocator unchanged; counting touches only a `const` thread-local cell.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The true plant: two rotors, quadratic thrust, body with a torque law, transport delay; midpoint rule.
struct Truth {
    rotor: [f64; 2],
    rate: f64,
    angle: f64,
    delay: VecDeque<[f64; 2]>,
    substep_s: f64,
    law: fn(f64, f64) -> f64,
}

const SUBSTEPS: usize = 40;

impl Truth {
    fn new(period_s: f64, delay_s: f64, law: fn(f64, f64) -> f64) -> Self {
        let substep_s = period_s / SUBSTEPS as f64;
        let waiting = (delay_s / substep_s).round() as usize;
        let hover = PlantParameters::paper().hover_rate;
        let delay = std::iter::repeat_n([0.463_34; 2], waiting).collect();
        Self { rotor: [hover; 2], rate: 0.0, angle: 0.0, delay, substep_s, law }
    }

    fn derivative(&self, [w_1, w_2, rate, angle]: [f64; 4], u: [f64; 2], torque: f64) -> [f64; 4] {
        let z = u.map(|u| 447.1 * u * u + 1124.5 * u);
        let thrust = 0.0197 * 0.0197 / (4.0 * 6.0771) * (w_1 * w_1 - w_2 * w_2);
        let sum = 0.25 * thrust + torque + (self.law)(angle, rate);
        [16.0 * (z[0] - w_1), 16.0 * (z[1] - w_2), sum / 0.032, rate]
    }

    /// One period under the command, with a disturbance torque given at each substep.
    fn advance(&mut self, command: [f64; 2], torque: f64) {
        for _ in 0..SUBSTEPS {
            self.delay.push_back(command);
            let u = self.delay.pop_front().expect("just pushed");
            let now = [self.rotor[0], self.rotor[1], self.rate, self.angle];
            let k = self.derivative(now, u, torque);
            let middle = std::array::from_fn(|i| now[i] + 0.5 * self.substep_s * k[i]);
            let k = self.derivative(middle, u, torque);
            let next: [f64; 4] = std::array::from_fn(|i| now[i] + self.substep_s * k[i]);
            (self.rotor, self.rate, self.angle) = ([next[0], next[1]], next[2], next[3]);
        }
    }

    fn sensors(&self, k: u32, noise: f64) -> Sensors {
        let stamp = 1_000_000 * u64::from(k);
        Sensors {
            sequence: u64::from(k),
            stamp_ns: stamp,
            body_rate: Sample::good(self.rate + noise, stamp, k),
            battery_voltage: Sample::good(12.6, stamp, k),
            ..Sensors::default()
        }
    }
}

fn free(_: f64, _: f64) -> f64 {
    0.0
}

fn applied(command: &Command, rotor: [f64; 2]) -> Applied {
    Applied { sequence: command.sequence, command_sequence: command.sequence, rotor, ..Applied::default() }
}

fn build(kind: ControllerKind, period_s: f64) -> (AnyController, Compensator) {
    let plant = PlantParameters::paper();
    let config = ControllerConfig { kind, ..ControllerConfig::default() };
    let built = config.build(&plant, period_s).expect("stable");
    let linear = match &built {
        AnyController::Emc(emc) => Compensator::Emc(emc.gains()),
        AnyController::Pid(pid) => Compensator::Pid(pid.gains()),
    };
    (built, linear)
}

fn closed(kind: ControllerKind, delay_s: f64, period_s: f64) -> Result<DiscreteLoop, ControlError> {
    let plant = PlantParameters::paper();
    let loop_plant = LoopPlant { delay_s, ..LoopPlant::new(&plant) };
    let linear = build(kind, period_s).1;
    DiscreteLoop::build(&plant, &loop_plant, &linear, &Compensation::default(), 0.0, period_s)
}

/// Complementary sensitivity, measured: a sine added to the rotor commands, the controller's answer correlated
/// with it over whole periods of the sine. The controller is not told of the sine.
fn measured_complementary(
    kind: ControllerKind,
    delay_s: f64,
    period_s: f64,
    cycles: u32,
    slots: u32,
) -> Complex<f64> {
    let (controller, _) = build(kind, period_s);
    let mut state = controller.start();
    let mut truth = Truth::new(period_s, delay_s, free);
    let mut last = Applied::default();
    let turn = TAU * f64::from(cycles) / f64::from(slots);
    let (amplitude, mut sum) = (0.01, Complex::new(0.0, 0.0));
    let torque_slope = 0.25 * 0.0197;
    // Long enough for the slowest mode (the predictor's, 1.2 rad/s) to be gone.
    let settle = slots * (20.0 / (f64::from(slots) * period_s)).ceil() as u32;
    for k in 0..settle + slots {
        let command = controller.step(&mut state, &truth.sensors(k + 1, 0.0), &Reference::default(), &last);
        let injected = amplitude * (turn * f64::from(k)).sin();
        // A torque is a difference of rotor speeds; dg/du at hover makes it a command, exactly by the inverse.
        let plant = PlantParameters::paper();
        let half = 0.5 * (command.torque + injected) / torque_slope;
        let rotor = [plant.hover_rate + half, plant.hover_rate - half].map(|rate| plant.command_for(rate));
        if k >= settle {
            sum += Complex::from_polar(1.0, -turn * f64::from(k)) * command.torque;
        }
        truth.advance(rotor, 0.0);
        last = applied(&command, command.rotor);
    }
    // Σ a sin(ωk + φ) e^(-iωk) = a n / (2i) e^(iφ)
    -sum * Complex::new(0.0, 2.0) / (amplitude * f64::from(slots))
}

#[test]
fn a_sweep_measures_the_loop_that_design_promised() {
    for (kind, delay_s, period_s) in [
        (ControllerKind::Emc, 0.0, 0.02),
        (ControllerKind::Emc, 0.013, 0.02),
        (ControllerKind::Pid, 0.0, 0.02),
        (ControllerKind::Pid, 0.02, 0.02),
        (ControllerKind::Emc, 0.0075, 0.005),
    ] {
        let promised = closed(kind, delay_s, period_s).expect("stable");
        let slots = (4.0 / period_s) as u32;
        for cycles in [1, 4, 8, 13, 20, 40] {
            let frequency = TAU * f64::from(cycles) / (f64::from(slots) * period_s);
            let promise = promised.response(frequency).complementary();
            let measured = measured_complementary(kind, delay_s, period_s, cycles, slots);
            // The test's integrator (midpoint rule, 40 a period), what is left of the start after 20 s, and the
            // linearization (sine of 2 % of the torque in reach) are each below 0.2 %.
            assert!(
                (promise - measured).norm() < 0.004 * promise.norm().max(0.1),
                "{kind:?} delay {delay_s} s at {frequency:.2} rad/s: promised {promise:.4}, measured {measured:.4}"
            );
        }
    }
}

#[test]
fn the_delay_margin_is_where_an_eigenvalue_leaves_the_unit_circle() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        for period_s in [0.02, 0.005] {
            let margins = closed(kind, 0.0, period_s).expect("stable").margins();
            // The frequency domain takes the further delay as a pure one; sampled, it is a change of the hold
            // within the period, which differs by less than 5 %.
            assert!(closed(kind, 0.95 * margins.delay_s, period_s).is_ok(), "{kind:?} {margins:?}");
            let error = closed(kind, 1.05 * margins.delay_s, period_s).unwrap_err();
            assert!(matches!(error, ControlError::Unstable { what: "closed loop", .. }), "{error}");
        }
    }
}

#[test]
fn the_gain_margins_are_where_an_eigenvalue_leaves_the_unit_circle() {
    let plant = PlantParameters::paper();
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let (_, linear) = build(kind, 0.02);
        let margins = closed(kind, 0.0, 0.02).expect("stable").margins();
        // A plant with less inertia is a loop with more gain.
        let with_gain = |gain: f64| {
            let real = LoopPlant { inertia: plant.inertia / gain, ..LoopPlant::new(&plant) };
            DiscreteLoop::build(&plant, &real, &linear, &Compensation::default(), 0.0, 0.02)
        };
        assert!(with_gain(0.999 * margins.gain_up).is_ok(), "{kind:?} {margins:?}");
        assert!(with_gain(1.001 * margins.gain_up).is_err(), "{kind:?} {margins:?}");
        assert!(with_gain(1.001 * margins.gain_down).is_ok(), "{kind:?} {margins:?}");
        if margins.gain_down > 0.0 {
            assert!(with_gain(0.999 * margins.gain_down).is_err(), "{kind:?} {margins:?}");
        }
    }
}

#[test]
fn pid_by_margins_has_its_margins() {
    let plant = PlantParameters::paper();
    for delay_s in [0.0, 0.01, 0.03] {
        let loop_plant = LoopPlant { delay_s, ..LoopPlant::new(&plant) };
        let gains = pid_by_margins(&plant, &loop_plant, 0.02, 1.0, 2.0).expect("reachable");
        let none = Compensation::default();
        let closed = DiscreteLoop::build(&plant, &loop_plant, &Compensator::Pid(gains), &none, 0.0, 0.02)
            .expect("stable");
        let margins = closed.margins();
        assert!(margins.phase_rad > 0.999 && margins.gain_up > 1.999, "{margins:?}");
        // And the angle comes back: the slowest eigenvalue is gone to 1 % within 20 s.
        let slowest = closed.eigenvalues().first().expect("some").norm();
        assert!(slowest.powf(20.0 / 0.02) < 0.01, "delay {delay_s}: {slowest}, {gains:?}");
    }
    let loop_plant = LoopPlant::new(&plant);
    let error = pid_by_margins(&plant, &loop_plant, 0.02, 3.1, 2.0).unwrap_err();
    assert!(error.to_string().contains("178°"), "{error}");
}

#[test]
fn defaults_are_sensible_at_every_rate() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        for period_s in [0.02, 0.01, 0.005, 0.002, 0.001] {
            let margins = closed(kind, 0.0, period_s).expect("stable").margins();
            assert!(margins.phase_rad > 0.35 && margins.gain_up > 1.5, "{kind:?} {period_s}: {margins:?}");
            assert!(
                margins.delay_s > 0.01 && margins.sensitivity_peak < 3.5,
                "{kind:?} {period_s}: {margins:?}"
            );
        }
    }
}

#[test]
fn advice_does_what_it_says() {
    let plant = PlantParameters::paper();
    let look = |config: &EmcConfig| {
        let gains = config.gains(plant.pole, 0.02).ok()?;
        let loop_plant = LoopPlant { delay_s: 0.02, ..LoopPlant::new(&plant) };
        let linear = Compensator::Emc(gains);
        let closed =
            DiscreteLoop::build(&plant, &loop_plant, &linear, &Compensation::default(), 0.0, 0.02).ok()?;
        Some(closed.margins())
    };
    let mut config = EmcConfig::default();
    let mut steps = 0;
    while let Some(advice) = look(&config).and_then(|now| advise(&config, &now, plant.pole, 0.02, look)) {
        let (before, after) = (look(&config).expect("stable"), look(&advice.config).expect("stable"));
        if before.sensitivity_peak > 2.0 {
            assert!(after.sensitivity_peak < before.sensitivity_peak, "{}", advice.sentence);
        } else {
            assert!(after.bandwidth_rad_s > before.bandwidth_rad_s, "{}", advice.sentence);
        }
        config = advice.config;
        steps += 1;
        assert!(steps < 60, "advice goes in circles at {config:?}");
    }
    let end = look(&config).expect("stable");
    assert!(end.sensitivity_peak <= 2.0, "{end:?}");
}

#[test]
fn an_unstable_loop_is_refused_with_its_eigenvalue() {
    let error = closed(ControllerKind::Pid, 0.5, 0.02).unwrap_err();
    let ControlError::Unstable { modulus, .. } = error else { panic!("{error}") };
    assert!(modulus > 1.0 && modulus < 2.0);
}

fn pendulum_and_friction(angle: f64, rate: f64) -> f64 {
    -0.4 * (angle + 0.1).sin() - 0.05 * (rate / 0.1).tanh() - 0.02 * rate
}

/// [rad] rms of the true angle against the reference, over slews there and back, with gyro noise.
fn tracking_error(kind: ControllerKind, known: &Compensation) -> f64 {
    let moves = [(2.0, 0.4), (6.0, -0.2), (10.0, 0.0)];
    let moves = moves.map(|(at_s, angle_rad)| MoveConfig { at_s, angle_rad, duration_s: 1.5 }).to_vec();
    let reference = ReferenceConfig { angle_rad: 0.0, moves };
    let config = ControllerConfig { kind, reference, ..ControllerConfig::default() };
    let controller = config.build_compensated(&PlantParameters::paper(), known, 0.02).expect("stable");
    let generator = config.reference.build(0.02).expect("valid");
    let (mut state, mut time) = (controller.start(), generator.start());
    let mut truth = Truth::new(0.02, 0.0, pendulum_and_friction);
    let mut last = Applied::default();
    let (mut sum, mut seed) = (0.0, 1_u64);
    let slots = 700;
    for k in 1..=slots {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // Uniform, 0.004 rad/s rms.
        let noise = 0.004 * 12f64.sqrt() * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
        let wanted = generator.next(&mut time, &last);
        let command = controller.step(&mut state, &truth.sensors(k, noise), &wanted, &last);
        sum += (truth.angle - wanted.angle).powi(2);
        truth.advance(command.rotor, 0.0);
        last = applied(&command, command.rotor);
    }
    (sum / f64::from(slots)).sqrt()
}

#[test]
fn known_physics_at_least_halves_the_tracking_error() {
    let known = Compensation {
        pendulum_moment: 0.4,
        pendulum_offset: 0.1,
        coulomb_torque: 0.05,
        coulomb_rate: 0.1,
        viscous_friction: 0.02,
        ..Compensation::default()
    };
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let base = tracking_error(kind, &Compensation::default());
        let better = tracking_error(kind, &known);
        println!("{kind:?}: {base:.5} rad without, {better:.5} rad with known physics");
        assert!(better < 0.5 * base, "{kind:?}: {base} rad without, {better} rad with known physics");
    }
}

#[test]
fn a_step_and_a_slew_arrive() {
    for duration_s in [0.0, 1.0] {
        let reference = ReferenceConfig {
            angle_rad: 0.0,
            moves: vec![MoveConfig { at_s: 1.0, angle_rad: 0.3, duration_s }],
        };
        let config = ControllerConfig { reference, ..ControllerConfig::default() };
        let controller = config.build(&PlantParameters::paper(), 0.02).expect("stable");
        let generator = config.reference.build(0.02).expect("valid");
        let (mut state, mut time) = (controller.start(), generator.start());
        let mut truth = Truth::new(0.02, 0.0, free);
        let mut last = Applied::default();
        let (mut overshoot, mut lag) = (0.0_f64, 0.0_f64);
        for k in 1..300 {
            let wanted = generator.next(&mut time, &last);
            let command = controller.step(&mut state, &truth.sensors(k, 0.0), &wanted, &last);
            truth.advance(command.rotor, 0.0);
            last = applied(&command, command.rotor);
            overshoot = overshoot.max(truth.angle - 0.3);
            lag = lag.max((truth.angle - generator.at(u64::from(k)).angle).abs());
        }
        assert!((truth.angle - 0.3).abs() < 2e-3, "{duration_s} s: ends at {} rad", truth.angle);
        if duration_s > 0.0 {
            // Reference and embedded model agree; what is left is Euler's forward step against the true plant.
            assert!(lag < 0.02 && overshoot < 0.01, "lag {lag} rad, overshoot {overshoot} rad");
        }
    }
}

#[test]
fn slews_follow_the_embedded_model_exactly() {
    let moves = vec![
        MoveConfig { at_s: 0.5, angle_rad: 0.2, duration_s: 1.0 },
        MoveConfig { at_s: 2.0, angle_rad: -0.1, duration_s: 0.0 },
        MoveConfig { at_s: 3.0, angle_rad: 0.4, duration_s: 0.7 },
    ];
    let generator = ReferenceConfig { angle_rad: 0.1, moves }.build(0.02).expect("valid");
    for k in 0..200 {
        let (now, next) = (generator.at(k), generator.at(k + 1));
        if k == 99 {
            assert!((next.angle - now.angle + 0.3).abs() < 1e-12, "the step, at 2 s");
            continue;
        }
        // Differences of numbers near 0.4, over the period up to three times: rounding of 1e-16 / 0.02³.
        assert!((now.angle + 0.02 * now.rate - next.angle).abs() < 1e-14);
        assert!((now.rate + 0.02 * now.acceleration - next.rate).abs() < 1e-12);
        assert!((now.acceleration + 0.02 * now.jerk - next.acceleration).abs() < 1e-10);
    }
    assert!((generator.at(49).angle - 0.2).abs() > 0.05);
    assert!((generator.at(75).angle - 0.2).abs() < 1e-12);
    assert!((generator.at(1000).angle - 0.4).abs() < 1e-12);
}

#[test]
fn moves_that_cannot_be_made_are_refused_by_number() {
    let backwards = vec![
        MoveConfig { at_s: 1.0, angle_rad: 0.2, duration_s: 2.0 },
        MoveConfig { at_s: 2.5, angle_rad: 0.0, duration_s: 0.0 },
    ];
    let error = ReferenceConfig { angle_rad: 0.0, moves: backwards }.build(0.02).unwrap_err();
    assert!(error.to_string().contains("move 1 at 2.5 s"), "{error}");
}

#[test]
fn a_measured_angle_holds_a_drifting_gyro() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let end = |use_body_angle: bool| {
            let config = ControllerConfig { kind, use_body_angle, ..ControllerConfig::default() };
            let controller = config.build(&PlantParameters::paper(), 0.02).expect("stable");
            let mut state = controller.start();
            let mut truth = Truth::new(0.02, 0.0, free);
            let mut last = Applied::default();
            for k in 1..1000 {
                let mut sensors = truth.sensors(k, 0.01);
                sensors.body_angle = Sample::good(truth.angle, sensors.stamp_ns, k);
                let command = controller.step(&mut state, &sensors, &Reference::default(), &last);
                truth.advance(command.rotor, 0.0);
                last = applied(&command, command.rotor);
            }
            truth.angle
        };
        // [LPC16]: the angle is the integral of the gyro; 0.01 rad/s of bias is 0.2 rad after 20 s.
        assert!((end(false) + 0.2).abs() < 0.02, "{kind:?}: {} rad", end(false));
        assert!(end(true).abs() < 0.02, "{kind:?}: {} rad", end(true));
    }
}

#[test]
fn known_faults_of_the_command_are_inverted() {
    let plant = PlantParameters::paper();
    let known = Compensation {
        dead_zone: 0.07,
        command_limit: 0.95,
        steady_rate_offset: 12.0,
        steady_rate_cubic: -300.0,
        cubic_center: 0.46,
        battery_scaling: true,
        ..Compensation::default()
    };
    let allocator = rotorbench::control::Allocator::build(&plant, &known).expect("valid");
    for voltage in [12.6, 11.5] {
        for difference in [-300.0, 0.0, 150.0] {
            let rotor = allocator.allocate(difference, voltage).rotor;
            let z = rotor.map(|u: f64| {
                let seen = (u.min(0.95) - 0.07).max(0.0) / 0.93 * voltage / 12.6;
                447.1 * seen * seen + 1124.5 * seen + 12.0 - 300.0 * (seen - 0.46).powi(3)
            });
            assert!((z[0] - z[1] - difference).abs() < 1e-6, "{voltage} V {difference}: {z:?}");
            assert!((0.5 * (z[0] + z[1]) - plant.hover_rate).abs() < 1e-6);
            assert!((allocator.difference(rotor, voltage) - difference).abs() < 1e-6);
        }
    }
    let flat = Compensation { steady_rate_cubic: -1e5, ..Compensation::default() };
    assert!(rotorbench::control::Allocator::build(&plant, &flat).is_err(), "no inverse");
}

#[test]
fn settings_that_no_controller_can_be_built_on_are_named() {
    let plant = PlantParameters::paper();
    let emc = |emc: EmcConfig| ControllerConfig { emc, ..ControllerConfig::default() }.build(&plant, 0.02);
    let named = |error: ControlError, name: &str| assert!(error.to_string().starts_with(name), "{error}");
    named(emc(EmcConfig { gamma_0: Some(2.5), ..EmcConfig::default() }).unwrap_err(), "gamma_0 is 2.5");
    named(emc(EmcConfig { alpha: -1.0, ..EmcConfig::default() }).unwrap_err(), "alpha is -1");
    named(emc(EmcConfig { alpha_c: f64::NAN, ..EmcConfig::default() }).unwrap_err(), "alpha_c is NaN");
    let pid = PidConfig { k_i: -0.1, ..PidConfig::default() };
    let config = ControllerConfig { kind: ControllerKind::Pid, pid, ..ControllerConfig::default() };
    named(config.build(&plant, 0.02).unwrap_err(), "k_i is -0.1");
    named(ControllerConfig::default().build(&plant, 0.0).unwrap_err(), "period_s is 0");
    for (broken, name) in [
        (PlantParameters { inertia: 0.0, ..plant }, "inertia"),
        (PlantParameters { voltage_gain: -1.0, ..plant }, "voltage_gain"),
        (PlantParameters { steady_rate_quadratic: -600.0, ..plant }, "steady_rate_quadratic"),
        (PlantParameters { hover_rate: 1600.0, ..plant }, "hover_rate"),
    ] {
        named(ControllerConfig::default().build(&broken, 0.02).unwrap_err(), name);
    }
    let known = Compensation { dead_zone: 1.0, ..Compensation::default() };
    named(ControllerConfig::default().build_compensated(&plant, &known, 0.02).unwrap_err(), "dead_zone");
}

#[test]
fn controllers_and_guard_allocate_nothing() {
    let guard = GuardConfig::default().build(0.02).expect("defaults");
    let known = Compensation { pendulum_moment: 0.1, coulomb_torque: 0.01, ..Compensation::default() };
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let config = ControllerConfig { kind, ..ControllerConfig::default() };
        let controller = config.build_compensated(&PlantParameters::paper(), &known, 0.02).expect("stable");
        let generator = config.reference.build(0.02).expect("valid");
        let (mut state, mut time) = (controller.start(), generator.start());
        let (mut guard_state, mut truth) = (GuardState::new(), Truth::new(0.02, 0.0, free));
        let mut last = Applied::default();
        let before = ALLOCATIONS.with(Cell::get);
        for k in 1..500_u32 {
            let now = 20_000_000 * u64::from(k);
            let mut sensors = truth.sensors(k, 1e-3 * f64::from(k % 7));
            for sample in [&mut sensors.body_rate, &mut sensors.battery_voltage] {
                sample.stamp_ns = now;
            }
            sensors.propeller_rate = [Sample::good(600.0 + f64::from(k % 5), now, k); 2];
            let request = Request { sequence: 1, stamp_ns: now, act: OperatorAct::Arm as u32, reserved: 0 };
            let wanted = generator.next(&mut time, &last);
            let mut command = controller.step(&mut state, &sensors, &wanted, &last);
            command.stamp_ns = now;
            // From the 400th on the controller is silent: failsafe and events are on the path too.
            let newest = (k < 400).then_some(&command);
            last = guard.step(&mut guard_state, now, &sensors, newest, (k == 10).then_some(&request));
            guard_state.take_events().for_each(drop);
            truth.delay.clear();
            if k == 399 {
                assert_eq!(guard_state.state(), State::Armed);
            }
        }
        assert_eq!(ALLOCATIONS.with(Cell::get) - before, 0, "{kind:?}");
        assert_eq!(guard_state.state(), State::FailsafeLatched);
    }
    assert!(!vec![0_u8; 1].is_empty() && ALLOCATIONS.with(Cell::get) > 0, "the allocator counts");
}
