//! What logs do not show is the template's, or is left out, and is said so; what they only seem to show is left out, too.

use rotorbench::identify::{Estimate, Identification, IdentifySettings, identify};
use rotorbench::log::{Dataset, csv};
use rotorbench::report::findings::sentence;
use rotorbench::screening::{Finding, screened};

use super::bad_logs::{refused, run};
use super::close;
use super::logs::{
    C_G1, C_G2, INERTIA, K_V, PERIOD, attitude, exciting, finding, moving, ramps, steady, voltage,
};

const RATE: &str = "propeller_rate_1_rad_s";
const VOLTAGE: &str = "battery_voltage_v";

fn found(log: &Dataset, settings: &IdentifySettings) -> Identification {
    identify(&screened(std::slice::from_ref(log)), &[], settings).expect("identified")
}

fn quadratic() -> IdentifySettings {
    IdentifySettings { degree: Some(2), ..IdentifySettings::default() }
}

/// The log with a column changed row by row.
fn with(log: &Dataset, name: &str, change: impl Fn(usize, f64) -> f64) -> Dataset {
    let values = log.column(name).expect("there").iter().enumerate();
    let mut changed = log.clone();
    changed
        .replace(name, values.map(|(row, value)| change(row, *value)).collect())
        .expect("as long as before");
    changed
}

/// Ramps alone show neither k_V nor the pole. The bench's k_V is 40, and the template says 52 or 28: the curve is off by
/// what that makes of the voltage's drop, and its errors say so.
#[test]
fn ramps_alone_take_k_v_and_the_pole_from_the_template_and_the_curve_knows_no_better() {
    let log = steady(ramps, 7000);
    for gain in [52.0, 28.0] {
        let mut settings = quadratic();
        settings.template.actuator.voltage_gain = gain;
        let found = found(&log, &settings);
        let curve = found.static_curve.as_ref().expect("ramps");
        for (estimate, truth) in curve.coefficients.iter().zip([C_G2, C_G1]) {
            // Off by 12 where half the template's is one standard deviation; the fit's own error is in it with less than a
            // tenth.
            let share = estimate.distance(truth) / (12.0 / (0.5 * gain));
            assert!((0.9..=1.0).contains(&share), "{share}: {estimate:?}");
        }
        let taken = finding(&found, "voltage_gain_from_template").expect("it is");
        assert_eq!((taken.number("template_rad_s_v"), taken.count("curve_allows_for_it")), (gain, 1));
        let pole = finding(&found, "pole_from_template").expect("it is");
        assert_eq!(pole.number("pole_rad_s"), 16.0);
        assert!(finding(&found, "curve_from_template").is_none(), "{:?}", found.findings);
    }
}

/// A template of another bench says more than a motor can have here: all of the rate over all of the volts is taken instead.
#[test]
fn a_k_v_that_no_motor_of_this_bench_has_is_not_taken_from_the_template() {
    let log = steady(ramps, 7000);
    let mut settings = quadratic();
    settings.template.actuator.voltage_gain = 400.0;
    let found = found(&log, &settings);
    // At full command the rotor turns at C_G1 + C_G2, and 12.6 V are full; ramps end before, where a battery has lost some of it.
    let most = (C_G1 + C_G2) / 12.6;
    let taken = found.model.actuator.voltage_gain;
    assert!((0.7 * most..1.1 * most).contains(&taken), "{taken} for {most}");
    let said = finding(&found, "voltage_gain_from_template").expect("it is");
    assert_eq!((said.number("taken_rad_s_v"), said.number("template_rad_s_v")), (taken, 400.0));
    assert!(sentence(said).contains("all of this bench's rate over all of its volts"), "{}", sentence(said));
}

