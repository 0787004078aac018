//! Plant, gains, eigenvalues, allocation: sections II to IV.A.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Matrix4, RowVector2, Vector3};
use rotorbench::control::design::LoopPlant;
use rotorbench::control::gains::{
    complementary_eigenvalues, feedback_gains, feedback_matrix, observer_gains, predictor_matrix,
};
use rotorbench::control::{
    Allocator, Beta, BetaRule, Compensation, ControlError, ControllerConfig, EmcConfig, PlantParameters,
};

use super::{BETA, T_C, close};

/// Rounds to as many significant digits as the paper prints.
fn printed(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().expect("a number")
}

fn spectral_radius(eigenvalues: &[nalgebra::Complex<f64>]) -> f64 {
    eigenvalues.iter().fold(0.0, |most, value| value.norm().max(most))
}

#[test]
fn eqs_13_14_and_table_iv_hover_point_and_torque_gain() {
    let plant = PlantParameters::paper();
    // Eq. (14): b = d c_p1 / J.
    close(plant.torque_gain(), 0.153_91, 5e-6);
    close(plant.thrust_coefficient, 1.5965e-5, 5e-10);
    close(plant.hover_rate, 617.0, 0.05);
    // The tangent of Table IV, Eq. (13), touches c ω² at hover.
    let thrust = plant.thrust_coefficient * plant.hover_rate * plant.hover_rate;
    close(thrust, 0.0197 * plant.hover_rate - 6.0771, 1e-12);
    close(thrust, 6.077, 5e-4);
    close(2.0 * plant.thrust_coefficient * plant.hover_rate, plant.thrust_slope, 1e-15);
    close(plant.command_for(plant.hover_rate), 0.4633, 5e-5);
}

#[test]
fn eq_7_has_an_inverse_over_the_whole_range() {
    let plant = PlantParameters::paper();
    close(plant.steady_rate(1.0), 447.1 + 1124.5, 1e-12);
    for step in 0..=1000 {
        let u = f64::from(step) / 1000.0;
        // The rounding of a root of numbers near 1000, over a slope above 1000.
        close(plant.command_for(plant.steady_rate(u)), u, 1e-14);
    }
    let straight = PlantParameters { steady_rate_quadratic: 0.0, ..plant };
    close(straight.command_for(562.25), 0.5, 1e-15);
}

