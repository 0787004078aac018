//! The programs in examples/, run: as modules, so that no program is linked with the library for each.

#[path = "../examples/compare.rs"]
mod compare;
#[path = "../examples/diagnose.rs"]
#[expect(dead_code, reason = "its main calls what is called here")]
mod diagnose;
#[path = "../examples/own_controller.rs"]
mod own_controller;
#[path = "../examples/own_effect.rs"]
#[expect(dead_code, reason = "its main calls what is called here")]
mod own_effect;
#[path = "../examples/read_log.rs"]
mod read_log;

use rotorbench::diagnose::Verdict;

#[test]
fn read_log_counts_the_readings() {
    read_log::main().expect("it runs");
    let log = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/record/kept/attitude.csv");
    let text = read_log::summary(log.as_ref()).expect("a log");
    assert!(text.contains("600 rows in 5.99 s") && text.contains("  body_rate_rad_s: "), "{text}");
}

#[test]
fn compare_finds_the_rotors_at_their_noise_and_the_body_above() {
    compare::main().expect("it runs");
    let at_floor = |name: &str| {
        let compared = compare::comparison().expect("compared");
        compared.blocks.iter().find(|block| block.name == name).expect("judged").error.is_noise()
    };
    assert!(at_floor("actuator_1") && at_floor("actuator_2"), "rotors without a hidden effect");
    assert!(!at_floor("body"), "the pendulum is missing");
}

#[test]
fn diagnose_names_the_pendulum_and_extend_adds_it() {
    let (found, extended) = diagnose::diagnosed().expect("diagnosed");
    diagnose::print(&found, &extended).expect("it is a model");
    assert_eq!(found.verdict, Verdict::MissingEffect);
    assert_eq!(found.effects, ["gravity_pendulum"]);
    assert!(extended.has_fallen && extended.extension.model.has("gravity_pendulum"));
}

#[test]
fn own_effect_is_named_before_the_catalogue() {
    let found = own_effect::diagnosed().expect("diagnosed");
    own_effect::print(&found);
    assert_eq!(found.effects, ["progressive_spring"]);
    let strength = &found.parameters["progressive_spring.k"];
    let error = strength.standard_error.expect("determined");
    // The promise of `diagnose`: within 10 % or three standard errors.
    let off = (strength.value - 6.0).abs();
    assert!(off < 0.6 || off < 3.0 * error, "{} ± {error}", strength.value);
}

#[test]
fn own_controller_follows_the_slew() {
    own_controller::main().expect("it runs");
    let slots = own_controller::run().expect("a run");
    assert_eq!(slots.len(), 500);
    // Commanded, and not held at zero by the guard.
    assert!(slots[400].applied.command_sequence > 0, "the guard let it through");
    let last = slots.last().expect("slots").truth.body_angle;
    // It has no integral: the rotors' own errors and the gyro's bias leave some hundredths of a radian.
    assert!((last - 0.3).abs() < 0.05, "{last} rad");
}
