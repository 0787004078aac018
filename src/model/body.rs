//! Free run of the body: from the actuators' torque to rate and angle.

use super::body_stride::{BodyStride, Motion};
use super::body_trace::{BodyInput, BodyStart, BodyTrace};
use super::equations::Equations;
use super::thresholds::THRESHOLDS;
use crate::cancel;
use crate::effect::Point;

/// Most states of laws with memory.
pub(super) const MOST_STATES: usize = 4;

impl Equations {
    /// [N] thrust of one rotor at `rate` [rad/s], effects included; `side` is +1 for rotor 1, -1 for rotor 2.
    /// [LPC16] Eq. (11): the nominal c ω², the same for every rotor, and what effects such as its own wind add.
    #[must_use]
    pub fn rotor_thrust(&self, rate: f64, side: f64, angle: f64, body_rate: f64) -> f64 {
        let mut point = Point { propeller_rate: rate, side, body_angle: angle, body_rate, ..self.constants };
        point.thrust = point.thrust_coefficient * rate * rate;
        for hook in &self.thrust {
            point.thrust += hook.add(&point);
        }
        point.thrust
    }

    /// Whether the torque is delayed or lagged, so that [`Equations::torque_means`] depends on the model.
    #[must_use]
    pub fn has_torque_stream(&self) -> bool {
        self.actuator_delay != 0.0 || !self.torque_stream.is_empty()
    }

    /// [N m] mean torque over the interval after each sample, delayed and lagged as the model says. `means` are those
    /// of the bare torque, `slopes` [N m/s] how it rises within each interval.
    #[must_use]
    pub fn torque_means(&self, time: &[f64], means: &[f64], slopes: &[f64]) -> Vec<f64> {
        cancel::check();
        let mut means = delayed_means(time, means, slopes, self.actuator_delay);
        // How it rises within an interval matters to a law that is faster than the samples. Behind a delay it rises elsewhere.
        let mut is_rising = self.actuator_delay == 0.0;
        for hook in &self.torque_stream {
            let Some(memory) = hook.memory() else { continue };
            let mut point = self.constants;
            point.torque = means.first().copied().unwrap_or(0.0);
            let mut state = memory.steady_state(&point);
            for (row, (mean, pair)) in means.iter_mut().zip(time.windows(2)).enumerate() {
                let step = (pair[1] - pair[0]) / THRESHOLDS.stream_steps as f64;
                let slope = slopes.get(row).copied().filter(|_| is_rising).unwrap_or(0.0);
                let mut sum = 0.0;
                for part in 0..THRESHOLDS.stream_steps {
                    point.torque =
                        *mean + slope * step * (part as f64 + 0.5 - 0.5 * THRESHOLDS.stream_steps as f64);
                    // The middle of the step stands for its mean.
                    let middle = memory.advance(state, &point, 0.5 * step);
                    sum += memory.add(middle, &point);
                    state = memory.advance(state, &point, step);
                }
                *mean += sum / THRESHOLDS.stream_steps as f64;
            }
            is_rising = false;
        }
        means
    }

    /// Whether a law on the torque remembers where the body has been.
    #[must_use]
    pub fn has_remembered_torque(&self) -> bool {
        !self.remembered_torque.is_empty()
    }

    /// Adds to the torque what laws add that remember where the body has been. A window begins in the middle of what they
    /// remember: they see the body as it was measured, angle [rad] and rate [rad/s] at the samples.
    pub fn add_remembered_torque(&self, input: &mut BodyInput, angle: &[f64], rate: &[f64]) {
        let at = |values: &[f64], row: usize| values.get(row).copied().unwrap_or(0.0);
        for hook in &self.remembered_torque {
            let Some(memory) = hook.memory() else { continue };
            cancel::check();
            let mut state = None;
            let mut added = Vec::with_capacity(input.time.len());
            let mut point = self.constants;
            for row in 0..input.time.len() {
                Self::hold(input, row, &mut point);
                (point.body_angle, point.body_rate) = (at(angle, row), at(rate, row));
                let step = input.time[row] - input.time[row.saturating_sub(1)];
                let now = state
                    .map_or_else(|| memory.steady_state(&point), |state| memory.advance(state, &point, step));
                state = Some(now);
                added.push(memory.add(now, &point));
            }
            for row in 0..input.time.len() {
                let next = added.get(row + 1).unwrap_or(&added[row]);
                input.torque[row] += 0.5 * (added[row] + next);
            }
        }
    }

