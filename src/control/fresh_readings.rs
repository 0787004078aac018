//! What a controller takes from the sensors: only what is new and good.

use super::thresholds::THRESHOLDS;
use crate::signal::{Sample, Sensors};

/// The last values a controller took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FreshReadings {
    /// Count and stamp of the gyro sample used last; `None` before the first.
    gyro: Option<(u32, u64)>,
    /// [V] last good voltage, or full.
    voltage: f64,
}

// In place, as all of a step: see `Allocator::allocate`.
impl FreshReadings {
    pub(super) fn start(full_voltage: f64) -> Self {
        Self { gyro: None, voltage: full_voltage }
    }

    /// [rad/s] the gyro's rate, unless it is bad or was used before.
    #[inline(always)]
    pub(super) fn body_rate(&mut self, sensors: &Sensors) -> Option<f64> {
        let sample = &sensors.body_rate;
        let identity = Some((sample.count, sample.stamp_ns));
        if !usable(sample) || self.gyro == identity {
            return None;
        }
        self.gyro = identity;
        Some(sample.value)
    }

    /// [V] battery voltage, and whether it had to be assumed.
    #[inline(always)]
    pub(super) fn voltage(&mut self, sensors: &Sensors) -> (f64, bool) {
        let sample = &sensors.battery_voltage;
        // Positive and finite.
        let good = sample.is_good() && sample.value > 0.0 && sample.value < f64::INFINITY;
        if good {
            self.voltage = sample.value;
        }
        (self.voltage, !good)
    }
}

/// Slow correction of the integrated angle by the measured one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AngleCorrection {
    /// [-] share of the difference taken in each period; 0 = not used.
    gain: f64,
}

impl AngleCorrection {
    pub(super) fn build(used: bool, period_s: f64) -> Self {
        Self { gain: if used { -(-THRESHOLDS.angle_correction_rate * period_s).exp_m1() } else { 0.0 } }
    }

    /// [rad] the angle after one period's correction.
    #[inline(always)]
    pub(super) fn correct(&self, angle: f64, sensors: &Sensors) -> f64 {
        match self.measured(sensors) {
            Some(measured) => angle + self.gain * (measured - angle),
            None => angle,
        }
    }

    /// [rad] the measured angle, when it is good, to be used, and no older than the other sensors' news allow.
    #[inline(always)]
    pub(super) fn measured(&self, sensors: &Sensors) -> Option<f64> {
        if self.gain <= 0.0 {
            return None;
        }
        let sample = &sensors.body_angle;
        let is_recent = sensors.stamp_ns.saturating_sub(sample.stamp_ns) <= THRESHOLDS.angle_oldest_ns;
        (is_recent && usable(sample)).then_some(sample.value)
    }
}

#[inline(always)]
fn usable(sample: &Sample) -> bool {
    sample.is_good() && sample.value.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_encoder_that_fell_silent_corrects_nothing() {
        let correction = AngleCorrection::build(true, 0.02);
        let mut sensors = Sensors { stamp_ns: 1_000_000_000, ..Sensors::default() };
        sensors.body_angle = Sample::good(0.2, 900_000_000, 7);
        assert_eq!(correction.measured(&sensors), Some(0.2));
        sensors.stamp_ns = 1_500_000_000;
        assert_eq!(correction.correct(0.5, &sensors), 0.5);
        assert_eq!(AngleCorrection::build(false, 0.02).measured(&sensors), None);
    }
}