/// q̇_b = -p q_b + p b u_x in 4000 midpoint steps a period, against the plant that margins are computed on.
#[test]
fn eqs_14_15_17_from_the_command_to_the_gyro() {
    let plant = PlantParameters::paper();
    let sampled = LoopPlant::new(&plant).sampled(T_C).expect("the paper's plant");
    let (mut x, mut q, mut rate, mut fastest) = (sampled.b.clone() * 0.0, 0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..100 {
        // The gyro's sample belongs to the beginning of the period.
        close(sampled.c.dot(&x), rate, 1e-9);
        fastest = fastest.max(rate.abs());
        let u_x = if k % 7 < 3 { 60.0 } else { -45.0 };
        x = &sampled.a * &x + &sampled.b * (plant.inertia * plant.torque_gain() * u_x);
        let step = T_C / 4000.0;
        for _ in 0..4000 {
            let slope = |q: f64| -plant.pole * q + plant.pole * plant.torque_gain() * u_x;
            let middle = q + 0.5 * step * slope(q);
            rate += step * middle;
            q += step * slope(middle);
        }
    }
    assert!(fastest > 0.3, "it moved: {fastest} rad/s");
}

#[test]
fn beta_by_zero_order_hold_by_euler_and_as_given() {
    close(Beta::Rule(BetaRule::ZeroOrderHold).value(16.0, T_C), 0.2739, 5e-5);
    close(Beta::Rule(BetaRule::Euler).value(16.0, T_C), 0.32, 1e-15);
    close(Beta::Value(0.276).value(16.0, T_C), 0.276, 0.0);
}

#[test]
fn eq_27_and_table_ii_eigenvalues() {
    let gamma: [f64; 4] = complementary_eigenvalues(BETA, 1.2);
    for (value, expected) in gamma.into_iter().zip([0.276, 0.120, 0.052, 0.023]) {
        close((value * 1000.0).round() / 1000.0, expected, 1e-15);
    }
    for (value, expected) in gamma.into_iter().zip([0.276, 0.120_14, 0.052_29, 0.022_76]) {
        close(value, expected, 5e-6);
    }
}

#[test]
fn eq_26_and_table_ii_gains() {
    let [l_0, l_1, l_2, l_3] = observer_gains(BETA, complementary_eigenvalues(BETA, 1.2));
    // The paper's -5.03e-17 is the rounding of its own arithmetic; zero is the exact value for γ_0 = β.
    assert!(l_0.abs() < 1e-15, "{l_0}");
    assert_eq!([printed(l_1, 3), printed(l_2, 3), printed(l_3, 3)], [1.95e-1, 1.02e-2, 1.43e-4]);
    close(l_1, 0.195_19, 5e-6);
    close(l_2, 0.010_207, 5e-7);
    close(l_3, 1.4299e-4, 5e-9);
}

#[test]
fn eqs_25_26_27_agree_on_polynomial_and_eigenvalues() {
    for (beta, gamma_0, alpha) in [(0.276, 0.276, 1.2), (0.32, 0.2, 0.4), (0.02, 0.05, 2.0)] {
        let gamma = complementary_eigenvalues(gamma_0, alpha);
        let l = observer_gains(beta, gamma);
        let a = predictor_matrix(beta, l);
        for gamma in gamma {
            // det((1 - γ) I - A) = p(-γ), in the paper's sign γ = λ - 1.
            let determinant = (Matrix4::identity() * (1.0 - gamma) - a).determinant();
            close(determinant, 0.0, 1e-15);
            let g = -gamma;
            let [l_0, l_1, l_2, l_3] = l;
            let p = g.powi(4)
                + (beta + l_1) * g.powi(3)
                + (l_2 + beta * l_1 + beta * l_0) * g * g
                + (l_3 + beta * l_2) * g
                + beta * l_3;
            close(p, 0.0, 1e-15);
        }
    }
}

#[test]
fn table_iii_printed_k_is_unstable_and_refused() {
    let print = [0.276, 0.120, 0.052];
    let eigenvalues = feedback_matrix(BETA, print).complex_eigenvalues();
    close(spectral_radius(eigenvalues.as_slice()), 1.171, 5e-4);

    let config = ControllerConfig {
        emc: EmcConfig { feedback_gain: Some(print), ..ControllerConfig::paper().emc },
        ..ControllerConfig::paper()
    };
    let error = config.build(&PlantParameters::paper(), T_C).unwrap_err();
    assert!(
        matches!(error, ControlError::Unstable { modulus, .. } if (modulus - 1.171).abs() < 5e-4),
        "{error}"
    );
    assert!(error.to_string().contains("A_c - B_c K is unstable: eigenvalue 1.1"), "{error}");
}

#[test]
fn table_iii_by_pole_placement() {
    let k = feedback_gains(BETA, complementary_eigenvalues(BETA, 0.0));
    for (value, expected) in k.into_iter().zip([0.076_18, 0.828, 2.0]) {
        close(value, expected, 5e-6);
    }
    // A triple eigenvalue splits by the cube root of the rounding.
    close(spectral_radius(feedback_matrix(BETA, k).complex_eigenvalues().as_slice()), 0.724, 1e-4);

    let slow = feedback_gains(BETA, complementary_eigenvalues(BETA, 1.2));
    for (value, expected) in slow.into_iter().zip([0.006_28, 0.1952, 0.6247]) {
        close(value, expected, 5e-5);
    }
    close(spectral_radius(feedback_matrix(BETA, slow).complex_eigenvalues().as_slice()), 0.948, 5e-4);
}

#[test]
fn eq_29_solves_the_sylvester_equation() {
    let a_c = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0 - BETA);
    let a_d = Matrix2::new(1.0, 1.0, 0.0, 1.0);
    let h_c = Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
    let b_c = Vector3::new(0.0, 0.0, BETA);
    let m = RowVector2::new(1.0, 1.0 / BETA);
    let q = Matrix3x2::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    assert!((a_c * q - q * a_d - h_c + b_c * m).abs().max() < 1e-15);
}

#[test]
fn eqs_16_to_19_allocate_and_come_back() {
    let plant = PlantParameters::paper();
    let allocator = Allocator::build(&plant, &Compensation::default()).expect("the paper's plant");
    for voltage in [12.6, 11.1, 9.9] {
        for difference in [-600.0, -40.0, 0.0, 1e-3, 250.0] {
            let allocation = allocator.allocate(difference, voltage);
            assert!(!allocation.saturated);
            // The difference of two rates near 1000, back from the inverse of g.
            close(allocator.difference(allocation.rotor, voltage), difference, 1e-9);
            // Eq. (2), with the sign of Eq. (6): both rotors settle around hover on any battery.
            let z = allocation.rotor.map(|u| plant.steady_rate(u) - 40.0 * (12.6 - voltage));
            close(z[0] - z[1], difference, 1e-9);
            close(0.5 * (z[0] + z[1]), plant.hover_rate, 1e-9);
            // Torque of the quadratic thrust: exactly linear, d c_p1 u_x.
            let torque = plant.arm * plant.thrust_coefficient * (z[0] * z[0] - z[1] * z[1]);
            close(torque, plant.inertia * plant.torque_gain() * difference, 1e-9);
        }
    }
    let beyond = allocator.allocate(2000.0, 12.6);
    assert!(beyond.saturated && beyond.rotor[1] == 0.0 && beyond.rotor[0] <= 1.0);
    let empty = allocator.allocate(0.0, 0.0);
    assert!(!empty.saturated, "504 rad/s of sag still leave hover in reach: {empty:?}");
    let drained = PlantParameters { voltage_gain: 100.0, ..plant };
    let drained = Allocator::build(&drained, &Compensation::default()).expect("builds");
    assert!(drained.allocate(0.0, 0.0).saturated);
}
