//! The periodic cycle on an absolute-time grid, and what is known about its timing.
//!
//! Slot k is due at `start + k * period`. A slot is run, or skipped because an earlier one took too long or because
//! the thread was not woken; slots = run + skipped, whatever the machine's load. Late slots are not run in a burst.

use super::statistics::{Statistics, record};
use crate::signal::CycleSample;

/// A slot that has begun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Release {
    /// Number of the slot, from 0.
    pub slot: u64,
    /// [ns] CLOCK_MONOTONIC when it should have begun.
    pub due_ns: u64,
    /// [ns] CLOCK_MONOTONIC when it began.
    pub released_ns: u64,
}

/// The grid, and where we are on it. Reads no clock: every instant is handed in.
#[derive(Debug)]
pub struct Cycle {
    period_ns: u64,
    /// A slot, and when it is due: the grid goes on from there. Never later than the next slot.
    anchor_slot: u64,
    anchor_ns: u64,
    next_slot: u64,
    statistics: Statistics,
}

impl Cycle {
    /// A grid of `period_ns` (at least 1) whose slot 0 is due at `start_ns`. Allocates everything it will need.
    #[must_use]
    pub fn new(period_ns: u64, start_ns: u64) -> Self {
        Self {
            period_ns: period_ns.max(1),
            anchor_slot: 0,
            anchor_ns: start_ns,
            next_slot: 0,
            statistics: Statistics::new(),
        }
    }

    /// Moves slot 0 to `start_ns`; only before the first slot: real-time set-up may take longer than a period.
    pub fn start_at(&mut self, start_ns: u64) {
        if self.next_slot == 0 {
            self.anchor_ns = start_ns;
        }
    }

    /// [ns] period.
    #[must_use]
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// [ns] CLOCK_MONOTONIC when the next slot is due: the deadline of the wait.
    #[must_use]
    pub fn due_ns(&self) -> u64 {
        self.due_of(self.next_slot)
    }

    fn due_of(&self, slot: u64) -> u64 {
        self.anchor_ns.saturating_add((slot - self.anchor_slot).saturating_mul(self.period_ns))
    }

    /// Number of slots that have gone by, run or skipped.
    #[must_use]
    pub fn slots(&self) -> u64 {
        self.next_slot
    }

    /// Begins the slot that is due at `now_ns`; `None` when none is due yet.
    pub fn begin(&mut self, now_ns: u64) -> Option<Release> {
        if now_ns < self.due_ns() {
            return None;
        }
        let awaited_ns = self.due_ns();
        let slot = self.anchor_slot + (now_ns - self.anchor_ns) / self.period_ns;
        self.statistics.skipped += slot - self.next_slot;
        self.next_slot = slot + 1;
        Some(self.release(slot, self.due_of(slot), now_ns, now_ns - awaited_ns))
    }

    /// Begins a slot now because what it waited for arrived, and lets the grid start again from here: the next slot is
    /// due, should nothing arrive, `grace_ns` later than a period from now.
    pub fn begin_at_arrival(&mut self, now_ns: u64, grace_ns: u64) -> Release {
        let slot = self.next_slot;
        self.next_slot += 1;
        self.anchor_slot = self.next_slot;
        self.anchor_ns = now_ns.saturating_add(self.period_ns).saturating_add(grace_ns);
        self.release(slot, now_ns, now_ns, 0)
    }

    /// The slot that was due has gone by without anything to run for.
    pub fn skip(&mut self) {
        self.next_slot += 1;
        self.statistics.skipped += 1;
    }

    fn release(&mut self, slot: u64, due_ns: u64, released_ns: u64, late_ns: u64) -> Release {
        self.statistics.run += 1;
        record(&mut self.statistics.lateness, late_ns);
        Release { slot, due_ns, released_ns }
    }

    /// Ends the slot: its command was out at `finished_ns`, made from a gyro sample stamped `sensor_ns` (0 = none).
    /// The sample is what recorder and monitor get; its `role` is theirs to set.
    pub fn finish(&mut self, release: Release, finished_ns: u64, sensor_ns: u64) -> CycleSample {
        let statistics = &mut self.statistics;
        let response = finished_ns.saturating_sub(release.due_ns);
        record(&mut statistics.execution, finished_ns.saturating_sub(release.released_ns));
        record(&mut statistics.response, response);
        let mut sensor_age_ns = 0;
        if sensor_ns != 0 {
            sensor_age_ns = release.released_ns.saturating_sub(sensor_ns);
            record(&mut statistics.sensor_age, sensor_age_ns);
            record(&mut statistics.sensor_to_command, finished_ns.saturating_sub(sensor_ns));
        }
        if response > self.period_ns {
            statistics.overruns += 1;
            statistics.overruns_in_a_row += 1;
            statistics.longest_overrun = statistics.longest_overrun.max(statistics.overruns_in_a_row);
        } else {
            statistics.overruns_in_a_row = 0;
        }
        CycleSample {
            slot: release.slot,
            due_ns: release.due_ns,
            released_ns: release.released_ns,
            finished_ns,
            sensor_age_ns,
            skipped: statistics.skipped,
            overruns: statistics.overruns,
            role: 0,
            reserved: 0,
        }
    }

