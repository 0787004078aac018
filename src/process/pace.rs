//! Which gyro frames start a control step where the IMU is the trigger: an IMU that sends faster than the control
//! period must not make the controller run faster than it is made for.

use crate::signal::Sample;

/// Picks, of the gyro's frames, the one nearest to a period after the one picked last. At the control period that is
/// each frame, at a multiple of its rate each second, third, fourth.
#[derive(Debug)]
pub(super) struct Pace {
    period_ns: u64,
    /// [ns] stamp of the frame that started the last step; 0 = none did.
    stepped_ns: u64,
    /// [ns] stamp and count of the newest frame looked at.
    seen: (u64, u32),
    /// [ns] between two frames, smoothed.
    interval_ns: u64,
}

impl Pace {
    pub(super) fn new(period_ns: u64) -> Self {
        Self { period_ns, stepped_ns: 0, seen: (0, 0), interval_ns: period_ns }
    }

    /// Whether the newest good value starts a step: its stamp has moved on by a period, less half of the time between
    /// two frames, and less a quarter period at most.
    pub(super) fn is_due(&mut self, gyro: &Sample) -> bool {
        let (seen_ns, seen_count) = self.seen;
        if gyro.stamp_ns == 0 || gyro.stamp_ns == seen_ns {
            return false;
        }
        let frames = u64::from(gyro.count.wrapping_sub(seen_count)).max(1);
        let interval_ns = (gyro.stamp_ns.saturating_sub(seen_ns) / frames).min(self.period_ns);
        self.interval_ns = (self.interval_ns * 7 + interval_ns) / 8;
        self.seen = (gyro.stamp_ns, gyro.count);
        let early_ns = (self.period_ns / 4).min(self.interval_ns / 2);
        let is_due = gyro.stamp_ns.saturating_sub(self.stepped_ns) >= self.period_ns - early_ns;
        if is_due {
            self.stepped_ns = gyro.stamp_ns;
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 20_000_000;

    /// [ns] stamps that start a step, of frames with these stamps.
    fn steps(stamps: impl Iterator<Item = u64>) -> Vec<u64> {
        let mut pace = Pace::new(PERIOD_NS);
        let sample = |(count, stamp_ns)| Sample::good(0.0, stamp_ns, count);
        (1..).zip(stamps).map(sample).filter(|it| pace.is_due(it)).map(|it| it.stamp_ns).collect()
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

    #[test]
    fn a_value_that_is_not_new_or_never_came_starts_nothing() {
        let mut pace = Pace::new(PERIOD_NS);
        assert!(!pace.is_due(&Sample::never()));
        assert!(pace.is_due(&Sample::good(0.1, 5_000_000_000, 1)));
        // A bad value counts, and leaves value and stamp as they were.
        assert!(!pace.is_due(&Sample::good(0.1, 5_000_000_000, 2)));
        assert!(pace.is_due(&Sample::good(0.1, 9_000_000_000, 3)), "after a long silence");
    }
}
