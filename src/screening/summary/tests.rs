//! Logs with one thing wrong in each.

use crate::screening::summary::*;

fn summary(log: &Dataset) -> LogSummary {
    LogSummary::of(&ScreenedLog::of(log))
}

/// 100 Hz, 10 s, a gyro that moves.
fn log(change: impl Fn(usize, &mut f64)) -> Dataset {
    let time: Vec<f64> = (0..1000).map(|row| f64::from(row) * 0.01).collect();
    let rate = (0..1000)
        .map(|row| {
            let mut value = (row as f64 * 0.37).sin() + 1e-4 * (row % 7) as f64;
            change(row, &mut value);
            value
        })
        .collect();
    Dataset::made(time, [("body_rate_rad_s", rate)])
}

#[test]
fn a_good_log_raises_nothing() {
    let findings = summary(&log(|_, _| {}));
    assert_eq!(findings.findings, []);
    assert!((findings.median_interval_s - 0.01).abs() < 1e-9);
}

#[test]
fn a_frozen_stretch_is_found_once_and_measured() {
    let findings = summary(&log(|row, value| {
        if (300..340).contains(&row) {
            *value = 0.5;
        }
    }));
    let frozen = &findings.channels[0].frozen;
    assert_eq!(frozen.len(), 1);
    assert!((frozen[0].start_s - 3.0).abs() < 1e-9 && (frozen[0].length_s - 0.39).abs() < 1e-9);
    assert_eq!(frozen[0].value, 0.5);
}

#[test]
fn a_saturated_channel_and_a_dropout_are_found() {
    let findings = summary(&log(|_, value| *value = value.min(0.8)));
    assert_eq!(findings.channels[0].perhaps_saturated.len(), 1);
    let end = findings.channels[0].perhaps_saturated[0];
    let saturated = findings.findings.iter().find(|it| it.code == SATURATED).expect("surely");
    assert_eq!((end.at, end.samples), (0.8, saturated.rows));
    assert_eq!(findings.findings.len(), 1, "and not perhaps: {:?}", findings.findings);
    let findings = summary(&log(|row, value| {
        if (500..520).contains(&row) {
            *value = f64::NAN;
        }
    }));
    let dropouts = &findings.channels[0].dropouts;
    assert_eq!(dropouts.len(), 1);
    assert!((dropouts[0].length_s - 0.21).abs() < 1e-9);
    assert_eq!(findings.channels[0].missing, 20);
}

/// An angle that stands says that the body rests, and a command that stands, that the rotor does: theirs is the word. What is frozen
/// beside them is named by the check that asked, with the reading that is repeated.
#[test]
fn what_the_screened_log_asked_for_is_not_judged_again() {
    let held = |row: usize, value: &mut f64| *value = if (300..340).contains(&row) { 0.5 } else { *value };
    let mut beside = log(held);
    let at_rest = |row: usize| if (300..340).contains(&row) { 300.0 } else { row as f64 };
    beside
        .insert(
            "body_angle_rad",
            (0..1000).map(|row| (0.37 * at_rest(row)).sin() + 1e-4 * (row % 7) as f64).collect(),
        )
        .expect("fits");
    let found = summary(&beside);
    let gyro = found.channels.iter().find(|it| it.name == "body_rate_rad_s").expect("there");
    assert_eq!((gyro.frozen.len(), found.findings.as_slice()), (0, &[][..]), "it rests");
    let swings = (0..1000).map(|row| (0.37 * f64::from(row)).sin()).collect();
    beside.replace("body_angle_rad", swings).expect("as long");
    let found = summary(&beside);
    let codes: Vec<&str> = found.findings.iter().map(|it| it.code).collect();
    assert_eq!(codes, [GYRO_FROZEN], "it does not");
    let frozen = &found.channels.iter().find(|it| it.name == "body_rate_rad_s").expect("there").frozen;
    assert!(frozen.len() == 1 && (frozen[0].start_s - 3.0).abs() < 1e-9, "{frozen:?}");
    assert!((frozen[0].length_s - 0.39).abs() < 1e-9 && frozen[0].value == 0.5, "{frozen:?}");
}

