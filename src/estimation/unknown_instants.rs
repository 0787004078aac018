//! What it costs a fitted lag that nobody knows exactly when its input stepped.

use nalgebra::{DMatrix, DVector};

use super::inversion::invert;
use super::lag_products::{FORGOTTEN, Record, run};
use super::thresholds::THRESHOLDS;
use super::variable_projection::LagFit;

/// A step of the input, and what moving it does to the output.
struct Moved {
    /// [s]
    at: f64,
    /// [unit of the output] at the step, by one standard deviation.
    by: f64,
    /// Its products with the columns, and with itself.
    with: DVector<f64>,
    square: f64,
}

/// Widens the standard errors of a fit whose input steps at instants that were found by the same output: before, each was known to
/// `deviation` [s]. These instants stand beside the parameters as nuisances, each with that prior, and are taken out; the values
/// are those at which the instants are, too. Where the record steps it has an unscored row.
pub(crate) fn widen<const M: usize>(fit: &mut LagFit, record: &Record<M>, deviation: f64) {
    let noise = fit.residual_rms.powi(2);
    let (mut normal, mut lost) = (DMatrix::zeros(M + 1, M + 1), DMatrix::zeros(M + 1, M + 1));
    let mut take = |moved: Option<Moved>| {
        if let Some(moved) = moved.filter(|moved| moved.square > 0.0) {
            lost += &moved.with * moved.with.transpose() / (moved.square + noise);
        }
    };
    for (segment, start) in record.segments.iter().zip(&fit.initial) {
        let start = if start.is_finite() { *start } else { 0.0 };
        let (mut own, mut along, mut ee) = (DMatrix::zeros(M + 1, M + 1), DVector::zeros(M + 1), 0.0);
        let mut open: Option<Moved> = None;
        run(record, segment, fit.pole, |row, lagged, slopes, e, g| {
            let (time, is_scored) = (record.time[row], record.output[row].is_finite());
            if row > segment.start && !is_scored {
                let jumps = record.inputs[row].iter().zip(&record.inputs[row - 1]).zip(&fit.coefficients);
                let by = fit.pole * deviation * jumps.map(|((to, from), c)| c * (to - from)).sum::<f64>();
                if by.abs() > THRESHOLDS.felt_step * fit.residual_rms {
                    take(open.replace(Moved { at: time, by, with: DVector::zeros(M + 1), square: 0.0 }));
                }
            }
            if !is_scored {
                return;
            }
            let slope = slopes.iter().zip(&fit.coefficients).map(|(s, c)| s * c).sum::<f64>() + start * g;
            let column = DVector::from_fn(M + 1, |index, _| lagged.get(index).copied().unwrap_or(slope));
            if let Some(moved) = &mut open {
                let shift = moved.by * (-fit.pole * (time - moved.at)).exp();
                moved.with += &column * shift;
                moved.square += shift * shift;
            }
            own += &column * column.transpose();
            along += &column * e;
            ee += e * e;
        });
        take(open);
        normal += own;
        if ee > FORGOTTEN {
            normal -= &along * along.transpose() / ee;
        }
    }
    if let Some((known, left)) = invert(&normal).zip(invert(&(&normal - &lost))) {
        scale::<M>(fit, &known, &left);
    }
}

/// Errors by as much larger as the information that is left knows less.
fn scale<const M: usize>(fit: &mut LagFit, known: &DMatrix<f64>, left: &DMatrix<f64>) {
    let factor =
        DVector::from_fn(M + 1, |index, _| (left[(index, index)] / known[(index, index)]).max(1.0).sqrt());
    for covariance in [&mut fit.covariance, &mut fit.per_noise] {
        for row in 0..M + 1 {
            for column in 0..M + 1 {
                covariance[(row, column)] *= factor[row] * factor[column];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimation::variable_projection;

    /// Steps of a lag with a pole of 10 rad/s, an unscored row at each; noise of 1.
    fn record() -> Record<1> {
        let mut record = Record { time: vec![], output: vec![], inputs: vec![], segments: vec![] };
        let (mut now, mut input, mut time) = (500.0, 500.0, 0.0);
        let mut go = |record: &mut Record<1>, now: &mut f64, input: f64, span: f64, output: Option<f64>| {
            record.time.push(time);
            record.inputs.push([input]);
            record.output.push(output.map_or(f64::NAN, |noise| *now + noise));
            *now = input + (*now - input) * (-10.0_f64 * span).exp();
            time += span;
        };
        for row in 0..3_000 {
            let noise = 1.7 * ((f64::from(row) * 12.9898).sin() * 43_758.547).fract();
            if row % 50 == 20 {
                go(&mut record, &mut now, input, 0.007, Some(noise));
                input = if input > 550.0 { 500.0 } else { 600.0 };
                go(&mut record, &mut now, input, 0.013, None);
            } else {
                go(&mut record, &mut now, input, 0.02, Some(noise));
            }
        }
        record.segments.push(0..record.time.len());
        record
    }

    /// An instant and a pole are correlated by 1/√2 in a lag that one sees go all its way: unknown instants take half of the information.
    #[test]
    fn unknown_instants_widen_the_error_of_a_pole() {
        let (record, widened) = (record(), |deviation: f64| {
            let record = record();
            let mut fit = variable_projection::fit(&record).expect("determined");
            let before = fit.pole_error();
            widen(&mut fit, &record, deviation);
            fit.pole_error() / before
        });
        assert!(variable_projection::fit(&record).is_some_and(|fit| (fit.pole - 10.0).abs() < 0.1));
        // Rows of a fifth of a time constant are not the limit, nor is a level that is fitted, too.
        let unknown = widened(0.02 / 12.0_f64.sqrt());
        assert!((1.25..1.55).contains(&unknown), "{unknown}");
        assert!((widened(1e-6) - 1.0).abs() < 1e-3, "known instants cost nothing");
        let half = widened(0.002);
        assert!(half > 1.02 && half < unknown, "{half}");
    }
}
