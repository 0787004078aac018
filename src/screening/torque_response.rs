//! How a body answers the torque that a model makes: how many times as fast it speeds up as the torque over J would have it.
//!
//! Over short windows, so that nothing has to be differentiated: what the rate gains, against the impulse of the torque over J. Beside
//! it stands what else may turn a body there (a constant torque, one that goes with the angle, with the rate, or with its sign), so that a
//! pendulum, a cable or friction does not pass for another J; and the impulse may come late. Noise of a torque makes the answer look
//! weaker, but then it explains as much less of what the rate gains: only where it explains nearly all of it there is an answer.

use std::ops::Range;

use super::attitude::Attitude;
use super::plausibility::is_another;
use super::thresholds::THRESHOLDS;
use super::{DrivenBy, ScreenedBody, ScreenedLog};
use crate::estimation::dependent_columns::DesignRows;
use crate::estimation::integral::{integral_of_held, interpolated, running, trapezoidal};
use crate::log::Dataset;
use crate::model::Model;
use crate::signal::columns::{self, BODY_ANGLE, BODY_RATE};

/// What turns the body, summed up from the first row on.
struct Motion<'a> {
    time: &'a [f64],
    /// [rad/s] as it was read.
    rate: &'a [f64],
    /// [rad] of the rate, [rad s] of the angle, [s] of the rate's sign.
    beside: [Vec<f64>; 3],
    stretches: &'a [Range<usize>],
}

/// What the windows of one length say.
#[derive(Clone, Copy)]
struct Answer {
    /// Of what the body does to what the model makes of the torque.
    ratio: f64,
    /// Share of what the rest leaves of the rate's gains that the torque explains.
    explained: f64,
}

/// How many times as fast as this model's torque over J has it the body of a log speeds up; `None` where they do not follow each other
/// clearly.
pub(crate) fn ratio(screened: &ScreenedLog, model: &Model) -> Option<f64> {
    let (log, body) = (screened.dataset(), screened.body()?);
    let rate = log.column(BODY_RATE)?;
    // The beginning of a very long log: beside its columns there is no room for as much again.
    let rows = log.len().min(THRESHOLDS.response_most);
    let motion = Motion::of(log, &rate[..rows], body.stretches());
    let impulse: Vec<f64> = impulse(screened, body, model, rows)?;
    let over_inertia: Vec<f64> = impulse.iter().map(|it| it / model.body.inertia).collect();
    let of_delay = |delay: &f64| {
        let late = late(motion.time, &over_inertia, *delay);
        THRESHOLDS.response_spans.map(|span| motion.answer(&late, span))
    };
    let all: Vec<_> = THRESHOLDS.response_delays.iter().map(of_delay).collect();
    let share = |it: &Option<Answer>| it.map_or(0.0, |it| it.explained);
    let most = |answers: &[Option<Answer>; 3]| answers.iter().map(share).fold(0.0, f64::max);
    let best = all.iter().max_by(|a, b| most(a).total_cmp(&most(b)))?;
    let clearest = best.iter().flatten().max_by(|a, b| a.explained.total_cmp(&b.explained))?;
    // What is one factor is the same over short windows and long ones.
    let is_other = |it: &Answer| is_another(&(it.ratio / clearest.ratio), THRESHOLDS.response_same_factor);
    let is_clear = clearest.ratio > 0.0
        && clearest.explained >= THRESHOLDS.response_explains
        && best.iter().flatten().count() > 1
        && !best.iter().flatten().any(is_other);
    // A gyro may be off by a factor of its own, which its angle shows; what the angle's noise adds to its slope is none.
    let of_angle = Attitude::of(log, rate).ratio;
    let of_gyro = of_angle.filter(|it| is_another(it, THRESHOLDS.unit_factor)).unwrap_or(1.0);
    is_clear.then_some(clearest.ratio / of_gyro)
}

impl<'a> Motion<'a> {
    fn of(log: &'a Dataset, rate: &'a [f64], stretches: &'a [Range<usize>]) -> Self {
        let time = &log.time()[..rate.len()];
        let known = interpolated(time, rate);
        let turned = trapezoidal(time, &known);
        let angle = log.column(BODY_ANGLE).map(|angle| interpolated(time, &angle[..rate.len()]));
        let swung = trapezoidal(time, angle.as_deref().filter(|it| it[0].is_finite()).unwrap_or(&turned));
        let signs: Vec<f64> = known.iter().map(|rate| rate.signum()).collect();
        let sides = trapezoidal(time, &signs);
        Self { time, rate, beside: [turned, swung, sides], stretches }
    }

