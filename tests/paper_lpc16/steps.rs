//! EMC and PID step by step.

use nalgebra::{Matrix5, Vector3, Vector5};
use rotorbench::control::gains::{complementary_eigenvalues, feedback_gains, observer_gains};
use rotorbench::control::{AnyController, Controller, ControllerConfig, ControllerKind, PlantParameters};
use rotorbench::signal::{Applied, Command, CommandFlags, Reference, Sample, Sensors};

use super::{BETA, T_C, close};

fn sensors(sequence: u32, body_rate: f64) -> Sensors {
    let stamp = 1_000_000 * u64::from(sequence);
    Sensors {
        sequence: u64::from(sequence),
        stamp_ns: stamp,
        body_rate: Sample::good(body_rate, stamp, sequence),
        battery_voltage: Sample::good(12.1, stamp, sequence),
        ..Sensors::default()
    }
}

fn let_through(command: &Command) -> Applied {
    Applied {
        sequence: command.sequence,
        command_sequence: command.sequence,
        rotor: command.rotor,
        ..Applied::default()
    }
}

fn build(kind: ControllerKind) -> AnyController {
    let config = ControllerConfig { kind, ..ControllerConfig::paper() };
    config.build(&PlantParameters::paper(), T_C).expect("the paper's controller")
}

/// Once more, as the paper writes them: matrices, no shared code.
#[test]
fn eqs_20_to_25_and_28_emc_step_is_the_matrix_form_of_the_paper() {
    let emc = build(ControllerKind::Emc);
    let mut state = emc.start();
    let [l_0, l_1, l_2, l_3] = observer_gains(BETA, complementary_eigenvalues(BETA, 1.2));
    let k = feedback_gains(BETA, complementary_eigenvalues(BETA, 0.0));
    let j = 0.032;
    let mut x = Vector5::<f64>::zeros();
    let mut applied = Applied::default();
    for i in 1..200_u32 {
        let rate = 0.5 * (0.21 * f64::from(i)).sin() + 0.1 * (1.7 * f64::from(i)).cos();
        let reference = Reference { angle: 0.1, rate: 0.02, acceleration: -0.3, jerk: 1.5 };
        let command = emc.step(&mut state, &sensors(i, rate), &reference, &applied);

        let y = T_C * rate;
        if i == 1 {
            x[1] = y; // at rest at the measured rate until the first command is let through
        }
        let r = Vector3::new(0.1, T_C * 0.02, T_C * T_C * -0.3);
        let nominal = r[2] + T_C.powi(3) * 1.5 / BETA;
        let q_x_d = Vector3::new(0.0, 0.0, x[3]);
        let e = r - x.fixed_rows::<3>(0) - q_x_d;
        let u = nominal + Vector3::from(k).dot(&e) - (x[3] + x[4] / BETA);
        close(command.torque, j / (T_C * T_C) * u, 1e-9);
        close(command.estimate.disturbance_torque, j / (T_C * T_C) * x[3], 1e-9);
        close(command.estimate.body_angle, x[0], 1e-12);
        close(command.estimate.model_error, (x[1] - y) / T_C, 1e-10);
        #[rustfmt::skip]
        let a = Matrix5::new(
            1.0, 1.0,         0.0,        0.0, 0.0,
            0.0, 1.0 - l_1,   1.0,        1.0, 0.0,
            0.0, -BETA * l_0, 1.0 - BETA, 0.0, 0.0,
            0.0, -l_2,        0.0,        1.0, 1.0,
            0.0, -l_3,        0.0,        0.0, 1.0
        );
        // The angle integrates the estimated rate: it is not observable from the gyro.
        x = a * x
            + Vector5::new(0.0, 0.0, BETA, 0.0, 0.0) * u
            + Vector5::new(0.0, l_1, BETA * l_0, l_2, l_3) * y;
        applied = let_through(&command);
    }
}

