//! When a frame arrived, on the one clock of all processes.

use super::thresholds::THRESHOLDS;

/// Puts the kernel's (CLOCK_REALTIME) and the adapter's stamps on CLOCK_MONOTONIC.
///
/// Whatever the two clocks do, a stamp never leaves the span in which the frame must have arrived: after the
/// moment at which the queue was last seen empty, and before now. So a stepped clock can make no old frame new.
#[derive(Debug, Clone, Copy)]
pub(super) struct StampClock {
    /// [ns] CLOCK_MONOTONIC at which the queue was last known to be empty.
    pub(super) empty_ns: u64,
    hardware: Option<Offset>,
    /// How far the two clocks of this machine are apart; `None` = never measured.
    distance: Option<Distance>,
}

/// [ns] uncertainty of a reading that needs no other one: half of what the drift adds until the next measurement.
const NARROW_NS: u64 = THRESHOLDS.distance_drift_ns / 2;

/// One clock measured against the other.
#[derive(Debug, Clone, Copy)]
struct Distance {
    /// [ns] CLOCK_REALTIME minus CLOCK_MONOTONIC, wrapping.
    distance_ns: u64,
    /// [ns] CLOCK_MONOTONIC of the measurement.
    measured_ns: u64,
    /// [ns] most that it was off then: half of what the reading took.
    uncertainty_ns: u64,
}

/// Monotonic minus adapter time.
#[derive(Debug, Clone, Copy)]
struct Offset {
    offset_ns: i64,
    stamp_ns: u64,
}

impl StampClock {
    /// For a queue that is empty now.
    pub(super) fn new(empty_ns: u64) -> Self {
        Self { empty_ns, hardware: None, distance: None }
    }

    /// Measures how far CLOCK_REALTIME is from CLOCK_MONOTONIC: each reading of the one lies between two of the other, at
    /// their middle give or take half of their distance. However long the reader was kept from its processor
    /// meanwhile: it is known. Nobody may be waiting, but nobody has to: a narrow reading is the last.
    pub(super) fn measure(
        &mut self,
        mut monotonic_ns: impl FnMut() -> u64,
        mut realtime_ns: impl FnMut() -> u64,
    ) {
        let mut narrowest: Option<Distance> = None;
        let mut before_ns = monotonic_ns();
        for _ in 0..THRESHOLDS.clock_readings {
            let realtime = realtime_ns();
            let after_ns = monotonic_ns();
            let width_ns = after_ns.saturating_sub(before_ns);
            let middle_ns = before_ns.saturating_add(width_ns / 2);
            let found = Distance {
                distance_ns: realtime.wrapping_sub(middle_ns),
                measured_ns: middle_ns,
                uncertainty_ns: width_ns.div_ceil(2),
            };
            if narrowest.is_none_or(|best| found.uncertainty_ns < best.uncertainty_ns) {
                narrowest = Some(found);
            }
            if found.uncertainty_ns <= NARROW_NS {
                break;
            }
            before_ns = after_ns;
        }
        self.distance = narrowest;
    }

    /// Whether it is time to measure, where that makes nobody wait.
    pub(super) fn is_distance_old(&self, now_ns: u64) -> bool {
        self.distance
            .is_none_or(|known| now_ns.saturating_sub(known.measured_ns) > THRESHOLDS.distance_oldest_ns / 2)
    }

    /// [ns] CLOCK_REALTIME at `monotonic_ns`, unless it was measured too long ago.
    pub(super) fn realtime(&self, monotonic_ns: u64) -> Option<u64> {
        let known = self.distance?;
        let is_fresh = monotonic_ns.saturating_sub(known.measured_ns) <= THRESHOLDS.distance_oldest_ns;
        is_fresh.then(|| monotonic_ns.wrapping_add(known.distance_ns))
    }

