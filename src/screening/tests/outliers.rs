//! Readings that no signal can have taken, and true peaks.

use crate::screening::tests::*;

fn outliers(log: &Dataset, name: &str) -> Vec<usize> {
    found(log, name, OUTLIERS).map_or(vec![], |judged| judged.rows)
}

/// One row in 200 at a place of its own, and what stands there instead of `values`.
fn hurt(values: &[f64], with: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<usize>) {
    let rows: Vec<usize> = (20..values.len() - 20).filter(|row| hash(row + 77) > 0.985).collect();
    let mut hurt = values.to_vec();
    rows.iter().for_each(|row| hurt[*row] = with(values[*row]));
    (hurt, rows)
}

#[test]
fn outliers_are_found_whatever_the_command_does() {
    type Wrong = fn(f64) -> f64;
    let wrong: [(&str, Wrong); 4] =
        [("5000", |_| 5000.0), ("half", |rate| 0.5 * rate), ("double", |rate| 2.0 * rate), ("zero", |_| 0.0)];
    let ramp = |row: usize| 0.3 + 0.3 * (row as f64 / ROWS as f64);
    for (case, (commands, rates)) in [
        ("binary", rotor(0.02, 16.0, binary(1))),
        ("slow binary", rotor(0.02, 16.0, binary(10))),
        ("levels", rotor(0.02, 16.0, levels(100))),
        ("ramp", rotor(0.02, 16.0, ramp)),
        ("one level", rotor(0.02, 16.0, |_| 0.45)),
    ] {
        for (name, with) in wrong {
            let (values, rows) = hurt(&noisy(&rates, 1.5), with);
            let log = log(RATE, 0.02, &commands, values);
            assert!(rows.len() > 20);
            // Zeros under a command are dropouts.
            let (left, found) = cleaned(&log, RATE);
            let taken: Vec<usize> = (0..ROWS).filter(|row| !left[*row].is_finite()).collect();
            assert_eq!(taken, rows, "{case}, {name}");
            let code = if name == "zero" { RATE_DROPOUT } else { OUTLIERS };
            assert!(found.iter().any(|it| it.code == code), "{case}, {name}: {found:?}");
        }
    }
}

#[test]
fn spikes_of_a_gyro_and_of_an_angle_are_found() {
    let swing: Vec<f64> = (0..ROWS).map(|row| 0.5 * (0.02 * row as f64).sin()).collect();
    let (commands, _) = rotor(0.01, 16.0, binary(1));
    for name in ["body_rate_rad_s", "body_angle_rad"] {
        for size in [3.0, -30.0] {
            let (values, rows) = hurt(&noisy(&swing, 0.004), |rate| rate + size);
            let log = log(name, 0.01, &commands, values);
            let (left, said) = cleaned(&log, name);
            let taken: Vec<usize> = (0..ROWS).filter(|row| !left[*row].is_finite()).collect();
            assert_eq!(taken, rows, "{name}, {size}: {said:?}");
            assert_eq!((said.len(), said[0].code, said[0].rows), (1, OUTLIERS, rows.len()), "{said:?}");
        }
    }
}

/// Just enough readings to look through once: what that found is kept.
#[test]
fn a_short_log_keeps_what_was_found() {
    let (commands, rates) = rotor(0.02, 16.0, binary(10));
    for rows in [56, 57, 80] {
        let mut values = noisy(&rates[..rows], 1.5);
        values[30] = 5000.0;
        assert_eq!(outliers(&log(RATE, 0.02, &commands[..rows], values), RATE), [30], "{rows} rows");
    }
}

#[test]
fn two_in_a_row_are_outliers_and_three_are_not() {
    let (commands, rates) = rotor(0.02, 16.0, binary(4));
    let with = |rows: &[usize], value: &dyn Fn(usize) -> f64| {
        let mut values = noisy(&rates, 1.5);
        rows.iter().for_each(|row| values[*row] = value(*row));
        outliers(&log(RATE, 0.02, &commands, values), RATE)
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
fn true_peaks_are_no_outliers() {
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
        assert_eq!(outliers(&log(body, 0.01, &still, values), body), [0; 0], "{case}");
    }
    // A gyro so slow that a hit is over from row to row.
    let slow = (0..ROWS).map(|row| noise(row) * 0.004 + if row % 500 == 250 { 3.0 } else { 0.0 }).collect();
    assert_eq!(outliers(&log(body, 0.5, &still, slow), body), [0; 0]);
    let pulses = |row: usize| if row % 400 == 100 { 0.7 } else { 0.45 };
    for (case, interval, pole, command) in [
        ("levels of one row each", 0.5, 16.0, &levels(1) as &dyn Fn(usize) -> f64),
        ("pulses of one row", 0.02, 16.0, &pulses),
        ("pulses of one row, a fast rotor", 0.05, 60.0, &pulses),
        ("fast rotor, levels", 0.05, 60.0, &levels(7)),
        ("steps", 0.02, 16.0, &levels(100)),
        ("binary", 0.02, 40.0, &binary(1)),
    ] {
        let (commands, rates) = rotor(interval, pole, command);
        for values in [noisy(&rates, 1.5), rates.clone(), on_grid(&rates, 5.0)] {
            assert_eq!(outliers(&log(RATE, interval, &commands, values), RATE), [0; 0], "{case}");
        }
    }
}

#[test]
fn too_many_for_glitches_are_left_in_and_found() {
    let (commands, rates) = rotor(0.02, 16.0, levels(100));
    let mut values = noisy(&rates, 1.5);
    (0..ROWS).filter(|row| hash(row + 3) > 0.76).for_each(|row| values[row] = 3000.0 + 100.0 * hash(row));
    let log = log(RATE, 0.02, &commands, values);
    let (left, said) = cleaned(&log, RATE);
    assert!(left.iter().all(|rate| rate.is_finite()), "{said:?}");
    assert!(said.len() == 1 && said[0].code == TOO_MANY_OUTLIERS, "{said:?}");
}

/// An outlier that a slow telemetry holds is one reading.
#[test]
fn outliers_that_are_held_are_both() {
    let (commands, rates) = rotor(0.01, 16.0, binary(5));
    let (values, rows) = hurt(&noisy(&rates, 1.5), |_| 5000.0);
    let fresh = |row: usize| row.is_multiple_of(2);
    let log = log(RATE, 0.01, &commands, held(&values, fresh));
    let (left, said) = cleaned(&log, RATE);
    let good = |row: &usize| fresh(*row) && !rows.contains(row);
    assert!((0..ROWS).all(|row| left[row].is_finite() == good(&row)) && said.len() == 2, "{said:?}");
}
