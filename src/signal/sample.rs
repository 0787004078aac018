//! One value of a sensor.

use iceoryx2::prelude::ZeroCopySend;

/// One measured quantity, with its age and its health.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Sample")]
pub struct Sample {
    /// Value in the SI unit of the field that holds it; the last good one while `health` says it is bad.
    pub value: f64,
    /// [ns] CLOCK_MONOTONIC when the value reached this machine; 0 = never.
    pub stamp_ns: u64,
    /// Number of values received so far, wrapping: distinguishes a stream that stopped from one that goes on.
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
    pub const fn never() -> Self {
        Self { value: 0.0, stamp_ns: 0, count: 0, health: Health::NEVER }
    }

    /// Whether a controller may use the value.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.health == 0
    }
}

/// What has never received anything, known when the program is built: each copy of it is one in the loop.
pub(super) trait NeverCame {
    /// A channel, or one for each rotor or axis.
    const NEVER: Self;
}

impl NeverCame for Sample {
    const NEVER: Self = Self::never();
}

impl<const N: usize> NeverCame for [Sample; N] {
    const NEVER: Self = [Sample::never(); N];
}
