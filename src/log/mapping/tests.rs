use super::*;

fn error(text: &str) -> String {
    Mapping::parse(text, Path::new("m.toml")).expect_err("a bad mapping").to_string()
}

#[test]
fn every_shipped_mapping_is_good() {
    for (name, _) in SHIPPED {
        assert!(!Mapping::load(name).expect("good").config.description.is_empty());
    }
}

#[test]
fn dshot_throttle_becomes_zero_to_one() {
    let mapping = Mapping::load("rcbenchmark").expect("good");
    let command = &mapping.config.signal[0];
    let of = |throttle: f64| throttle * command.scale + command.offset;
    assert!(of(48.0).abs() < 1e-15, "{}", of(48.0));
    assert!((of(2047.0) - 1.0).abs() < 1e-15, "{}", of(2047.0));
}

#[test]
fn a_shipped_mapping_fits_where_its_columns_are_and_mean_the_same() {
    let signals = Mapping::load("rcbenchmark").expect("good").config.signal;
    let names = [
        "Time (s)",
        "ESC signal",
        "Voltage (V)",
        "Current (A)",
        "Thrust (gf)",
        "Motor Optical Speed (rad/s)",
    ];
    assert_eq!(
        Mapping::shipped_for(&names, &signals),
        Some("rcbenchmark"),
        "the torque's column may be absent"
    );
    assert_eq!(Mapping::shipped_for(&names[..5], &signals), None, "a column is missing");
    let mut pulses = signals;
    pulses[0].scale = 0.001;
    assert_eq!(Mapping::shipped_for(&names, &pulses), None, "pulses of 1000 to 2000 µs");
}

#[test]
fn errors_name_the_place_and_the_signal() {
    let signal = |rest: &str| format!("[time]\ncolumn = \"t\"\n[[signal]]\nname = \"command_1\"\n{rest}");
    assert_eq!(error("[time"), "m.toml: line 1, column 6: unclosed table, expected `]`");
    assert_eq!(
        error(&signal("column = \"u\"\nunits = \"-\"\n")),
        "m.toml: line 6, column 1: unknown field `units`, expected one of `name`, `column`, `columns`, `combine`, \
         `time_column`, `unit`, `scale`, `offset`, `clamp`, `valid`, `rows_later`, `optional`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"V\"\n")),
        "m.toml: signal `command_1`: unit `V` measures V, but - is needed: `-`, `1`, `%`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\n")),
        "m.toml: signal `command_1`: its unit is missing: say which unit becomes -"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"-\"\nclamp = [1.0, 0.0]\n")),
        "m.toml: signal `command_1`: `clamp` must go from low to high"
    );
    let one_clock = "m.toml: time: give one of `column`, `period_s` and `levels`";
    for clock in ["", "column = \"t\"\nlevels = true", "period_s = 1.0\nlevels = true", "levels = false"] {
        assert_eq!(error(&format!("signal = []\n[time]\n{clock}\n")), one_clock, "{clock}");
    }
    assert_eq!(
        Mapping::load("nowhere").expect_err("unknown").to_string(),
        "no mapping `nowhere`: not a file, and not one of `rcbenchmark`"
    );
}
