use super::*;

fn sampled(columns: &[(&str, &[f64])]) -> Vec<SampledColumn> {
    let of = |(name, values): &(&str, &[f64])| SampledColumn {
        name: (*name).to_owned(),
        values: values.to_vec(),
        ..SampledColumn::default()
    };
    columns.iter().map(of).collect()
}

fn guess_of(columns: &[(&str, &[f64])]) -> Vec<(String, String, Certainty)> {
    guess(&sampled(columns)).into_iter().map(|it| (it.signal, it.unit, it.certainty)).collect()
}

fn is(found: &(String, String, Certainty), signal: &str, unit: &str, certainty: Certainty) {
    assert_eq!((found.0.as_str(), found.1.as_str(), found.2), (signal, unit, certainty));
}

#[test]
fn a_thrust_stand_is_understood() {
    let found = guess_of(&[
        ("Time (s)", &[0.0, 0.01]),
        ("ESC signal (µs)", &[1000.0, 1500.0]),
        ("Torque (N·m)", &[0.1, 0.2]),
        ("App message", &[f64::NAN, f64::NAN]),
        ("Thrust (gf)", &[100.0, 700.0]),
        ("Voltage (V)", &[25.1, 25.0]),
        ("Current (A)", &[1.0, 20.0]),
        ("Motor Electrical Speed (rad/s)", &[0.0, 0.0]),
        ("Motor Optical Speed (rad/s)", &[700.0, 710.0]),
        ("Mechanical Power (W)", &[1.0, 2.0]),
    ]);
    is(&found[0], "time_s", "s", Certainty::Named);
    is(&found[1], "command_1", "-", Certainty::Named);
    is(&found[2], "torque_n_m", "", Certainty::Unknown);
    is(&found[3], "app_message", "", Certainty::Empty);
    is(&found[4], "thrust_1_n", "gf", Certainty::Named);
    is(&found[5], "battery_voltage_v", "V", Certainty::Named);
    is(&found[6], "current_1_a", "A", Certainty::Named);
    is(&found[7], "motor_electrical_speed_rad_s", "", Certainty::Unknown);
    is(&found[8], "propeller_rate_1_rad_s", "rad/s", Certainty::Named);
    is(&found[9], "mechanical_power_w", "", Certainty::Unknown);
}

#[test]
fn motors_a_and_b_of_a_stand_are_rotors_1_and_2() {
    let found = guess_of(&[
        ("ESC A (µs)", &[1000.0, 1500.0]),
        ("ESC B (µs)", &[1000.0, 1500.0]),
        ("Thrust B (kgf)", &[0.1]),
        ("Motor Optical Speed B (RPM)", &[5000.0]),
    ]);
    is(&found[0], "command_1", "-", Certainty::Named);
    is(&found[1], "command_2", "-", Certainty::Named);
    is(&found[2], "thrust_2_n", "kgf", Certainty::Named);
    is(&found[3], "propeller_rate_2_rad_s", "RPM", Certainty::Named);
}

/// Load cells are labelled in grams: where a force is read, that is its weight.
#[test]
fn a_thrust_in_grams_is_a_force() {
    for (name, unit) in [
        ("Thrust (g)", "gf"),
        ("Thrust (kg)", "kgf"),
        ("thrust_g", "gf"),
        ("Lift [Kg]", "kgf"),
        ("load_cell_g", "gf"),
    ] {
        is(&guess_of(&[(name, &[100.0, 700.0])])[0], "thrust_1_n", unit, Certainty::Named);
    }
    is(&guess_of(&[("Mass (g)", &[100.0, 700.0])])[0], "mass_g", "", Certainty::Unknown);
}

