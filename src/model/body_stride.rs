//! Strides of a free body over several rows, where rows are closer together than its laws need.
//!
//! The torque is held over each interval: alone it moves the body in parabolas, which are known exactly. What laws of the body's own
//! motion add is smooth: one Runge-Kutta step goes over all rows of a stride, and a cubic through both of its ends tells the rows
//! between.

use super::body_trace::BodyInput;
use super::equations::Equations;
use super::thresholds::THRESHOLDS;
use crate::effect::Point;

/// Most intervals of a stride.
const MOST_ROWS: usize = 32;

/// How a body moves, or a part of how it does.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Motion {
    /// [rad]
    pub angle: f64,
    /// [rad/s]
    pub rate: f64,
}

/// The stride that a free run is in.
#[derive(Debug)]
pub(super) struct BodyStride {
    /// [s] since the stride began, of each of its rows.
    at: [f64; MOST_ROWS + 1],
    /// What the torque alone has moved since then; behind the stride how the body moves at each of its rows.
    motion: [Motion; MOST_ROWS + 1],
    /// Its intervals.
    rows: usize,
    /// [rad/s²] of the laws at the end of the last stride, where another one begins.
    acceleration: Option<f64>,
}

impl BodyStride {
    /// For a run of so many `rows`; `None` where strides would be no quicker, or wrong.
    pub fn of(equations: &Equations, rows: usize) -> Option<Self> {
        let sees_motion_only = equations.sees_motion_only && !equations.is_stiff;
        (rows > 2 && sees_motion_only && !equations.torque.is_empty()).then(|| Self {
            at: [0.0; MOST_ROWS + 1],
            motion: [Motion::default(); MOST_ROWS + 1],
            rows: 0,
            acceleration: None,
        })
    }

    /// How the body moves at each row of the stride that begins at `row`, the last of which begins the next one; `None` where rows are so
    /// far apart that no stride goes over two intervals, or the run ends: before the row `to`.
    pub fn go(
        &mut self,
        equations: &Equations,
        (input, row, to): (&BodyInput, usize, usize),
        (angle, rate): (f64, f64),
        held: &mut Point,
    ) -> Option<&[Motion]> {
        self.drive(equations, input, row, to);
        if self.rows < 2 {
            self.acceleration = None;
            return None;
        }
        self.follow(equations, Motion { angle, rate }, held);
        Some(&self.motion[..=self.rows])
    }

    /// Finds how long the stride from `row` is, and what the torque alone does in it.
    fn drive(&mut self, equations: &Equations, input: &BodyInput, row: usize, to: usize) {
        self.rows = 0;
        let end = to.min(input.time.len()).min(input.torque.len() + 1).min(row + MOST_ROWS + 1);
        let (Some(time), Some(torque)) = (input.time.get(row..end), input.torque.get(row..end - 1)) else {
            return;
        };
        let (mut motion, begin) = (Motion::default(), time[0]);
        let mut before = 0.0;
        for (index, (next, torque)) in time[1..].iter().zip(torque).enumerate() {
            let since = next - begin;
            if since > THRESHOLDS.longest_stride_s {
                break;
            }
            let (span, acceleration) = (since - before, torque * equations.per_inertia);
            motion.angle += span * (motion.rate + 0.5 * span * acceleration);
            motion.rate += span * acceleration;
            (self.at[index + 1], self.motion[index + 1], before) = (since, motion, since);
            self.rows = index + 1;
        }
    }

    /// What the torque alone has moved [s] behind the stride's begin.
    fn driven(&self, since: f64) -> Motion {
        let next = self.at[1..=self.rows].iter().position(|at| *at > since).map_or(self.rows, |at| at + 1);
        let before = if next > 1 { self.motion[next - 1] } else { Motion::default() };
        let (at, behind) = (self.at[next - 1], self.motion[next]);
        let (span, part) = (self.at[next] - at, since - at);
        let acceleration = (behind.rate - before.rate) / span;
        Motion {
            angle: before.angle + part * (before.rate + 0.5 * part * acceleration),
            rate: before.rate + part * acceleration,
        }
    }

    /// Takes one classical Runge-Kutta step over the stride from where the body is.
    fn follow(&mut self, equations: &Equations, from: Motion, held: &mut Point) {
        let step = self.at[self.rows];
        let (half, sixth) = (0.5 * step, step / 6.0);
        let (middle, end) = (self.driven(half), self.motion[self.rows]);
        held.torque = 0.0;
        let mut law = |own: Motion, driven: Motion| {
            equations.body_acceleration(own.angle + driven.angle, own.rate + driven.rate, held)
        };
        let own = |rate_behind: f64, span: f64, acceleration: f64| Motion {
            angle: from.angle + span * rate_behind,
            rate: from.rate + span * acceleration,
        };
        let first = self.acceleration.unwrap_or_else(|| law(from, Motion::default()));
        let second_at = own(from.rate, half, first);
        let second = law(second_at, middle);
        let third_at = own(second_at.rate, half, second);
        let third = law(third_at, middle);
        let fourth_at = own(third_at.rate, step, third);
        let fourth = law(fourth_at, end);
        let last = Motion {
            angle: from.angle + sixth * (from.rate + 2.0 * (second_at.rate + third_at.rate) + fourth_at.rate),
            rate: from.rate + sixth * (first + 2.0 * (second + third) + fourth),
        };
        let behind = law(last, end);
        self.acceleration = Some(behind);
        let angles = cubic((from.angle, step * from.rate), (last.angle, step * last.rate));
        let rates = cubic((from.rate, step * first), (last.rate, step * behind));
        let share = 1.0 / step;
        for (motion, at) in self.motion[1..self.rows].iter_mut().zip(&self.at[1..self.rows]) {
            let part = at * share;
            motion.angle += value(&angles, part);
            motion.rate += value(&rates, part);
        }
        self.motion[0] = from;
        self.motion[self.rows] = Motion { angle: last.angle + end.angle, rate: last.rate + end.rate };
    }
}

/// Coefficients by ascending power of the cubic with these values and slopes over a stride at both its ends.
fn cubic((from, slope): (f64, f64), (to, last_slope): (f64, f64)) -> [f64; 4] {
    let (bend, twist) = (to - from - slope, last_slope - slope);
    [from, slope, 3.0 * bend - twist, twist - 2.0 * bend]
}

/// Its value a `part` of the stride behind the stride's begin.
#[inline]
fn value(cubic: &[f64; 4], part: f64) -> f64 {
    cubic[0] + part * (cubic[1] + part * (cubic[2] + part * cubic[3]))
}
