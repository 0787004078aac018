//! The battery's voltage without the noise of its reading.
//!
//! **Deviation:** (6) and what the paper builds on it regress on the voltage as it was read. Noise of a regressor biases
//! its coefficient towards zero: of a minute's discharge half of what is read is noise. So the voltage is replaced by
//! what can be foretold of it (two-stage least squares): its smooth course over time, and what the commands draw from
//! it, at once and as the rotor follows them. None of these carries noise of the reading.

use nalgebra::{DMatrix, DVector};

use super::record_of::record_of;
use super::rotor_log::RotorLog;
use crate::effect::followed;

/// [s] a discharge bends over no shorter time.
const SHORTEST_BEND: f64 = 10.0;
/// Most knots of the course: 40 minutes of the shortest bends.
const MOST_KNOTS: usize = 240;
/// Samples for each number that is fitted, at least: what noise they carry over is a tenth of the reading's variance.
const ROWS_EACH: usize = 10;
/// Functions of the command: u, u², u² behind the rotor's lag, and the first three powers of the rate that they give.
const OF_COMMAND: usize = 6;
/// Share of the power that keeps directions apart which the data do not tell apart, as two levels do u and u².
const RIDGE: f64 = 1e-9;

/// How a rotor follows its command, roughly: what it draws from the battery goes with its rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Follows {
    /// [1/s]
    pub pole: f64,
    /// [s]
    pub delay: f64,
    /// [rad/s] of u and u²; any scale will do.
    pub curve: [f64; 2],
}

/// The log with its voltage replaced; unchanged where it has none, or too little of it.
pub(super) fn without_noise(rotor: &RotorLog, follows: Follows) -> RotorLog {
    let mut smooth = rotor.clone();
    if let Some(voltage) = rotor.voltage.as_deref()
        && let Some(foretold) = foretold(rotor, voltage, follows)
    {
        smooth.voltage = Some(foretold);
    }
    smooth
}

/// [V] what time and commands foretell of the voltage.
fn foretold(rotor: &RotorLog, voltage: &[f64], follows: Follows) -> Option<Vec<f64>> {
    let (first, last) = (*rotor.time.first()?, *rotor.time.last()?);
    let bends = ((last - first) / SHORTEST_BEND).floor() as usize;
    let knots = bends.clamp(1, MOST_KNOTS) + 1;
    let spacing = (last - first) / (knots - 1) as f64;
    let size = knots + OF_COMMAND;
    let of_command = of_command(rotor, follows);
    // The columns that are not zero: the two hats that a time lies under, and the functions of the command.
    let columns = |row: usize| {
        let place = ((rotor.time[row] - first) / spacing).clamp(0.0, (knots - 1) as f64);
        let left = (place.floor() as usize).min(knots - 2);
        let right = place - left as f64;
        let hats = [(left, 1.0 - right), (left + 1, right)];
        let of_command = of_command[row];
        hats.into_iter().chain((0..OF_COMMAND).map(move |at| (knots + at, of_command[at])))
    };
    let mut squares = DMatrix::<f64>::zeros(size, size);
    let mut products = DVector::<f64>::zeros(size);
    let mut known = 0;
    let whole = rotor.whole();
    let rows = whole.iter().flat_map(Clone::clone);
    for row in rows.clone().filter(|row| voltage[*row].is_finite()) {
        known += 1;
        for (a, x) in columns(row) {
            products[a] += x * voltage[row];
            columns(row).for_each(|(b, y)| squares[(a, b)] += x * y);
        }
    }
    if known < ROWS_EACH * size {
        return None;
    }
    for at in 0..size {
        squares[(at, at)] += RIDGE * known as f64;
    }
    let weights = squares.cholesky()?.solve(&products);
    let mut foretold = voltage.to_vec();
    for row in rows {
        foretold[row] = columns(row).map(|(at, x)| weights[at] * x).sum();
    }
    Some(foretold)
}

/// [-] u and u² now, u² behind the lag, and the first powers of the rate, settled where a stretch begins. Commands that
/// are missing are held; where they are known (again), the rate goes on from what was measured there: its noise has no part
/// in that of the voltage.
fn of_command(rotor: &RotorLog, follows: Follows) -> Vec<[f64; OF_COMMAND]> {
    let Follows { curve: [linear, quadratic], .. } = follows;
    let scale = linear.abs() + quadratic.abs();
    let mut functions: Vec<_> = rotor.command.iter().map(|u| [*u, u * u, u * u, 0.0, 0.0, 0.0]).collect();
    let held = followed_rate(rotor, follows, None);
    // What the battery takes from the rate, on the whole.
    let (mut missing, mut count) = (0.0, 0.0);
    for &(row, _, rate) in held.iter().filter(|(row, ..)| rotor.rate[*row].is_finite()) {
        missing += rate - rotor.rate[row];
        count += 1.0;
    }
    let missing = if count > 0.0 { missing / count } else { 0.0 };
    for (row, square, rate) in followed_rate(rotor, follows, Some(missing)) {
        let rate = rate / scale;
        functions[row][2..].copy_from_slice(&[square, rate, rate * rate, rate.powi(3)]);
    }
    functions
}

/// Row, u² behind the lag [-], and the rate [rad/s] that the curve gives. With `missing` [rad/s] the rate goes on from what
/// was measured, and as much more, where commands are known again, or a stretch begins.
fn followed_rate(rotor: &RotorLog, follows: Follows, missing: Option<f64>) -> Vec<(usize, f64, f64)> {
    let Follows { pole, delay, curve: [linear, quadratic] } = follows;
    let whole = RotorLog { segments: rotor.whole(), ..rotor.clone() };
    let mut begins = rotor.segments.iter().map(|known| known.start).peekable();
    // The commands as they act, with a row more where one comes between two samples.
    let acting = record_of(std::slice::from_ref(&whole), 0.0, delay, |u, _| [u, u * u]);
    let mut each = Vec::with_capacity(rotor.time.len());
    for (segment, rows) in whole.segments.iter().zip(&acting.segments) {
        let mut left = segment.clone();
        let of = |[u, square]: [f64; 2]| linear * u + quadratic * square;
        let (mut square, mut rate) = (acting.inputs[rows.start][1], of(acting.inputs[rows.start]));
        for at in rows.clone() {
            if let Some(row) = left.clone().next()
                && rotor.time[row] == acting.time[at]
            {
                left.start += 1;
                while begins.next_if(|begin| *begin < row).is_some() {}
                let begins = begins.next_if_eq(&row).is_some();
                if let Some(missing) = missing.filter(|_| begins && rotor.rate[row].is_finite()) {
                    rate = rotor.rate[row] + missing;
                }
                each.push((row, square, rate));
            }
            if at + 1 < rows.end {
                let share = followed(pole, acting.time[at + 1] - acting.time[at]);
                square += (acting.inputs[at][1] - square) * share;
                rate += (of(acting.inputs[at]) - rate) * share;
            }
        }
    }
    each
}
