//! Sensors with laws of their own: what the gyroscope shows of a body's rate, and the rate behind what a sensor showed.

use std::borrow::Cow;

use super::body::MOST_STATES;
use super::body_trace::BodyStart;
use super::equations::Equations;
use super::thresholds::THRESHOLDS;
use crate::effect::Point;

/// The way back from what a sensor with a memory shows: reading and lag times its slope. Exact for a first-order lag.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagInverse {
    /// [s] by which the reading of a ramp is late; zero for a sensor without a memory.
    pub lag_s: f64,
    /// Rows to each side over which a slope is to be taken.
    pub half: usize,
}

impl LagInverse {
    /// Of a sensor without a memory.
    pub const NONE: Self = Self { lag_s: 0.0, half: 1 };

    /// Of the sensor that shows `shown` at the end of a ramp that rises by one a second to `end` [rad/s], and `settled` of a rate that
    /// has lasted; over rows `interval` [s] apart.
    fn of_ramp(
        interval: f64,
        end: f64,
        settled: impl Fn(f64) -> f64,
        shown: impl FnOnce(&[f64], &[f64]) -> f64,
    ) -> Self {
        let time: Vec<f64> = (0..THRESHOLDS.ramp.1).map(|row| THRESHOLDS.ramp.0 * row as f64).collect();
        let last = time.last().copied().unwrap_or(0.0);
        let ramp: Vec<f64> = time.iter().map(|at| end + at - last).collect();
        let late = (settled(end) - shown(&time, &ramp)) / (settled(end + 1.0) - settled(end));
        let half = (THRESHOLDS.slope_reach_s / interval.max(1e-9))
            .round()
            .clamp(1.0, THRESHOLDS.most_slope_rows) as usize;
        if late.is_finite() && late.abs() > 1e-9 { Self { lag_s: late, half } } else { Self::NONE }
    }
}

impl Equations {
    /// [rad/s] what the gyroscope would show of a given motion, true rate [rad/s] and angle [rad] at `time` [s].
    #[must_use]
    pub fn gyroscope(&self, time: &[f64], rate: &[f64], angle: &[f64]) -> Vec<f64> {
        let mut states = [0.0; MOST_STATES];
        let mut shown = Vec::with_capacity(rate.len());
        for (row, (rate_now, angle_now)) in rate.iter().zip(angle).enumerate() {
            let here =
                Point { time: time[row], body_rate: *rate_now, body_angle: *angle_now, ..self.constants };
            if row == 0 {
                states = self.settled(&here);
            } else {
                self.advance_rate_sensor(
                    &mut states,
                    (rate[row - 1], *rate_now),
                    &here,
                    time[row] - time[row - 1],
                );
            }
            shown.push(self.sensed_rate(*rate_now, *angle_now, time[row], &states));
        }
        shown
    }

    #[inline]
    pub(super) fn sensed_rate(&self, rate: f64, angle: f64, time: f64, states: &[f64]) -> f64 {
        if self.rate_sensor.is_empty() {
            return rate;
        }
        let mut point = Point { time, body_rate: rate, body_angle: angle, ..self.constants };
        for (hook, state) in self.rate_sensor.iter().zip(states) {
            point.body_rate += match hook.memory() {
                Some(memory) => memory.add(*state, &point),
                None => hook.add(&point),
            };
        }
        point.body_rate
    }

    /// Over `step` [s] in which the body's rate goes from the one to the other [rad/s]; `here` is the rest of the point.
    pub(super) fn advance_rate_sensor(
        &self,
        states: &mut [f64],
        (from, to): (f64, f64),
        here: &Point,
        step: f64,
    ) {
        let steps = (step / THRESHOLDS.sensor_step_s).ceil().clamp(1.0, THRESHOLDS.most_steps);
        let part = 1.0 / steps;
        for index in 0..steps as usize {
            let mut mean = Point { body_rate: from + (to - from) * part * (index as f64 + 0.5), ..*here };
            for (hook, state) in self.rate_sensor.iter().zip(&mut *states) {
                mean.body_rate += match hook.memory() {
                    Some(memory) => {
                        *state = memory.advance(*state, &mean, part * step);
                        memory.add(*state, &mean)
                    }
                    None => hook.add(&mean),
                };
            }
        }
    }