/// `mV` is one word, however it is joined to the name.
#[test]
fn a_unit_with_a_prefix_is_read_whole() {
    for (name, signal, unit) in [
        ("vbat_mV", "battery_voltage_v", "mV"),
        ("Voltage mV", "battery_voltage_v", "mV"),
        ("voltagemV", "battery_voltage_v", "mV"),
        ("current_mA", "current_1_a", "mA"),
        ("currentmA", "current_1_a", "mA"),
        ("currentA", "current_1_a", "A"),
        ("batteryVoltageV", "battery_voltage_v", "V"),
    ] {
        is(&guess_of(&[(name, &[16_000.0, 16_400.0])])[0], signal, unit, Certainty::Named);
    }
    // Hundredths are no unit here: the values say what they may be, and nobody says that the name does.
    let found = &guess_of(&[("volt_cV", &[1600.0, 1640.0])])[0];
    assert_eq!(found.2, Certainty::UnitGuessed, "{found:?}");
}

/// The log that VESC Tool writes, as far as it is read here.
#[test]
fn a_log_of_vesc_tool_is_understood() {
    let found = guess_of(&[
        ("ms_today", &[12_345.0, 12_365.0, 12_385.0]),
        ("input_voltage", &[16.4, 16.3]),
        ("temp_mos_max", &[31.0]),
        ("temp_motor", &[28.0]),
        ("current_motor", &[1.0, 20.0]),
        ("current_in", &[1.0, 10.0]),
        ("erpm", &[21_000.0, 42_000.0]),
        ("duty_cycle", &[0.1, 0.9]),
        ("ms_today_setup", &[12_345.0, 12_365.0]),
        ("speed_meters_per_sec", &[0.0, 0.3]),
    ]);
    let signals: Vec<&str> = found.iter().map(|it| it.0.as_str()).collect();
    let wanted = [
        "time_s",
        "battery_voltage_v",
        "esc_temperature_1_k",
        "motor_temperature_1_k",
        "current_1_a",
        "current_in",
        "propeller_rate_1_rad_s",
        "command_1",
        "ms_today_setup",
        "speed_meters_per_sec",
    ];
    assert_eq!(signals, wanted);
    assert_eq!([found[0].1.as_str(), found[6].1.as_str()], ["ms", "rpm"]);
}

#[test]
fn units_come_from_values_where_names_have_none() {
    let found = guess_of(&[
        ("t", &[0.0, 10.0, 20.0]),
        ("motor[0]", &[1100.0, 1900.0]),
        ("motor[1]", &[1100.0, 1900.0]),
        ("rpm[0]", &[9000.0, 12000.0]),
        ("vbat", &[11_800.0, 12_600.0]),
        ("pitch", &[-20.0, 30.0]),
    ]);
    is(&found[0], "time_s", "ms", Certainty::UnitGuessed);
    is(&found[1], "command_1", "-", Certainty::UnitGuessed);
    is(&found[2], "command_2", "-", Certainty::UnitGuessed);
    is(&found[3], "propeller_rate_1_rad_s", "rpm", Certainty::Named);
    is(&found[4], "battery_voltage_v", "mV", Certainty::UnitGuessed);
    is(&found[5], "body_angle_rad", "deg", Certainty::UnitGuessed);
}

#[test]
fn our_own_names_are_what_they_say_and_a_signal_is_given_once() {
    let found = guess_of(&[
        ("command_2", &[0.1]),
        ("throttle 2", &[0.2]),
        ("collective", &[0.4]),
        ("throttle 2", &[0.2]),
    ]);
    is(&found[0], "command_2", "-", Certainty::Named);
    is(&found[1], "throttle_2", "", Certainty::Unknown);
    is(&found[2], "collective", "", Certainty::Unknown);
    is(&found[3], "throttle_2_2", "", Certainty::Unknown);
}

#[test]
fn every_guess_is_a_mapping() {
    let column = |name: &str| SampledColumn {
        name: name.to_owned(),
        values: vec![0.1, 0.2],
        ..SampledColumn::default()
    };
    let guessed = guess(&[column("t (s)"), column("u"), column("RPM 1"), column("<img src=x>"), column("é")]);
    let signals = signals(&guessed);
    assert_eq!(signals.len(), 4);
    for (index, signal) in signals.iter().enumerate() {
        assert_eq!(signal.check(&signals[..index]).map(|_| ()), Ok(()), "{}", signal.name);
    }
}

