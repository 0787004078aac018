//! Where the angle is to go, and that it gets there.

use rotorbench::control::{
    Controller, ControllerConfig, ControllerKind, MoveConfig, PlantParameters, ReferenceConfig,
};
use rotorbench::signal::{Applied, Reference, Sample};

use super::truth::{Truth, applied, free};

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
