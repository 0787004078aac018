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
    let older =
        ["Time (s)", "ESC (µs)", "Thrust (N)", "Voltage (V)", "Current (A)", "Motor Optical Speed (RPM)"];
    assert_eq!(
        Mapping::shipped_for(&older, &signals),
        Some("rcbenchmark"),
        "other columns of the same signals"
    );
    let mut pulses = signals;
    pulses[0].scale = 0.001;
    assert_eq!(Mapping::shipped_for(&names, &pulses), None, "pulses of 1000 to 2000 µs");
}

/// Pulses of 1000 to 2270 µs, by a scale and an offset of six digits: 1.00000054 at the end.
#[test]
fn the_digits_of_a_scale_command_no_more_than_all() {
    let read = |cell: &str| {
        let text = "[time]\ncolumn = \"t\"\nunit = \"s\"\n[[signal]]\nname = \"command_1\"\ncolumn = \"pulse\"\nunit = \"-\"\n\
                    scale = 0.000787402\noffset = -0.787402\n";
        let mapping = Mapping::parse(text, Path::new("m.toml")).expect("good");
        let rows = format!("t,pulse\n0,{cell}\n0.1,{cell}\n");
        let log = crate::log::mapped::parse(rows.as_bytes(), Path::new("log.csv"), &mapping, None);
        log.expect("a log").0.column("command_1").expect("mapped")[0]
    };
    assert_eq!((read("2270"), read("1000")), (1.0, 0.0));
    assert!((read("1635") - 0.5).abs() < 1e-5, "{}", read("1635"));
    assert!(read("2300") > 1.02, "more than a rounding is kept, and said");
}

/// Exports of other years and units, and of a stand without a probe, are read by the same name.
#[test]
fn the_shipped_mapping_knows_the_headers_of_older_exports() {
    let read = |head: &str, row: &str| {
        let text = format!("{head}\n0,{row}\n0.1,{row}\n");
        let mapping = Mapping::load("rcbenchmark").expect("good");
        crate::log::mapped::parse(text.as_bytes(), Path::new("stand.csv"), &mapping, None)
    };
    let first = |log: &crate::log::Dataset, name: &str| log.column(name).map(|values| values[0]);
    let head = "Time (s),ESC signal (µs),Thrust (gf),Voltage (V),Current (A),Motor Electrical Speed (RPM),Motor Optical Speed (RPM)";
    let (log, notes) = read(head, "1250,100,11,5,6000,0").expect("an older export");
    let near = |name: &str, value: f64| {
        let found = first(&log, name);
        assert!(found.is_some_and(|it| (it - value).abs() < 1e-9), "{name}: {found:?}");
    };
    near("command_1", 0.25);
    near("esc_signal", 1250.0);
    near("thrust_1_n", 0.980_665);
    near("propeller_rate_1_rad_s", 6000.0 * std::f64::consts::PI / 30.0);
    assert_eq!(notes.absent, ["shaft_torque_nm"]);
    let instead: Vec<_> = notes.instead.iter().map(|it| (it.read.as_str(), it.dead.as_str())).collect();
    assert_eq!(instead, [("Motor Electrical Speed (RPM)", "Motor Optical Speed (RPM)")]);
    // A probe that counts goes before.
    let (log, notes) = read(head, "1250,100,11,5,6000,5990").expect("with a probe");
    assert!(
        first(&log, "propeller_rate_1_rad_s").is_some_and(|it| it < 5995.0 * std::f64::consts::PI / 30.0)
    );
    assert!(notes.instead.is_empty());
    let (log, _) = read(
        "Time (s),ESC (µs),Thrust (N),Voltage (V),Current (A),Motor Optical Speed (RPM)",
        "1400,3,30,1,0",
    )
    .expect("another series");
    assert_eq!((first(&log, "thrust_1_n"), first(&log, "propeller_rate_1_rad_s")), (Some(3.0), Some(0.0)));
    let error = read("Time (s),ESC A (µs),Thrust (N),Voltage (V),Current (A)", "1400,3,30,1")
        .expect_err("no command");
    let said = error.to_string();
    assert!(
        said.contains("no column `ESC signal`, `ESC signal (µs)`, `ESC (µs)` (for `command_1`"),
        "{said}"
    );
    assert!(said.contains("the header reads `Time (s)`, `ESC A (µs)`, "), "{said}");
}

/// What the program itself names so is not asked about.
#[test]
fn mappings_of_ours_write_no_names_that_are_asked_about() {
    let shipped = SHIPPED.iter().map(|(_, text)| *text);
    let of_formats = crate::log::formats::FORMATS.iter().filter_map(|format| format.mapping());
    for text in shipped.chain(of_formats) {
        let config: MappingConfig = toml::from_str(text).expect("a mapping");
        let writes = |signal: &str| config.signal.iter().any(|it| it.name == signal);
        for name in config.signal.iter().map(|it| &it.name) {
            let meant = crate::log::guess::meant_by(name).filter(|signal| !writes(signal));
            assert_eq!(meant, None, "{name} of {}", config.description);
        }
    }
}

/// Four motors turn a body: two one way, two the other.
#[test]
fn a_sum_may_weigh_its_columns() {
    let text = "[time]\ncolumn = \"t\"\n[[signal]]\nname = \"torque_command_nm\"\ncolumns = [\"m2\", \"m4\", \"m1\", \"m3\"]\n\
                combine = \"sum\"\nweights = [1, 1, -1, -0.5]\nunit = \"N m\"\nscale = 0.1\n";
    let mapping = Mapping::parse(text, Path::new("m.toml")).expect("a mapping");
    let log = "t,m1,m2,m3,m4\n0,10,20,30,40\n1,10,,30,40\n";
    let (log, _) =
        crate::log::mapped::parse(log.as_bytes(), Path::new("quad.csv"), &mapping, None).expect("a log");
    let torque = log.column("torque_command_nm").expect("there");
    assert!((torque[0] - 3.5).abs() < 1e-12 && torque[1].is_nan(), "{torque:?}");
}