    /// Whether the gyroscope shows anything but the body's rate.
    #[must_use]
    pub fn has_rate_sensor_laws(&self) -> bool {
        !self.rate_sensor.is_empty()
    }

    /// How late the gyroscope is, over rows `interval` [s] apart.
    #[must_use]
    pub fn gyroscope_inverse(&self, interval: f64) -> LagInverse {
        if !self.rate_sensor.iter().any(|hook| hook.memory().is_some()) {
            return LagInverse::NONE;
        }
        let last = THRESHOLDS.ramp.0 * (THRESHOLDS.ramp.1 - 1) as f64;
        let settled = |rate: f64| self.settled_reading(rate, 0.0, last);
        LagInverse::of_ramp(interval, 0.0, settled, |time, ramp| {
            self.gyroscope(time, ramp, &vec![0.0; time.len()]).last().copied().unwrap_or(f64::NAN)
        })
    }

    /// Where a free run starts at `time` [s] and `angle` [rad], where the gyroscope shows `reading` [rad/s]; `slope` tells how that
    /// rises [rad/s²], over so many rows to each side.
    #[must_use]
    pub fn start_behind(
        &self,
        inverse: &LagInverse,
        (time, angle, reading): (f64, f64, f64),
        slope: impl FnOnce(usize) -> f64,
    ) -> BodyStart {
        if !self.has_rate_sensor_laws() {
            return BodyStart { angle, rate: reading, sensor: 0.0 };
        }
        let rate = self.without_static_laws(reading, angle, time);
        if inverse.lag_s == 0.0 {
            return BodyStart { angle, rate, sensor: 0.0 };
        }
        let late = inverse.lag_s * slope(inverse.half);
        BodyStart { angle, rate: self.without_static_laws(reading + late, angle, time), sensor: -late }
    }

    /// [rad/s] the rate of which the gyroscope would show `reading` once it has lasted: its laws are as good as straight lines.
    fn without_static_laws(&self, reading: f64, angle: f64, time: f64) -> f64 {
        let offset = self.settled_reading(0.0, angle, time);
        let slope = self.settled_reading(1.0, angle, time) - offset;
        if slope.abs() > 1e-6 { (reading - offset) / slope } else { reading }
    }

    /// [rad/s] what the gyroscope shows of a rate that has lasted.
    fn settled_reading(&self, rate: f64, angle: f64, time: f64) -> f64 {
        let here = Point { time, body_rate: rate, body_angle: angle, ..self.constants };
        self.sensed_rate(rate, angle, time, &self.settled(&here))
    }

    /// What the gyroscope's memories hold when a rate has lasted.
    pub(super) fn settled(&self, point: &Point) -> [f64; MOST_STATES] {
        let (mut here, mut states) = (*point, [0.0; MOST_STATES]);
        for (hook, state) in self.rate_sensor.iter().zip(&mut states) {
            here.body_rate += match hook.memory() {
                Some(memory) => {
                    *state = memory.steady_state(&here);
                    memory.add(*state, &here)
                }
                None => hook.add(&here),
            };
        }
        states
    }

    /// How late a rotor's telemetry is, over rows `interval` [s] apart.
    #[must_use]
    pub fn telemetry_inverse(&self, interval: f64) -> LagInverse {
        if !self.senses_rotor_late() {
            return LagInverse::NONE;
        }
        let settled = |rate: f64| self.shown_of_ramp(&[0.0], &[rate]);
        LagInverse::of_ramp(interval, THRESHOLDS.ramp_end, settled, |time, ramp| {
            self.shown_of_ramp(time, ramp)
        })
    }

    /// [rad/s] what a rotor did of which telemetry without gaps shows `readings` [rad/s]; `slopes` tells how these rise [rad/s²], over
    /// so many rows to each side.
    #[must_use]
    pub fn rates_behind<'a>(
        &self,
        inverse: &LagInverse,
        readings: Cow<'a, [f64]>,
        slopes: impl FnOnce(&[f64], usize) -> Vec<f64>,
    ) -> Cow<'a, [f64]> {
        if inverse.lag_s == 0.0 {
            return readings;
        }
        let slopes = slopes(&readings, inverse.half);
        readings.iter().zip(slopes).map(|(reading, slope)| reading + inverse.lag_s * slope).collect()
    }
}