#[test]
fn one_level_alone_takes_curve_and_pole_from_the_template() {
    let found = found(&steady(|_| 0.45, 6000), &quadratic());
    assert!(found.battery.is_some(), "{:?}", found.parts);
    let curve = finding(&found, "curve_from_template").expect("it is");
    assert_eq!(curve.numbers("coefficients_rad_s"), [1124.5, 447.1]);
    let text = "g(u) = 1124.5 u + 447.1 u^2 rad/s is the template's";
    assert!(sentence(curve).contains(text), "{}", sentence(curve));
    assert!(finding(&found, "pole_from_template").is_some_and(|it| it.number("pole_rad_s") == 16.0));
    assert!(finding(&found, "voltage_gain_from_template").is_none(), "{:?}", found.findings);
}

#[test]
fn a_log_of_the_body_alone_leaves_the_rotor_to_the_template() {
    let log = attitude(|t| 0.25 * (exciting(t) - 0.47), 3000);
    let mut alone = Dataset::new("body.csv", "", log.time().to_vec()).expect("rising time");
    let rate = log.column("body_rate_rad_s").expect("there").to_vec();
    let torque = log.time().iter().map(|t| exciting(*t) - 0.47).collect();
    alone.insert("body_rate_rad_s", rate).expect("as long as time");
    alone.insert("torque_command_nm", torque).expect("as long as time");
    let found = found(&alone, &quadratic());
    assert!(finding(&found, "rotor_from_template").is_some(), "{:?}", found.findings);
    assert_eq!(found.model.actuator, IdentifySettings::default().template.actuator);
}

/// Nothing moved it: as if it had not been measured, and said in words.
#[test]
fn a_voltage_that_never_moves_says_nothing_of_k_v() {
    let log = moving(exciting, 3000);
    let constant = found(&with(&log, VOLTAGE, |_, _| 12.3), &quadratic());
    let reads = finding(&constant, "battery_constant").map(|it| it.number("voltage_v"));
    assert_eq!(reads, Some(12.3), "{:?}", constant.findings);
    let without = found(&with(&log, VOLTAGE, |_, _| f64::NAN), &quadratic());
    assert!(finding(&without, "battery_not_logged").is_some(), "{:?}", without.findings);
    assert_eq!(constant.model.actuator, without.model.actuator);
    assert_eq!(constant.model.actuator.voltage_gain, 0.0);
}

/// At the end of its range a battery's reading is no voltage: as if it had not been measured.
#[test]
fn a_battery_reading_that_is_saturated_says_nothing_of_k_v() {
    let log = moving(exciting, 3000);
    // Down by half a volt under load and back, a dozen times; what the wire tells ends at 12.2 V.
    let sags = |row: usize| 12.0 + 0.4 * (0.05 * row as f64).sin() + 0.01 * ((row * 7919 % 13) as f64 - 6.0);
    let saturated = found(&with(&log, VOLTAGE, |row, _| sags(row).min(12.2)), &quadratic());
    let is_it = |it: &Finding| it.code == "battery_saturated" && it.numbers("at") == [12.2];
    assert!(saturated.findings.iter().any(is_it), "{:?}", saturated.findings);
    let without = found(&with(&log, VOLTAGE, |_, _| f64::NAN), &quadratic());
    assert_eq!(saturated.model.actuator, without.model.actuator);
    let whole = found(&with(&log, VOLTAGE, |row, _| sags(row)), &quadratic());
    assert!(!whole.findings.iter().any(|it| it.code == "battery_saturated"), "{:?}", whole.findings);
}

