//! What is known about the timing of a cycle: counters, histograms, and the numbers a person reads.

use hdrhistogram::Histogram;
use serde::Serialize;

/// [ns] longest span a histogram resolves; longer ones count as this one.
const LONGEST_NS: u64 = 60_000_000_000;
/// Significant decimal digits of a histogram.
const DIGITS: u8 = 3;

/// Counters and histograms of a cycle. No outlier is removed.
#[derive(Debug, Clone)]
pub struct Statistics {
    /// Slots that ran.
    pub run: u64,
    /// Slots that did not.
    pub skipped: u64,
    /// Slots whose command was out after the next slot was due.
    pub overruns: u64,
    /// Longest sequence of overruns.
    pub longest_overrun: u64,
    pub(super) overruns_in_a_row: u64,
    /// [ns] from when the slot that was waited for was due to released: slots slept through count in full.
    pub lateness: Histogram<u64>,
    /// [ns] from released to command out.
    pub execution: Histogram<u64>,
    /// [ns] from due to command out: what the deadline is on.
    pub response: Histogram<u64>,
    /// [ns] from the gyro sample's arrival to released.
    pub sensor_age: Histogram<u64>,
    /// [ns] from the gyro sample's arrival to command out.
    pub sensor_to_command: Histogram<u64>,
}

impl Statistics {
    pub(super) fn new() -> Self {
        Self {
            run: 0,
            skipped: 0,
            overruns: 0,
            longest_overrun: 0,
            overruns_in_a_row: 0,
            lateness: histogram(),
            execution: histogram(),
            response: histogram(),
            sensor_age: histogram(),
            sensor_to_command: histogram(),
        }
    }

    /// Takes in what another cycle of the same period saw.
    pub fn add(&mut self, other: &Self) {
        self.run += other.run;
        self.skipped += other.skipped;
        self.overruns += other.overruns;
        self.overruns_in_a_row = other.overruns_in_a_row;
        self.longest_overrun = self.longest_overrun.max(other.longest_overrun);
        for (ours, theirs) in [
            (&mut self.lateness, &other.lateness),
            (&mut self.execution, &other.execution),
            (&mut self.response, &other.response),
            (&mut self.sensor_age, &other.sensor_age),
            (&mut self.sensor_to_command, &other.sensor_to_command),
        ] {
            // All histograms of this file have the same bounds, so that each value of one has a place in the other.
            let _ = ours.add(theirs);
        }
    }

    /// The numbers a person or a program reads.
    #[must_use]
    pub fn summary(&self) -> Summary {
        Summary {
            slots: self.run + self.skipped,
            run: self.run,
            skipped: self.skipped,
            overruns: self.overruns,
            longest_overrun: self.longest_overrun,
            lateness: Percentiles::of(&self.lateness),
            execution: Percentiles::of(&self.execution),
            response: Percentiles::of(&self.response),
            sensor_age: Percentiles::of(&self.sensor_age),
            sensor_to_command: Percentiles::of(&self.sensor_to_command),
        }
    }
}

/// An empty histogram of spans [ns], from 1 ns to a minute, to three digits.
#[must_use]
pub fn histogram() -> Histogram<u64> {
    // Bounds within what the crate takes; fixed bounds make it allocate here and never again.
    Histogram::new_with_bounds(1, LONGEST_NS, DIGITS)
        .unwrap_or_else(|_| unreachable!("constant bounds are valid"))
}

/// Counts a span [ns]; one beyond the histogram's ends counts at the end.
pub fn record(histogram: &mut Histogram<u64>, span_ns: u64) {
    histogram.saturating_record(span_ns.max(1));
}

/// Timing of a cycle, in numbers.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Slots that have gone by; = run + skipped.
    pub slots: u64,
    /// Slots that ran.
    pub run: u64,
    /// Slots that did not.
    pub skipped: u64,
    /// Slots whose command was out after the next slot was due.
    pub overruns: u64,
    /// Longest sequence of overruns.
    pub longest_overrun: u64,
    /// From when the slot that was waited for was due to released: slots slept through count in full.
    pub lateness: Percentiles,
    /// From released to command out.
    pub execution: Percentiles,
    /// From due to command out: what the deadline is on.
    pub response: Percentiles,
    /// From the gyro sample's arrival to released.
    pub sensor_age: Percentiles,
    /// From the gyro sample's arrival to command out.
    pub sensor_to_command: Percentiles,
}

/// What a histogram says.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    /// Number of values.
    pub count: u64,
    /// [µs]
    pub p50_us: f64,
    /// [µs]
    pub p90_us: f64,
    /// [µs]
    pub p99_us: f64,
    /// [µs]
    pub p99_9_us: f64,
    /// [µs]
    pub p99_99_us: f64,
    /// [µs]
    pub max_us: f64,
}

impl Percentiles {
    /// Of a histogram of nanoseconds; all zero when it is empty.
    #[must_use]
    pub fn of(histogram: &Histogram<u64>) -> Self {
        let at = |quantile| {
            if histogram.is_empty() { 0.0 } else { histogram.value_at_quantile(quantile) as f64 * 1e-3 }
        };
        Self {
            count: histogram.len(),
            p50_us: at(0.5),
            p90_us: at(0.9),
            p99_us: at(0.99),
            p99_9_us: at(0.999),
            p99_99_us: at(0.9999),
            max_us: at(1.0),
        }
    }
}
