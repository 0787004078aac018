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

/// A rotor with a pole of 12 rad/s that loses its motor under a command of 0.12 or more at 8 s, stands at exactly 0 for 4.8 s and runs up again:
/// what counts is what it does before its fall and half a second after its start.
#[test]
fn a_stall_while_the_rotor_is_commanded_is_no_evidence_of_its_law() {
    let stalled = |command: fn(f64) -> f64| {
        rotor(command, move |t, rate| {
            let fallen = (-12.0 * (t - 7.7)).exp();
            let risen = 1.0 - (-12.0 * (t - 12.5)).exp();
            match t {
                _ if t < 7.7 => rate,
                _ if t < 8.0 => rate * fallen,
                _ if t < 12.5 => 0.0,
                _ => rate * risen,
            }
        })
    };
    for command in [|_| 0.12, |t| 0.3 + 0.05 * f64::from((t * 0.7) as u32 % 3)] {
        let (log, findings) = stalled(command);
        let rotor = log.rotor(1).expect("measured");
        let found: Vec<&Finding> = findings.iter().filter(|it| it.code == "stalled").collect();
        assert_eq!(found.len(), 1, "{findings:?}");
        let span = ["from_s", "to_s"].map(|name| found[0].number(name));
        assert!((span[0] - 8.0).abs() < 0.03 && (span[1] - 12.48).abs() < 0.05, "{span:?}");
        let out: Vec<f64> =
            (0..1000).filter(|row| !rotor.is_scored(*row)).map(|row| 0.02 * row as f64).collect();
        assert!(out.iter().all(|t| (7.5..13.1).contains(t)), "{out:?}");
        assert!(out[0] < 7.78 && out[out.len() - 1] > 12.9, "{out:?}");
        assert_eq!(rotor.reason(500), Some("stalled"));
        assert!(rotor.rests(500) && !rotor.rests(100));
        // It stood: that drives a body, and is a measurement.
        assert_eq!(log.dataset().column("propeller_rate_1_rad_s").expect("measured")[500], 0.0);
    }
}

/// Below 0.1 nothing turns it, whenever: the rotor's own law, which is fitted to.
#[test]
fn a_dead_zone_is_no_stall() {
    let command = |t: f64| if (t / 2.5) as u32 % 2 == 1 { 0.09 } else { 0.3 };
    let dead = rotor(command, |_, rate| if rate < 140.0 { 0.0 } else { rate });
    assert!(dead.1.iter().all(|it| it.code != "stalled"), "{:?}", dead.1);
    assert_eq!(counted(&dead).0, 1000);
}

/// The same of rotors with a pole of 12 rad/s, which still stand in the row in which they are commanded more, and of a speed controller that keeps a
/// fifth of its range for itself.
#[test]
fn a_dead_zone_is_no_stall_where_the_rotor_takes_its_time_to_start() {
    for (least, low, high) in [(0.1, 0.09, 0.3), (0.2, 0.18, 0.5)] {
        let command = move |t: f64| if (t / 4.0) as u32 % 2 == 1 { low } else { high };
        // Ten steps of Euler a row; below 5 rad/s it reads 0.
        let (mut turns, mut rates) = (1400.0 * high, Vec::new());
        for row in 0..1000 {
            rates.push(if turns < 5.0 { 0.0 } else { turns });
            let commanded = command(0.02 * f64::from(row));
            let settled = if commanded < least { 0.0 } else { 1400.0 * commanded };
            (0..10).for_each(|_| turns += 0.002 * 12.0 * (settled - turns));
        }
        let dead = rotor(command, |t, _| rates[(50.0 * t).round() as usize]);
        assert!(dead.1.iter().all(|it| it.code != "stalled"), "{:?}", dead.1);
        assert_eq!(counted(&dead).0, 1000, "{:?}", dead.1);
    }
}