/// Of a curve that was fitted without the battery's part the template's k_V would take 0.3 V times 40 once more.
#[test]
fn a_battery_that_does_not_show_is_not_put_into_the_model() {
    let noise = |row: usize| 30.0 * ((row.wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0);
    let found = found(&with(&moving(exciting, 600), RATE, |row, rate| rate + noise(row)), &quadratic());
    assert!(found.joint.as_ref().is_some_and(|joint| joint.voltage_gain.is_none()), "{:?}", found.joint);
    assert_eq!(found.model.actuator.voltage_gain, 0.0);
    assert!(finding(&found, "voltage_gain_without_battery").is_some(), "{:?}", found.findings);
    let middle = found.actuator.steady_rate(0.47, Some(voltage(6.0)));
    // What there is, with 17 rad/s of noise in each of 600 samples.
    close(middle, C_G1 * 0.47 * 0.47 + C_G2 * 0.47 - 40.0 * (12.6 - voltage(6.0)), 4.0);
}

/// A recorder that kept the last rate, and a telemetry that drops out: what is left is as good as it was.
#[test]
fn a_rate_that_froze_or_dropped_out_does_not_move_pole_or_inertia() {
    let log = moving(exciting, 3000);
    let whole = found(&log, &quadratic()).joint.expect("exciting commands");
    let last = log.column(RATE).expect("there")[1500];
    let froze = with(&log, RATE, |row, rate| if row > 1500 { last } else { rate });
    let dropped = with(&log, RATE, |row, rate| if row % 37 == 5 { 0.0 } else { rate });
    for (log, code, rows) in [(froze, "rate_frozen", 1500), (dropped, "rate_dropout", 81)] {
        let found = found(&log, &quadratic());
        let is_it = |it: &Finding| it.code == code && it.rows == rows;
        assert!(found.findings.iter().any(is_it), "{:?}", found.findings);
        let joint = found.joint.expect("exciting commands");
        close(joint.pole.value, whole.pole.value, 1e-3);
        assert!(joint.samples < whole.samples && joint.pole.standard_error > 0.0);
    }
    let body = attitude(|t| 0.25 * (exciting(t) - 0.47), 3000);
    let last = body.column(RATE).expect("there")[1500];
    let body = with(&body, RATE, |row, rate| if row > 1500 { last } else { rate });
    let found = found(&body, &IdentifySettings { battery: false, ..quadratic() });
    let inertia = found.body.expect("the body turns").inertia.value;
    close(inertia, INERTIA, 1e-4 * INERTIA);
}

/// Only why there is no rotor: what each step would have needed of one is of no use to anybody.
#[test]
fn without_a_rotor_only_the_reason_is_said() {
    let exciting = moving(exciting, 3000);
    for (bad, reason) in [
        (
            with(&exciting, RATE, |_, _| 0.0),
            "reads exactly 0 in 3000 rows in which the rotor was commanded to turn",
        ),
        (
            with(&exciting, RATE, |_, _| 612.5),
            "reads exactly 612.5 rad/s from 0.0 to 60.0 s while the command changes",
        ),
        (
            with(&exciting, "command_1", |_, _| 0.47),
            "the command stands still at 0.4700 while the rate scatters",
        ),
    ] {
        let (output, text) = run(&csv::emit(&bad));
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(reason), "`{reason}` is not in: {text}");
        assert!(text.contains("not used: no rate was measured while a rotor ran"), "{text}");
        assert!(!text.contains("battery") && text.trim().lines().count() == 3, "{text}");
    }
}