/// An ESC's telemetry counts turns of the field, pole pairs times those of the rotor.
#[test]
fn an_electrical_rate_wants_the_pole_pairs() {
    for name in ["eRPM", "ERPM", "erpm1", "Electrical RPM", "Speed (eRPM)"] {
        let found = guess_of(&[("t", &[0.0, 0.01]), (name, &[42_000.0, 63_000.0])]);
        is(&found[1], "propeller_rate_1_rad_s", "rpm", Certainty::Electrical);
    }
    let column =
        SampledColumn { name: "eRPM".to_owned(), values: vec![42_000.0], ..SampledColumn::default() };
    assert_eq!(guess(&[column])[0].scale, 1.0 / 7.0);
    // A rate that was counted goes before, wherever it stands.
    let found = guess_of(&[("eRPM", &[42_000.0, 63_000.0]), ("optical rpm", &[6000.0, 9000.0])]);
    is(&found[0], "erpm", "", Certainty::Unknown);
    is(&found[1], "propeller_rate_1_rad_s", "rpm", Certainty::Named);
    // What a stand calls an electrical speed it may have divided already.
    is(
        &guess_of(&[("Motor Electrical Speed (RPM)", &[700.0])])[0],
        "motor_electrical_speed_rpm",
        "",
        Certainty::Unknown,
    );
}

#[test]
fn a_rate_that_reads_nothing_gives_way_to_one_that_does() {
    let columns = |optical: &'static [f64]| {
        guess_of(&[
            ("Time (s)", &[0.0, 0.01]),
            ("Motor Optical Speed (RPM)", optical),
            ("Motor Electrical Speed eRPM", &[4000.0, 4100.0]),
        ])
    };
    let live = columns(&[700.0, 710.0]);
    assert_eq!([&live[1].0, &live[2].0], ["propeller_rate_1_rad_s", "motor_electrical_speed_erpm"]);
    let dead = columns(&[0.0, 0.0]);
    assert_eq!([&dead[1].0, &dead[2].0], ["motor_optical_speed_rpm", "propeller_rate_1_rad_s"]);
    assert_eq!(dead[2].2, Certainty::Electrical);
    // Of two that read nothing it is the first.
    let standing = guess_of(&[("Speed A (rpm)", &[0.0]), ("Speed 1 (rpm)", &[0.0])]);
    assert_eq!(standing[0].0, "propeller_rate_1_rad_s");
}

/// A stand divides its electrical speed by the poles that it was given: it stands in for an optical probe that is not connected.
#[test]
fn a_rate_by_poles_stands_in_for_a_probe_that_reads_nothing() {
    let stand = |optical: &'static [f64], electrical: &'static [f64]| {
        let [electrical, optical] =
            [("Motor Electrical Speed (RPM)", electrical), ("Motor Optical Speed (RPM)", optical)];
        guess_of(&[("Time (s)", &[0.0, 0.01]), electrical, optical])
    };
    let dead = stand(&[0.0, 0.0], &[3521.0, 5788.0]);
    is(&dead[1], "propeller_rate_1_rad_s", "RPM", Certainty::ByPoles);
    is(&dead[2], "motor_optical_speed_rpm", "", Certainty::Unknown);
    for electrical in [&[0.0, 0.0], &[3521.0, 5788.0]] {
        let live = stand(&[3500.0, 5700.0], electrical);
        is(&live[1], "motor_electrical_speed_rpm", "", Certainty::Unknown);
        is(&live[2], "propeller_rate_1_rad_s", "RPM", Certainty::Named);
    }
    let both = stand(&[0.0, 0.0], &[0.0, 0.0]);
    is(&both[1], "motor_electrical_speed_rpm", "", Certainty::Unknown);
    is(&both[2], "propeller_rate_1_rad_s", "RPM", Certainty::Named);
}

