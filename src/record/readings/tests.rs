//! Logs in which readings repeat, and logs in which they seem to.

use super::*;

const RATE: &str = "propeller_rate_1_rad_s";
const ROWS: usize = 6000;

/// A number from -1 to 1 that a row has always, and no two in a way that shows.
fn hash(row: usize) -> f64 {
    let mixed = (row as u64 ^ 0x9e37).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Noise of size one: of twelve numbers as these, nearly normal.
fn noise(row: usize) -> f64 {
    (0..12).map(|part| hash(12 * row + part + 1_000_000)).sum::<f64>() / 2.0
}

/// Rows `interval` [s] apart under the name of a measured channel, with a command beside.
fn log(name: &str, interval: f64, told: &[f64], values: Vec<f64>) -> Dataset {
    let time = (0..values.len()).map(|row| row as f64 * interval).collect();
    let mut log = Dataset::new("log.csv", "", time).unwrap();
    log.insert("command_1", told.to_vec()).unwrap();
    log.insert(name, values).unwrap();
    log
}

/// Commands, and what a rotor of `pole` [rad/s] does under them.
fn rotor(interval: f64, pole: f64, command: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
    let told: Vec<f64> = (0..ROWS).map(command).collect();
    let mut rate = 1300.0 * told[0];
    let follow = 1.0 - (-pole * interval).exp();
    let rates = told.iter().map(|told| {
        let now = rate;
        rate += follow * (1300.0 * told - rate);
        now
    });
    let rates = rates.collect();
    (told, rates)
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

fn repeats(log: &Dataset, name: &str) -> Option<Repeats> {
    Unmeasured::of(log, name).repeats
}

#[test]
fn held_readings_are_taken_as_missing_and_told() {
    type Fresh = fn(usize) -> bool;
    let patterns: [(&str, Fresh, &str); 5] = [
        (
            "second",
            |row| row.is_multiple_of(2),
            "every reading stands in 2 rows, fresh ones come at 25 Hz in a log of 50 Hz",
        ),
        (
            "third",
            |row| row.is_multiple_of(3),
            "every reading stands in 3 rows, fresh ones come at 16.7 Hz in a log of 50 Hz",
        ),
        ("fourth", |row| row.is_multiple_of(4), "every reading stands in 4 rows, fresh ones come at 12.5 Hz"),
        ("1-2-1-2", |row| row % 3 != 2, "readings stand in 1 to 2 rows, fresh ones come at 33.3"),
        ("1-1-1-2", |row| row % 5 != 4, "readings stand in 1 to 2 rows, fresh ones come at 40 Hz"),
    ];
    for (pattern, fresh, sentence) in patterns {
        for (kind, command) in [("fast", binary(1)), ("slow", binary(10))] {
            let (told, rates) = rotor(0.02, 16.0, command);
            let log = log(RATE, 0.02, &told, held(&noisy(&rates, 1.5), fresh));
            let mut said = Vec::new();
            let cleaned = measured(&log, &mut said);
            let left = cleaned.column(RATE).unwrap();
            let wrong = (0..ROWS).filter(|row| left[*row].is_finite() != fresh(*row)).count();
            assert_eq!(wrong, 0, "{pattern} {kind}: {said:?}");
            assert!(said.len() == 1 && said[0].contains(sentence), "{pattern} {kind}: {said:?}");
            assert_eq!(cleaned.column("command_1"), log.column("command_1"));
        }
    }
}

/// A speed in steps of a controller's own counting, noise below a step, and an angle of 4096 steps a turn that swings.
#[test]
fn coarse_readings_that_are_held_are_seen_as_held() {
    let (told, rates) = rotor(0.02, 16.0, binary(3));
    let fresh = |row: usize| row.is_multiple_of(2);
    let coarse = log(RATE, 0.02, &told, held(&on_grid(&noisy(&rates, 1.5), 2.0), fresh));
    assert_eq!(repeats(&coarse, RATE).map(|found| found.stands_in), Some([2, 2]));
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.4 * (0.02 * row as f64 * 1.7).sin()).collect();
    let angle =
        log("body_angle_rad", 0.01, &told, held(&on_grid(&swing, std::f64::consts::TAU / 4096.0), fresh));
    assert_eq!(repeats(&angle, "body_angle_rad").map(|found| found.stands_in), Some([2, 2]));
}

/// At a level to which a rate has settled, and at zero, readings are left at the telemetry's pace.
#[test]
fn a_level_that_stands_keeps_readings_at_the_telemetrys_pace() {
    let (told, mut rates) = rotor(0.02, 16.0, binary(2));
    rates[3000..4000].fill(612.5);
    let log = log(RATE, 0.02, &told, held(&rates, |row| row.is_multiple_of(2)));
    let cleaned = measured(&log, &mut Vec::new());
    let left = &cleaned.column(RATE).unwrap()[3000..4000];
    assert_eq!(left.iter().filter(|rate| rate.is_finite()).count(), 500);
}

#[test]
fn fresh_readings_that_happen_to_be_equal_are_left_alone() {
    let (told, lively) = rotor(0.02, 16.0, binary(1));
    let (slow_told, slow) = rotor(0.02, 16.0, levels(100));
    // One step, or one tick of a period's counter, in each second row.
    let ramp: Vec<f64> = (0..ROWS).map(|row| 0.01 * (row / 2) as f64).collect();
    let ticks: Vec<f64> = (0..ROWS).map(|row| 3.6e5 / (3600 - row / 2) as f64).collect();
    let still: Vec<f64> = (0..ROWS).map(|row| 0.002 * noise(row)).collect();
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.3 * (0.01 * row as f64).sin()).collect();
    let mut stands = noisy(&lively, 1.5);
    stands[1000..3000].fill(0.0);
    for (name, channel, told, values) in [
        ("noise in coarse steps", RATE, &told, on_grid(&noisy(&lively, 1.5), 5.0)),
        ("noise smaller than a step", RATE, &slow_told, on_grid(&noisy(&slow, 1.7), 2.0)),
        ("noise as large as a step", RATE, &slow_told, on_grid(&noisy(&slow, 2.0), 2.0)),
        ("coarse, without noise", RATE, &slow_told, on_grid(&slow, 10.0)),
        ("levels without noise", RATE, &slow_told, on_grid(&slow, 1e-3)),
        ("levels to the last bit", RATE, &slow_told, slow.clone()),
        ("a slow ramp in few digits", RATE, &told, ramp),
        ("a period counted in ticks", RATE, &told, ticks),
        (
            "a link that loses half of its frames",
            RATE,
            &told,
            held(&noisy(&lively, 1.5), |row| hash(row) > 0.0),
        ),
        ("a rotor that stands for long", RATE, &told, stands),
        ("a body at rest", "body_rate_rad_s", &told, on_grid(&still, 0.001)),
        ("a coarse angle", "body_angle_rad", &told, on_grid(&swing, 0.005)),
        ("few digits", "body_rate_rad_s", &told, on_grid(&swing, 0.01)),
    ] {
        let log = log(channel, 0.02, told, values);
        assert_eq!(repeats(&log, channel), None, "{name}");
        let mut said = Vec::new();
        assert!(matches!(measured(&log, &mut said), Cow::Borrowed(_)) && said.is_empty(), "{name}: {said:?}");
    }
}

