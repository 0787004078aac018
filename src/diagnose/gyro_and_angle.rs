//! Where the body's angle is measured beside its rate, their difference in time is measured, too, without a model of what turns it.

use nalgebra::{DMatrix, DVector};

use super::thresholds::THRESHOLDS;
use crate::estimation::integral::trapezoidal;
use crate::estimation::least_squares::{LinearFit, least_squares};
use crate::screening::ScreenedLog;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// By how much the gyro follows the slope of the measured angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BehindAngle {
    /// [s] its time constant.
    pub(crate) lag: f64,
    /// [s] standard error.
    pub(crate) error: f64,
    /// [s] between rows, the longest of the logs.
    pub(crate) interval: f64,
}

/// A gyro held against the angle, window by window.
struct Windows {
    /// Of each window: Δy [rad/s], ∫y [rad], Δt [s], Δθ [rad].
    rows: Vec<[f64; 4]>,
    /// Of kτ, k and b: see [`BehindAngle::of`].
    fit: LinearFit,
    /// [s] between rows, the longest of the logs.
    interval: f64,
}

impl Windows {
    /// `None` where no angle is logged, or too little of it.
    fn of(logs: &[ScreenedLog]) -> Option<Self> {
        let mut rows: Vec<[f64; 4]> = Vec::new();
        let mut interval: f64 = 0.0;
        for log in logs.iter().map(ScreenedLog::dataset) {
            let Some((rate, angle)) = log.column(BODY_RATE).zip(log.cells(BODY_ANGLE)) else { continue };
            let angle = angle.for_once();
            interval = interval.max(log.median_interval());
            let length = (THRESHOLDS.gyro_window_s / log.median_interval()).round().max(1.0) as usize;
            for segment in log.segments() {
                let (time, rate, angle) =
                    (&log.time()[segment.clone()], &rate[segment.clone()], &angle[segment]);
                let turned =
                    |from: usize| trapezoidal(&time[from..=from + length], &rate[from..=from + length]);
                let windows = (0..time.len().saturating_sub(length)).step_by(length);
                rows.extend(windows.filter_map(|from| {
                    let to = from + length;
                    let row = [
                        rate[to] - rate[from],
                        turned(from).last().copied()?,
                        time[to] - time[from],
                        angle[to] - angle[from],
                    ];
                    row.iter().all(|value| value.is_finite()).then_some(row)
                }));
            }
        }
        if rows.len() < THRESHOLDS.fewest_gyro_windows {
            return None;
        }
        let design = DMatrix::from_fn(rows.len(), 3, |row, column| rows[row][column]);
        let fit = least_squares(&design, &DVector::from_fn(rows.len(), |row, _| rows[row][3]))?;
        Some(Self { rows, fit, interval })
    }
}

impl BehindAngle {
    /// A gyro y with a scale k, a bias and a lag τ obeys k τ y' + k y + b = θ', so over a window k τ Δy + k ∫y + b Δt = Δθ: linear in
    /// all three. `None` where no angle is logged, or too little of it.
    pub(crate) fn of(logs: &[ScreenedLog]) -> Option<Self> {
        let Windows { fit, interval, .. } = Windows::of(logs)?;
        let scale = fit.coefficients[1];
        let (lag, error) = (fit.coefficients[0] / scale, fit.standard_error(0) / scale.abs());
        (lag.is_finite() && error.is_finite() && scale > 0.0).then_some(Self { lag, error, interval })
    }

    /// Whether it is less than what a law of the gyro could be seen by.
    pub(crate) fn is_none(self) -> bool {
        self.lag + THRESHOLDS.behind_angle_errors * self.error < THRESHOLDS.behind_angle_rows * self.interval
    }
}

/// How far a gyro's bias wanders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BiasDrift {
    /// [rad/s] the least bias of a part of the log.
    pub(crate) least: f64,
    /// [rad/s] the most.
    pub(crate) most: f64,
}

impl BiasDrift {
    /// Of one log: after it has been off, a gyro may have another bias. `None` where the angle shows no drift that matters beside the mean.
    /// A slow drift makes the biases of neighbouring parts similar, which distinguishes it from noise of any size: the ratio of von Neumann
    /// (1941), 2 for parts without order.
    pub(crate) fn of(log: &ScreenedLog) -> Option<Self> {
        let Windows { rows, fit, .. } = Windows::of(std::slice::from_ref(log))?;
        let scale = fit.coefficients[1];
        let part = |rows: &[[f64; 4]]| {
            let left = |row: &[f64; 4]| fit.coefficients[0] * row[0] + scale * row[1] - row[3];
            rows.iter().map(left).sum::<f64>() / rows.iter().map(|row| scale * row[2]).sum::<f64>()
        };
        let parts = THRESHOLDS.drift_parts;
        let begin = |at: usize| at * rows.len() / parts;
        let biases: Vec<f64> = (0..parts).map(|at| part(&rows[begin(at)..begin(at + 1)])).collect();
        let count = biases.len() as f64;
        let mean = biases.iter().sum::<f64>() / count;
        let squares: f64 = biases.iter().map(|bias| (bias - mean).powi(2)).sum();
        let steps: f64 = biases.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
        let is_drift = steps < THRESHOLDS.drift_ratio * squares;
        let size = (squares / count).sqrt();
        let matters = size > THRESHOLDS.drift_of_bias * mean.abs() && size > THRESHOLDS.least_drift_rad_s;
        let (least, most) = biases
            .iter()
            .fold((f64::MAX, f64::MIN), |(least, most), bias| (least.min(*bias), most.max(*bias)));
        // Of a body that stands still the slope of the angle is no measure of the gyro's scale.
        (scale > THRESHOLDS.least_gyro_scale && is_drift && matters).then_some(Self { least, most })
    }
}