#[test]
fn the_rate_of_a_body_without_one_is_the_slope_of_its_angle() {
    let column = |name: &str| {
        let values = if name == "time (s)" { vec![0.1, 0.2, 0.3] } else { vec![10.0, 20.0, 30.0] };
        SampledColumn { name: name.to_owned(), values, ..SampledColumn::default() }
    };
    let signals = signals(&guess(&["time (s)", "angulo_deg"].map(column)));
    let found: Vec<_> = signals.iter().map(|it| (it.name.as_str(), it.unit.as_deref(), it.slope)).collect();
    assert_eq!(found, [("body_angle_rad", Some("deg"), false), ("body_rate_rad_s", Some("deg/s"), true)]);
    assert!(signals[1].check(&signals[..1]).is_ok());
    let signals = super::signals(&guess(&["time (s)", "angle (deg)", "gyro (deg/s)"].map(column)));
    assert!(signals.iter().all(|it| !it.slope), "{signals:?}");
    // The table of a thrust stand with its propeller's pitch: no body.
    let mut table = ["time (s)", "pitch (deg)"].map(column);
    table[0].values = vec![10.0, 22.0, 31.0];
    let signals = super::signals(&guess(&table));
    assert!(signals.iter().all(|it| !it.slope), "{signals:?}");
}

#[test]
fn time_is_known_in_other_languages_where_it_grows() {
    for (name, values, unit, certainty) in [
        ("tempo_us", [0.0, 10_000.0, 20_000.0], "us", Certainty::Named),
        ("tempo_ms", [12.0, 22.0, 32.0], "ms", Certainty::Named),
        ("Tempo_s", [0.0, 0.01, 0.02], "s", Certainty::Named),
        ("Tiempo ", [-0.4, -0.38, -0.36], "s", Certainty::UnitGuessed),
        ("Zeit", [0.0, 10.0, 20.0], "ms", Certainty::UnitGuessed),
        ("temps (s)", [0.0, 0.01, 0.02], "s", Certainty::Named),
    ] {
        is(&guess_of(&[(name, &values)])[0], "time_s", unit, certainty);
    }
    for (name, values) in [("temps", [31.0, 30.0, 32.0]), ("tempo_s", [0.5, 0.5, 0.5])] {
        assert_eq!(guess_of(&[(name, &values)])[0].2, Certainty::Unknown, "{name}");
    }
}

/// A helicopter with two degrees of freedom: voltages and rates beside the angles of the same names.
#[test]
fn a_letter_before_another_columns_name_is_something_else_of_it() {
    let names = ["Tiempo ", "U_YAW", "U_PITCH", "W_YAW", "W_PITCH", "YAW", "PITCH"];
    let columns = names.map(|name| (name, [0.0, 0.02, 0.04]));
    let found = guess_of(&columns.each_ref().map(|(name, values)| (*name, &values[..])));
    let signals: Vec<&str> = found.iter().map(|it| it.0.as_str()).collect();
    assert_eq!(signals, ["time_s", "u_yaw", "u_pitch", "w_yaw", "w_pitch", "yaw", "body_angle_rad"]);
    // Not so what is known by itself: a rate in electrical turns, a rotor's own command, what has a unit.
    let columns = [("t (s)", 0.1), ("RPM", 0.0), ("eRPM", 4e4), ("throttle", 50.0), ("m2_throttle", 40.0)];
    let columns = columns.map(|(name, value)| (name, [value, 1.1 * value]));
    let found = guess_of(&columns.each_ref().map(|(name, values)| (*name, &values[..])));
    is(&found[2], "propeller_rate_1_rad_s", "rpm", Certainty::Electrical);
    assert_eq!([&found[3].0, &found[4].0], ["command_1", "command_2"]);
    let found = guess_of(&[("battery (%)", &[90.0, 89.0]), ("V_battery (V)", &[12.0, 11.9])]);
    is(&found[1], "battery_voltage_v", "V", Certainty::Named);
    // Also without the angle beside it, a voltage and a rate of an axis are no angle and no propeller's rate.
    let found = guess_of(&[("U_PITCH", &[0.1, 0.2]), ("W_YAW", &[0.1, 0.2])]);
    assert!(found.iter().all(|it| it.2 == Certainty::Unknown), "{found:?}");
}