    /// Runs the body freely over the rows `from..to` of its inputs; appends to `trace`.
    pub fn simulate_body(
        &self,
        input: &BodyInput,
        from: usize,
        to: usize,
        start: &BodyStart,
        trace: &mut BodyTrace,
    ) {
        let (mut angle, mut rate) = (start.angle, start.rate);
        let time = input.time.get(from).copied().unwrap_or(0.0);
        let at_start = Point { time, body_rate: rate, body_angle: angle, ..self.constants };
        let mut sensor = self.settled(&at_start).map(|state| state + start.sensor);
        let mut held = self.constants;
        let (mut stride, mut row) = (BodyStride::of(self, to.saturating_sub(from)), from);
        while row < to {
            let in_stride = stride.as_mut();
            let in_stride =
                in_stride.and_then(|stride| stride.go(self, (input, row, to), (angle, rate), &mut held));
            if let Some([before @ .., end]) = in_stride {
                self.take_down(before, end, (input, row), (&mut held, &mut sensor), trace);
                (angle, rate) = (end.angle, end.rate);
                row += before.len();
                continue;
            }
            trace.angle.push(angle);
            let at = input.time.get(row).copied().unwrap_or(0.0);
            trace.rate.push(self.sensed_rate(rate, angle, at, &sensor));
            let (Some(now), Some(next)) = (input.time.get(row), input.time.get(row + 1)) else { break };
            Self::hold(input, row, &mut held);
            let (step, steps) = self.steps_of(next - now);
            for _ in 0..steps {
                let before = rate;
                (angle, rate) = self.turn(angle, rate, &mut held, step);
                if self.has_rate_sensor_laws() {
                    let here = Point { body_angle: angle, ..held };
                    self.advance_rate_sensor(&mut sensor, (before, rate), &here, step);
                }
            }
            row += 1;
        }
    }

    /// Takes down the rows of a stride from `row` on, but for its `end`.
    fn take_down(
        &self,
        rows: &[Motion],
        end: &Motion,
        (input, row): (&BodyInput, usize),
        (held, sensor): (&mut Point, &mut [f64]),
        trace: &mut BodyTrace,
    ) {
        trace.angle.extend(rows.iter().map(|motion| motion.angle));
        if !self.has_rate_sensor_laws() {
            return trace.rate.extend(rows.iter().map(|motion| motion.rate));
        }
        let next = rows[1..].iter().chain([end]);
        for (row, (now, next)) in (row..).zip(rows.iter().zip(next)) {
            let at = input.time[row];
            trace.rate.push(self.sensed_rate(now.rate, now.angle, at, sensor));
            Self::hold(input, row, held);
            let here = Point { body_angle: next.angle, ..*held };
            self.advance_rate_sensor(sensor, (now.rate, next.rate), &here, input.time[row + 1] - at);
        }
    }

    /// [rad/s] the body's rate at the row behind `row`, from angle [rad] and rate [rad/s] there; `None` behind the last row.
    #[must_use]
    pub fn next_body_rate(&self, input: &BodyInput, row: usize, angle: f64, rate: f64) -> Option<f64> {
        let span = input.time.get(row + 1)? - input.time.get(row)?;
        let mut held = self.constants;
        Self::hold(input, row, &mut held);
        let (step, steps) = self.steps_of(span);
        Some((0..steps).fold((angle, rate), |(angle, rate), _| self.turn(angle, rate, &mut held, step)).1)
    }

    /// How long the steps [s] of an interval [s] are, and how many.
    #[inline]
    fn steps_of(&self, span: f64) -> (f64, usize) {
        let longest =
            if self.is_stiff { THRESHOLDS.longest_step_s } else { THRESHOLDS.longest_smooth_step_s };
        let steps = (span / longest).ceil().clamp(1.0, THRESHOLDS.most_steps);
        (span / steps, steps as usize)
    }

