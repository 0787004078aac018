//! A body's rate that no gyro measured: a difference of the angle beside it, filtered or late (or an angle that was summed up from the
//! rate). Then one sensor says both, and nothing of a gyro can be told from them.
//!
//! From the two columns alone: a gyro knows nothing of the noise and the steps of an encoder. Where these are what is new in the angle
//! from row to row, and all but a little of what is new in the rate follows from them, the one was made from the other. (Or a controller
//! made a torque of them, and the gyro saw what came of it. Then the rate is ahead of the slope that follows from it.)
//!
//! Held against a model is then the angle's own slope at each row, which no filter makes late.

use crate::estimation::dependent_columns::DesignRows;
use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::body::CheckedBody;
use crate::screening::channel::Judgement;
use crate::screening::thresholds::THRESHOLDS;
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// The code: a rate that is a difference of the angle.
pub const RATE_OF_ANGLE: &str = "rate_is_angle_difference";

/// Angles from four rows before to the next.
const ANGLES: usize = THRESHOLDS.angles;
/// Where among them the row itself is.
const HERE: usize = THRESHOLDS.angle_before;

/// Says it; no row is left out.
pub(crate) fn check(body: &CheckedBody) -> Option<Judgement> {
    let angle = body.log.column(BODY_ANGLE)?;
    let rows = rows(body, angle);
    if rows.len() < THRESHOLDS.new_fewest || memory_of_noise(angle, &rows) > THRESHOLDS.angle_noise {
        return None;
    }
    let time = body.log.time();
    let nominal = body.log.median_interval();
    let without = left(body.rate, &rows, &|_, _| 0.0, 0)?.0;
    let difference = |of_clock: bool| {
        move |row: usize, at: usize| {
            let (from, to) = (row + at - HERE, row + at + 1 - HERE);
            (angle[to] - angle[from]) / if of_clock { time[to] - time[from] } else { nominal }
        }
    };
    // Whoever took the difference may have reckoned with the clock, or with a steady pace.
    let fits = [true, false].map(|of_clock| left(body.rate, &rows, &difference(of_clock), ANGLES - 1));
    let (with, lag) = fits.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let finding = Finding::new(RATE_OF_ANGLE, BODY_RATE).of(body.log.source_name());
    let finding = finding.with("left_share", with / without).with("lag_ms", 1e3 * lag * nominal);
    // Nothing that was made from an angle is ahead of it; a sum of rates is by half a row.
    let is_made = with < THRESHOLDS.angle_explains * without && lag > -1.0;
    is_made.then(|| Judgement::new(finding, Vec::new()))
}

/// [rad/s] The slope of the angle from the row before to the row behind, where a rate was read: the same without filter and delay, with
/// more of the angle's noise. `None` without both columns.
pub(crate) fn slopes(log: &Dataset) -> Option<Vec<f64>> {
    let (angle, rate, time) = (log.column(BODY_ANGLE)?, log.column(BODY_RATE)?, log.time());
    let mut slopes = vec![f64::NAN; log.len()];
    for segment in log.segments() {
        let inside = segment.start + 1..segment.end.saturating_sub(1);
        for row in inside.filter(|row| rate[*row].is_finite()) {
            slopes[row] = (angle[row + 1] - angle[row - 1]) / (time[row + 1] - time[row - 1]);
        }
    }
    Some(slopes)
}

/// Puts these rates, where there are some, in the place of the log's.
pub(crate) fn put(rates: Option<Vec<f64>>, raw: &Dataset, cleaned: &mut Option<Dataset>) {
    if let Some(rates) = rates {
        // As long as the column they replace.
        let _ = cleaned.get_or_insert_with(|| raw.clone()).replace(BODY_RATE, rates);
    }
}

/// Rows whose neighbours are there and no hole lies between, of a long log some.
fn rows(body: &CheckedBody, angle: &[f64]) -> Vec<usize> {
    let is_whole = |row: &usize| {
        angle[row - HERE..row - HERE + ANGLES]
            .iter()
            .chain(&body.rate[row - 2..=*row])
            .all(|it| it.is_finite())
    };
    let all = |rows: std::ops::Range<usize>| rows.start + HERE..rows.end.saturating_sub(1);
    let rows: Vec<usize> = body.log.segments().into_iter().flat_map(all).filter(is_whole).collect();
    let share = rows.len().div_ceil(THRESHOLDS.new_most).max(1);
    rows.into_iter().step_by(share).collect()
}

/// Correlation of neighbours among the third differences of the angle: -3/4 of noise, -2/3 of steps, more of motion.
fn memory_of_noise(angle: &[f64], rows: &[usize]) -> f64 {
    let third = |row: usize| angle[row] - 3.0 * angle[row - 1] + 3.0 * angle[row - 2] - angle[row - 3];
    let products: f64 = rows.iter().map(|row| third(*row) * third(row - 1)).sum();
    let squares: f64 = rows.iter().map(|row| third(*row).powi(2)).sum();
    if squares > 0.0 { products / squares } else { 0.0 }
}

