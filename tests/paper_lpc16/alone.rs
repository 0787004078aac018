//! Rates that are not those of the commands beside them, and rotors that differ: refused or said, not averaged.

use rotorbench::identify::{IdentifyError, IdentifySettings, identify};
use rotorbench::log::{Dataset, csv};
use rotorbench::report::findings::sentence;
use rotorbench::screening::{Finding, ScreeningError, screened};

use super::bad_logs::run;
use super::logs::{C_G1, C_G2, FULL_VOLTAGE, K_V, POLE, exciting, moving, ramps, steady, voltage};

const RATE: [&str; 2] = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s"];

/// One rotor: what makes it differ from the paper's.
#[derive(Clone, Copy)]
struct Rotor {
    linear: f64,
    pole: f64,
    /// [s] dead time.
    delay: f64,
}

const PAPER: Rotor = Rotor { linear: C_G2, pole: POLE, delay: 0.0 };

impl Rotor {
    /// [rad/s] in ten midpoint steps for each of `rows` rows, `period` [s] apart, with 1.5 rad/s of noise that nobody can
    /// foretell.
    fn rates(&self, command: impl Fn(f64) -> f64, period: f64, rows: usize, seed: usize) -> Vec<f64> {
        let step = period / 10.0;
        let z = |u: f64, t: f64| C_G1 * u * u + self.linear * u - K_V * (FULL_VOLTAGE - voltage(t));
        let mut rate = z(command(0.0), 0.0);
        let mut rates = Vec::with_capacity(rows);
        for row in 0..rows {
            let t = row as f64 * period;
            let hash = (row + 7919 * seed).wrapping_mul(2_654_435_761) ^ (row * seed).wrapping_mul(40_503);
            // Uniform: its rms is half its width over the root of three.
            rates.push(rate + 2.6 * (f64::from((hash >> 13 & 1023) as u16) / 511.5 - 1.0));
            for part in 0..10 {
                let now = t + (f64::from(part) + 0.5) * step;
                let sent = ((now - self.delay) / period).floor().max(0.0) * period;
                let steady = z(command(sent), now);
                let middle = rate + 0.5 * step * self.pole * (steady - rate);
                rate += step * self.pole * (steady - middle);
            }
        }
        rates
    }
}

/// Both rotors of a log, each with its command.
fn both(rotors: [Rotor; 2], commands: [&dyn Fn(f64) -> f64; 2], rows: usize) -> Dataset {
    let time: Vec<f64> = (0..rows).map(|row| 0.02 * row as f64).collect();
    let mut log = Dataset::new("both.csv", "", time.clone()).expect("rising time");
    let volts = time.iter().map(|t| voltage(*t)).collect();
    log.insert("battery_voltage_v", volts).expect("as long as time");
    for (at, (rotor, command)) in rotors.iter().zip(commands).enumerate() {
        let commands = time.iter().map(|t| command(*t)).collect();
        log.insert(format!("command_{}", at + 1), commands).expect("as long as time");
        log.insert(RATE[at], rotor.rates(command, 0.02, rows, at + 1)).expect("as long as time");
    }
    log
}

/// Another rotor's commands, of the same kind.
fn other(t: f64) -> f64 {
    exciting(t + 1000.0)
}

fn differential(t: f64) -> f64 {
    0.94 - exciting(t)
}

fn swapped(mut log: Dataset) -> Dataset {
    let [one, other] = RATE.map(|name| log.column(name).expect("there").to_vec());
    log.replace(RATE[0], other).expect("as long as before");
    log.replace(RATE[1], one).expect("as long as before");
    log
}

fn warnings(log: &Dataset, rotors: &[usize]) -> Vec<Finding> {
    let settings =
        IdentifySettings { degree: Some(2), rotors: rotors.to_vec(), ..IdentifySettings::default() };
    identify(&screened(std::slice::from_ref(log)), &[], &settings).expect("identified").findings
}