    /// What the interval after a row holds.
    #[inline]
    fn hold(input: &BodyInput, row: usize, point: &mut Point) {
        let at = |values: &[f64]| values.get(row).copied().unwrap_or(0.0);
        point.time = at(&input.time);
        point.torque = at(&input.torque);
        point.propeller_rate_1 = at(&input.propeller_rate[0]);
        point.propeller_rate_2 = at(&input.propeller_rate[1]);
    }

    /// [rad/s²] of the body. [LPC16] Eq. (1). `point` holds what the interval holds; the laws' own quantities in it
    /// are scratch, because a copy for each of the many calls would cost more than the laws.
    #[inline]
    pub(super) fn body_acceleration(&self, angle: f64, rate: f64, point: &mut Point) -> f64 {
        (point.body_angle, point.body_rate) = (angle, rate);
        if self.thrust.is_empty() {
            // Laws on the torque look at the bare one.
            return self.torque.iter().fold(point.torque, |sum, hook| sum + hook.add(point))
                * self.per_inertia;
        }
        let torque = point.torque;
        for (side, propeller_rate) in [(1.0, point.propeller_rate_1), (-1.0, point.propeller_rate_2)] {
            let bare = point.thrust_coefficient * propeller_rate * propeller_rate;
            (point.side, point.propeller_rate, point.thrust) = (side, propeller_rate, bare);
            for hook in &self.thrust {
                point.thrust += hook.add(point);
            }
            point.torque += side * point.arm * (point.thrust - bare);
        }
        let sum = self.torque.iter().fold(point.torque, |sum, hook| sum + hook.add(point));
        point.torque = torque;
        sum * self.per_inertia
    }

    /// One classical Runge-Kutta step.
    fn turn(&self, angle: f64, rate: f64, held: &mut Point, step: f64) -> (f64, f64) {
        if self.thrust.is_empty() && self.torque.is_empty() {
            let acceleration = held.torque * self.per_inertia;
            let turned = rate + 0.5 * step * acceleration;
            return (angle + step * turned, rate + step * acceleration);
        }
        let half = 0.5 * step;
        let first = self.body_acceleration(angle, rate, held);
        let rate_2 = rate + half * first;
        let second = self.body_acceleration(angle + half * rate, rate_2, held);
        let rate_3 = rate + half * second;
        let third = self.body_acceleration(angle + half * rate_2, rate_3, held);
        let rate_4 = rate + step * third;
        let fourth = self.body_acceleration(angle + step * rate_3, rate_4, held);
        let sixth = step / 6.0;
        (
            angle + sixth * (rate + 2.0 * (rate_2 + rate_3) + rate_4),
            rate + sixth * (first + 2.0 * (second + third) + fourth),
        )
    }
}

/// Mean over the interval after each sample of a signal with a dead time of `delay` [s].
fn delayed_means(time: &[f64], means: &[f64], slopes: &[f64], delay: f64) -> Vec<f64> {
    let (Some(first_time), Some(first), false) = (time.first(), means.first(), delay == 0.0) else {
        return means.to_vec();
    };
    // The integral from the first sample to each sample; before it the first value held.
    let mut integral = vec![0.0; time.len()];
    for row in 1..time.len() {
        integral[row] = integral[row - 1] + means[row - 1] * (time[row] - time[row - 1]);
    }
    let mut row = 0;
    let mut integral_at = |at: f64| {
        if at <= *first_time {
            return first * (at - first_time);
        }
        while row + 2 < time.len() && time[row + 1] <= at {
            row += 1;
        }
        let span = at - time[row];
        let rest = time.get(row + 1).map_or(0.0, |next| next - at);
        // A straight line with the interval's mean and slope.
        integral[row] + span * (means[row] - 0.5 * slopes[row] * rest)
    };
    let delayed: Vec<f64> = time.iter().map(|at| integral_at(at - delay)).collect();
    let delayed =
        delayed.windows(2).zip(time.windows(2)).map(|(sum, span)| (sum[1] - sum[0]) / (span[1] - span[0]));
    delayed.chain(means.last().copied()).collect()
}
