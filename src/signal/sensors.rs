//! What a sensor said.

use iceoryx2::prelude::ZeroCopySend;

use super::ROTORS;

/// One measured quantity, with its age and its health.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Sample")]
pub struct Sample {
    /// Value in the SI unit of the field that holds it; the last good one while `health` says it is bad.
    pub value: f64,
    /// [ns] CLOCK_MONOTONIC when the value reached this machine; 0 = never.
    pub stamp_ns: u64,
    /// Number of values received so far, wrapping: tells a stream that stopped from one that goes on.
    pub count: u32,
    /// Bits of [`Health`]; 0 = good.
    pub health: u32,
}

/// Bits of [`Sample::health`]. Bad values are flagged and recorded, never silently replaced.
pub struct Health;

impl Health {
    /// No value has ever arrived.
    pub const NEVER: u32 = 1;
    /// The last value is older than the signal's staleness limit.
    pub const STALE: u32 = 1 << 1;
    /// The last value received is outside the signal's configured range.
    pub const OUT_OF_RANGE: u32 = 1 << 2;
    /// The last value received is not a finite number.
    pub const NOT_A_NUMBER: u32 = 1 << 3;
    /// Frames go on, but the value (or the sender's counter) has not changed for too long.
    pub const FROZEN: u32 = 1 << 4;
    /// The sender's counter jumped, went back or repeated.
    pub const COUNTER: u32 = 1 << 5;
}

impl Sample {
    /// A good sample of `value` at `stamp_ns`.
    #[must_use]
    pub fn good(value: f64, stamp_ns: u64, count: u32) -> Self {
        Self { value, stamp_ns, count, health: 0 }
    }

    /// A channel that never received anything.
    #[must_use]
    pub fn never() -> Self {
        Self { value: 0.0, stamp_ns: 0, count: 0, health: Health::NEVER }
    }

    /// Whether a controller may use the value.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.health == 0
    }
}

/// Everything measured, as the bridge or the emulator publishes it: the newest value of each channel.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("rotorbench::Sensors")]
pub struct Sensors {
    /// Counts publications from 1; 0 = nothing published yet.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC at publication.
    pub stamp_ns: u64,
    /// [rad/s] gyroscope, about the bench's axis.
    pub body_rate: Sample,
    /// [rad] encoder or potentiometer at the pivot, where the bench has one; recorded, not used by EMC.
    pub body_angle: Sample,
    /// [m/s²] accelerometer x, y, z.
    pub acceleration: [Sample; 3],
    /// [V] battery.
    pub battery_voltage: Sample,
    /// [rad/s] rotor speeds (mechanical).
    pub propeller_rate: [Sample; ROTORS],
    /// [A] motor or ESC input currents.
    pub current: [Sample; ROTORS],
    /// [N] load cells, where the bench has them.
    pub thrust: [Sample; ROTORS],
}

impl Default for Sensors {
    fn default() -> Self {
        let never = Sample::never();
        Self {
            sequence: 0,
            stamp_ns: 0,
            body_rate: never,
            body_angle: never,
            acceleration: [never; 3],
            battery_voltage: never,
            propeller_rate: [never; ROTORS],
            current: [never; ROTORS],
            thrust: [never; ROTORS],
        }
    }
}