/// A body whose angle alone was measured: the rate is the angle's slope, and none is known next to a hole, a missing cell or an end.
#[test]
fn a_rate_may_be_the_slope_of_an_angle() {
    let text = "[time]\ncolumn = \"t\"\nunit = \"ms\"\n[[signal]]\nname = \"body_rate_rad_s\"\ncolumn = \"angle\"\n\
                unit = \"deg/s\"\nslope = true\nscale = -1.0\nvalid = [-10.0, 10.0]\n\
                [[signal]]\nname = \"body_angle_rad\"\ncolumn = \"angle\"\nunit = \"deg\"\n";
    let mapping = Mapping::parse(text, Path::new("m.toml")).expect("a mapping");
    // Rows are 10 ms apart, the angle falls by 1 degree each; one cell is missing, a second is without rows, and one angle wraps.
    let mut log = "t,angle\n".to_owned();
    for row in 0..30 {
        let time = 10 * row + if row < 20 { 0 } else { 1000 };
        let angle =
            if row == 10 { String::new() } else { format!("{}", if row < 26 { -row } else { 360 - row }) };
        log += &format!("{time},{angle}\n");
    }
    let (log, notes) =
        crate::log::mapped::parse(log.as_bytes(), Path::new("body.csv"), &mapping, None).expect("a log");
    let rate = log.column("body_rate_rad_s").expect("there");
    let unknown: Vec<usize> = (0..30).filter(|row| rate[*row].is_nan()).collect();
    assert_eq!(unknown, [0, 9, 10, 11, 19, 20, 25, 26, 29]);
    let wanted = 100.0_f64.to_radians();
    assert!(rate.iter().all(|it| it.is_nan() || (it - wanted).abs() < 1e-9), "{rate:?}");
    assert_eq!(notes.invalid["body_rate_rad_s"].first_lines, [27, 28]);
    assert!((log.column("body_angle_rad").expect("there")[1] + 1.0_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn errors_name_the_place_and_the_signal() {
    let signal = |rest: &str| format!("[time]\ncolumn = \"t\"\n[[signal]]\nname = \"command_1\"\n{rest}");
    assert_eq!(error("[time"), "m.toml: line 1, column 6: unclosed table, expected `]`");
    assert_eq!(
        error(&signal("column = \"u\"\nunits = \"-\"\n")),
        "m.toml: line 6, column 1: unknown field `units`, expected one of `name`, `column`, `columns`, `combine`, \
         `weights`, `slope`, `time_column`, `unit`, `scale`, `offset`, `clamp`, `valid`, `rows_later`, `optional`, `instead`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"V\"\n")),
        "m.toml: signal `command_1`: unit `V` measures V, but - is needed: `-`, `1`, `%`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\n")),
        "m.toml: signal `command_1`: its unit is missing: say which unit becomes -"
    );
    let again = "[[signal]]\nname = \"command_1\"\ncolumn = \"v\"\nunit = \"-\"\n";
    assert_eq!(
        error(&signal(&format!("column = \"u\"\nunit = \"-\"\n{again}"))),
        "m.toml: signal `command_1`: it is mapped twice; of several columns the second has `instead = true`"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"-\"\ninstead = true\n")),
        "m.toml: signal `command_1`: `instead` wants a signal of the same name above it"
    );
    assert_eq!(
        error(&signal("column = \"u\"\nunit = \"-\"\nclamp = [1.0, 0.0]\n")),
        "m.toml: signal `command_1`: `clamp` must go from low to high"
    );
    let one_clock = "m.toml: time: give one of `column`, `period_s` and `levels`";
    for clock in ["", "column = \"t\"\nlevels = true", "period_s = 1.0\nlevels = true", "levels = false"] {
        assert_eq!(error(&format!("signal = []\n[time]\n{clock}\n")), one_clock, "{clock}");
    }
    for weights in [
        "column = \"u\"\nweights = [1.0]",
        "columns = [\"u\", \"v\"]\ncombine = \"sum\"\nweights = [1.0]",
        "columns = [\"u\", \"v\"]\ncombine = \"mean\"\nweights = [1.0, 2.0]",
    ] {
        assert_eq!(
            error(&signal(&format!("{weights}\nunit = \"-\"\n"))),
            "m.toml: signal `command_1`: `weights` are of a `combine = \"sum\"`, one for each of its `columns`"
        );
    }
    let levels = "[time]\nlevels = true\n[[signal]]\nname = \"body_rate_rad_s\"\ncolumn = \"a\"\nunit = \"deg/s\"\nslope = true\n";
    assert_eq!(
        error(levels),
        "m.toml: signal `body_rate_rad_s`: `slope` wants a clock: the rows of `levels = true` have none"
    );
    let none = "columns = [\"u\", \"v\"]\ncombine = \"sum\"\nweights = [1.0, 0.0]\nunit = \"-\"\n";
    assert_eq!(error(&signal(none)), "m.toml: signal `command_1`: `weights` are numbers other than 0");
    assert_eq!(
        Mapping::load("nowhere").expect_err("unknown").to_string(),
        "no mapping `nowhere`: not a file, and not one of `rcbenchmark`"
    );
}