/// What nothing can be asked of, as a current, is named as doubtful where it stands, and left in.
#[test]
fn a_current_that_stands_is_perhaps_frozen() {
    let mut log = log(|_, _| {});
    let noise = |row: usize| (row.wrapping_mul(2_654_435_761) >> 9 & 1023) as f64 / 1023.0;
    let current = |row: usize| if (500..560).contains(&row) { 6.5 } else { 6.0 + noise(row) };
    log.insert("current_1_a", (0..1000).map(current).collect()).expect("fits");
    let found = summary(&log);
    let codes: Vec<&str> = found.findings.iter().map(|it| it.code).collect();
    assert_eq!(codes, [PERHAPS_FROZEN]);
    let current = found.channels.iter().find(|it| it.name == "current_1_a").expect("there");
    assert!(current.frozen.len() == 1 && (current.frozen[0].length_s - 0.59).abs() < 1e-9);
}

/// A gyro without an angle beside it: dead at zero for a while, or at one value throughout. It is in doubt while a command moves,
/// and not while it stands.
#[test]
fn a_gyro_that_stands_is_perhaps_frozen_while_what_turns_the_body_moves() {
    let dead = |from: usize, value: f64| {
        move |row: usize, rate: &mut f64| {
            if (from..from + 200).contains(&row) {
                *rate = value;
            }
        }
    };
    // It is held for two seconds, and moves before and after.
    let held = |row: usize| if (300..500).contains(&row) { 0 } else { row / 50 % 2 };
    let command: Vec<f64> = (0..1000).map(|row| 0.4 + 0.2 * held(row) as f64).collect();
    let found = |mut log: Dataset, name: &str| {
        log.insert(name, command.clone()).expect("fits");
        let found = summary(&log);
        let of_gyro =
            found.findings.iter().filter(|it| it.subject == "body_rate_rad_s" && it.code == PERHAPS_FROZEN);
        assert_eq!(of_gyro.count(), found.channels[0].frozen.len());
        found.channels[0]
            .frozen
            .iter()
            .map(|it| (it.value, (100.0 * it.length_s).round() as i32))
            .collect::<Vec<_>>()
    };
    let beside = |log: Dataset| found(log, "command_1");
    assert_eq!(beside(log(dead(600, 0.0))), [(0.0, 199)], "dead at zero");
    assert_eq!(beside(log(dead(300, 0.0))), [], "beside a command that stands");
    assert_eq!(beside(log(|_, rate| *rate = 0.0)), [(0.0, 999)], "throughout");
    assert_eq!(beside(log(|_, rate| *rate = 0.3)), [(0.3, 999)]);
    assert_eq!(beside(log(|row, rate| *rate = if row < 300 { 0.0 } else { *rate })), [(0.0, 299)]);
    assert_eq!(found(log(dead(300, 0.0)), "torque_command_nm"), [], "beside a torque that stands");
    let still = vec![0.4; 1000];
    let mut at_rest = log(|_, rate| *rate = 0.0);
    at_rest.insert("command_1", still).expect("fits");
    assert_eq!(summary(&at_rest).channels[0].frozen, [], "nothing moved");
}

#[test]
fn a_quantized_channel_is_neither_frozen_nor_saturated() {
    let findings = summary(&log(|row, value| *value = 15.0 - (row / 20) as f64 * 0.01));
    assert_eq!(findings.findings, [], "{:?}", findings.channels[0]);
}

/// 10 mV steps, noise that shows at first and not any more: it stands on every step. Where it does not go on from where it
/// stood, it was frozen.
#[test]
fn a_battery_read_in_steps_stands_on_each_and_freezes_where_it_jumps() {
    let battery = |frozen: bool| {
        let time: Vec<f64> = (0..4000).map(|row| f64::from(row) * 0.01).collect();
        let reading = |row: i32| {
            let noise = if row < 2000 { 0.006 * f64::from(row * 37 % 11 - 5) / 5.0 } else { 0.0 };
            let held = if frozen && (2500..3300).contains(&row) { 2500 } else { row };
            ((12.6 - 2e-4 * f64::from(held) + noise) * 100.0).round() / 100.0
        };
        let mut log = Dataset::new("test", "", time).expect("time rises");
        log.insert("battery_voltage_v", (0..4000).map(reading).collect()).expect("right length");
        summary(&log)
    };
    let good = battery(false);
    assert_eq!(good.findings, [], "{:?}", good.channels[0]);
    let frozen = &battery(true).channels[0].frozen;
    assert!(frozen.len() == 1 && (frozen[0].length_s - 8.0).abs() < 0.5, "{frozen:?}");
}