#[test]
fn the_name_of_a_probe_is_no_number_of_a_rotor() {
    let found = guess_of(&[("4N76 Temp", &[25.0]), ("motor 2 temp", &[30.0]), ("rpm3", &[900.0])]);
    assert_eq!(found[0].2, Certainty::Unknown, "{found:?}");
    assert_eq!([&found[1].0, &found[2].0], ["motor_temperature_2_k", "propeller_rate_3_rad_s"]);
}

#[test]
fn a_unit_that_nobody_knows_is_not_replaced_by_another() {
    let speed = |name: &str| guess_of(&[(name, &[900.0, 2000.0])]).remove(0);
    for name in ["Speed (steps/s)", "speed [counts/s]", "speed_steps_per_s"] {
        assert_eq!(speed(name).2, Certainty::Unknown, "{name}");
    }
    is(&speed("Drehzahl (1/min)"), "propeller_rate_1_rad_s", "rpm", Certainty::Named);
    is(&speed("Speed (left)"), "propeller_rate_1_rad_s", "rad/s", Certainty::UnitGuessed);
}

/// A duty of 8 bits, as microcontrollers write it, is no DShot: that goes to 2047, and one unit holds for all motors.
#[test]
fn commands_up_to_255_are_of_8_bits() {
    let scale = |columns: &[(&str, &[f64])]| {
        guess(&sampled(columns)).into_iter().map(|it| it.scale).collect::<Vec<_>>()
    };
    assert_eq!(scale(&[("PWM", &[0.0, 255.0])]), [1.0 / 255.0]);
    assert_eq!(scale(&[("leftCommand", &[0.0, 116.0]), ("rightCommand", &[36.0, 72.0])]), [1.0 / 255.0; 2]);
    assert_eq!(scale(&[("PWM", &[0.0, 256.0])]), [1.0 / 1999.0]);
    assert_eq!(scale(&[("PWM", &[0.0, 254.5])]), [1.0 / 1999.0]);
    // Motors that idle, and one of four that does not.
    assert_eq!(scale(&[("motor[0]", &[137.0, 161.0])]), [1.0 / 1999.0]);
    assert_eq!(scale(&[("motor[0]", &[0.0, 161.0]), ("motor[1]", &[0.0, 900.0])]), [1.0 / 1999.0; 2]);
    assert_eq!(scale(&[("PWM", &[0.0, 60.0])]), [1.0], "percent");
}

/// What a flight controller gives its motors is the command, not what the pilot asks for.
#[test]
fn outputs_to_motors_go_before_sticks() {
    let names = ["rcCommand[0]", "rcCommand[3]", "motor[0]", "motor[1]", "motor[2]", "motor[3]"];
    let found = guess_of(&names.map(|name| (name, &[1100.0, 1500.0][..])));
    let signals: Vec<&str> = found.iter().map(|it| it.0.as_str()).collect();
    assert_eq!(signals, ["rccommand_0", "rccommand_3", "command_1", "command_2", "command_3", "command_4"]);
}

