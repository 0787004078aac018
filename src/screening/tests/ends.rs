//! Readings at an end of a range, and sensors that stand still.

use crate::screening::tests::*;

/// What a sensor or its link cannot carry stands at an end of its range, whichever and however often.
#[test]
fn readings_at_the_end_of_a_range_are_missing_and_found() {
    let (commands, rates) = rotor(0.02, 16.0, levels(25));
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    for (name, size, values) in [(RATE, 1.5, &rates), ("body_rate_rad_s", 0.004, &swing)] {
        let values = noisy(values, size);
        let sorted = crate::estimation::quantile::sorted(values.iter().copied());
        for (low, high) in [(0.0, 0.9), (0.0, 0.98), (0.05, 1.0), (0.2, 0.8), (0.36, 0.64)] {
            let ends = [low, high].map(|share| sorted[(share * (ROWS - 1) as f64) as usize]);
            let saturated = values.iter().map(|value| value.clamp(ends[0], ends[1])).collect();
            let log = log(name, 0.02, &commands, saturated);
            let (left, said) = cleaned(&log, name);
            let is_cut =
                |row: usize| (low > 0.0 && values[row] <= ends[0]) || (high < 1.0 && values[row] >= ends[1]);
            for (row, left) in left.iter().enumerate() {
                // And what comes right before and behind.
                let beside = is_cut(row) || row > 0 && is_cut(row - 1) || row + 1 < ROWS && is_cut(row + 1);
                assert_eq!(left.is_finite(), !beside, "{name}, {low} to {high}: row {row}, {said:?}");
            }
            assert!(said.len() == 1 && said[0].code == SATURATED, "{said:?}");
        }
    }
}

/// Under two commands, most of the readings at either end; a coarse reading, too.
#[test]
fn both_ends_of_a_range_may_hold_most_of_the_readings() {
    let (commands, rates) = rotor(0.02, 16.0, binary(10));
    for step in [1e-3, 2.0] {
        let values = on_grid(&noisy(&rates, 1.5), step);
        let saturated: Vec<f64> = values.iter().map(|rate| rate.clamp(560.0, 680.0)).collect();
        let at_ends = saturated.iter().filter(|rate| **rate == 560.0 || **rate == 680.0).count();
        assert!(at_ends > ROWS * 65 / 100);
        let found =
            found(&log(RATE, 0.02, &commands, saturated), RATE, SATURATED).expect("it is saturated").finding;
        assert_eq!((found.rows, found.numbers("at")), (at_ends, &[560.0, 680.0][..]), "steps of {step}");
    }
}

/// Under two commands a quiet, coarse reading settles at the same two values again and again, as a supply's voltage under
/// load does the other way round.
#[test]
fn what_a_coarse_reading_settles_to_is_not_saturated() {
    for (interval, pole, rows, step, size) in [
        (0.02, 20.0, 10, 3.0, 0.3),
        (0.02, 16.0, 10, 1.5, 0.1),
        (0.01, 12.0, 30, 3.0, 0.3),
        (0.01, 12.0, 30, 2.0, 0.15),
    ] {
        let (commands, rates) = rotor(interval, pole, binary(rows));
        let values = on_grid(&noisy(&rates, size), step);
        let found = found(&log(RATE, interval, &commands, values), RATE, SATURATED);
        assert!(found.is_none(), "{pole}, {step}: {found:?}");
        let sags = rates.iter().map(|rate| 12.6 - (rate / 700.0).powi(3));
        let sags = on_grid(&sags.collect::<Vec<_>>(), 0.01);
        let found = saturated::find(&sags, Some(&commands));
        assert!(found.is_none(), "{pole}, a supply: {found:?}");
    }
}

/// Levels reached to the last digit, coarse readings, a body that begins at rest: nothing is saturated.
#[test]
fn what_stands_at_an_end_rightly_is_not_saturated() {
    let (commands, rates) = rotor(0.1, 16.0, binary(40));
    let (slow, coarse) = rotor(0.02, 16.0, binary(25));
    let coarse = on_grid(&noisy(&coarse, 2.0), 5.0);
    let swing = |row: usize| 0.5 * (0.02 * (row.max(500) - 500) as f64).cos();
    let from_rest: Vec<f64> = (0..ROWS).map(swing).collect();
    // Each level just long enough for the last digit.
    let (levels, steady) = rotor(0.02, 16.0, |row| if row / 125 % 2 == 0 { 0.55 } else { 0.4 });
    let cases = [
        (RATE, commands, rates),
        (RATE, levels, steady),
        (RATE, slow.clone(), coarse),
        ("body_angle_rad", slow, from_rest),
    ];
    for (name, commands, values) in cases {
        let found = found(&log(name, 0.02, &commands, values), name, SATURATED);
        assert!(found.is_none(), "{name}: {found:?}");
    }
}

/// A gyroscope that stops is not a body that rests.
#[test]
fn a_gyroscope_that_stands_still_is_missing_and_found() {
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    let noisy = noisy(&swing, 0.004);
    let name = "body_rate_rad_s";
    let is_held = |row: usize| (2000..2100).contains(&row);
    let stopped = |at: f64| (0..ROWS).map(|row| if is_held(row) { at } else { noisy[row] }).collect();
    let (commands, _) = rotor(0.02, 16.0, binary(1));
    let gyro = log(name, 0.02, &commands, stopped(0.123));
    let (left, said) = cleaned(&gyro, name);
    let missing: Vec<usize> = (0..ROWS).filter(|row| !left[*row].is_finite()).collect();
    assert_eq!(missing, (2001..2100).collect::<Vec<usize>>(), "its first one was measured: {said:?}");
    assert_eq!((said.len(), said[0].code, said[0].number("value")), (1, GYRO_FROZEN, 0.123), "{said:?}");
    assert!((said[0].number("from_s") - 40.0).abs() < 0.03 && (said[0].number("to_s") - 42.0).abs() < 0.03);
    // At rest; and where the angle says that it rests, with a bias.
    assert_eq!(found(&log(name, 0.02, &commands, stopped(0.0)), name, GYRO_FROZEN), None);
    let mut rests = log(name, 0.02, &commands, stopped(0.123));
    let angle = (0..ROWS).map(|row| if is_held(row) { 0.2 } else { (0.01 * row as f64).sin() }).collect();
    rests.insert("body_angle_rad", angle).unwrap();
    assert_eq!(found(&rests, name, GYRO_FROZEN), None);
    // Without an angle: held while nothing turns it, with a bias; or moved so gently that a coarse reading stands.
    let still = (0..ROWS).map(|row| if is_held(row) { 0.45 } else { commands[row] }).collect::<Vec<f64>>();
    assert_eq!(found(&log(name, 0.02, &still, stopped(0.123)), name, GYRO_FROZEN), None);
    let gentle = (0..ROWS)
        .map(|row| if row % 60 < 20 { 0.02 } else { 0.3 * (0.3 * row as f64).sin() })
        .collect::<Vec<f64>>();
    let (commands, _) = rotor(0.02, 16.0, binary(60));
    let gentle = on_grid(&gentle, 0.01);
    assert_eq!(found(&log(name, 0.02, &commands, gentle), name, GYRO_FROZEN), None);
}
