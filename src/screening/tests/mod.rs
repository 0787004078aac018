//! Logs in which readings repeat, and logs in which they seem to.

use crate::log::Dataset;
use crate::screening::checks::battery_dropout::BATTERY_DROPOUT;
use crate::screening::checks::gyro_frozen::GYRO_FROZEN;
use crate::screening::checks::outliers::{OUTLIERS, TOO_MANY_OUTLIERS};
use crate::screening::checks::rate_dropout::RATE_DROPOUT;
use crate::screening::checks::sample_and_hold::SAMPLE_AND_HOLD;
use crate::screening::checks::saturated::{self, SATURATED};
use crate::screening::readings::bridged;
use crate::screening::{Finding, Judgement, ScreenedLog};
use crate::signal::columns::BATTERY_VOLTAGE;

mod ends;
mod outliers;
mod rates;
mod standstill;

const RATE: &str = "propeller_rate_1_rad_s";
const ROWS: usize = 6000;

/// A number from -1 to 1 that another always has, and no two in a way that shows.
pub(crate) fn mixed(number: u64) -> f64 {
    let mixed = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// The number of a row, in one of several sequences that know nothing of each other.
pub(crate) fn noise_of(row: usize, of: u64) -> f64 {
    mixed(row as u64 ^ of << 32)
}

fn hash(row: usize) -> f64 {
    mixed(row as u64 ^ 0x9e37)
}

/// Noise of size one: of twelve numbers as these, nearly normal.
fn noise(row: usize) -> f64 {
    (0..12).map(|part| hash(12 * row + part + 1_000_000)).sum::<f64>() / 2.0
}

/// Rows `interval` [s] apart under the name of a measured channel, with a command beside.
fn log(name: &str, interval: f64, commands: &[f64], values: Vec<f64>) -> Dataset {
    let time = (0..values.len()).map(|row| row as f64 * interval).collect();
    Dataset::made(time, [("command_1", commands.to_vec()), (name, values)])
}

/// Commands, and what a rotor of `pole` [rad/s] does under them.
fn rotor(interval: f64, pole: f64, command: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
    let commands: Vec<f64> = (0..ROWS).map(command).collect();
    let mut rate = 1300.0 * commands[0];
    let share = 1.0 - (-pole * interval).exp();
    let rates = commands.iter().map(|command| {
        let now = rate;
        rate += share * (1300.0 * command - rate);
        now
    });
    let rates = rates.collect();
    (commands, rates)
}

/// Two levels, changed or not each `rows` rows.
fn binary(rows: usize) -> impl Fn(usize) -> f64 {
    move |row| if hash(row / rows) > 0.0 { 0.55 } else { 0.4 }
}

/// A level of its own each `rows` rows.
fn levels(rows: usize) -> impl Fn(usize) -> f64 {
    move |row| 0.45 + 0.2 * hash(row / rows)
}

fn on_grid(values: &[f64], step: f64) -> Vec<f64> {
    values.iter().map(|value| (value / step).round() * step).collect()
}

fn noisy(values: &[f64], size: f64) -> Vec<f64> {
    values.iter().enumerate().map(|(row, value)| value + size * noise(row)).collect()
}

/// Each reading written again until the next comes; `fresh` says in which rows one does.
fn held(values: &[f64], fresh: impl Fn(usize) -> bool) -> Vec<f64> {
    let mut last = values[0];
    let each = values.iter().enumerate().map(|(row, value)| {
        last = if fresh(row) { *value } else { last };
        last
    });
    each.collect()
}

/// What a check found in a channel, by its code.
fn found(log: &Dataset, name: &str, code: &str) -> Option<Judgement> {
    let screened = ScreenedLog::of(log);
    let judged = &screened.channel(name).expect("it is looked at").judgements;
    judged.iter().find(|judged| judged.finding.code == code).cloned()
}

/// A channel without what is no measurement, and what was found in the log.
fn cleaned(log: &Dataset, name: &str) -> (Vec<f64>, Vec<Finding>) {
    let screened = ScreenedLog::of(log);
    (screened.dataset().column(name).unwrap().to_vec(), screened.findings().cloned().collect())
}

/// Fewest and most rows in which readings stand.
fn stands_in(log: &Dataset, name: &str) -> Option<[usize; 2]> {
    let finding = found(log, name, SAMPLE_AND_HOLD)?.finding;
    Some([finding.count("least_rows"), finding.count("most_rows")])
}

#[test]
fn held_readings_are_taken_as_missing_and_found() {
    type Fresh = fn(usize) -> bool;
    let patterns: [(&str, Fresh, [usize; 2], f64); 5] = [
        ("second", |row| row.is_multiple_of(2), [2, 2], 25.0),
        ("third", |row| row.is_multiple_of(3), [3, 3], 16.7),
        ("fourth", |row| row.is_multiple_of(4), [4, 4], 12.5),
        ("1-2-1-2", |row| row % 3 != 2, [1, 2], 33.3),
        ("1-1-1-2", |row| row % 5 != 4, [1, 2], 40.0),
    ];
    for (pattern, fresh, rows, hertz) in patterns {
        for (kind, command) in [("fast", binary(1)), ("slow", binary(10))] {
            let (commands, rates) = rotor(0.02, 16.0, command);
            let log = log(RATE, 0.02, &commands, held(&noisy(&rates, 1.5), fresh));
            let (left, said) = cleaned(&log, RATE);
            let wrong = (0..ROWS).filter(|row| left[*row].is_finite() != fresh(*row)).count();
            assert_eq!(wrong, 0, "{pattern} {kind}: {said:?}");
            assert_eq!((said.len(), stands_in(&log, RATE)), (1, Some(rows)), "{pattern} {kind}: {said:?}");
            let pace = said[0].number("interval_s").recip();
            assert!((pace / hertz - 1.0).abs() < 0.03, "{pattern} {kind}: {said:?}");
            assert!((said[0].number("log_interval_s") - 0.02).abs() < 1e-9);
            assert_eq!(ScreenedLog::of(&log).dataset().column("command_1"), log.column("command_1"));
        }
    }
}

/// A speed in steps of a controller's own counting, noise below a step, and an angle of 4096 steps a turn that swings.
#[test]
fn coarse_readings_that_are_held_are_seen_as_held() {
    let (commands, rates) = rotor(0.02, 16.0, binary(3));
    let fresh = |row: usize| row.is_multiple_of(2);
    let coarse = log(RATE, 0.02, &commands, held(&on_grid(&noisy(&rates, 1.5), 2.0), fresh));
    assert_eq!(stands_in(&coarse, RATE), Some([2, 2]));
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.4 * (0.02 * row as f64 * 1.7).sin()).collect();
    let angle =
        log("body_angle_rad", 0.01, &commands, held(&on_grid(&swing, std::f64::consts::TAU / 4096.0), fresh));
    assert_eq!(stands_in(&angle, "body_angle_rad"), Some([2, 2]));
}

