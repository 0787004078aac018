//! Sensors of the emulated bench: each with its own rate, noise and quantization.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::clock::NANOSECONDS_PER_SECOND;
use crate::signal::Sample;

use super::error::EmulateError;

/// One kind of sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorConfig {
    /// [Hz] samples each second; 0 = the bench has no such sensor.
    pub rate_hz: f64,
    /// [unit of the signal] rms of white, normally distributed noise.
    #[serde(default)]
    pub noise: f64,
    /// [unit of the signal] step of the quantizer; 0 = none.
    #[serde(default)]
    pub quantization: f64,
}

/// The `[emulator.sensors]` table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorsConfig {
    /// [rad/s] gyroscope.
    pub body_rate: SensorConfig,
    /// [rad] encoder at the pivot.
    pub body_angle: SensorConfig,
    /// [m/s²] accelerometer at the pivot.
    pub acceleration: SensorConfig,
    /// [V] battery voltage.
    pub battery_voltage: SensorConfig,
    /// [rad/s] rotor rates, as the ESCs tell them.
    pub propeller_rate: SensorConfig,
    /// [A] currents, as the ESCs tell them.
    pub current: SensorConfig,
    /// [N] load cells below the rotors.
    pub thrust: SensorConfig,
}

impl Default for SensorsConfig {
    fn default() -> Self {
        let sensor = |rate_hz, noise, quantization| SensorConfig { rate_hz, noise, quantization };
        Self {
            body_rate: sensor(1000.0, 0.004, 1.0 / 1024.0),
            body_angle: sensor(200.0, 0.001, std::f64::consts::TAU / 16384.0),
            acceleration: sensor(200.0, 0.05, 0.01),
            battery_voltage: sensor(100.0, 0.01, 0.01),
            propeller_rate: sensor(200.0, 1.5, 0.1),
            current: sensor(200.0, 0.1, 0.05),
            thrust: sensor(0.0, 0.02, 0.005),
        }
    }
}

impl SensorsConfig {
    /// Every sensor at `rate_hz`, except those the bench does not have.
    #[must_use]
    pub fn at_rate(mut self, rate_hz: f64) -> Self {
        for sensor in [
            &mut self.body_rate,
            &mut self.body_angle,
            &mut self.acceleration,
            &mut self.battery_voltage,
            &mut self.propeller_rate,
            &mut self.current,
            &mut self.thrust,
        ] {
            if sensor.rate_hz > 0.0 {
                sensor.rate_hz = rate_hz;
            }
        }
        self
    }
}

impl SensorConfig {
    /// [ns] between samples; 0 = never.
    pub(super) fn period_ns(&self, name: &str) -> Result<u64, EmulateError> {
        let sane = (0.0..=100_000.0).contains(&self.rate_hz)
            && self.noise >= 0.0
            && self.noise.is_finite()
            && self.quantization >= 0.0
            && self.quantization.is_finite();
        if !sane {
            let Self { rate_hz, noise, quantization } = *self;
            return Err(EmulateError::Sensor { name: name.to_owned(), rate_hz, noise, quantization });
        }
        if self.rate_hz == 0.0 {
            return Ok(0);
        }
        Ok((NANOSECONDS_PER_SECOND as f64 / self.rate_hz).round() as u64)
    }
}

/// A sensor at work: when it samples next, and its own stream of random numbers, so that the rate of one
/// sensor never changes the noise of another.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    /// [ns] since the start; `u64::MAX` = never.
    pub next_ns: u64,
    count: u32,
    random: ChaCha8Rng,
}

impl Channel {
    pub fn new(seed: u64, stream: u64, period_ns: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Self { next_ns: if period_ns == 0 { u64::MAX } else { 0 }, count: 0, random }
    }

    /// One more sample follows `period_ns` after this one.
    pub fn advance(&mut self, period_ns: u64) {
        self.next_ns = self.next_ns.saturating_add(period_ns);
        self.count = self.count.wrapping_add(1);
    }

    pub fn sample(&mut self, config: &SensorConfig, truth: f64, stamp_ns: u64) -> Sample {
        let noise: f64 = self.random.sample(StandardNormal);
        let mut value = truth + config.noise * noise;
        if config.quantization > 0.0 {
            value = (value / config.quantization).round() * config.quantization;
        }
        Sample::good(value, stamp_ns, self.count)
    }
}