/// A bench supply that comes to rest at both levels: nothing of it is beyond the sensor's range.
#[test]
fn a_battery_that_settles_is_not_saturated() {
    let time: Vec<f64> = (0..6000).map(|row| f64::from(row) * 0.01).collect();
    // Half a second of time constant: most of each ten seconds it stands.
    let load = |row: i32| f64::from(row / 1000 % 2);
    let mut volts = 12.13;
    let reading = |row: i32| {
        volts += 0.02 * (12.13 - 0.91 * load(row) - volts);
        (volts * 100.0).round() / 100.0
    };
    let mut log = Dataset::new("test", "", time).expect("time rises");
    log.insert("battery_voltage_v", (0..6000).map(reading).collect()).expect("right length");
    log.insert("command_1", (0..6000).map(|row| 0.4 + 0.2 * load(row)).collect()).expect("right length");
    let findings = summary(&log);
    let is_saturated = |it: &Finding| ["saturated", "perhaps_saturated"].contains(&it.code);
    assert!(!findings.findings.iter().any(is_saturated), "{:?}", findings.findings);
}

#[test]
fn a_slow_channel_does_not_drop_out() {
    let findings = summary(&log(|row, value| {
        if row % 10 != 0 {
            *value = f64::NAN;
        }
    }));
    assert!(findings.channels[0].dropouts.is_empty());
}

#[test]
fn holes_name_the_step_and_starts_from_standstill_are_counted() {
    let rows = 200;
    let time = (0..rows).map(|row| f64::from(row) * 0.01 + if row >= 100 { 0.2 } else { 0.0 }).collect();
    let mut log = Dataset::new("test", "", time).expect("time rises");
    let turns = |row: i32| row >= 98;
    log.insert("command_1", (0..rows).map(|row| if turns(row) { 0.5 } else { 0.0 }).collect())
        .expect("right length");
    let rate = (0..rows).map(|row| if turns(row) { 400.0 + f64::from(row) } else { 0.0 }).collect();
    log.insert("propeller_rate_1_rad_s", rate).expect("right length");
    let findings = summary(&log);
    assert_eq!(findings.holes.len(), 1);
    assert_eq!(findings.holes[0].at_step, Some(StepDirection::Up));
    assert_eq!(findings.standstill_starts_s.len(), 1);
    let codes: Vec<&str> = findings.findings.iter().map(|it| it.code).collect();
    assert_eq!(codes, ["holes", "starts_from_standstill", "standstill_left_out"]);
}

/// What a rotor shows that rests all the time is noise.
#[test]
fn a_rotor_that_is_never_commanded_does_not_start() {
    let noise = |row: i32| if row % 10 < 4 { 0.0 } else { 4.0 };
    for (greatest, starts) in [(0.5, 2), (0.0, 1)] {
        let time = (0..400).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("here", "", time).expect("rises");
        let begins = |at: i32, level: f64| (0..400).map(move |row| if row < at { 0.0 } else { level });
        for (name, values) in [
            ("command_1", begins(100, 0.4).collect::<Vec<f64>>()),
            ("propeller_rate_1_rad_s", begins(103, 520.0).collect()),
            ("command_2", begins(200, greatest).collect()),
            ("propeller_rate_2_rad_s", (0..400).map(noise).collect()),
        ] {
            log.insert(name, values).expect("fits");
        }
        let found = summary(&log).standstill_starts_s;
        assert_eq!(found.len(), starts, "{found:?}");
        assert!((found[0] - 1.0).abs() < 1e-9, "when it was commanded: {found:?}");
    }
}