/// At a level to which a rate has settled, and at zero, readings are left at the telemetry's pace.
#[test]
fn a_level_that_stands_keeps_readings_at_the_telemetrys_pace() {
    let (mut commands, mut rates) = rotor(0.02, 16.0, binary(2));
    // Under one command: else it would be frozen.
    commands[3000..4000].fill(0.47);
    rates[3000..4000].fill(612.5);
    let log = log(RATE, 0.02, &commands, held(&rates, |row| row.is_multiple_of(2)));
    let left = &cleaned(&log, RATE).0[3000..4000];
    assert_eq!(left.iter().filter(|rate| rate.is_finite()).count(), 500);
}

#[test]
fn fresh_readings_that_happen_to_be_equal_are_left_alone() {
    let (commands, excited) = rotor(0.02, 16.0, binary(1));
    let (slow_commands, slow) = rotor(0.02, 16.0, levels(100));
    // One step, or one tick of a period's counter, in each second row.
    let ramp: Vec<f64> = (0..ROWS).map(|row| 0.01 * (row / 2) as f64).collect();
    let ticks: Vec<f64> = (0..ROWS).map(|row| 3.6e5 / (3600 - row / 2) as f64).collect();
    let still: Vec<f64> = (0..ROWS).map(|row| 0.002 * noise(row)).collect();
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.3 * (0.01 * row as f64).sin()).collect();
    let mut stands = noisy(&excited, 1.5);
    stands[1000..3000].fill(0.0);
    for (name, channel, commands, values) in [
        ("noise in coarse steps", RATE, &commands, on_grid(&noisy(&excited, 1.5), 5.0)),
        ("noise smaller than a step", RATE, &slow_commands, on_grid(&noisy(&slow, 1.7), 2.0)),
        ("noise as large as a step", RATE, &slow_commands, on_grid(&noisy(&slow, 2.0), 2.0)),
        ("coarse, without noise", RATE, &slow_commands, on_grid(&slow, 10.0)),
        ("levels without noise", RATE, &slow_commands, on_grid(&slow, 1e-3)),
        ("levels to the last bit", RATE, &slow_commands, slow.clone()),
        ("a slow ramp in few digits", RATE, &commands, ramp),
        ("a period counted in ticks", RATE, &commands, ticks),
        (
            "a link that loses half of its frames",
            RATE,
            &commands,
            held(&noisy(&excited, 1.5), |row| hash(row) > 0.0),
        ),
        ("a rotor that stands for long", RATE, &commands, stands),
        ("a body at rest", "body_rate_rad_s", &commands, on_grid(&still, 0.001)),
        ("a coarse angle", "body_angle_rad", &commands, on_grid(&swing, 0.005)),
        ("few digits", "body_rate_rad_s", &commands, on_grid(&swing, 0.01)),
    ] {
        let log = log(channel, 0.02, commands, values);
        // Of a rotor that stands its command asks: that is another check's.
        let said: Vec<Finding> = ScreenedLog::of(&log).findings().cloned().collect();
        let is_another = |it: &Finding| name == "a rotor that stands for long" && it.code == RATE_DROPOUT;
        assert!(said.iter().all(is_another), "{name}: {said:?}");
    }
}