/// Levels of two rows, two rows a second: nobody can tell from these whether a reading was held.
#[test]
fn rows_so_far_apart_that_everything_settles_say_nothing() {
    let (told, rates) = rotor(0.5, 16.0, levels(2));
    assert_eq!(repeats(&log(RATE, 0.5, &told, on_grid(&rates, 0.1)), RATE), None);
}

#[test]
fn commands_and_batteries_may_be_held() {
    let (told, rates) = rotor(0.02, 16.0, levels(2));
    let mut log = log(RATE, 0.02, &told, noisy(&rates, 1.5));
    let volts: Vec<f64> = (0..ROWS).map(|row| 12.0 + 0.3 * hash(row / 2)).collect();
    log.insert("battery_voltage_v", volts).unwrap();
    let mut said = Vec::new();
    assert!(matches!(measured(&log, &mut said), Cow::Borrowed(_)) && said.is_empty(), "{said:?}");
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

fn wild(log: &Dataset, name: &str) -> Vec<usize> {
    Unmeasured::of(log, name).wild.map_or(vec![], |wild| wild.rows)
}

/// One row in 200 at a place of its own, and what stands there instead of `values`.
fn hurt(values: &[f64], with: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<usize>) {
    let rows: Vec<usize> = (20..values.len() - 20).filter(|row| hash(row + 77) > 0.985).collect();
    let mut hurt = values.to_vec();
    rows.iter().for_each(|row| hurt[*row] = with(values[*row]));
    (hurt, rows)
}

#[test]
fn wild_readings_are_found_whatever_the_command_does() {
    type Wrong = fn(f64) -> f64;
    let wrong: [(&str, Wrong); 4] =
        [("5000", |_| 5000.0), ("half", |rate| 0.5 * rate), ("double", |rate| 2.0 * rate), ("zero", |_| 0.0)];
    let ramp = |row: usize| 0.3 + 0.3 * (row as f64 / ROWS as f64);
    for (case, (told, rates)) in [
        ("binary", rotor(0.02, 16.0, binary(1))),
        ("slow binary", rotor(0.02, 16.0, binary(10))),
        ("levels", rotor(0.02, 16.0, levels(100))),
        ("ramp", rotor(0.02, 16.0, ramp)),
        ("one level", rotor(0.02, 16.0, |_| 0.45)),
    ] {
        for (name, with) in wrong {
            let (values, rows) = hurt(&noisy(&rates, 1.5), with);
            let log = log(RATE, 0.02, &told, values);
            assert!(rows.len() > 20);
            assert_eq!(wild(&log, RATE), rows, "{case}, {name}");
        }
    }
}

#[test]
fn spikes_of_a_gyro_and_of_an_angle_are_found() {
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    let (told, _) = rotor(0.01, 16.0, binary(1));
    for name in ["body_rate_rad_s", "body_angle_rad"] {
        for size in [3.0, -30.0] {
            let (values, rows) = hurt(&noisy(&swing, 0.004), |rate| rate + size);
            let log = log(name, 0.01, &told, values);
            let mut said = Vec::new();
            let cleaned = measured(&log, &mut said);
            let left = cleaned.column(name).unwrap();
            let taken: Vec<usize> = (0..ROWS).filter(|row| !left[*row].is_finite()).collect();
            assert_eq!(taken, rows, "{name}, {size}: {said:?}");
            let sentence = format!("{} wild readings lie far from the neighbours, the first at", rows.len());
            assert!(said.len() == 1 && said[0].contains(&sentence), "{said:?}");
        }
    }
}

/// Just enough readings to look through once: what that found is kept.
#[test]
fn a_short_log_keeps_what_was_found() {
    let (told, rates) = rotor(0.02, 16.0, binary(10));
    for rows in [56, 57, 80] {
        let mut values = noisy(&rates[..rows], 1.5);
        values[30] = 5000.0;
        assert_eq!(wild(&log(RATE, 0.02, &told[..rows], values), RATE), [30], "{rows} rows");
    }
}

#[test]
fn two_in_a_row_are_wild_and_three_are_not() {
    let (told, rates) = rotor(0.02, 16.0, binary(4));
    let with = |rows: &[usize], value: &dyn Fn(usize) -> f64| {
        let mut values = noisy(&rates, 1.5);
        rows.iter().for_each(|row| values[*row] = value(*row));
        wild(&log(RATE, 0.02, &told, values), RATE)
    };
    assert_eq!(with(&[500, 501], &|_| 5000.0), [500, 501]);
    // The one lies between the other and the rest.
    assert_eq!(with(&[500, 501], &|row| if row == 500 { 2800.0 } else { 5000.0 }), [500, 501]);
    // Half of the speed, next to each other and with one between.
    assert_eq!(with(&[500, 501], &|row| 0.5 * rates[row]), [500, 501]);
    assert_eq!(with(&[500, 502], &|row| 0.5 * rates[row]), [500, 502]);
    assert_eq!(with(&[500, 501, 502], &|_| 5000.0), [0; 0], "who knows");
}

/// What true signals do, and glitches do not.
#[test]
fn true_peaks_are_not_wild() {
    let body = "body_rate_rad_s";
    // Hits: one row from rest, and back as a loop or a pivot brings it back, some slowly, some within few rows.
    let hits = |back: f64| -> Vec<f64> {
        let mut rate = 0.0;
        let each = (0..ROWS).map(|row| {
            rate = back * rate + if row % 500 == 250 { 3.0 } else { 0.0 };
            rate + 0.004 * noise(row)
        });
        each.collect()
    };
    // One in ten five times as large.
    let heavy = |row: usize| noise(row) * if hash(row + 5) > 0.8 { 5.0 } else { 1.0 };
    let still = vec![0.45; ROWS];
    for (case, values) in [
        ("a hit that the loop brings back", hits(0.95)),
        ("a hit that a stiff pivot brings back", hits(0.5)),
        ("heavy noise", (0..ROWS).map(|row| 0.004 * heavy(row)).collect()),
        (
            "a coarse angle at rest",
            (0..ROWS).map(|row| if hash(row) > 0.98 { 0.0015 } else { 0.0 }).collect(),
        ),
    ] {
        assert_eq!(wild(&log(body, 0.01, &still, values), body), [0; 0], "{case}");
    }
    // A gyro so slow that a hit is over from row to row.
    let slow = (0..ROWS).map(|row| noise(row) * 0.004 + if row % 500 == 250 { 3.0 } else { 0.0 }).collect();
    assert_eq!(wild(&log(body, 0.5, &still, slow), body), [0; 0]);
    let pulses = |row: usize| if row % 400 == 100 { 0.7 } else { 0.45 };
    for (case, interval, pole, command) in [
        ("levels of one row each", 0.5, 16.0, &levels(1) as &dyn Fn(usize) -> f64),
        ("pulses of one row", 0.02, 16.0, &pulses),
        ("pulses of one row, a fast rotor", 0.05, 60.0, &pulses),
        ("fast rotor, levels", 0.05, 60.0, &levels(7)),
        ("steps", 0.02, 16.0, &levels(100)),
        ("binary", 0.02, 40.0, &binary(1)),
    ] {
        let (told, rates) = rotor(interval, pole, command);
        for values in [noisy(&rates, 1.5), rates.clone(), on_grid(&rates, 5.0)] {
            assert_eq!(wild(&log(RATE, interval, &told, values), RATE), [0; 0], "{case}");
        }
    }
}

#[test]
fn too_many_for_glitches_are_left_in_and_told() {
    let (told, rates) = rotor(0.02, 16.0, levels(100));
    let mut values = noisy(&rates, 1.5);
    (0..ROWS).filter(|row| hash(row + 3) > 0.76).for_each(|row| values[row] = 3000.0 + 100.0 * hash(row));
    let log = log(RATE, 0.02, &told, values);
    let mut said = Vec::new();
    assert!(matches!(measured(&log, &mut said), Cow::Borrowed(_)), "{said:?}");
    assert!(said.len() == 1 && said[0].contains("too many for single glitches"), "{said:?}");
}

/// A wild reading that a slow telemetry holds is one reading.
#[test]
fn wild_readings_that_are_held_are_both() {
    let (told, rates) = rotor(0.01, 16.0, binary(5));
    let (values, rows) = hurt(&noisy(&rates, 1.5), |_| 5000.0);
    let fresh = |row: usize| row.is_multiple_of(2);
    let log = log(RATE, 0.01, &told, held(&values, fresh));
    let mut said = Vec::new();
    let cleaned = measured(&log, &mut said);
    let left = cleaned.column(RATE).unwrap();
    let good = |row: &usize| fresh(*row) && !rows.contains(row);
    assert!((0..ROWS).all(|row| left[row].is_finite() == good(&row)) && said.len() == 2, "{said:?}");
}

/// What a sensor or its wire cannot tell stands at an end of its range, whichever and however often.
#[test]
fn readings_at_the_end_of_a_range_are_missing_and_told() {
    let (told, rates) = rotor(0.02, 16.0, levels(25));
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    for (name, size, values) in [(RATE, 1.5, &rates), ("body_rate_rad_s", 0.004, &swing)] {
        let values = noisy(values, size);
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        for (low, high) in [(0.0, 0.9), (0.0, 0.98), (0.05, 1.0), (0.2, 0.8), (0.36, 0.64)] {
            let ends = [low, high].map(|share| sorted[(share * (ROWS - 1) as f64) as usize]);
            let clipped = values.iter().map(|value| value.clamp(ends[0], ends[1])).collect();
            let log = log(name, 0.02, &told, clipped);
            let mut said = Vec::new();
            let left = measured(&log, &mut said).column(name).unwrap().to_vec();
            let is_cut =
                |row: usize| (low > 0.0 && values[row] <= ends[0]) || (high < 1.0 && values[row] >= ends[1]);
            for (row, left) in left.iter().enumerate() {
                // And what comes right before and behind.
                let beside = is_cut(row) || row > 0 && is_cut(row - 1) || row + 1 < ROWS && is_cut(row + 1);
                assert_eq!(left.is_finite(), !beside, "{name}, {low} to {high}: row {row}, {said:?}");
            }
            assert!(said.len() == 1 && said[0].contains("is clipped at"), "{said:?}");
        }
    }
}

/// Under two commands, most of the readings at either end; a coarse reading, too.
#[test]
fn both_ends_of_a_range_may_hold_most_of_the_readings() {
    let (told, rates) = rotor(0.02, 16.0, binary(10));
    for step in [1e-3, 2.0] {
        let values = on_grid(&noisy(&rates, 1.5), step);
        let clipped: Vec<f64> = values.iter().map(|rate| rate.clamp(560.0, 680.0)).collect();
        let at_ends = clipped.iter().filter(|rate| **rate == 560.0 || **rate == 680.0).count();
        assert!(at_ends > ROWS * 65 / 100);
        let found = Unmeasured::of(&log(RATE, 0.02, &told, clipped), RATE).clipped;
        assert_eq!(found.map(|it| (it.cells, it.at)), Some((at_ends, vec![560.0, 680.0])), "steps of {step}");
    }
}

/// Under two commands a quiet, coarse reading settles at the same two values again and again, as a supply's voltage under
/// load does the other way round.
#[test]
fn what_a_coarse_reading_settles_to_is_no_clip() {
    for (interval, pole, rows, step, size) in [
        (0.02, 20.0, 10, 3.0, 0.3),
        (0.02, 16.0, 10, 1.5, 0.1),
        (0.01, 12.0, 30, 3.0, 0.3),
        (0.01, 12.0, 30, 2.0, 0.15),
    ] {
        let (told, rates) = rotor(interval, pole, binary(rows));
        let values = on_grid(&noisy(&rates, size), step);
        let found = Unmeasured::of(&log(RATE, interval, &told, values), RATE).clipped;
        assert!(found.is_none(), "{pole}, {step}: {:?}", found.map(|it| (it.cells, it.at)));
        let sags = rates.iter().map(|rate| 12.6 - (rate / 700.0).powi(3));
        let sags = on_grid(&sags.collect::<Vec<_>>(), 0.01);
        let found = clipped::find(&sags, Some(&told));
        assert!(found.is_none(), "{pole}, a supply: {:?}", found.map(|it| (it.cells, it.at)));
    }
}

/// Levels reached to the last digit, coarse readings, a body that begins at rest: nothing is clipped.
#[test]
fn what_stands_at_an_end_rightly_is_no_clip() {
    let (told, rates) = rotor(0.1, 16.0, binary(40));
    let (slow, coarse) = rotor(0.02, 16.0, binary(25));
    let coarse = on_grid(&noisy(&coarse, 2.0), 5.0);
    let swing = |row: usize| 0.5 * (0.02 * (row.max(500) - 500) as f64).cos();
    let from_rest: Vec<f64> = (0..ROWS).map(swing).collect();
    // Each level just long enough for the last digit.
    let (late, settled) = rotor(0.02, 16.0, |row| if row / 125 % 2 == 0 { 0.55 } else { 0.4 });
    let cases = [
        (RATE, told, rates),
        (RATE, late, settled),
        (RATE, slow.clone(), coarse),
        ("body_angle_rad", slow, from_rest),
    ];
    for (name, told, values) in cases {
        let found = Unmeasured::of(&log(name, 0.02, &told, values), name).clipped;
        assert!(found.is_none(), "{name}: {:?}", found.map(|it| (it.cells, it.at)));
    }
}

/// A gyroscope that stops is not a body that rests.
#[test]
fn a_gyroscope_that_stands_still_is_missing_and_told() {
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    let noisy = noisy(&swing, 0.004);
    let name = "body_rate_rad_s";
    let is_held = |row: usize| (2000..2100).contains(&row);
    let stopped = |at: f64| (0..ROWS).map(|row| if is_held(row) { at } else { noisy[row] }).collect();
    let (told, _) = rotor(0.02, 16.0, binary(1));
    let gyro = log(name, 0.02, &told, stopped(0.123));
    let mut said = Vec::new();
    let left = measured(&gyro, &mut said).column(name).unwrap().to_vec();
    let missing: Vec<usize> = (0..ROWS).filter(|row| !left[*row].is_finite()).collect();
    assert_eq!(missing, (2001..2100).collect::<Vec<usize>>(), "its first one was measured: {said:?}");
    assert!(said.len() == 1 && said[0].contains("is frozen from 40.0 to 42.0 s at 0.123"), "{said:?}");
    // At rest; and where the angle says that it rests, with a bias.
    assert_eq!(Unmeasured::of(&log(name, 0.02, &told, stopped(0.0)), name).stuck, None);
    let mut rests = log(name, 0.02, &told, stopped(0.123));
    let angle = (0..ROWS).map(|row| if is_held(row) { 0.2 } else { (0.01 * row as f64).sin() }).collect();
    rests.insert("body_angle_rad", angle).unwrap();
    assert_eq!(Unmeasured::of(&rests, name).stuck, None);
    // Without an angle: held while nothing turns it, with a bias; or moved so gently that a coarse reading stands.
    let still = (0..ROWS).map(|row| if is_held(row) { 0.45 } else { told[row] }).collect::<Vec<f64>>();
    assert_eq!(Unmeasured::of(&log(name, 0.02, &still, stopped(0.123)), name).stuck, None);
    let gentle = (0..ROWS)
        .map(|row| if row % 60 < 20 { 0.02 } else { 0.3 * (0.3 * row as f64).sin() })
        .collect::<Vec<f64>>();
    let (told, _) = rotor(0.02, 16.0, binary(60));
    let gentle = on_grid(&gentle, 0.01);
    assert_eq!(Unmeasured::of(&log(name, 0.02, &told, gentle), name).stuck, None);
}
