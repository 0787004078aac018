//! Running integrals over time, and straight lines where values are missing.

use super::finite::finite_rows;

/// The running integral of a signal that is held from its sample until the next one; one that is missing counts as nothing.
pub(crate) fn integral_of_held(time: &[f64], values: &[f64]) -> Vec<f64> {
    running(time, |row, step| if values[row].is_finite() { values[row] * step } else { 0.0 })
}

/// The running integral by the trapezoidal rule.
pub(crate) fn trapezoidal(time: &[f64], values: &[f64]) -> Vec<f64> {
    running(time, |row, step| 0.5 * step * (values[row] + values[row + 1]))
}

/// The running sum of what each interval adds: of its first row and its length.
pub(crate) fn running(time: &[f64], added: impl Fn(usize, f64) -> f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut running = vec![0.0; time.len()];
    for (row, step) in time.windows(2).enumerate() {
        sum += added(row, step[1] - step[0]);
        running[row + 1] = sum;
    }
    running
}

/// Straight lines between values that are there; before the first and behind the last, that one. Of none, not-a-number.
pub(crate) fn interpolated(time: &[f64], values: &[f64]) -> Vec<f64> {
    let known: Vec<usize> = finite_rows(values, 0..values.len());
    let mut next = 0;
    (0..values.len())
        .map(|row| {
            while next < known.len() && known[next] < row {
                next += 1;
            }
            match (next.checked_sub(1).and_then(|at| known.get(at)), known.get(next)) {
                (Some(&before), Some(&after)) => {
                    let share = (time[row] - time[before]) / (time[after] - time[before]);
                    values[before] + share * (values[after] - values[before])
                }
                (None, Some(&only)) | (Some(&only), None) => values[only],
                (None, None) => f64::NAN,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: [f64; 4] = [0.0, 1.0, 3.0, 4.0];

    #[test]
    fn integrals_run_over_uneven_time() {
        assert_eq!(integral_of_held(&TIME, &[2.0, f64::NAN, 1.0, 9.0]), [0.0, 2.0, 2.0, 3.0]);
        assert_eq!(trapezoidal(&TIME, &[2.0, 4.0, 0.0, 1.0]), [0.0, 3.0, 7.0, 7.5]);
    }

    #[test]
    fn what_is_missing_lies_on_a_line() {
        let none = f64::NAN;
        assert_eq!(interpolated(&TIME, &[none, 1.0, none, 4.0]), [1.0, 1.0, 3.0, 4.0]);
        assert_eq!(interpolated(&TIME, &[5.0, none, none, none]), [5.0; 4]);
        assert!(interpolated(&TIME, &[none; 4]).iter().all(|value| value.is_nan()));
    }
}