/// Levels of two rows, two rows a second: these cannot show whether a reading was held.
#[test]
fn rows_so_far_apart_that_everything_settles_say_nothing() {
    let (commands, rates) = rotor(0.5, 16.0, levels(2));
    assert_eq!(stands_in(&log(RATE, 0.5, &commands, on_grid(&rates, 0.1)), RATE), None);
}

#[test]
fn commands_and_batteries_may_be_held() {
    let (commands, rates) = rotor(0.02, 16.0, levels(2));
    let mut log = log(RATE, 0.02, &commands, noisy(&rates, 1.5));
    let volts: Vec<f64> = (0..ROWS).map(|row| 12.0 + 0.3 * hash(row / 2)).collect();
    log.insert("battery_voltage_v", volts).unwrap();
    let said: Vec<Finding> = ScreenedLog::of(&log).findings().cloned().collect();
    assert_eq!(said, []);
}

#[test]
fn each_row_that_is_left_out_has_its_reason() {
    let (commands, rates) = rotor(0.02, 16.0, levels(100));
    let mut values = noisy(&rates, 1.5);
    (values[1000], values[2000]) = (5000.0, 0.0);
    let mut log = log(RATE, 0.02, &commands, values);
    let volts = (0..ROWS).map(|row| if row == 70 { 0.0 } else { 12.0 + 0.01 * hash(row) }).collect();
    log.insert(BATTERY_VOLTAGE, volts).unwrap();
    let screened = ScreenedLog::of(&log);
    let reason = |name: &str, row| screened.channel(name).and_then(|channel| channel.reason(row));
    assert_eq!([reason(RATE, 1000), reason(RATE, 1001)], [Some(OUTLIERS), None]);
    assert_eq!(
        [reason(RATE, 2000), reason(BATTERY_VOLTAGE, 70)],
        [Some(RATE_DROPOUT), Some(BATTERY_DROPOUT)]
    );
    assert_eq!(screened.channels().iter().flat_map(|channel| channel.left_out()).count(), 3);
}

#[test]
fn lines_bridge_what_is_missing_here_and_there_and_no_more() {
    let none = f64::NAN;
    let time: Vec<f64> = (0..13).map(f64::from).collect();
    let values = [0.0, 1.0, none, 3.0, 4.0, none, none, none, none, none, 10.0, 11.0, none];
    let found = bridged(&time, &values);
    assert_eq!(found[..5], [0.0, 1.0, 2.0, 3.0, 4.0]);
    assert!(found[5..10].iter().all(|value| value.is_nan()) && found[12].is_nan(), "{found:?}");
}

/// 100 Hz, a command that changes at the given rows, a hole of 90 ms after the given row.
pub(crate) fn log_with_hole(rows: usize, changes: &[usize], hole_after: usize) -> Dataset {
    let delay = |row: usize| if row > hole_after { 0.08 } else { 0.0 };
    let time: Vec<f64> = (0..rows).map(|row| 0.01 * row as f64 + delay(row)).collect();
    let level = |row: usize| changes.iter().filter(|change| **change <= row).count();
    let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.1 * (level(row) % 2) as f64).collect();
    Dataset::made(
        time,
        [("propeller_rate_1_rad_s", command.iter().map(|u| 1300.0 * u).collect()), ("command_1", command)],
    )
}