    /// What is known about the timing so far.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Whatever the waking and the working take: every slot is run once or skipped, and none twice.
        #[test]
        fn slots_are_run_or_skipped(
            period in 1_u64..2_000,
            steps in prop::collection::vec((0_u64..7_000, 0_u64..7_000), 1..200),
        ) {
            let start = 1_000_000;
            let mut cycle = Cycle::new(period, start);
            let mut now = start;
            let mut ran = Vec::new();
            for (sleep, work) in steps {
                now += sleep;
                if let Some(release) = cycle.begin(now) {
                    prop_assert_eq!(release.due_ns, start + release.slot * period);
                    prop_assert!(release.due_ns <= now && now < release.due_ns + period);
                    ran.push(release.slot);
                    now += work;
                    cycle.finish(release, now, 0);
                } else {
                    prop_assert!(now < cycle.due_ns());
                }
            }
            prop_assert!(ran.windows(2).all(|pair| pair[0] < pair[1]));
            let summary = cycle.statistics().summary();
            prop_assert_eq!(summary.run, ran.len() as u64);
            prop_assert_eq!(cycle.slots(), ran.last().map_or(0, |last| last + 1));
            prop_assert_eq!(summary.slots, cycle.slots());
        }
    }

    /// A histogram that forgets the time slept through flatters the machine; cyclictest counts it, too.
    #[test]
    fn slots_slept_through_are_lateness() {
        let mut cycle = Cycle::new(100, 1_000);
        let release = cycle.begin(1_370).expect("due");
        assert_eq!((release.slot, release.due_ns), (3, 1_300));
        cycle.finish(release, 1_380, 0);
        let summary = cycle.statistics().summary();
        assert_eq!((summary.run, summary.skipped, summary.overruns), (1, 3, 0));
        assert!((summary.lateness.max_us - 0.370).abs() < 0.001, "{summary:?}");
        assert!((summary.response.max_us - 0.080).abs() < 0.001, "{summary:?}");
    }

    #[test]
    fn an_overrun_is_a_command_after_the_next_slot_is_due() {
        let mut cycle = Cycle::new(100, 1_000);
        for (begin, end) in [(1_000, 1_100), (1_100, 1_201), (1_201, 1_301), (1_301, 1_390)] {
            let release = cycle.begin(begin).expect("due");
            cycle.finish(release, end, 0);
        }
        let summary = cycle.statistics().summary();
        assert_eq!((summary.run, summary.skipped), (4, 0));
        assert_eq!((summary.overruns, summary.longest_overrun), (2, 2));
    }

    #[test]
    fn what_two_cycles_saw_adds_up() {
        let cycle = |lateness: &[u64]| {
            let mut cycle = Cycle::new(100, 1_000);
            for (slot, late) in lateness.iter().enumerate() {
                let begin = 1_000 + 100 * slot as u64 + late;
                let release = cycle.begin(begin).expect("due");
                cycle.finish(release, begin + 90, begin);
            }
            cycle.statistics().clone()
        };
        let (mut one, other) = (cycle(&[1, 2, 30, 31, 32]), cycle(&[3, 40]));
        one.add(&other);
        let summary = one.summary();
        assert_eq!((summary.run, summary.overruns, summary.longest_overrun), (7, 4, 3));
        assert_eq!((summary.lateness.count, summary.sensor_to_command.count), (7, 7));
        assert!((summary.lateness.max_us - 0.04).abs() < 1e-12 && summary.lateness.p50_us > 0.029);
    }

    #[test]
    fn an_arrival_moves_the_grid() {
        let mut cycle = Cycle::new(100, 1_000);
        assert_eq!(cycle.begin_at_arrival(1_030, 50).slot, 0);
        assert_eq!(cycle.due_ns(), 1_180);
        cycle.skip();
        assert_eq!(cycle.due_ns(), 1_280);
        assert_eq!(cycle.begin_at_arrival(1_260, 50).slot, 2);
        assert_eq!(cycle.statistics().summary().slots, 3);
    }

    /// More slots than periods since the machine was started must not put the next one into the far future: it is
    /// the one in which the guard notices that nothing arrives any more.
    #[test]
    fn arrivals_faster_than_the_period_leave_the_next_slot_where_it_belongs() {
        let mut cycle = Cycle::new(100, 1_000);
        for now in 1_000..2_000 {
            cycle.begin_at_arrival(now, 50);
        }
        assert_eq!(cycle.due_ns(), 1_999 + 150);
        assert_eq!(cycle.begin(2_249).map(|release| (release.slot, release.due_ns)), Some((1_001, 2_249)));
    }
}