    /// [ns] most that the kernel's stamp of about `monotonic_ns` is off once it is on CLOCK_MONOTONIC; `None` = no
    /// clock was compared yet.
    pub(super) fn uncertainty_ns(&self, monotonic_ns: u64) -> Option<u64> {
        let known = self.distance?;
        let apart_ns = monotonic_ns.abs_diff(known.measured_ns);
        let drift_ns = apart_ns.div_ceil(THRESHOLDS.distance_oldest_ns / THRESHOLDS.distance_drift_ns);
        Some(known.uncertainty_ns.saturating_add(drift_ns))
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
            Some(known) if seen.abs_diff(known.offset_ns) < THRESHOLDS.adapter_jump_ns => {
                let elapsed = software_ns.saturating_sub(known.stamp_ns);
                seen.min(known.offset_ns.saturating_add((elapsed as f64 * THRESHOLDS.adapter_drift) as i64))
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

    /// Measures with clocks that say these, one after the other.
    fn measure(clock: &mut StampClock, monotonic: [u64; 4], realtime: [u64; 3]) {
        let (mut monotonic, mut realtime) = (monotonic.into_iter(), realtime.into_iter());
        clock.measure(
            || monotonic.next().expect("four readings"),
            || realtime.next().expect("three readings"),
        );
    }

    /// Clocks 7 s apart, read by somebody who is interrupted: before the reading, or after it.
    #[test]
    fn the_narrowest_of_three_readings_counts_and_says_how_sure_it_is() {
        const APART: u64 = 7_000_000_000;
        for (read_at, uncertainty) in [
            ([100, 110, 5_000_120, 9_000_130], 5),
            ([100, 5_000_100, 5_000_112, 9_000_000], 6),
            ([100, 5_000_100, 9_000_000, 9_000_040], 20),
        ] {
            for late in [false, true] {
                let mut clock = StampClock::new(0);
                // The realtime clock is read right after one of two readings of the other, or right before the next.
                let realtime =
                    std::array::from_fn(|i| APART + if late { read_at[i + 1] } else { read_at[i] });
                measure(&mut clock, read_at, realtime);
                let now = 9_000_200;
                let off = clock.realtime(now).expect("measured").abs_diff(now + APART);
                assert!(off <= uncertainty, "{off} ns off with {read_at:?}");
                assert_eq!(off, uncertainty, "the bound is reached: it is no wider than it must be");
                let said = clock.uncertainty_ns(now).expect("measured");
                // 500 ppm of the time since: at most 9 ms.
                assert!((uncertainty..=uncertainty + 4_501).contains(&said), "{said} of {uncertainty}");
            }
        }
        let mut clock = StampClock::new(0);
        measure(&mut clock, [1_000; 4], [APART; 3]);
        assert_eq!(clock.uncertainty_ns(1_000), Some(0));
        // Without an interruption each clock is read no more often than it must be.
        let (mut ours, mut theirs) = (0, 0);
        let reading = |count: &mut u64, at_ns| {
            *count += 1;
            at_ns
        };
        clock.measure(|| reading(&mut ours, 2_000), || reading(&mut theirs, APART));
        assert_eq!((ours, theirs), (2, 1));
        assert_eq!(
            clock.uncertainty_ns(1_000 + THRESHOLDS.distance_oldest_ns),
            Some(THRESHOLDS.distance_drift_ns)
        );
    }

    /// A reading that is as sure as the drift until the next one needs no second.
    #[test]
    fn a_narrow_reading_is_the_last() {
        for (width, readings) in [(40_000, 1), (60_000, 3)] {
            let (mut clock, mut now, mut count) = (StampClock::new(0), 0, 0);
            let monotonic = || {
                now += width;
                now
            };
            let realtime = || {
                count += 1;
                7
            };
            clock.measure(monotonic, realtime);
            assert_eq!(count, readings, "{width} ns wide");
        }
    }

    #[test]
    fn the_distance_of_the_clocks_holds_for_a_tenth_of_a_second() {
        let mut clock = StampClock::new(0);
        assert_eq!((clock.realtime(1_000), clock.uncertainty_ns(1_000)), (None, None));
        assert!(clock.is_distance_old(0));
        measure(&mut clock, [1_000; 4], [500; 3]);
        assert!(!clock.is_distance_old(1_000 + THRESHOLDS.distance_oldest_ns / 2));
        assert!(clock.is_distance_old(1_001 + THRESHOLDS.distance_oldest_ns / 2));
        assert_eq!(
            clock.realtime(1_000 + THRESHOLDS.distance_oldest_ns),
            Some(500 + THRESHOLDS.distance_oldest_ns)
        );
        assert_eq!(clock.realtime(1_001 + THRESHOLDS.distance_oldest_ns), None);
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
