//! Sensors of the emulated bench: each with its own rate, noise and quantization.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use crate::clock::NANOSECONDS_PER_SECOND;
use crate::signal::channels::sensor_table;
use crate::signal::{Channel, Multiplicity, Sample, Sensor};

use super::error::EmulateError;

/// One kind of sensor.
#[cfg_attr(test, derive(schemars::JsonSchema))]
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

macro_rules! sensors_config {
    ($(
        $(#[$doc:meta])*
        $field:ident: $type:ty as $sensor:ident, $unit:literal $suffix:literal,
        [$($channels:tt)+],
        guard($($guard:tt)*),
        $row:expr;
    )+) => {
        /// The `[emulator.sensors]` table.
        #[cfg_attr(test, derive(schemars::JsonSchema))]
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct SensorsConfig {
            $($(#[$doc])* pub $field: SensorConfig,)+
        }

        impl Default for SensorsConfig {
            fn default() -> Self {
                Self { $($field: SensorConfig::of(Sensor::$sensor),)+ }
            }
        }

        impl SensorsConfig {
            /// Of one sensor.
            #[must_use]
            pub fn of(&self, sensor: Sensor) -> &SensorConfig {
                match sensor {
                    $(Sensor::$sensor => &self.$field,)+
                }
            }

            /// Of one sensor, to change.
            #[must_use]
            pub fn of_mut(&mut self, sensor: Sensor) -> &mut SensorConfig {
                match sensor {
                    $(Sensor::$sensor => &mut self.$field,)+
                }
            }
        }
    };
}
sensor_table!(sensors_config);

impl SensorsConfig {
    /// Every sensor at `rate_hz`, except those the bench does not have.
    #[must_use]
    pub fn at_rate(mut self, rate_hz: f64) -> Self {
        for sensor in Sensor::ALL {
            let config = self.of_mut(sensor);
            if config.rate_hz > 0.0 {
                config.rate_hz = rate_hz;
            }
        }
        self
    }

    /// The devices of the emulated bench: one for each sensor, or for each rotor's.
    pub(super) fn devices(&self) -> Result<Vec<Device>, EmulateError> {
        let mut devices = Vec::new();
        for sensor in Sensor::ALL {
            let (config, row) = (*self.of(sensor), sensor.row());
            let period_ns = config.period_ns(sensor.name())?;
            let size = if row.multiplicity == Multiplicity::Rotors { 1 } else { sensor.channels().len() };
            for channels in sensor.channels().chunks(size) {
                let is_passenger = row.emulated.is_passenger;
                devices.push(Device { config, channels, period_ns, is_passenger });
            }
        }
        if devices.iter().all(|device| device.is_passenger || device.period_ns == 0) {
            devices.iter_mut().for_each(|device| device.is_passenger = false);
        }
        Ok(devices)
    }
}

impl SensorConfig {
    /// As the table of sensors has it.
    fn of(sensor: Sensor) -> Self {
        let row = sensor.row().emulated;
        Self { rate_hz: row.rate_hz, noise: row.noise, quantization: row.quantization }
    }

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

/// A sensor as built: what is read together, at one time and with one stream of random numbers.
#[derive(Debug, Clone)]
pub(super) struct Device {
    config: SensorConfig,
    pub channels: &'static [Channel],
    /// [ns] between samples; 0 = never.
    period_ns: u64,
    /// Whether it samples only when another device does.
    pub is_passenger: bool,
}

/// A sensor at work: when it samples next, and its own stream of random numbers, so that the rate of one
/// sensor never changes the noise of another.
#[derive(Debug, Clone)]
pub(super) struct Sampler {
    /// [ns] since the start; `u64::MAX` = never.
    pub next_ns: u64,
    count: u32,
    random: ChaCha8Rng,
}

impl Device {
    /// At rest, its noise from this stream of the seed.
    pub fn start(&self, seed: u64, stream: u64) -> Sampler {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        Sampler { next_ns: if self.period_ns == 0 { u64::MAX } else { 0 }, count: 0, random }
    }
}

impl Sampler {
    /// One more sample of `device` is due a period after the one before.
    pub fn advance(&mut self, device: &Device) {
        self.next_ns = self.next_ns.saturating_add(device.period_ns);
        self.count = self.count.wrapping_add(1);
    }

    pub fn sample(&mut self, device: &Device, truth: f64, stamp_ns: u64) -> Sample {
        let config = &device.config;
        let noise: f64 = self.random.sample(StandardNormal);
        let mut value = truth + config.noise * noise;
        if config.quantization > 0.0 {
            value = (value / config.quantization).round() * config.quantization;
        }
        Sample::good(value, stamp_ns, self.count)
    }
}