#[cfg(test)]
mod tests {
    use super::super::block_builder::refusal;
    use super::*;
    use crate::log::Dataset;
    use crate::model::Model;

    /// A body that swings, its gyro with a scale, a bias, noise and a lag [s], and whether its angle is logged.
    fn log(lag: f64, has_angle: bool) -> ScreenedLog {
        with_bias(|_| 0.02, lag, has_angle)
    }

    fn with_bias(bias: impl Fn(f64) -> f64, lag: f64, has_angle: bool) -> ScreenedLog {
        let noise = |row: usize| ((row.wrapping_mul(2_654_435_761) >> 9) & 1023) as f64 / 512.0 - 1.0;
        let time: Vec<f64> = (0..6000).map(|row| 0.01 * f64::from(row)).collect();
        // The lag of a sum of sines is known for each.
        let sines = [(0.4, 1.7), (0.2, 4.1), (0.05, 9.0)];
        let angle = |t: f64| sines.iter().map(|(size, w)| size * (w * t).sin()).sum::<f64>();
        let gyro = |t: f64| -> f64 {
            let one = |(size, w): &(f64, f64)| {
                let (way, turn) = (1.0 / (1.0 + (w * lag).powi(2)).sqrt(), (w * lag).atan());
                size * w * way * (w * t - turn).cos()
            };
            bias(t) + 1.05 * sines.iter().map(one).sum::<f64>()
        };
        let rates = time.iter().enumerate().map(|(row, t)| gyro(*t) + 0.005 * noise(row)).collect();
        let angles = time.iter().enumerate().map(|(row, t)| angle(*t) + 0.001 * noise(row + 7919)).collect();
        let mut log = Dataset::made(time, [(BODY_RATE, rates)]);
        if has_angle {
            log.insert(BODY_ANGLE, angles).expect("fits");
        }
        log.into()
    }

    #[test]
    fn the_lag_of_a_gyro_is_read_off_the_angle_beside_it() {
        for lag in [0.0, 0.01, 0.05] {
            let found = BehindAngle::of(&[log(lag, true)]).expect("measured");
            // Half a millisecond for the trapezes that stand in for the integral.
            assert!((found.lag - lag).abs() < 3.0 * found.error + 5e-4, "{lag}: {found:?}");
            assert_eq!(found.is_none(), lag == 0.0, "{lag}: {found:?}");
        }
        assert_eq!(BehindAngle::of(&[log(0.0, false)]), None);
    }

    #[test]
    fn a_law_of_the_gyro_in_time_is_not_tried_where_the_angle_shows_none() {
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let is_tried = |id: &str, log: &ScreenedLog| {
            let effect = known.iter().find(|effect| effect.id == id).expect("known");
            refusal(effect, &model, std::slice::from_ref(log)).is_none()
        };
        assert!(!is_tried("gyro_lag", &log(0.0, true)));
        assert!(is_tried("gyro_lag", &log(0.05, true)) && is_tried("gyro_lag", &log(0.0, false)));
        assert!(is_tried("gyro_bias", &log(0.0, true)), "no law in time");
    }

    #[test]
    fn a_bias_that_drifts_is_distinguished_from_one_that_is_there() {
        let drift = |mean: f64, size: f64| {
            let log = with_bias(move |t| mean + size * (t / 15.0).sin(), 0.0, true);
            BiasDrift::of(&log)
        };
        assert_eq!([drift(0.0, 0.0), drift(0.0005, 0.0), drift(0.05, 0.0)], [None; 3], "noise");
        let found = drift(0.003, 0.004).expect("more than half of its mean");
        // A part is 3 s long, and the last one the least.
        let least = 0.003 + 0.004 * 3.9_f64.sin();
        assert!((found.least - least).abs() < 5e-4 && (found.most - 0.007).abs() < 5e-4, "{found:?}");
        assert_eq!(drift(0.05, 0.004), None, "a tenth of it: a bias all the same");
        assert_eq!(BiasDrift::of(&with_bias(|t| 0.004 * (t / 15.0).sin(), 0.0, false)), None, "no angle");
    }

    #[test]
    fn a_bias_that_drifts_is_not_named() {
        let model = Model::paper();
        let effect = model.effect("gyro_bias").expect("known");
        let why = |size: f64| {
            let log = with_bias(move |t| 0.001 + size * (t / 15.0).sin(), 0.0, true);
            refusal(&effect, &model, std::slice::from_ref(&log)).map(|refusal| refusal.to_string())
        };
        assert_eq!(why(0.0), None);
        let two = [0.01, 0.03].map(|bias| with_bias(move |_| bias, 0.0, true));
        assert_eq!(refusal(&effect, &model, &two), None, "each log has one of its own");
        let said = why(0.004).expect("refused");
        let begin = "the gyro's bias drifts: beside the slope of the measured angle it is between -0.0";
        assert!(said.starts_with(begin) && said.ends_with(" rad/s"), "{said}");
    }
}
