//! A static curve that bends otherwise than the polynomial of the model, and one that is shifted.

use std::fmt::Write;

use super::desk::{Desk, diagnose, finding, has_code, number, run, said};

const ROWS: usize = 3000;

/// A number between 0 and 1 for each count, from a multiplicative hash.
fn draw(count: usize) -> f64 {
    f64::from(((count as u32).wrapping_mul(2_654_435_761) >> 16) & 0xfff) / 4096.0
}

/// Levels of 0.3 s on a rotor with this curve, in twenty small Euler steps a row: no code of the model.
fn log(seed: usize, curve: impl Fn(f64) -> f64) -> String {
    let mut text = "time_s,command_1,propeller_rate_1_rad_s\n".to_owned();
    let mut rate = curve(0.45);
    for row in 0..ROWS {
        let command = 0.26 + 0.4 * draw(row / 15 + seed);
        // Twelve draws make a normal number.
        let noise: f64 = (0..12).map(|part| draw(row * 7 + part * 31 + seed * 977)).sum::<f64>() - 6.0;
        let (time, reading) = (0.02 * row as f64, rate + 1.5 * noise);
        writeln!(text, "{time:.3},{command:.6},{reading:.4}").expect("a string grows");
        for _ in 0..20 {
            rate += 0.001 * 16.0 * (curve(command) - rate);
        }
    }
    text
}

/// `identify` follows the bend with a quartic through the origin, as far as one can; what is left is a shift of -500 rad/s to a search,
/// and a few rad/s to the rotor.
#[test]
fn a_shift_that_makes_up_for_a_bend_is_said_to_be_none() {
    let desk = Desk::new();
    let curve = |u: f64| 1124.5 * u + 447.1 * u * u + 4900.0 * (u - 0.467).powi(3);
    let (train, held_out) =
        (desk.write("train.csv", &log(1, curve)), desk.write("held_out.csv", &log(500, curve)));
    let model = desk.path("m.toml").display().to_string();
    let identified = run(&["identify", "--log", &train.display().to_string(), "-o", &model]);
    assert!(identified.status.success(), "{}", said(&identified));
    let (answer, _) = diagnose(&model, &train, &held_out);
    assert_eq!(answer["effects"], serde_json::json!(["static_offset"]), "{}", answer["warnings"]);
    let bend = finding(&answer, "shift_is_curve");
    assert!(number(bend, &["evidence", "shift_rad_s"]) < -300.0, "{bend}");
    assert!(number(bend, &["evidence", "greatest_rad_s"]) < 10.0, "{bend}");
    assert!(number(bend, &["evidence", "least_rad_s"]) > -10.0, "{bend}");
}

/// Forty rad/s more at every command are forty rad/s more, beside a slope that has changed, too.
#[test]
fn a_shift_is_one() {
    let desk = Desk::new();
    let curve = |u: f64| 40.0 + 1170.0 * u + 447.1 * u * u;
    let (train, held_out) =
        (desk.write("train.csv", &log(1, curve)), desk.write("held_out.csv", &log(500, curve)));
    let (answer, _) = diagnose("paper", &train, &held_out);
    assert_eq!(answer["effects"], serde_json::json!(["static_offset"]), "{}", answer["warnings"]);
    assert!(!has_code(&answer, "shift_is_curve"), "{answer}");
}
