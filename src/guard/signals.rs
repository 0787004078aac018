//! Assessment of each measured signal: missing, stale, out of range, no number, frozen.

use super::Cause;
use crate::signal::{Health, Sample};

/// Limits of one signal, resolved.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SignalLimit {
    pub(super) required: bool,
    pub(super) stale_after_ns: u64,
    /// Age at which a warning says that it grows too old: [`super::thresholds::Thresholds::warning_share`] of that.
    pub(super) warning_ns: u64,
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
pub(super) enum SignalState {
    Good,
    /// Bad, and still within the time that the last good value may be used.
    Bad(Cause),
    /// Bad for too long.
    Lost(Cause),
}

impl SignalTrack {
    /// Assesses the newest sample. A value may stay the same for ever while no rotor turns (`turning` = false).
    #[inline]
    pub(super) fn assess(
        &mut self,
        limit: &SignalLimit,
        sample: &Sample,
        now_ns: u64,
        turning: bool,
    ) -> SignalState {
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
            return SignalState::Lost(complaint.unwrap_or(Cause::SignalFrozen));
        }
        match complaint {
            None => {
                self.good_ns = sample.stamp_ns;
                SignalState::Good
            }
            Some(cause) if now_ns.saturating_sub(self.good_ns) > limit.stale_after_ns => {
                SignalState::Lost(cause)
            }
            Some(cause) => SignalState::Bad(cause),
        }
    }
}

impl SignalTrack {
    /// Bits of [`Health`] that only time shows: for a copy of the sample.
    pub(super) fn flags(&self, limit: &SignalLimit, sample: &Sample, now_ns: u64) -> u32 {
        let came = sample.stamp_ns != 0;
        let stale = came && now_ns.saturating_sub(sample.stamp_ns) > limit.stale_after_ns;
        let frozen = came && self.frozen && self.bits == sample.value.to_bits();
        (if stale { Health::STALE } else { 0 }) | (if frozen { Health::FROZEN } else { 0 })
    }
}

/// Whether a sample is old enough to degrade. A stamp from the future is no fresher than one as far in the past.
fn is_old(limit: &SignalLimit, sample: &Sample, now_ns: u64) -> bool {
    now_ns.abs_diff(sample.stamp_ns) > limit.warning_ns
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
    } else if sample.health != 0 || is_old(limit, sample, now_ns) {
        Some(Cause::SignalStale)
    } else {
        None
    }
}