/// Twenty seconds of a battery that falls by 0.08 V say little, and next to nothing where the noise is stronger: then the
/// template's number is kept.
#[test]
fn a_k_v_that_hardly_shows_is_found() {
    let noise = |row: usize| (row.wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0;
    let noisy = |level: f64, strength: f64, rows: usize| {
        with(&steady(|_| level, rows), RATE, |row, rate| rate + strength * noise(row))
    };
    let little = found(&noisy(0.45, 12.0, 1000), &quadratic());
    let gain = little.battery.as_ref().expect("one level").gain;
    assert!((0.2..0.4).contains(&(gain.standard_error / gain.value)), "{gain:?}");
    assert!(finding(&little, "voltage_gain_uncertain").is_some(), "{:?}", little.findings);
    assert_eq!(little.model.actuator.voltage_gain, gain.value);
    // Beside ramps, which say the curve.
    let ramps = steady(ramps, 7000);
    let logs = [noisy(0.45, 36.0, 1000), ramps];
    let next_to_nothing = identify(&screened(&logs), &[], &quadratic()).expect("identified");
    assert!(next_to_nothing.battery.is_none());
    assert_eq!(next_to_nothing.model.actuator.voltage_gain, 40.0);
    assert!(!next_to_nothing.model.standard_errors.contains_key("voltage_gain"));
    let taken = finding(&next_to_nothing, "voltage_gain_from_template").expect("it is");
    assert_eq!(taken.number("template_rad_s_v"), 40.0);
    assert!(taken.number("error") > 0.0, "what the logs show: {taken:?}");
    assert!(finding(&next_to_nothing, "voltage_gain_zero").is_none());
}

/// A k_V of 10, of which a noisy level shows 4 ± 4: far from the template's 40, and so taken as none. That it is off by 10
/// is what the curve's errors must know of.
#[test]
fn a_k_v_that_is_taken_as_none_weighs_on_the_curve_with_all_that_it_may_be() {
    let volts = |row: usize| voltage(row as f64 * PERIOD);
    // Neighbours are opposite, so that no noise of the slope is in what shows.
    let noise = |row: usize| {
        let size = ((row / 2).wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0;
        if row.is_multiple_of(2) { 26.3 * size } else { -26.3 * size }
    };
    let shown = |row: usize, _| 600.0 + 4.0 * volts(row) + noise(row);
    let level = with(&steady(|_| 0.45, 3000), RATE, shown);
    let ramps = with(&steady(ramps, 7000), RATE, |row, rate| rate + 30.0 * (12.6 - volts(row)));
    let found = identify(&screened(&[level, ramps]), &[], &quadratic()).expect("ramps");
    assert_eq!(found.model.actuator.voltage_gain, 0.0);
    let shown = finding(&found, "voltage_gain_zero").expect("next to nothing");
    assert!(sentence(shown).contains("the logs show, 4 ± 4.0"), "{}", sentence(shown));
    let curve = found.static_curve.expect("ramps").coefficients;
    // 10 of the root of 4² + 4²; in that of u² there is as much again of what a wrong k_V leaves over.
    assert!((1.5..2.0).contains(&curve[0].distance(C_G2)), "{curve:?}");
    assert!((1.3..1.6).contains(&curve[1].distance(C_G1)), "{curve:?}");
}

/// As many ESCs read it: over a minute two or three steps. Taken as it reads, k_V is known half as well, and k_V and the curve
/// come out up to 3 standard errors off.
#[test]
fn a_battery_that_is_read_in_tenths_of_a_volt_gives_the_numbers_of_a_fine_reading() {
    // Two noises that have nothing to do with each other, of which the voltage's is a tenth of a step.
    let noise = |row: usize, factor: usize| ((row + 1).wrapping_mul(factor) >> 16 & 255) as f64 / 127.5 - 1.0;
    let as_read = |log: &Dataset| {
        let log = with(log, RATE, |row, rate| rate + 2.6 * noise(row, 2_654_435_761));
        let volts = |row: usize, volts: f64| volts + 0.017 * noise(row, 2_246_822_519);
        with(&log, VOLTAGE, |row, it| (volts(row, it) * 10.0).round() / 10.0)
    };
    let [level, ramps, exciting] =
        [moving(|_| 0.45, 3000), moving(ramps, 3500), moving(exciting, 3000)].map(|log| as_read(&log));
    for logs in [vec![level, ramps], vec![exciting]] {
        let found = identify(&screened(&logs), &[], &quadratic()).expect("identified");
        let of_reading = ["battery_reading_frozen", "battery_constant", "battery_quantized"];
        assert!(of_reading.iter().all(|code| finding(&found, code).is_none()), "{:?}", found.findings);
        let (actuator, errors) = (&found.model.actuator, &found.model.standard_errors);
        let curve = &actuator.steady_rate;
        for (name, value, truth, share) in [
            ("voltage_gain", actuator.voltage_gain, K_V, 0.02),
            ("steady_rate_linear", curve[1], C_G2, 0.0012),
            ("steady_rate_quadratic", curve[2], C_G1, 0.004),
        ] {
            let number = Estimate { value, standard_error: errors[name] };
            assert!(number.distance(truth) < 3.0, "{name} {number:?}");
            assert!(number.standard_error < share * truth, "{name} {number:?}");
        }
    }
}

/// A rotor whose ESC governs its rate: it has no k_V, and a level of it alone gives no model at all.
#[test]
fn one_level_that_shows_nothing_gives_no_model() {
    let noise = |row: usize| 2.0 * ((row.wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0);
    let governed = with(&steady(|_| 0.4633, 6000), RATE, |row, _| 617.0 + noise(row));
    refused(&csv::emit(&governed), "voltage_gain_not_significant");
    let found = identify(&screened(&[governed, steady(ramps, 7000)]), &[], &quadratic()).expect("ramps");
    let against = finding(&found, "voltage_gain_zero").map(|it| it.number("template_rad_s_v"));
    assert_eq!(against, Some(40.0), "{:?}", found.findings);
    assert_eq!(found.model.actuator.voltage_gain, 0.0);
}

/// Two numbers for k_V: first the one that the model has.
#[test]
fn the_k_v_in_the_model_stands_first() {
    let level = steady(|_| 0.45, 6000);
    for (strength, first) in [(0.0, "constant commands"), (30.0, "joint estimation")] {
        let noise =
            |row: usize| strength * ((row.wrapping_mul(2_654_435_761) >> 16 & 255) as f64 / 127.5 - 1.0);
        let noisy = with(&level, RATE, |row, rate| rate + noise(row));
        let logs = [noisy, steady(ramps, 7000), moving(exciting, 3000)];
        let found = identify(&screened(&logs), &[], &quadratic()).expect("identified");
        let text = found.parameter_table().text();
        let gains: Vec<&str> = text.lines().filter(|line| line.starts_with("k_V")).collect();
        assert!(gains.len() == 2 && gains[0].contains(first), "{text}");
        assert!(gains[0].contains("in the model") && gains[1].contains("less certain"), "{text}");
    }
    // Without ramps the curve is that of the exciting commands, and k_V goes with it, however sure the other is.
    let found = identify(&screened(&[level, moving(exciting, 3000)]), &[], &quadratic()).expect("identified");
    let text = found.parameter_table().text();
    let gains: Vec<&str> = text.lines().filter(|line| line.starts_with("k_V")).collect();
    assert!(gains[0].contains("in the model") && gains[1].contains("Eq. (6), as a check"), "{text}");
}

/// Another rotor's rates: no pole and no model comes of them.
#[test]
fn rates_that_do_not_follow_the_commands_give_no_pole() {
    let log = moving(exciting, 3000);
    let rates = log.column(RATE).expect("there");
    let shuffled = csv::emit(&with(&log, RATE, |row, _| rates[(row * 1009 + 13) % 3000]));
    refused(&shuffled, "pole_not_significant");
}

/// Stretches of a log that are another moment's: the fit holds on to them, and it is said that it explains little.
#[test]
fn a_fit_that_explains_little_is_found() {
    let log = moving(exciting, 3000);
    let rates = log.column(RATE).expect("there");
    let mixed = with(&log, RATE, |row, rate| if row % 300 < 90 { rates[(row + 777) % 3000] } else { rate });
    let found = found(&mixed, &quadratic());
    assert!(finding(&found, "rates_unexplained").is_some(), "{:?}", found.findings);
}

/// The same on ramps, which step nowhere: it stands above all numbers, and not over a level, whose rate is all noise.
#[test]
fn ramps_that_are_explained_little_are_found_and_said_first() {
    let log = steady(ramps, 7000);
    let commands = log.column("command_1").expect("there");
    let kinked = with(&log, RATE, |row, _| 20.0 + 4_000.0 * (commands[row] - 0.4).max(0.0));
    let bad = found(&kinked, &IdentifySettings { degree: Some(1), ..IdentifySettings::default() });
    assert!(finding(&bad, "rates_unexplained").is_some(), "{:?} {:?}", bad.training, bad.findings);
    let said = bad.caution().expect("it is said");
    assert!(
        said.starts_with("These numbers are hardly this bench's: on ") && said.contains("a fit of"),
        "{said}"
    );
    for good in [found(&log, &quadratic()), found(&steady(|_| 0.45, 6000), &quadratic())] {
        assert!(finding(&good, "rates_unexplained").is_none(), "{:?}", good.findings);
        assert_eq!(good.caution(), None);
    }
}

/// A battery that fills while the rotor is driven, and one whose reading freezes.
#[test]
fn a_voltage_that_cannot_be_is_found_or_left_out() {
    let log = moving(exciting, 3000);
    let filling = found(&with(&log, VOLTAGE, |_, volts| 24.6 - volts), &quadratic());
    assert!(filling.joint.is_some_and(|joint| joint.voltage_gain.is_none()));
    // The degree, too, is then chosen without it.
    let chosen = |log: &Dataset| found(log, &IdentifySettings::default()).model.actuator;
    let (filling_chosen, without) =
        (chosen(&with(&log, VOLTAGE, |_, volts| 24.6 - volts)), with(&log, VOLTAGE, |_, _| 12.0));
    assert_eq!(filling_chosen, chosen(&without));
    assert_eq!(filling.model.actuator.voltage_gain, 0.0);
    let last = voltage(20.0);
    let froze = found(&with(&log, VOLTAGE, |row, volts| if row > 1000 { last } else { volts }), &quadratic());
    let reading = finding(&froze, "battery_reading_frozen").expect("it froze");
    let numbers = ["voltage_v", "from_s", "to_s"].map(|name| (10.0 * reading.number(name)).round() / 10.0);
    assert_eq!(numbers, [12.3, 20.0, 60.0], "{reading:?}");
    // Cells that are empty are no reading that stands.
    let empty = |row: usize| (1001..2801).contains(&row);
    let empty = with(&log, VOLTAGE, |row, volts| if empty(row) { f64::NAN } else { volts });
    let empty = found(&empty, &quadratic());
    let gap = finding(&empty, "battery_reading_gap").expect("nothing was read");
    assert_eq!(["from_s", "to_s"].map(|name| gap.number(name).round()), [20.0, 56.0], "{gap:?}");
    assert!(finding(&empty, "battery_reading_frozen").is_none(), "{:?}", empty.findings);
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// What was said of this bench's battery is not the template's.
    #[test]
    fn a_full_voltage_that_cannot_be_is_said_to_be_the_one_that_was_given() {
        let log = moving(exciting, 3000);
        for (volts, given, code) in [
            (5.0, true, "battery_above_full_voltage"),
            (5.0, false, "battery_above_full_voltage"),
            (25.2, true, "battery_below_full_voltage"),
            (25.2, false, "battery_below_full_voltage"),
        ] {
            let mut settings = IdentifySettings { full_voltage_given: given, ..quadratic() };
            settings.template.actuator.full_voltage = volts;
            let found = found(&log, &settings);
            let it = finding(&found, code).unwrap_or_else(|| panic!("{code}: {:?}", found.findings));
            let from = if given { "option" } else { "template" };
            assert_eq!((it.number("full_voltage_v"), it.text("full_voltage_from")), (volts, from));
            if volts == 5.0 {
                assert_eq!(it.number("voltage_v"), 12.4);
            }
        }
    }

    /// A straight line through a bent curve leaves little of all steps, and is off at each level; the bent one is not.
    #[test]
    fn levels_that_the_model_misses_are_found() {
        let stairs = |t: f64| 0.25 + 0.1 * f64::from((t / 3.0) as u32 % 5);
        let log = moving(stairs, 6000);
        let bent = with(&log, RATE, |_, rate| 600.0 * (rate / 600.0).powf(0.75));
        let straight = IdentifySettings { degree: Some(1), ..IdentifySettings::default() };
        let missing = found(&bent, &straight);
        let missed = finding(&missing, "levels_missed").expect("found").clone();
        assert!((missed.number("command") - 0.25).abs() < 1e-9, "{missed}");
        let share = missed.number("modelled_rad_s") / missed.number("measured_rad_s");
        assert!((0.8..0.95).contains(&share), "a line from 0 lies below: {missed}");
        for good in
            [found(&log, &quadratic()), found(&bent, &IdentifySettings { degree: Some(4), ..quadratic() })]
        {
            assert!(finding(&good, "levels_missed").is_none(), "{:?}", good.findings);
        }
    }
}
