//! Judgement of each measured signal: missing, stale, out of range, no number, frozen.

use std::fmt;

use super::Cause;
use crate::signal::{Health, Sample, Sensors};

/// A measured signal that the guard can watch; the number is the subject of a [`crate::signal::GuardEvent`].
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Gyroscope.
    BodyRate = 0,
    /// Encoder at the pivot.
    BodyAngle = 1,
    /// Battery.
    BatteryVoltage = 2,
    /// Speed of rotor 1.
    PropellerRate1 = 3,
    /// Speed of rotor 2.
    PropellerRate2 = 4,
    /// Current of rotor 1.
    Current1 = 5,
    /// Current of rotor 2.
    Current2 = 6,
    /// Thrust of rotor 1.
    Thrust1 = 7,
    /// Thrust of rotor 2.
    Thrust2 = 8,
}

impl Signal {
    /// Number of signals.
    pub const COUNT: usize = 9;

    /// All signals, in the order of their numbers.
    pub const ALL: [Self; Self::COUNT] = [
        Self::BodyRate,
        Self::BodyAngle,
        Self::BatteryVoltage,
        Self::PropellerRate1,
        Self::PropellerRate2,
        Self::Current1,
        Self::Current2,
        Self::Thrust1,
        Self::Thrust2,
    ];

    /// The signal with this number.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|signal| *signal as u32 == code)
    }

    /// Its newest sample.
    #[must_use]
    pub fn sample(self, sensors: &Sensors) -> &Sample {
        match self {
            Self::BodyRate => &sensors.body_rate,
            Self::BodyAngle => &sensors.body_angle,
            Self::BatteryVoltage => &sensors.battery_voltage,
            Self::PropellerRate1 => &sensors.propeller_rate[0],
            Self::PropellerRate2 => &sensors.propeller_rate[1],
            Self::Current1 => &sensors.current[0],
            Self::Current2 => &sensors.current[1],
            Self::Thrust1 => &sensors.thrust[0],
            Self::Thrust2 => &sensors.thrust[1],
        }
    }
}

impl Signal {
    /// Its newest sample, to be flagged.
    pub(super) fn sample_mut(self, sensors: &mut Sensors) -> &mut Sample {
        match self {
            Self::BodyRate => &mut sensors.body_rate,
            Self::BodyAngle => &mut sensors.body_angle,
            Self::BatteryVoltage => &mut sensors.battery_voltage,
            Self::PropellerRate1 => &mut sensors.propeller_rate[0],
            Self::PropellerRate2 => &mut sensors.propeller_rate[1],
            Self::Current1 => &mut sensors.current[0],
            Self::Current2 => &mut sensors.current[1],
            Self::Thrust1 => &mut sensors.thrust[0],
            Self::Thrust2 => &mut sensors.thrust[1],
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::BodyRate => "body_rate",
            Self::BodyAngle => "body_angle",
            Self::BatteryVoltage => "battery_voltage",
            Self::PropellerRate1 => "propeller_rate 1",
            Self::PropellerRate2 => "propeller_rate 2",
            Self::Current1 => "current 1",
            Self::Current2 => "current 2",
            Self::Thrust1 => "thrust 1",
            Self::Thrust2 => "thrust 2",
        })
    }
}

/// Limits of one signal, resolved.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SignalLimit {
    pub(super) required: bool,
    pub(super) stale_after_ns: u64,
    pub(super) minimum: f64,
    pub(super) maximum: f64,
    /// 0 = never frozen.
    pub(super) frozen_after_ns: u64,
}

/// What the guard remembers of one signal.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SignalTrack {
    /// [ns] stamp of the last good value.
    good_ns: u64,
    /// [ns] when the value last changed.
    changed_ns: u64,
    /// Bits of the last value.
    bits: u64,
    /// Count of the last sample.
    count: u32,
    /// Frames went on with the same value for too long, and no other has come since.
    frozen: bool,
}

/// What a signal is now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Verdict {
    Good,
    /// Bad, and still within the time that the last good value may be used.
    Bad(Cause),
    /// Bad for too long.
    Lost(Cause),
}

impl SignalTrack {
    /// Judges the newest sample. A value may stay the same for ever while no rotor turns (`turning` = false).
    pub(super) fn judge(
        &mut self,
        limit: &SignalLimit,
        sample: &Sample,
        now_ns: u64,
        turning: bool,
    ) -> Verdict {
        let bits = sample.value.to_bits();
        let changed = bits != self.bits;
        let live = sample.count != self.count;
        if changed || !turning {
            self.changed_ns = now_ns;
        }
        (self.bits, self.count) = (bits, sample.count);
        let complaint = complaint(limit, sample, now_ns);
        // Silence is staleness; only frames that go on with the same value are frozen. Where they do because each new
        // value is refused and the last good one stands, why they are refused says more.
        let still_ns = now_ns.saturating_sub(self.changed_ns);
        let still = limit.frozen_after_ns > 0 && still_ns > limit.frozen_after_ns;
        self.frozen = still && (live || self.frozen);
        if still && live {
            return Verdict::Lost(complaint.unwrap_or(Cause::SignalFrozen));
        }
        match complaint {
            None => {
                self.good_ns = sample.stamp_ns;
                Verdict::Good
            }
            Some(cause) if now_ns.saturating_sub(self.good_ns) > limit.stale_after_ns => Verdict::Lost(cause),
            Some(cause) => Verdict::Bad(cause),
        }
    }
}

impl SignalTrack {
    /// Bits of [`Health`] that only time tells: for a copy of the sample.
    pub(super) fn flags(&self, limit: &SignalLimit, sample: &Sample, now_ns: u64) -> u32 {
        let came = sample.stamp_ns != 0;
        let stale = came && now_ns.saturating_sub(sample.stamp_ns) > limit.stale_after_ns;
        let frozen = came && self.frozen && self.bits == sample.value.to_bits();
        (if stale { Health::STALE } else { 0 }) | (if frozen { Health::FROZEN } else { 0 })
    }
}

/// What is wrong with a sample by itself.
fn complaint(limit: &SignalLimit, sample: &Sample, now_ns: u64) -> Option<Cause> {
    let flagged = |bit: u32| sample.health & bit != 0;
    if flagged(Health::NEVER) || sample.stamp_ns == 0 {
        Some(Cause::SignalNever)
    } else if flagged(Health::NOT_A_NUMBER) || !sample.value.is_finite() {
        Some(Cause::SignalNotANumber)
    } else if flagged(Health::OUT_OF_RANGE) || sample.value < limit.minimum || sample.value > limit.maximum {
        Some(Cause::SignalOutOfRange)
    } else if flagged(Health::FROZEN) {
        Some(Cause::SignalFrozen)
    } else if flagged(Health::COUNTER) {
        Some(Cause::SignalCounter)
    } else if sample.health != 0 || now_ns.abs_diff(sample.stamp_ns) > limit.stale_after_ns / 2 {
        // Half of what it may be silent for is already worth a warning. A stamp from the future is no fresher
        // than one as far in the past.
        Some(Cause::SignalStale)
    } else {
        None
    }
}
