//! Where a rotor stands, by its measured rate.

use crate::log::Dataset;
use crate::screening::{Finding, ScreenedLog};

/// 20 s at 50 Hz of a rotor that turns with 1400 rad/s for a full command, and what `rate` makes of that at a time [s].
fn rotor(command: impl Fn(f64) -> f64, rate: impl Fn(f64, f64) -> f64) -> (ScreenedLog, Vec<Finding>) {
    let time: Vec<f64> = (0..1000).map(|row| 0.02 * f64::from(row)).collect();
    let commands: Vec<f64> = time.iter().map(|time| command(*time)).collect();
    let rates = time.iter().zip(&commands).map(|(time, command)| rate(*time, 1400.0 * command)).collect();
    let log = Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)]);
    let log = ScreenedLog::from(log);
    let findings = log.rotor(1).expect("measured").findings().cloned().collect();
    (log, findings)
}

/// How many rows count, and how many are left out as standstill.
fn counted((log, findings): &(ScreenedLog, Vec<Finding>)) -> (usize, usize) {
    let stands = findings.iter().filter(|it| it.code == "standstill_left_out").map(|it| it.rows);
    (log.rotor(1).expect("measured").scored().count(), stands.sum())
}

/// An ESC that idles at 60 rad/s, a tenth of its greatest rate, where nothing is commanded; the same, and once it stands.
#[test]
fn a_rotor_that_idles_at_no_command_never_stands() {
    let command = |t: f64| if (t / 4.0) as u32 % 2 == 1 { 0.0 } else { 0.45 };
    let idles = rotor(command, |_, rate| rate.max(60.0));
    assert_eq!(counted(&idles), (1000, 0), "{:?}", idles.1);
    let stops = rotor(command, |t, rate| if (15.9..16.0).contains(&t) { 10.0 } else { rate.max(60.0) });
    // Four seconds twice without a command, and half a second behind each.
    assert!((448..=452).contains(&counted(&stops).1), "{:?}", stops.1);
}

/// From rest at a command that turns nothing for two seconds: it starts at 7 s, and counts half a second later.
#[test]
fn a_rotor_that_has_not_started_yet_stands_whatever_is_commanded() {
    let command = |t: f64| if t < 5.0 { 0.0 } else { 0.1 + 0.02 * (t - 5.0) };
    let stalls = rotor(command, |t, rate| if t < 7.0 { 0.0 } else { rate });
    let of_log = stalls.0.rotor(1).expect("measured");
    let first = of_log.scored().map(|row| of_log.data().time[row]).next().expect("some count");
    assert!((7.46..7.53).contains(&first), "{first}: {:?}", stalls.1);
}