#[test]
fn what_is_asked_for_is_not_measured_and_sides_are_rotors() {
    let names = ["targetSpeed", "leftSpeed", "leftCommand", "rightSpeed", "rightCommand"];
    let found = guess_of(&names.map(|name| (name, &[0.0, 200.0][..])));
    let signals: Vec<&str> = found.iter().map(|it| it.0.as_str()).collect();
    let wanted =
        ["targetspeed", "propeller_rate_1_rad_s", "command_1", "propeller_rate_2_rad_s", "command_2"];
    assert_eq!(signals, wanted);
    for name in [
        "speed_ref",
        "Desired speed (rpm)",
        "rpm_setpoint",
        "consigna_rpm",
        "commanded_deg_s",
        "soll_drehzahl",
    ] {
        assert_eq!(guess_of(&[(name, &[0.0, 200.0])])[0].2, Certainty::Unknown, "{name}");
    }
    // One side alone says no rotor.
    is(&guess_of(&[("right speed", &[9.0])])[0], "propeller_rate_1_rad_s", "rad/s", Certainty::UnitGuessed);
}

#[test]
fn round_stamps_of_a_log_that_would_be_over_at_once_are_milliseconds() {
    let unit = |values: &[f64]| guess_of(&[("time", values)]).remove(0).1;
    assert_eq!(unit(&[17_800.0, 18_900.0, 20_000.0]), "ms");
    assert_eq!(unit(&[17_812.0, 18_904.0, 20_008.0]), "us");
    assert_eq!(unit(&[0.0, 1_000_000.0, 1_001_000.0, 1_002_000.0]), "us");
}

/// A battery sags; a voltage that is given to a motor goes to 0, and in steps.
#[test]
fn a_voltage_that_goes_to_zero_is_no_batterys() {
    let asked = |name: &str, values: &[f64]| {
        let column =
            SampledColumn { name: name.to_owned(), values: values.to_vec(), ..SampledColumn::default() };
        guess(&[column]).remove(0)
    };
    let given: Vec<f64> = (0..100).map(|row| if row < 30 { 0.0 } else { 9.0 }).collect();
    let found = asked("Voltaje (V)", &given);
    assert_eq!((found.certainty, found.asked_volts), (Certainty::Unknown, Some(9.0)));
    let stairs: Vec<f64> = (0..100).map(|row| 3.0 + f64::from(row / 25)).collect();
    let found = asked("Voltage (V)", &stairs);
    assert_eq!((found.signal.as_str(), found.asked_volts), ("battery_voltage_v", Some(6.0)));
    let sags: Vec<f64> = (0..100).map(|row| 12.5 - 0.01 * f64::from(row / 10)).collect();
    let dropout: Vec<f64> = (0..100).map(|row| if row == 50 { 0.0 } else { 12.5 }).collect();
    for battery in [sags, dropout, vec![0.0; 100]] {
        let found = asked("Voltage (V)", &battery);
        assert_eq!((found.signal.as_str(), found.asked_volts), ("battery_voltage_v", None));
    }
}

/// Flags are text; marks of no value among numbers are not.
#[test]
fn columns_of_text_are_left_out_and_marks_of_no_value_are_missing() {
    let column = |name: &str, texts: &[&str]| SampledColumn {
        name: name.to_owned(),
        values: vec![0.0, f64::NAN, 0.5],
        texts: texts.iter().map(|it| (*it).to_owned()).collect(),
    };
    let found = guess(&[column("flags", &["ANGLE_MODE"]), column("throttle", &["off"]), column("my", &[])]);
    assert_eq!(found[0].certainty, Certainty::Text);
    assert_eq!((found[1].signal.as_str(), &found[1].texts[..]), ("command_1", &["off".to_owned()][..]));
    assert_eq!(found[2].certainty, Certainty::Unknown);
    let many: Vec<String> = (0..9).map(|it| format!("x{it}")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    assert_eq!(guess(&[column("throttle", &many)])[0].certainty, Certainty::Text);
    // A name that is there twice names no column of a mapping.
    let twice = guess(&[column("my", &[]), column("my", &[]), column("u", &[])]);
    assert_eq!(signals(&twice).iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["command_1"]);
}
