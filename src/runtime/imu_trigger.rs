//! Which gyro frames start a control step where the IMU is the trigger: an IMU that sends faster than the control
//! period must not make the controller run faster than it is made for.

use super::thresholds::THRESHOLDS;
use crate::signal::Sample;

/// Picks, of the gyro's frames, those nearest to a schedule of one step a period, which follows the IMU's own clock. At
/// the control rate that is each frame, however it jitters by less than half a period; at a multiple of it each second,
/// third, fourth.
///
/// Whatever the frames do: no two steps are closer than half a period, and of n steps in a row the last is
/// `n (1 - 1/16) - 2` periods or more after the first.
#[derive(Debug)]
pub(crate) struct ImuTrigger {
    period_ns: u64,
    /// [ns] stamp of the frame that started the last step; 0 = none did.
    stepped_ns: u64,
    /// [ns] stamp that the next step's frame would have, were there no jitter.
    scheduled_ns: u64,
    /// [ns] stamp and count of the newest frame looked at.
    seen: (u64, u32),
    /// [ns] between two frames, smoothed; at first as if the IMU kept the control rate.
    interval_ns: u64,
}

impl ImuTrigger {
    pub(crate) fn new(period_ns: u64) -> Self {
        Self { period_ns, stepped_ns: 0, scheduled_ns: 0, seen: (0, 0), interval_ns: period_ns }
    }

    /// Whether the newest good value starts a step: no later frame will be nearer to the schedule.
    pub(crate) fn is_due(&mut self, gyro: &Sample) -> bool {
        let (stamp_ns, half_ns) = (gyro.stamp_ns, self.period_ns / 2);
        if stamp_ns == 0 || stamp_ns == self.seen.0 {
            return false;
        }
        self.look(gyro);
        let early_ns = half_ns / self.frames_per_period();
        let is_near = stamp_ns.saturating_add(early_ns) >= self.scheduled_ns;
        // Frames that were held up come all at once: only one of them.
        if !is_near || stamp_ns.saturating_sub(self.stepped_ns) < half_ns {
            return false;
        }
        self.stepped_ns = stamp_ns;
        self.scheduled_ns = self.period_ns.saturating_add(if stamp_ns < self.scheduled_ns {
            self.scheduled_ns - (self.scheduled_ns - stamp_ns) / THRESHOLDS.followed_share
        } else if stamp_ns - self.scheduled_ns <= half_ns {
            self.scheduled_ns + (stamp_ns - self.scheduled_ns) / THRESHOLDS.followed_share
        } else {
            // The first, or one after a silence, or of an IMU slower than the control rate.
            stamp_ns
        });
        true
    }

    /// Learns the time between two frames.
    fn look(&mut self, gyro: &Sample) {
        let (seen_ns, seen_count) = self.seen;
        self.seen = (gyro.stamp_ns, gyro.count);
        if seen_ns == 0 {
            return;
        }
        let frames = u64::from(gyro.count.wrapping_sub(seen_count)).max(1);
        // A silence says nothing of it.
        let interval_ns = (gyro.stamp_ns.saturating_sub(seen_ns) / frames).min(2 * self.period_ns);
        self.interval_ns =
            (self.interval_ns * (THRESHOLDS.interval_memory - 1) + interval_ns) / THRESHOLDS.interval_memory;
    }

