//! A second-order lag with two real poles, by the sums of products that its outputs have with what was measured.

use nalgebra::DMatrix;

use super::inversion::invert;
use super::lag_products::{ProductColumns, Record};

/// Columns of the problem: at most five outputs, two initial states, the measurement.
const WIDEST: usize = 8;

/// Sum of squared errors of a record with these two poles [rad/s], all that enters linearly fitted:
/// `pq/((s+p)(s+q)) = (q H_p - p H_q)/(q - p)` with H first-order lags, so that the held input is solved exactly.
pub(crate) fn two_pole_cost<const M: usize>(record: &Record<M>, slow: f64, fast: f64) -> f64 {
    let mut normal = DMatrix::<f64>::zeros(M + 1, M + 1);
    let mut block = ProductColumns::<WIDEST>::EMPTY;
    for segment in &record.segments {
        let mut gram = products(record, segment.clone(), (slow, fast), &mut block);
        eliminate(&mut gram, M);
        eliminate(&mut gram, M + 1);
        let kept = |index: usize| if index < M { index } else { M + 2 };
        normal += DMatrix::from_fn(M + 1, M + 1, |i, j| gram[(kept(i), kept(j))]);
    }
    let Some(inverse) = invert(&normal.view((0, 0), (M, M)).into_owned()) else { return f64::INFINITY };
    let right = normal.view((0, M), (M, 1)).into_owned();
    normal[(M, M)] - (right.transpose() * inverse * &right)[(0, 0)]
}

/// Products over one stretch of: the M outputs, the responses to both initial states, the measurement.
fn products<const M: usize>(
    record: &Record<M>,
    segment: std::ops::Range<usize>,
    (slow, fast): (f64, f64),
    block: &mut ProductColumns<WIDEST>,
) -> DMatrix<f64> {
    let columns = M + 3;
    let mut gram = [[0.0; WIDEST]; WIDEST];
    let (mut a, mut b) = ([0.0; M], [0.0; M]);
    let mut states = [1.0, 1.0];
    let mut values = [0.0; WIDEST];
    let (mut interval, mut decays) = (f64::NAN, (1.0, 1.0));
    for row in segment.clone() {
        if record.output[row].is_finite() {
            for j in 0..M {
                values[j] = (fast * a[j] - slow * b[j]) / (fast - slow);
            }
            values[M] = states[0];
            values[M + 1] = states[1];
            values[M + 2] = record.output[row];
            block.push(&values);
            if block.is_full() {
                block.take(columns, &mut gram);
            }
        }
        if row + 1 < segment.end {
            let span = record.time[row + 1] - record.time[row];
            if (span - interval).abs() > 1e-9 * span || interval.is_nan() {
                interval = span;
                decays = ((-slow * span).exp(), (-fast * span).exp());
            }
            let (slow_decay, fast_decay) = decays;
            for j in 0..M {
                let input = record.inputs[row][j];
                a[j] = slow_decay * (a[j] - input) + input;
                b[j] = fast_decay * (b[j] - input) + input;
            }
            states = [states[0] * slow_decay, states[1] * fast_decay];
        }
    }
    block.take(columns, &mut gram);
    DMatrix::from_fn(columns, columns, |i, j| gram[i.max(j)][i.min(j)])
}

/// Projects column `index` out of a Gram matrix.
fn eliminate(gram: &mut DMatrix<f64>, index: usize) {
    let pivot = gram[(index, index)];
    if pivot > 1e-12 {
        let column = gram.column(index).into_owned();
        gram.ger(-1.0 / pivot, &column, &column, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two poles in steps of a thousandth of the sampling, by Euler, in two stretches that start anywhere.
    #[test]
    fn two_poles_explain_what_two_poles_made_and_others_do_not() {
        let (slow, fast, gain) = (3.0, 20.0, 2.5);
        let mut record =
            Record { time: vec![], output: vec![], inputs: vec![], segments: vec![0..150, 150..400] };
        let (mut first, mut second) = (1.0, 4.0);
        for row in 0..400 {
            if row == 150 {
                (first, second) = (-7.0, 2.0);
            }
            let input = f64::from(row / 7 % 3) - 1.0;
            record.time.push(0.02 * f64::from(row));
            record.output.push(if row % 10 == 3 { f64::NAN } else { second });
            record.inputs.push([input]);
            for _ in 0..1000 {
                first += 2e-5 * slow * (gain * input - first);
                second += 2e-5 * fast * (first - second);
            }
        }
        let power: f64 = record.output.iter().filter(|it| it.is_finite()).map(|it| it * it).sum();
        // Euler's steps are off by a part in some thousand, whose square is left.
        assert!(two_pole_cost(&record, slow, fast) < 1e-5 * power);
        for (slow, fast) in [(2.0, 20.0), (3.0, 10.0), (3.0, 200.0)] {
            assert!(two_pole_cost(&record, slow, fast) > 1e-4 * power, "{slow}, {fast}");
        }
    }
}