    /// What the windows of so many seconds say of this impulse [rad/s].
    fn answer(&self, impulse: &[f64], span: f64) -> Option<Answer> {
        let windows: Vec<(usize, usize)> =
            self.stretches.iter().flat_map(|rows| self.windows(rows.clone(), span)).collect();
        if windows.len() < THRESHOLDS.response_fewest {
            return None;
        }
        let share = windows.len().div_ceil(THRESHOLDS.new_most);
        let (mut with, mut without) = (DesignRows::new(5, windows.len()), DesignRows::new(4, windows.len()));
        let mut gains = Vec::new();
        for (from, to) in windows.into_iter().step_by(share) {
            let gain = |values: &[f64]| values[to] - values[from];
            let [turned, swung, sides] = self.beside.each_ref().map(|it| gain(it));
            with.push(&[gain(impulse), gain(self.time), turned, swung, sides]);
            without.push(&[gain(self.time), turned, swung, sides]);
            gains.push(gain(self.rate));
        }
        let kept: Vec<usize> = (0..gains.len()).collect();
        let left = |design: &DesignRows, fit: &[f64]| -> f64 {
            kept.iter().map(|at| (gains[*at] - design.value(*at, fit)).powi(2)).sum()
        };
        let fit = with.coefficients(&gains, &kept)?;
        let before = left(&without, &without.coefficients(&gains, &kept)?);
        let explained = 1.0 - left(&with, &fit) / before;
        explained.is_finite().then_some(Answer { ratio: fit[0], explained })
    }

    /// First and last rows of windows of so many seconds within a stretch, each beginning in the middle of the one before.
    fn windows(&self, stretch: Range<usize>, span: f64) -> Vec<(usize, usize)> {
        let stretch = stretch.start..stretch.end.min(self.rate.len());
        let rows: Vec<usize> = stretch.filter(|row| self.rate[*row].is_finite()).collect();
        let mut windows = Vec::new();
        let (mut from, mut to) = (0, 0);
        while from < rows.len() {
            let begin = self.time[rows[from]];
            // A billionth of the span forgives the rounding of stamps.
            let behind = |at: usize, share: f64| self.time[rows[at]] - begin >= share * span * (1.0 - 1e-9);
            while to < rows.len() && !behind(to, 1.0) {
                to += 1;
            }
            if to == rows.len() {
                break;
            }
            if !behind(to, 1.5) {
                windows.push((rows[from], rows[to]));
            }
            from = (from + 1..=to).find(|at| behind(*at, 0.5)).unwrap_or(to);
        }
        windows
    }
}

/// [N m s] The running integral of the torque that drives a body over the first `rows`.
fn impulse(screened: &ScreenedLog, body: &ScreenedBody, model: &Model, rows: usize) -> Option<Vec<f64>> {
    let log = screened.dataset();
    let time = &log.time()[..rows];
    if body.driven_by() == DrivenBy::TorqueCommand {
        return Some(integral_of_held(time, &body.torque()[..rows]));
    }
    let rates = |number: usize| match log.column(&columns::propeller_rate(number)) {
        Some(rates) => Some(interpolated(time, &rates[..rows])),
        None => Some(followed(time, &screened.commanded(number)?.data().command[..rows], model)),
    };
    let (first, second) = (rates(1)?, rates(2)?);
    let equations = model.bare_equations();
    let torque = |row: usize| equations.rotor_torque(first[row], second[row]);
    Some(running(time, |row, step| 0.5 * step * (torque(row) + torque(row + 1))))
}

/// [rad/s] The rates of a rotor that nobody measured, with a full battery.
fn followed(time: &[f64], command: &[f64], model: &Model) -> Vec<f64> {
    let steady = |row: usize| Some(command[row]).filter(|it| it.is_finite()).map(|it| model.steady_rate(it));
    let mut rate = (0..command.len()).find_map(steady).unwrap_or(0.0);
    let mut rates = Vec::with_capacity(time.len());
    for row in 0..time.len() {
        rates.push(rate);
        let step = time.get(row + 1).map_or(0.0, |next| next - time[row]);
        let share = 1.0 - (-model.actuator.pole * step).exp();
        rate += share * (steady(row).unwrap_or(rate) - rate);
    }
    rates
}

/// The same `delay` [s] later; straight lines between the rows.
fn late(time: &[f64], values: &[f64], delay: f64) -> Vec<f64> {
    let mut before = 0;
    let at = |row: usize| {
        let then = time[row] - delay;
        while before + 1 < row && time[before + 1] <= then {
            before += 1;
        }
        let next = (before + 1).min(row);
        let share = ((then - time[before]) / (time[next] - time[before])).clamp(0.0, 1.0);
        // The first row has none before it.
        if share.is_nan() { values[row] } else { values[before] + share * (values[next] - values[before]) }
    };
    (0..time.len()).map(at).collect()
}