/// Refused with this finding, and one sentence for people.
fn refused(log: &Dataset, code: &str) -> Finding {
    let refused = identify(&screened(std::slice::from_ref(log)), &[], &IdentifySettings::default());
    let Err(IdentifyError::Screening(ScreeningError::Column(found))) = refused else { panic!("{refused:?}") };
    assert_eq!(found.code, code, "{found:?}");
    let (output, text) = run(&csv::emit(log));
    assert_eq!(output.status.code(), Some(2), "{text}");
    let file = |text: &str| text.replace("log.csv", found.log.as_str());
    assert!(file(&text).contains(&sentence(&found)), "`{}` is not in: {text}", sentence(&found));
    assert_eq!(text.trim().lines().count(), 1, "one sentence: {text}");
    *found
}

const MORE: Rotor = Rotor { linear: 1.03 * C_G2, ..PAPER };

#[test]
fn a_rotor_mismatch_is_found() {
    differ(MORE, &other, "rates_rad_s");
    differ(Rotor { pole: 12.0, ..PAPER }, &other, "poles_rad_s");
    // The same but for the delay, which a lag alone takes for a slower pole.
    differ(Rotor { delay: 0.01, ..PAPER }, &other, "delays_ms");
}

/// The paper's rotor beside one that differs, with a command of its own.
fn differ(rotor: Rotor, command: &dyn Fn(f64) -> f64, differs: &str) {
    let paper: &dyn Fn(f64) -> f64 = &exciting;
    let log = both([PAPER, rotor], [paper, command], 3000);
    let found = warnings(&log, &[1, 2]);
    let first = &found[0];
    assert_eq!((first.code, first.log.as_str()), ("rotor_mismatch", "both.csv"), "{found:?}");
    assert_eq!(["rotor", "other_rotor"].map(|name| first.count(name)), [1, 2]);
    let [one, two] = *first.numbers(differs) else { panic!("{differs}: {first:?}") };
    match differs {
        "rates_rad_s" => assert!((0.4..0.5).contains(&first.number("command")), "{first:?}"),
        "poles_rad_s" => assert!((one - POLE).abs() < 1.0 && (two - rotor.pole).abs() < 1.0, "{first:?}"),
        _ => assert!(one == 0.0 && first.numbers("rates_rad_s").is_empty(), "{first:?}"),
    }
    // What the model then has is said all the same, and no reason for it that is none.
    assert!(found[1..].iter().all(|it| it.code == "voltage_gain_without_battery"), "{found:?}");
}

#[test]
fn nothing_but_a_rotor_mismatch_is_found() {
    let paper: &dyn Fn(f64) -> f64 = &exciting;
    let log = both([PAPER, Rotor { pole: 12.0, ..PAPER }], [paper, &other], 3000);
    assert_eq!([&[1], &[2]].map(|rotor| warnings(&log, rotor)), [vec![], vec![]], "each by itself");
    // Ramps commanded to both rotors at the same time.
    let matched = both([PAPER, PAPER], [&ramps, &ramps], 7000);
    let mismatched = both([PAPER, MORE], [&ramps, &ramps], 7000);
    let mismatches =
        |log: &Dataset| warnings(log, &[1, 2]).iter().filter(|it| it.code == "rotor_mismatch").count();
    assert_eq!([mismatches(&matched), mismatches(&mismatched)], [0, 1]);
    for command in [&other as &dyn Fn(f64) -> f64, &differential, paper] {
        assert_eq!(warnings(&both([PAPER, PAPER], [paper, command], 3000), &[1, 2]), []);
    }
}

/// One rotor of a log of its own.
fn alone(name: &str, number: usize, rotor: Rotor, command: &dyn Fn(f64) -> f64) -> Dataset {
    let (rows, at) = (3000, |row: usize| 0.02 * row as f64);
    let mut log = Dataset::new(name, "", (0..rows).map(at).collect()).expect("rising time");
    log.insert(format!("command_{number}"), (0..rows).map(|row| command(at(row))).collect())
        .expect("as long as time");
    log.insert(RATE[number - 1], rotor.rates(command, 0.02, rows, number)).expect("as long as time");
    log.insert("battery_voltage_v", (0..rows).map(|row| voltage(at(row))).collect())
        .expect("as long as time");
    log
}