/// A rotor that is stopped at 10 s, and stands at 12 s, where a part begins: in the part alone nobody would know that it has
/// been running down; a recorder of commands that freezes at 30 s.
#[test]
fn what_is_not_scored_in_a_log_is_not_scored_in_a_part_of_it() {
    let time: Vec<f64> = (0..3000).map(|row| 0.02 * f64::from(row)).collect();
    let noise = |row: usize| (row.wrapping_mul(2_654_435_761) >> 9 & 255) as f64 / 255.0;
    let command = |row: usize| match row {
        500..600 => 0.0,
        _ => 0.5 + 0.05 * f64::from((row / 40 % 2) as u32),
    };
    let mut commands: Vec<f64> = (0..3000).map(command).collect();
    let mut rates = Vec::with_capacity(3000);
    let mut rate = 600.0;
    for (row, command) in commands.iter().enumerate() {
        rate += 0.27 * (1200.0 * command - rate);
        rates.push(rate + noise(row));
    }
    let frozen = commands[1500];
    commands[1500..2000].fill(frozen);
    let log = Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)]);
    let whole = ScreenedLog::from(log);
    let stretches = [550..900, 1600..2400];
    let part = whole.of_rows(&stretches);
    let rows: Vec<usize> = stretches.into_iter().flatten().collect();
    let (rotor, own) = (part.rotor(1).expect("a rotor"), whole.rotor(1).expect("a rotor"));
    assert_eq!(part.raw().len(), rows.len());
    for (row, in_whole) in rows.iter().enumerate() {
        assert!(!rotor.is_scored(row) || own.is_scored(*in_whole), "row {in_whole}");
        assert!(rotor.is_scored(row) || rotor.reason(row).is_some(), "row {in_whole}");
    }
    assert!(rotor.scored().count() > 500, "{}", rotor.scored().count());
    assert!((0..400).any(|row| own.reason(1600 + row).is_some()), "the frozen recorder is seen in the whole");
}

/// A battery that a log of two thirds of zeros takes out, and a rate with a run of zeros that the whole knows as lost frames: a part
/// that begins behind them, or holds nothing else, would judge otherwise.
#[test]
fn cells_and_battery_of_a_part_are_as_they_were_judged_in_the_whole() {
    let time: Vec<f64> = (0..3000).map(|row| 0.02 * f64::from(row)).collect();
    let noise = |row: usize| (row.wrapping_mul(2_654_435_761) >> 9 & 255) as f64 / 255.0;
    let command = |row: usize| 0.5 + 0.05 * f64::from((row / 40 % 2) as u32);
    let rate = |row: usize| if (1640..1700).contains(&row) { 0.0 } else { 600.0 + noise(row) };
    let volts = |row: usize| if row.is_multiple_of(3) { 12.0 + 0.1 * noise(row) } else { 0.0 };
    let mut log = Dataset::new("a.csv", "", time).expect("time rises");
    for (name, values) in [
        ("command_1", (0..3000).map(command).collect::<Vec<f64>>()),
        ("propeller_rate_1_rad_s", (0..3000).map(rate).collect()),
        ("battery_voltage_v", (0..3000).map(volts).collect()),
    ] {
        log.insert(name, values).expect("as long");
    }
    let whole = ScreenedLog::from(log);
    let stretches = [1000..1300, 1640..1705];
    let part = whole.of_rows(&stretches);
    for name in ["command_1", "propeller_rate_1_rad_s", "battery_voltage_v"] {
        let (own, all) = (part.dataset().column(name), whole.dataset().column(name));
        assert_eq!(own.is_some(), all.is_some(), "{name}");
        for (row, in_whole) in stretches.iter().cloned().flatten().enumerate() {
            let at = |values: Option<&[f64]>, row: usize| values.map(|values| values[row].to_bits());
            assert_eq!(at(own, row), at(all, in_whole), "{name}, row {in_whole}");
        }
    }
    let codes = |log: &ScreenedLog| -> Vec<&'static str> {
        log.channel_findings().map(|finding| finding.code).collect()
    };
    assert!(!codes(&whole).is_empty() && codes(&part).iter().all(|code| codes(&whole).contains(code)));
    let rates = part.channel("propeller_rate_1_rad_s").expect("looked at");
    assert!(rates.left_out().all(|row| (300..365).contains(&row)), "{:?}", rates.judgements);
}
