//! When a frame arrived, on the house's one clock.

/// [ns/ns] most that an adapter's clock and the machine's run apart.
const DRIFT: f64 = 200e-6;
/// [ns] beyond which an adapter's clock has been set anew rather than drifted.
const JUMP_NS: u64 = 1_000_000_000;

/// Puts the kernel's (CLOCK_REALTIME) and the adapter's stamps on CLOCK_MONOTONIC.
///
/// Whatever the two clocks do, a stamp never leaves the span in which the frame must have arrived: after the
/// moment at which the queue was last seen empty, and before now. So a stepped clock can make no old frame new.
#[derive(Debug, Clone, Copy)]
pub(super) struct StampClock {
    /// [ns] CLOCK_MONOTONIC at which the queue was last known to be empty.
    pub(super) empty_ns: u64,
    hardware: Option<Offset>,
    /// [ns] CLOCK_REALTIME minus CLOCK_MONOTONIC, wrapping, and when both were read, on the latter; `None` = never.
    realtime: Option<(u64, u64)>,
}

/// [ns] age at which the distance of the two clocks must be measured again. What they run apart meanwhile, at the
/// 500 ppm that a clock is disciplined with at most, is 50 µs.
const DISTANCE_OLDEST_NS: u64 = 100_000_000;

/// Monotonic minus adapter time.
#[derive(Debug, Clone, Copy)]
struct Offset {
    offset_ns: i64,
    stamp_ns: u64,
}

impl StampClock {
    /// For a queue that is empty now.
    pub(super) fn new(empty_ns: u64) -> Self {
        Self { empty_ns, hardware: None, realtime: None }
    }

    /// Takes in both clocks, read at once.
    pub(super) fn measure(&mut self, monotonic_ns: u64, realtime_ns: u64) {
        self.realtime = Some((realtime_ns.wrapping_sub(monotonic_ns), monotonic_ns));
    }

    /// [ns] CLOCK_REALTIME at `monotonic_ns`, unless it was measured too long ago.
    pub(super) fn realtime(&self, monotonic_ns: u64) -> Option<u64> {
        let (distance_ns, measured_ns) = self.realtime?;
        let is_fresh = monotonic_ns.saturating_sub(measured_ns) <= DISTANCE_OLDEST_NS;
        is_fresh.then(|| monotonic_ns.wrapping_add(distance_ns))
    }

    /// [ns] CLOCK_MONOTONIC of the kernel's stamp, given both clocks now.
    pub(super) fn software(&self, stamp_ns: u64, monotonic_ns: u64, realtime_ns: u64) -> u64 {
        let age = if stamp_ns == 0 { 0 } else { realtime_ns.saturating_sub(stamp_ns) };
        self.bound(monotonic_ns.saturating_sub(age), monotonic_ns)
    }

    /// [ns] CLOCK_MONOTONIC of the adapter's stamp, given the kernel's for the same frame. The offset between the
    /// clocks is the least seen, because every delay makes it greater; it may grow only as fast as clocks drift.
    pub(super) fn hardware(&mut self, stamp_ns: u64, software_ns: u64) -> u64 {
        let seen = software_ns.wrapping_sub(stamp_ns) as i64;
        let offset_ns = match self.hardware {
            Some(known) if seen.abs_diff(known.offset_ns) < JUMP_NS => {
                let elapsed = software_ns.saturating_sub(known.stamp_ns);
                seen.min(known.offset_ns.saturating_add((elapsed as f64 * DRIFT) as i64))
            }
            _ => seen,
        };
        self.hardware = Some(Offset { offset_ns, stamp_ns: software_ns });
        self.bound(stamp_ns.wrapping_add_signed(offset_ns), software_ns)
    }

    fn bound(&self, stamp_ns: u64, latest_ns: u64) -> u64 {
        stamp_ns.max(self.empty_ns).min(latest_ns)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever an adapter or a kernel says the time was: never a panic, and never outside the span in which the
        /// frame must have arrived.
        #[test]
        fn absurd_stamps_stay_in_bounds(stamps in prop::collection::vec((any::<u64>(), any::<u64>()), 1..20)) {
            let mut clock = StampClock::new(5_000);
            for (index, (stamp, other)) in stamps.into_iter().enumerate() {
                let now = 10_000 + index as u64;
                let software = clock.software(stamp, now, other);
                prop_assert!((5_000..=now).contains(&software));
                prop_assert!((5_000..=now).contains(&clock.hardware(other, software)));
                // Clocks that are themselves absurd.
                clock.hardware(stamp, other.max(5_000));
            }
        }
    }

    #[test]
    fn a_stepped_clock_makes_no_old_frame_new_nor_a_new_one_old() {
        let clock = StampClock::new(5_000);
        assert_eq!(clock.software(99_000, 10_000, 100_000), 9_000, "an ordinary age of 1 µs");
        assert_eq!(clock.software(99_000, 10_000, 9_000_000), 5_000, "the clock was set forward");
        assert_eq!(clock.software(99_000, 10_000, 50_000), 10_000, "the clock was set back");
        assert_eq!(clock.software(0, 10_000, 100_000), 10_000, "no stamp");
    }

    #[test]
    fn the_distance_of_the_clocks_holds_for_a_tenth_of_a_second() {
        let mut clock = StampClock::new(0);
        assert_eq!(clock.realtime(1_000), None);
        clock.measure(1_000, 500);
        assert_eq!(clock.realtime(1_000 + DISTANCE_OLDEST_NS), Some(500 + DISTANCE_OLDEST_NS));
        assert_eq!(clock.realtime(1_001 + DISTANCE_OLDEST_NS), None);
        // Stamps between two measurements: an ordinary age; and, the clock set meanwhile, still within the span.
        let now = 2_000_000;
        let realtime = clock.realtime(now).expect("fresh");
        assert_eq!(clock.software(realtime - 700, now, realtime), now - 700);
        clock.empty_ns = now - 5_000;
        assert_eq!(clock.software(realtime + 3_600_000_000_000, now, realtime), now);
        assert_eq!(clock.software(1, now, realtime.wrapping_add(3_600_000_000_000)), now - 5_000);
    }

    #[test]
    fn the_adapters_stamp_takes_the_delay_of_the_host_away() {
        let mut clock = StampClock::new(0);
        // The adapter's clock is 1 s behind; the host sees the frames 10, 90 and 30 µs late.
        let seen: Vec<u64> = [(0, 10_000), (1_000_000, 90_000), (2_000_000, 30_000)]
            .into_iter()
            .map(|(hardware, late)| clock.hardware(hardware + 1, hardware + 1_000_000_001 + late))
            .collect();
        // Relative to the first, whose 10 µs stay in the offset: right to the drift that 1 ms allows.
        for (index, stamp) in seen.iter().enumerate() {
            let truth = 1_000_010_001 + index as u64 * 1_000_000;
            assert!(stamp.abs_diff(truth) <= 500, "{stamp} against {truth}");
        }
    }

    #[test]
    fn an_adapter_that_starts_again_is_followed() {
        let mut clock = StampClock::new(0);
        clock.hardware(10_000_000_000, 50_000_000_000);
        assert_eq!(clock.hardware(5, 50_001_000_000), 50_001_000_000);
    }
}
