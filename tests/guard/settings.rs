//! The `[guard]` table of the bench file.

use rotorbench::guard::GuardConfig;

use crate::rig::defaults;

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