/// Bits of 40 ms; the hash of `exciting` for slots of 0.1 s.
fn quick(t: f64) -> f64 {
    exciting(2.5 * t)
}

/// What is left over by a lag fitted to such a log is as good as white, and the pole is off by half of itself.
#[test]
fn commands_that_are_written_after_they_were_sent_are_found() {
    let log = timed(quick, 0.02, 3000, 1.0);
    assert_eq!(warnings(&log, &[1]), []);
    let commands = log.column("command_1").expect("there").to_vec();
    let row_before = |row: usize| commands[row.saturating_sub(1)];
    let mut one_row = log.clone();
    one_row.replace("command_1", (0..3000).map(row_before).collect()).expect("as long as before");
    // Every second row of a log whose commands change in those between.
    let fine = timed(|t| quick(t + 0.01), 0.01, 6000, 1.0);
    let mut half = Dataset::new("timed.csv", "", log.time().to_vec()).expect("rising time");
    for name in ["command_1", RATE[0], "battery_voltage_v"] {
        let column = fine.column(name).expect("there");
        half.insert(name, column.iter().step_by(2).copied().collect()).expect("as long as time");
    }
    for (log, by) in [(one_row, 1.0), (half, 0.5)] {
        let found = warnings(&log, &[1]);
        assert_eq!(
            (found[0].code, found[0].number("rows_earlier")),
            ("rates_lead_commands", by),
            "{found:?}"
        );
        assert!((10.0..20.0).contains(&found[0].number("pole_rad_s")), "{found:?}");
        // Nothing else is said of what the fit leaves over.
        let of_rest = ["rotor_residual_correlated", "rates_unexplained", "body_residual_correlated"];
        assert!(found.iter().all(|it| !of_rest.contains(&it.code)), "{found:?}");
    }
}

/// Commanded a little more all the time while its battery falls by 4 V, a rotor slows down.
#[test]
fn a_rotor_that_its_battery_slows_down_is_not_refused() {
    let time: Vec<f64> = (0..4800).map(|row| 0.05 * f64::from(row)).collect();
    let command: Vec<f64> = time.iter().map(|t| 0.44 + 0.06 * t / 240.0).collect();
    let volts: Vec<f64> = time.iter().map(|t| FULL_VOLTAGE - 4.0 * t / 240.0).collect();
    let z = |(u, v): (&f64, &f64)| C_G1 * u * u + C_G2 * u - K_V * (FULL_VOLTAGE - v);
    let rates: Vec<f64> = command.iter().zip(&volts).map(z).collect();
    assert!(rates[4799] < rates[0]);
    let mut log = Dataset::new("slower.csv", "", time).expect("rising time");
    for (name, column) in [("command_1", command), (RATE[0], rates), ("battery_voltage_v", volts)] {
        log.insert(name, column).expect("as long as time");
    }
    let settings = IdentifySettings { degree: Some(2), ..IdentifySettings::default() };
    let curve =
        identify(&screened(&[log]), &[], &settings).expect("identified").static_curve.expect("a ramp");
    // With the template's k_V, which is this bench's.
    assert!(curve.coefficients[0].distance(C_G2) < 1.0, "{:?}", curve.coefficients);
}

#[test]
fn rates_of_another_rotor_are_refused() {
    let log = both([PAPER, PAPER], [&exciting, &other], 6000);
    let crossed = |log: &Dataset| {
        let found = refused(log, "rates_of_other_rotor");
        ["rotor", "other_rotor", "crossed"].map(|name| found.count(name))
    };
    assert_eq!(crossed(&swapped(log.clone())), [1, 2, 2]);
    let mut twice = log;
    twice.replace(RATE[1], twice.column(RATE[0]).expect("there").to_vec()).expect("as long as before");
    assert_eq!(crossed(&twice), [2, 1, 1]);
    assert_eq!(crossed(&swapped(both([PAPER, PAPER], [&exciting, &differential], 6000))), [1, 2, 2]);
    // Commanded two values only, each the opposite of the other's, both just slow down when they are commanded more.
    let binary = |t: f64| if exciting(t) > 0.47 { 0.55 } else { 0.39 };
    let log = swapped(both([PAPER, PAPER], [&binary, &|t| 0.94 - binary(t)], 6000));
    let falls = refused(&log, "rate_falls_with_command");
    let range = ["lowest_command", "highest_command"].map(|name| (1e3 * falls.number(name)).round());
    assert_eq!(range, [390.0, 550.0]);
}

