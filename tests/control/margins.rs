//! Promised margins against measured ones.

use std::f64::consts::TAU;

use nalgebra::Complex;
use rotorbench::control::design::{Compensator, DiscreteLoop, LoopPlant, advise, pid_by_margins};
use rotorbench::control::{
    Compensation, ControlError, Controller, ControllerKind, EmcConfig, PlantParameters,
};
use rotorbench::signal::{Applied, Reference};

use super::truth::{Truth, applied, build, closed, free};

/// Complementary sensitivity, measured: a sine added to the rotor commands, the controller's answer correlated
/// with it over whole periods of the sine. The controller does not know of the sine.
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
            assert!(after.sensitivity_peak < before.sensitivity_peak, "{advice:?}");
        } else {
            assert!(after.bandwidth_rad_s > before.bandwidth_rad_s, "{advice:?}");
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
