//! Rates that drop out or freeze, and rates that seem to.

use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::channel::CheckedChannel;
use crate::screening::checks::rate_dropout::{self, RATE_DROPOUT};
use crate::screening::checks::rate_frozen::{self, RATE_FROZEN};

const ROWS: usize = 6000;
const RATE: &str = "propeller_rate_1_rad_s";

fn hash(row: usize) -> usize {
    row.wrapping_mul(2_654_435_761) >> 7
}

/// Two levels, each for a tenth of a second at least, or what `command` says; a rotor of 16 rad/s, its rate read with 2
/// rad/s of noise in steps of `step` [rad/s].
fn log(command: impl Fn(f64) -> f64, noise: f64, step: f64) -> Dataset {
    let time: Vec<f64> = (0..ROWS).map(|row| row as f64 * 0.02).collect();
    let commands: Vec<f64> = time.iter().map(|t| command(*t)).collect();
    let mut rate = 1400.0 * commands[0];
    let mut rates = Vec::new();
    for (row, command) in commands.iter().enumerate() {
        let scatter = noise * ((hash(row) >> 9 & 255) as f64 / 128.0 - 1.0);
        rates.push(((rate + scatter) / step).round() * step);
        rate += 0.27 * (1400.0 * command - rate);
    }
    Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)])
}

fn binary(t: f64) -> f64 {
    if hash((t / 0.1 + 0.5) as usize) & 1 == 1 { 0.5 } else { 0.4 }
}

/// Rows of rotor 1 that were taken away, and what was found.
fn taken(log: &Dataset) -> (Vec<usize>, Vec<Finding>) {
    let mut channel = CheckedChannel::of(log, RATE).unwrap();
    for check in [rate_dropout::check, rate_frozen::check] {
        let found = check(&channel);
        channel.found.extend(found);
    }
    let mut rows: Vec<usize> = channel.found.iter().flat_map(|judged| judged.rows.clone()).collect();
    rows.sort_unstable();
    (rows, channel.found.into_iter().map(|judged| judged.finding).collect())
}

fn changed(log: &Dataset, change: impl Fn(usize, f64) -> f64) -> Dataset {
    let name = RATE;
    let rates = log.column(name).unwrap().iter().enumerate();
    let mut log = log.clone();
    log.replace(name, rates.map(|(row, rate)| change(row, *rate)).collect()).unwrap();
    log
}

#[test]
fn a_rate_that_freezes_is_left_out_and_found() {
    let excited = log(binary, 2.0, 1e-3);
    let (rows, findings) = taken(&changed(&excited, |_, _| 612.5));
    assert_eq!(rows.len(), ROWS, "never moved: {findings:?}");
    assert_eq!((findings.len(), findings[0].code, findings[0].rows), (1, RATE_FROZEN, ROWS));
    let value = |name: &str| findings[0].number(name);
    assert_eq!([value("value"), value("least_command"), value("greatest_command")], [612.5, 0.4, 0.5]);
    assert!(value("from_s") == 0.0 && (value("to_s") - 120.0).abs() < 0.03, "{findings:?}");
    let last = excited.column("propeller_rate_1_rad_s").unwrap()[3000];
    let half = changed(&excited, |row, rate| if (3000..4000).contains(&row) { last } else { rate });
    let (rows, findings) = taken(&half);
    assert_eq!((rows.first(), rows.last(), rows.len()), (Some(&3000), Some(&3999), 1000), "{findings:?}");
    assert!((findings[0].number("from_s") - 60.0).abs() < 0.03, "{findings:?}");
    assert!((findings[0].number("to_s") - 80.0).abs() < 0.03 && findings[0].rows == 1000, "{findings:?}");
}

#[test]
fn what_a_good_reading_does_is_no_freezing() {
    // A coarse reading under one level, under levels that change once, on a slow ramp and on its way back, and beside a
    // command that moves by less than the reading resolves.
    let ramp = |t: f64| 0.3 + 0.002 * (60.0 - (t - 60.0).abs());
    for (name, log) in [
        ("one level", log(|_| 0.45, 0.0, 10.0)),
        ("levels", log(|t| 0.3 + 0.1 * (t / 20.0).floor() / 5.0, 0.0, 10.0)),
        ("ramp", log(ramp, 0.0, 10.0)),
        ("coarse", log(|t| 0.46 + 0.002 * (2.0 * t).sin().signum(), 0.0, 20.0)),
        ("excited", log(binary, 0.0, 10.0)),
        ("at rest", log(|t| if t < 60.0 { 0.03 * (t / 30.0).floor() } else { 0.45 }, 0.0, 10.0)),
    ] {
        assert_eq!(taken(&log), (vec![], vec![]), "{name}");
    }
    let dead_zone = log(|t| 0.06 + 0.04 * (t / 10.0).floor() / 12.0, 0.0, 10.0);
    assert_eq!(taken(&changed(&dead_zone, |_, _| 0.0)), (vec![], vec![]), "a rotor below its dead zone");
}

#[test]
fn single_zeros_are_missing_and_counted() {
    let excited = log(binary, 2.0, 1e-3);
    let lost = |row: usize| row > 0 && (hash(row).is_multiple_of(40) || (3000..3003).contains(&row));
    let (rows, findings) = taken(&changed(&excited, |row, rate| if lost(row) { 0.0 } else { rate }));
    let expected: Vec<usize> = (0..ROWS).filter(|row| lost(*row)).collect();
    assert!(expected.len() > 100 && rows == expected, "{findings:?}");
    assert_eq!((findings[0].code, findings[0].rows), (RATE_DROPOUT, expected.len()));
    // Long ones are no better, once the rotor must have started; a rotor that starts is none.
    let (rows, findings) = taken(&changed(&excited, |row, rate| if row >= 4000 { 0.0 } else { rate }));
    assert_eq!((rows.first(), rows.len()), (Some(&4000), 2000), "{findings:?}");
    // Nor are those before the first frame; a rotor that starts, and one in its dead zone, are none of these.
    for count in [1, 3, 25] {
        let (rows, findings) = taken(&changed(&excited, |row, rate| if row < count { 0.0 } else { rate }));
        assert_eq!(rows, (0..count).collect::<Vec<usize>>(), "{findings:?}");
    }
    let from_rest = changed(&log(|_| 0.45, 0.0, 1e-3), |row, rate| rate * (1.0 - 0.73f64.powi(row as i32)));
    assert_eq!(taken(&from_rest), (vec![], vec![]), "it starts with the log");
    let dead_zone = log(|t| 0.06 + 0.02 * t, 2.0, 1e-3);
    let dead_zone = changed(&dead_zone, |row, rate| if row < 150 { 0.0 } else { rate });
    assert_eq!(taken(&dead_zone), (vec![], vec![]), "up to 0.12 it stands");
    let starts = log(|t| if t < 1.0 { 0.0 } else { 0.45 }, 2.0, 1e-3);
    let starts = changed(&starts, |row, rate| if row < 100 { 0.0 } else { rate });
    assert_eq!(taken(&starts), (vec![], vec![]), "it took a second to start");
}