/// Rms of what two earlier rates and `count` of these leave of the rate, and by how many rows the rate then is behind the angle.
fn left(rate: &[f64], rows: &[usize], of: &dyn Fn(usize, usize) -> f64, count: usize) -> Option<(f64, f64)> {
    let mut design = DesignRows::new(3 + count, rows.len());
    let mut values = vec![1.0; 3 + count];
    for row in rows {
        (values[1], values[2]) = (rate[row - 1], rate[row - 2]);
        values[3..].iter_mut().enumerate().for_each(|(at, value)| *value = of(*row, at));
        design.push(&values);
    }
    let read: Vec<f64> = rows.iter().map(|row| rate[*row]).collect();
    let fit = design.coefficients(&read, &(0..rows.len()).collect::<Vec<_>>())?;
    let of_angle = &fit[3..];
    // The last of them ends a row later, and a difference is the slope half a row before its end.
    let age = |at: usize| (HERE - at) as f64 - 0.5;
    let (sum, aged) =
        of_angle.iter().enumerate().fold((0.0, 0.0), |(sum, aged), (at, it)| (sum + it, aged + it * age(at)));
    let (first, second) = (fit[1], fit[2]);
    let left: f64 = read.iter().enumerate().map(|(at, read)| (read - design.value(at, &fit)).powi(2)).sum();
    Some(((left / rows.len() as f64).sqrt(), aged / sum + (first + 2.0 * second) / (1.0 - first - second)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::noise_of as noise;
    use crate::signal::columns::TORQUE_COMMAND;

    /// 30 s at 100 Hz of a pendulum under levels of torque, its angle in `step`s or with as much noise; the rate is that of a gyro with
    /// noise of `gyro`, or the angle's difference behind a low-pass of this many rows and so many rows late.
    fn found(step: f64, gyro: Option<f64>, (filter, late): (f64, usize)) -> Option<f64> {
        let torque = |row: usize| 0.2 * noise(row / 7, 1);
        let (mut angle, mut rate, mut filtered) = (0.0_f64, 0.0_f64, 0.0);
        let mut moved = Vec::new();
        let (mut angles, mut gyros, mut differences) = (Vec::new(), Vec::new(), vec![0.0; late + 1]);
        for row in 0..3000 {
            let read = if step < 0.0 { angle + step * noise(row, 2) } else { (angle / step).round() * step };
            let before = angles.last().copied().unwrap_or(read);
            filtered += ((read - before) / 0.01 - filtered) / (1.0 + filter);
            differences.push(filtered);
            angles.push(read);
            moved.push(rate);
            gyros.push(rate + gyro.unwrap_or(0.0) * noise(row, 3));
            for _ in 0..20 {
                rate += 5e-4 * (torque(row) - 0.4 * angle.sin() - 0.01 * rate) / 0.02;
                angle += 5e-4 * rate;
            }
        }
        let rates = if gyro.is_some() { gyros } else { differences[1..=3000].to_vec() };
        let time = (0..3000).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        let torques = (0..3000).map(torque).collect();
        for (name, column) in [(TORQUE_COMMAND, torques), (BODY_RATE, rates), (BODY_ANGLE, angles)] {
            log.insert(name, column).expect("fits");
        }
        let log = ScreenedLog::of(&log);
        let rates = [log.dataset(), log.raw()].map(|log| log.column(BODY_RATE).expect("there").to_vec());
        // What is held against a model moves with the body, and not behind it.
        let apart = |rates: &[f64]| (10..2990).map(|row| (rates[row] - moved[row]).powi(2)).sum::<f64>();
        let is_replaced = log.body().expect("a body").has(RATE_OF_ANGLE);
        assert_eq!(rates[0] != rates[1], is_replaced);
        assert!(!is_replaced || filter < 3.0 || apart(&rates[0]) < 0.2 * apart(&rates[1]));
        log.findings().find(|it| it.code == RATE_OF_ANGLE).map(|it| it.number("lag_ms"))
    }

    #[test]
    fn a_difference_of_the_angle_is_found_with_its_lag() {
        for step in [1.5e-3, -1e-3] {
            for (filter, late, lag) in [(0.0, 0, 5.0), (4.0, 0, 45.0), (2.0, 2, 45.0)] {
                let found = found(step, None, (filter, late));
                assert!(
                    found.is_some_and(|it| (it - lag).abs() < 0.3 * lag),
                    "{step} {filter} {late}: {found:?}"
                );
            }
        }
    }

    /// 40 s at 100 Hz of a body that a controller holds by its encoder, which is noisier than its gyro.
    #[test]
    fn a_gyro_that_sees_what_a_controller_made_of_the_encoder_is_one() {
        for (stiffness, damping) in [(20.0, 4.0), (60.0, 3.0)] {
            let (mut angle, mut rate) = (0.0_f64, 0.0_f64);
            let mut columns: [Vec<f64>; 3] = Default::default();
            for row in 0..4000 {
                let read = angle + 8e-3 * noise(row, 2);
                let gyro = rate + 2e-3 * noise(row, 3);
                let torque = stiffness * (0.2 * (0.013 * row as f64).sin() - read) - damping * gyro;
                for (column, value) in columns.iter_mut().zip([torque, gyro, read]) {
                    column.push(value);
                }
                for _ in 0..20 {
                    rate += 5e-4 * (torque - 0.4 * angle.sin() - 0.05 * rate) / 0.03;
                    angle += 5e-4 * rate;
                }
            }
            let time = (0..4000).map(|row| 0.01 * f64::from(row)).collect();
            let [torques, gyros, angles] = columns;
            let columns = [(TORQUE_COMMAND, torques), (BODY_RATE, gyros), (BODY_ANGLE, angles)];
            let log = Dataset::made(time, columns);
            let log = ScreenedLog::of(&log);
            assert!(log.findings().all(|it| it.code != RATE_OF_ANGLE), "{stiffness}");
        }
    }

    #[test]
    fn a_gyro_beside_an_encoder_is_one() {
        for step in [1.5e-3, -1e-3, 1e-5] {
            for gyro in [0.0, 2e-3, 0.02] {
                assert_eq!(found(step, Some(gyro), (0.0, 0)), None, "{step} {gyro}");
            }
        }
    }
}
