//! Which way the torque turns the body, seen beside what else may: without a simulation, which an unmodelled weight runs away with.

use nalgebra::{DMatrix, DVector};

use super::block_data::Runs;
use super::data_split::DataSplit;
use super::thresholds::THRESHOLDS;
use crate::estimation::integral::{integral_of_held, trapezoidal};
use crate::estimation::least_squares::least_squares;

/// Whether the torque turns the body its own way. Over a window J Δω = ∫τ - k ∫θ - d Δθ + b Δt holds with a weight, a spring, a
/// friction and a bias, whatever they are: linear in 1/J and the rest. Without an angle nobody can tell.
pub(crate) fn turns_the_body(split: &DataSplit) -> bool {
    let Runs::Body(runs) = &split.train.runs else { return false };
    let mut rows: Vec<[f64; 5]> = Vec::new();
    for run in runs.iter().filter(|run| !run.angle.is_empty()) {
        let time = &run.input.time;
        let turned = integral_of_held(time, &run.input.torque);
        let path = run.path();
        let angles = trapezoidal(time, &path.angle);
        let over = |values: &[f64], from: usize, to: usize| values[to] - values[from];
        rows.extend(run.windows.iter().filter(|window| window.len() > 1).map(|window| {
            let (from, to) = (window.start, window.end - 1);
            [
                over(&turned, from, to),
                over(&angles, from, to),
                over(&path.angle, from, to),
                time[to] - time[from],
                over(&path.rate, from, to),
            ]
        }));
    }
    rows.retain(|row| row.iter().all(|value| value.is_finite()));
    if rows.len() < THRESHOLDS.fewest_gyro_windows {
        return false;
    }
    let design = DMatrix::from_fn(rows.len(), 4, |row, column| rows[row][column]);
    let rates = DVector::from_fn(rows.len(), |row, _| rows[row][4]);
    least_squares(&design, &rates)
        .is_some_and(|fit| fit.coefficients[0] > THRESHOLDS.behind_angle_errors * fit.standard_error(0))
}

#[cfg(test)]
mod tests {
    use super::super::tests::weighed_down;
    use super::*;

    #[test]
    fn a_torque_is_seen_beside_a_weight_that_nobody_modelled() {
        assert!(turns_the_body(&weighed_down(1.0, true)));
        assert!(!turns_the_body(&weighed_down(-1.0, true)), "the other way round");
        assert!(!turns_the_body(&weighed_down(1.0, false)), "without an angle nobody can tell");
    }
}
