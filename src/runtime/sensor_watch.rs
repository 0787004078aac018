//! Whether sensors still come: who flies by them says so when they stop, and when they are back, and not at the end of the run.

use super::thresholds::THRESHOLDS;
use crate::clock;
use crate::rt::{LogQueue, Severity};
use crate::signal::{Channel, Sensors};

/// Looks at the newest values once a period. Neither waits nor allocates.
#[derive(Debug)]
pub(super) struct SensorWatch {
    log: LogQueue,
    silent_after_ns: u64,
    /// [ns] stamp of the last value before the silence; `None` = they come.
    silent_since_ns: Option<u64>,
}

impl SensorWatch {
    pub(super) fn new(log: LogQueue, period_ns: u64) -> Self {
        let periods_ns = period_ns.saturating_mul(THRESHOLDS.silent_periods);
        let silent_after_ns = periods_ns.max(clock::span_ns(THRESHOLDS.sensors_silent_s));
        Self { log, silent_after_ns, silent_since_ns: None }
    }

    /// Takes in what is known at `now_ns`.
    pub(super) fn look(&mut self, now_ns: u64, newest: &Sensors) {
        // The gyro is what a body is flown by; a bench of rotors alone may have none.
        let gyro_ns = newest.body_rate.stamp_ns;
        let any = || Channel::WATCHED.into_iter().map(|channel| channel.of(newest).stamp_ns).max();
        let newest_ns = if gyro_ns > 0 { gyro_ns } else { any().unwrap_or(0) };
        if newest_ns == 0 {
            // None has come yet, which is said elsewhere.
            return;
        }
        let is_silent = now_ns.saturating_sub(newest_ns) > self.silent_after_ns;
        match self.silent_since_ns {
            None if is_silent => {
                self.silent_since_ns = Some(newest_ns);
                let text = if gyro_ns > 0 {
                    "the sensors have stopped: no new body rate; age of the last one [s]"
                } else {
                    "the sensors have stopped: no new value of any; age of the last one [s]"
                };
                self.log.say(Severity::Warning, text, clock::span_s(now_ns.saturating_sub(newest_ns)));
            }
            Some(since_ns) if !is_silent => {
                self.silent_since_ns = None;
                let text = "the sensors are back; they were silent for [s]";
                self.log.say(Severity::Info, text, clock::span_s(newest_ns.saturating_sub(since_ns)));
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Sample;

    const MS: u64 = 1_000_000;

    fn said(log: &LogQueue) -> Vec<(Severity, f64)> {
        std::iter::from_fn(|| log.take()).map(|line| (line.severity, (line.value * 1e3).round())).collect()
    }

    #[test]
    fn sensors_that_stop_and_come_back_are_said_once_each() {
        let log = LogQueue::new(8);
        let mut watch = SensorWatch::new(log.clone(), 20 * MS);
        let mut sensors = Sensors::default();
        watch.look(10_000 * MS, &sensors);
        assert_eq!(said(&log), [], "none has come yet");
        for turn in 0..100 {
            let now_ns = 10_000 * MS + turn * 20 * MS;
            if !(20..70).contains(&turn) {
                sensors.body_rate = Sample::good(0.1, now_ns, turn as u32);
            }
            watch.look(now_ns, &sensors);
        }
        // The last before the silence came in turn 19, the next one in turn 70.
        assert_eq!(said(&log), [(Severity::Warning, 520.0), (Severity::Info, 51.0 * 20.0)]);
    }

    #[test]
    fn without_a_gyro_any_value_counts_and_a_slow_bench_is_given_its_periods() {
        let log = LogQueue::new(8);
        let mut watch = SensorWatch::new(log.clone(), 200 * MS);
        let mut sensors = Sensors::default();
        sensors.propeller_rate[1] = Sample::good(300.0, 1_000 * MS, 1);
        watch.look(3_000 * MS, &sensors);
        assert_eq!(said(&log), []);
        watch.look(3_001 * MS, &sensors);
        assert_eq!(said(&log), [(Severity::Warning, 2_001.0)]);
    }
}