#[test]
fn commands_that_count_the_other_way_round_are_refused() {
    for log in [moving(exciting, 3000), steady(ramps, 7000), moving(ramps, 7000)] {
        let commands = log.column("command_1").expect("there").iter().map(|command| 1.0 - command).collect();
        let mut turned = log.clone();
        turned.replace("command_1", commands).expect("as long as before");
        refused(&turned, "rate_falls_with_command");
        assert!(run(&csv::emit(&log)).0.status.success(), "as it was");
    }
}

/// One rotor, rows `period` [s] apart, whose time is written in another unit.
fn timed(command: impl Fn(f64) -> f64, period: f64, rows: usize, unit: f64) -> Dataset {
    let at = |row: usize| period * row as f64;
    let time = (0..rows).map(|row| unit * at(row)).collect();
    let mut log = Dataset::new("timed.csv", "", time).expect("rising time");
    let commands = (0..rows).map(|row| command(at(row))).collect();
    log.insert("command_1", commands).expect("as long as time");
    log.insert(RATE[0], PAPER.rates(&command, period, rows, 1)).expect("as long as time");
    log.insert("battery_voltage_v", (0..rows).map(|row| voltage(at(row))).collect())
        .expect("as long as time");
    log
}

/// At 1000 and 500 Hz rows come 1 and 2 "s" apart, as those of a slow telemetry do.
#[test]
fn a_time_in_milliseconds_is_refused_and_a_slow_telemetry_is_not() {
    // Bits of 20 ms; the hash of `exciting` for slots of 0.1 s.
    let bits = |t: f64| exciting(5.0 * t);
    for (rate, rows) in [(1000.0, 20_000), (500.0, 6_000)] {
        refused(&timed(bits, 1.0 / rate, rows, 1e3), "rotor_too_slow");
    }
    let held = |t: f64| 0.35 + 0.05 * ((t + 0.01) / 40.0).floor().rem_euclid(6.0);
    let (output, text) = run(&csv::emit(&timed(held, 1.0, 600, 1.0)));
    assert!(output.status.success(), "{text}");
    assert!(text.contains("done: ") && text.contains("of constant levels"), "{text}");
}

/// `tools/test --all` runs it.
mod at_length {
    use super::*;

    /// A pole between both, with an error that is none, and nothing said.
    #[test]
    fn a_rotor_mismatch_between_two_logs_is_found() {
        let slow = Rotor { pole: 14.5, ..PAPER };
        let more = Rotor { linear: 1.02 * C_G2, ..PAPER };
        for (rotor, number, differs) in [
            (PAPER, 2, None),
            (PAPER, 1, None),
            (slow, 2, Some("poles_rad_s")),
            (slow, 1, Some("poles_rad_s")),
            (more, 2, Some("rates_rad_s")),
        ] {
            let logs = [alone("one.csv", 1, PAPER, &exciting), alone("two.csv", number, rotor, &other)];
            let settings = IdentifySettings { degree: Some(2), ..IdentifySettings::default() };
            let found = identify(&screened(&logs), &[], &settings).expect("identified").findings;
            let Some(differs) = differs else {
                assert_eq!(found, []);
                continue;
            };
            assert_eq!(found[0].code, "rotor_mismatch_between_logs", "{found:?}");
            assert_eq!(
                found[0].texts("names"),
                ["one.csv, rotor 1".to_owned(), format!("two.csv, rotor {number}")]
            );
            assert_eq!(found[0].numbers(differs).len(), 2, "{found:?}");
        }
    }

    #[test]
    fn a_rotor_mismatch_is_found_whatever_the_commands() {
        differ(MORE, &differential, "rates_rad_s");
        differ(MORE, &exciting, "rates_rad_s");
        differ(Rotor { pole: 15.0, ..PAPER }, &other, "poles_rad_s");
    }
}
