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
fn errors_name_the_place_and_the_signal() {
    let signal = |rest: &str| format!("[time]\ncolumn = \"t\"\n[[signal]]\nname = \"command_1\"\n{rest}");
    assert_eq!(error("[time"), "m.toml: line 1, column 6: unclosed table, expected `]`");
    assert_eq!(
        error(&signal("column = \"u\"\nunits = \"-\"\n")),
        "m.toml: line 6, column 1: unknown field `units`, expected one of `name`, `column`, `columns`, `combine`, \
         `time_column`, `unit`, `scale`, `offset`, `clamp`, `valid`, `optional`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"V\"\n")),
        "m.toml: signal `command_1`: unit `V` measures V, but - is needed"
    );
    assert_eq!(
        error(&signal("column = \"u\"\n")),
        "m.toml: signal `command_1`: its unit is missing: say which unit becomes -"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"-\"\nclamp = [1.0, 0.0]\n")),
        "m.toml: signal `command_1`: `clamp` must go from low to high"
    );
    assert_eq!(error("signal = []\n[time]\n"), "m.toml: time: give either `column` or `period_s`");
    assert_eq!(
        Mapping::load("nowhere").expect_err("unknown").to_string(),
        "no mapping `nowhere`: not a file, and not one of `rcbenchmark`"
    );
}