    /// To the nearest whole number, at least 1.
    fn frames_per_period(&self) -> u64 {
        let frames = (2 * self.period_ns + self.interval_ns).checked_div(2 * self.interval_ns);
        frames.unwrap_or(1).clamp(1, self.period_ns.max(1))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const PERIOD_NS: u64 = 20_000_000;

    /// [ns] stamps that start a step, of frames with these stamps.
    fn steps(stamps: impl Iterator<Item = u64>) -> Vec<u64> {
        let mut imu_trigger = ImuTrigger::new(PERIOD_NS);
        let sample = |(count, stamp_ns)| Sample::good(0.0, stamp_ns, count);
        (1..).zip(stamps).map(sample).filter(|it| imu_trigger.is_due(it)).map(|it| it.stamp_ns).collect()
    }

    /// Frames at `factor` times the control rate for 4 s, each late by up to a tenth of their interval.
    fn frames(factor: f64) -> impl Iterator<Item = u64> {
        let interval_ns = PERIOD_NS as f64 / factor;
        (0..(200.0 * factor) as u64).map(move |frame| {
            let late = 0.1 * (frame as f64 * 1.618).fract();
            1_000_000_000 + ((frame as f64 + late) * interval_ns) as u64
        })
    }

    #[test]
    fn an_imu_of_any_multiple_of_the_control_rate_steps_it_at_its_own() {
        for factor in [1.0, 2.0, 3.0, 4.0, 8.0, 20.0] {
            let steps = steps(frames(factor));
            assert!((199..=201).contains(&steps.len()), "{} steps at {factor} times the rate", steps.len());
            // Once the interval is known: 16 frames.
            let gaps: Vec<u64> = steps.windows(2).skip(16).map(|pair| pair[1] - pair[0]).collect();
            assert!(
                gaps.iter().all(|gap| gap.abs_diff(PERIOD_NS) <= PERIOD_NS / 8),
                "{factor} times the rate: {gaps:?}"
            );
        }
    }

    /// An IMU whose clock is off by a hundredth: each frame steps, and none is left out in the long run.
    #[test]
    fn an_imu_at_the_control_rate_by_its_own_clock_steps_it_with_each_frame() {
        for factor in [0.99, 1.01] {
            let count = frames(factor).count();
            assert_eq!(steps(frames(factor)).len(), count, "{factor} times the rate");
        }
    }

    proptest! {
        /// At exactly the control rate each frame is a step, none left out and none made up, however the frames are late by
        /// less than half a period: by delays of any kind, drawn anew for each frame.
        #[test]
        fn jitter_below_half_a_period_loses_no_step(late in prop::collection::vec(0..PERIOD_NS / 2, 1..300)) {
            let frames = (1_u64..).zip(&late).map(|(frame, late)| 7_000_000_000 + frame * PERIOD_NS + late);
            prop_assert_eq!(steps(frames).len(), late.len());
        }

        /// At a multiple of the control rate one step a period, with jitter up to nearly half of the time between two frames:
        /// half of it could not be distinguished from the frame beside.
        #[test]
        fn a_faster_imu_that_jitters_steps_once_a_period(
            factor in 2_u64..9,
            late in prop::collection::vec(0.0..0.45, 900),
        ) {
            let interval_ns = (PERIOD_NS / factor) as f64;
            let frames = (0..).zip(&late).map(|(frame, late)| {
                7_000_000_000 + ((f64::from(frame) + late) * interval_ns) as u64
            });
            let steps = steps(frames);
            let periods = 900 / factor;
            // Until the interval is known, in the first dozen frames, a step may be early.
            prop_assert!(steps.len().abs_diff(periods as usize) <= 2, "{} steps in {periods}", steps.len());
        }

        /// Whatever comes, whenever: frames in bunches, silence, an IMU at any rate.
        #[test]
        fn no_frames_of_any_kind_make_the_controller_faster(
            gaps in prop_oneof![
                prop::collection::vec(prop_oneof![0..PERIOD_NS / 4, 0..2 * PERIOD_NS], 1..400),
                (0..2 * PERIOD_NS).prop_map(|gap| vec![gap; 300]),
            ],
        ) {
            let mut now_ns = 7_000_000_000;
            let steps = steps(gaps.into_iter().map(|gap| { now_ns += gap; now_ns }));
            prop_assert!(steps.windows(2).all(|pair| pair[1] - pair[0] >= PERIOD_NS / 2));
            for (first, from) in steps.iter().enumerate() {
                for (count, to) in (0_u64..).zip(&steps[first..]) {
                    let least = (count * PERIOD_NS * 15 / 16).saturating_sub(PERIOD_NS + 400);
                    prop_assert!(to - from >= least, "{count} steps in {} ns", to - from);
                }
            }
        }
    }

    /// An IMU between two multiples of the control rate: neither each frame nor each second one is a period after the one
    /// before. On average they are.
    #[test]
    fn an_imu_at_one_and_a_half_times_the_control_rate_steps_it_at_its_own() {
        for factor in [1.3, 1.4, 1.5, 1.7, 2.5] {
            let steps = steps(frames(factor));
            // The schedule follows the frames by a sixteenth of a period at most: 200 periods are 213 steps at most.
            assert!((186..=214).contains(&steps.len()), "{} steps at {factor} times the rate", steps.len());
        }
    }

    #[test]
    fn a_value_that_is_not_new_or_never_came_starts_nothing() {
        let mut imu_trigger = ImuTrigger::new(PERIOD_NS);
        assert!(!imu_trigger.is_due(&Sample::never()));
        assert!(imu_trigger.is_due(&Sample::good(0.1, 5_000_000_000, 1)));
        // A bad value counts, and leaves value and stamp as they were.
        assert!(!imu_trigger.is_due(&Sample::good(0.1, 5_000_000_000, 2)));
        assert!(imu_trigger.is_due(&Sample::good(0.1, 9_000_000_000, 3)), "after a long silence");
    }
}