#[test]
fn emc_believes_what_the_guard_let_through_and_not_what_it_asked_for() {
    let emc = build(ControllerKind::Emc);
    let mut state = emc.start();
    let asked = emc.step(&mut state, &sensors(1, 0.4), &Reference::default(), &Applied::default());
    assert!(asked.torque < -0.1);
    let nothing = Applied { rotor: [0.4, 0.4], ..let_through(&asked) };
    let after = emc.step(&mut state, &sensors(2, 0.4), &Reference::default(), &nothing);
    close(after.estimate.actuator_acceleration, 0.0, 1e-12);
}

#[test]
fn a_missing_gyro_sample_is_predicted_and_flagged() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let controller = build(kind);
        let mut state = controller.start();
        let reference = Reference::default();
        let first = controller.step(&mut state, &sensors(1, 0.4), &reference, &Applied::default());
        assert_eq!(first.flags & CommandFlags::SENSOR_MISSING, 0);
        // The same sample again, and one that is no number: neither is a measurement.
        let mut bad = sensors(2, f64::NAN);
        for missing in [sensors(1, 0.4), bad] {
            let command = controller.step(&mut state, &missing, &reference, &let_through(&first));
            assert_eq!(command.flags & CommandFlags::SENSOR_MISSING, CommandFlags::SENSOR_MISSING);
            assert!(command.torque.is_finite() && command.estimate.body_angle > 0.0);
            close(command.estimate.model_error, 0.0, 0.0);
        }
        bad.battery_voltage = Sample::never();
        let command = controller.step(&mut state, &bad, &reference, &let_through(&first));
        assert_eq!(command.flags & CommandFlags::VOLTAGE_ASSUMED, CommandFlags::VOLTAGE_ASSUMED);
    }
}

#[test]
fn eq_30_with_the_gains_of_table_iii() {
    let pid = build(ControllerKind::Pid);
    let mut state = pid.start();
    let reference = Reference { angle: 0.1, ..Reference::default() };
    let (mut angle, mut x_i) = (0.0, 0.0);
    let mut applied = Applied::default();
    for i in 1..100_u32 {
        let rate = 0.05 * (0.3 * f64::from(i)).sin();
        let command = pid.step(&mut state, &sensors(i, rate), &reference, &applied);
        let e = 0.1 - angle;
        let x_2 = T_C * rate;
        close(command.torque, 2.248 * e - 0.574 / T_C * x_2 + 0.985 * T_C * x_i, 1e-12);
        // The bench was at rest until now: the integral begins with the first command let through.
        x_i += if i > 1 { e } else { 0.0 };
        angle += x_2;
        applied = let_through(&command);
    }
}

#[test]
fn pid_integral_stops_where_the_guard_saturates() {
    let pid = build(ControllerKind::Pid);
    let reference = Reference { angle: 0.5, ..Reference::default() };
    let integral = |flags: u32, rotor: Option<[f64; 2]>| {
        let mut state = pid.start();
        let mut applied = Applied::default();
        let mut last = 0.0;
        for i in 1..50 {
            let command = pid.step(&mut state, &sensors(i, 0.0), &reference, &applied);
            // The torque on the body that the integral holds against has the other sign.
            last = -command.estimate.disturbance_torque;
            applied = Applied { flags, ..let_through(&command) };
            applied.rotor = rotor.unwrap_or(applied.rotor);
        }
        last
    };
    close(integral(0, None), 0.985 * T_C * 0.5 * 47.0, 1e-9);
    close(integral(1, Some([0.47, 0.46])), 0.0, 0.0);
    // Saturated, yet the rotors already do more than was asked for: the integral may go on.
    assert!(integral(1, Some([0.9, 0.1])) > 0.4);
}

#[test]
fn a_disarmed_bench_does_not_wind_up() {
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let controller = build(kind);
        let mut state = controller.start();
        let mut command = Command::default();
        for i in 1..3000 {
            command =
                controller.step(&mut state, &sensors(i, 0.01), &Reference::default(), &Applied::default());
        }
        close(command.estimate.body_angle, 0.0, 0.0);
        close(command.estimate.disturbance_torque, 0.0, 0.0);
    }
}
