//! `jitter`: how punctual this machine is, from a bare cycle to the whole loop, beside cyclictest in the same run.
//!
//! Each round measures every stage once, one after the other, forwards and backwards in turn, so that what changes
//! slowly on the machine meets all of them. Figures of different rounds are held against cyclictest of the same round.

mod config;
mod cyclictest;
mod measurement;

use std::time::SystemTime;

use hdrhistogram::Histogram;
use serde::Serialize;

use crate::clock;
use crate::estimation::quantile::middle;
use crate::rt::{self, Granted, Machine, Percentiles, RealTimeConfig, Shutdown, Statistics, Summary, Usage};
use crate::runtime::ProcessError;
use crate::screening::Finding;

pub use config::JitterConfig;
pub use cyclictest::Cyclictest;
pub use measurement::Stage;

/// What one stage showed.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct StageResult {
    /// What ran in the cycle.
    pub stage: Stage,
    /// Why it was not measured; the rest is then absent. Beside it in the JSON, as a sentence: `not_measured`.
    pub finding: Option<Finding>,
    /// Timing over all rounds.
    pub timing: Option<Summary>,
    /// What the kernel counted of the cycle's thread.
    pub usage: Usage,
    /// What the system granted the cycle's thread.
    pub granted: Option<Granted>,
    /// Release lateness of each round.
    pub rounds: Vec<Percentiles>,
    /// Its release lateness over cyclictest's latency of the same round, median over the rounds.
    pub to_cyclictest: Option<Ratios>,
    /// Histograms and counters over all rounds.
    #[serde(skip)]
    pub statistics: Option<Statistics>,
}

/// What cyclictest showed.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct CyclictestResult {
    /// Why it was not measured; the rest is then absent. Beside it in the JSON, as a sentence: `not_measured`.
    pub finding: Option<Finding>,
    /// How it was called.
    pub command: String,
    /// Its latency over all rounds.
    pub latency: Option<Percentiles>,
    /// Its latency of each round.
    pub rounds: Vec<Percentiles>,
    /// The same as a histogram [ns].
    #[serde(skip)]
    pub histogram: Histogram<u64>,
}

/// Figures over a yardstick's.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ratios {
    /// Of the medians.
    pub p50: f64,
    /// Of the 99th percentiles.
    pub p99: f64,
    /// Of the 99.9th percentiles.
    pub p99_9: f64,
}

/// The whole measurement.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Jitter {
    /// [s] period of the cycles.
    pub period_s: f64,
    /// [s] asked for, for each stage.
    pub seconds: f64,
    /// Rounds asked for.
    pub rounds: u32,
    /// Whether it was ended before its time.
    pub is_cut_short: bool,
    /// The machine.
    pub machine: Machine,
    /// What was asked of the system.
    pub asked: RealTimeConfig,
    /// The stages, in the order of what they hold.
    pub stages: Vec<StageResult>,
    /// The yardstick.
    pub cyclictest: CyclictestResult,
    /// When it began.
    #[serde(skip)]
    pub began: SystemTime,
    /// [s] it took.
    #[serde(skip)]
    pub took_s: f64,
}

/// Measures until all is done or `shutdown`; `progress` is called with the share of the whole that is done, 0..1.
///
/// # Errors
/// Settings that cannot be; a stage other than the bus that cannot run.
pub fn jitter(
    config: &JitterConfig,
    shutdown: &Shutdown,
    mut progress: impl FnMut(f64),
) -> Result<Jitter, ProcessError> {
    config.check()?;
    let start_ns = clock::monotonic_ns();
    let granted = measurement::granted(&config.bench.real_time)?;
    let mut jitter = Jitter {
        period_s: config.bench.period_s,
        seconds: config.seconds,
        rounds: config.rounds,
        is_cut_short: false,
        machine: Machine::look(),
        asked: config.bench.real_time.clone(),
        stages: Stage::ALL.into_iter().map(StageResult::new).collect(),
        cyclictest: CyclictestResult::new(config),
        began: SystemTime::now(),
        took_s: 0.0,
    };
    let whole = f64::from(config.rounds) * (Stage::ALL.len() + 1) as f64;
    let mut done = 0.0;
    for round in 0..config.rounds {
        let stages = Stage::ALL.len();
        let forwards = 0..=stages;
        let order: Vec<usize> = if round % 2 == 0 { forwards.collect() } else { forwards.rev().collect() };
        for place in order {
            if shutdown.is_requested() {
                jitter.is_cut_short = true;
                break;
            }
            match jitter.stages.get_mut(place) {
                Some(result) => result.measure(config, shutdown)?,
                None => jitter.cyclictest.measure(config, &granted, shutdown),
            }
            done += 1.0;
            progress(done / whole);
        }
    }
    jitter.is_cut_short |= shutdown.is_requested();
    jitter.summarize();
    jitter.took_s = clock::span_s(clock::monotonic_ns().saturating_sub(start_ns));
    Ok(jitter)
}

impl Jitter {
    /// Whether a command was late past its period, or never came, in any stage.
    #[must_use]
    pub fn has_missed(&self) -> bool {
        let mut timings = self.stages.iter().filter_map(|it| it.timing.as_ref());
        timings.any(|timing| timing.overruns + timing.skipped > 0)
    }

    fn summarize(&mut self) {
        let yardstick = &self.cyclictest;
        for result in &mut self.stages {
            result.timing = result.statistics.as_ref().map(Statistics::summary);
            result.to_cyclictest = Ratios::median_of(&result.rounds, &yardstick.rounds);
        }
        if !self.cyclictest.rounds.is_empty() {
            self.cyclictest.latency = Some(Percentiles::of(&self.cyclictest.histogram));
        }
    }
}

impl StageResult {
    fn new(stage: Stage) -> Self {
        Self {
            stage,
            finding: None,
            timing: None,
            usage: Usage::default(),
            granted: None,
            rounds: Vec::new(),
            to_cyclictest: None,
            statistics: None,
        }
    }

    fn measure(&mut self, config: &JitterConfig, shutdown: &Shutdown) -> Result<(), ProcessError> {
        if self.finding.is_some() {
            return Ok(());
        }
        let measured = match measurement::measure(self.stage, config, config.slots(), shutdown) {
            Ok(measured) => measured,
            // A machine without a bus is no failure: it is what the user asked to know.
            Err(error) if self.stage == Stage::Bus => {
                self.finding = Some(without_bus(&config.bench.bus.interface, &error));
                return Ok(());
            }
            Err(error) => return Err(error),
        };
        self.usage = self.usage.and(measured.usage);
        self.granted = Some(measured.granted);
        self.rounds.push(Percentiles::of(&measured.statistics.lateness));
        match &mut self.statistics {
            Some(statistics) => statistics.add(&measured.statistics),
            none => *none = Some(measured.statistics),
        }
        Ok(())
    }
}

/// Why nothing was measured on the bus.
fn without_bus(interface: &str, error: &ProcessError) -> Finding {
    match error {
        ProcessError::JitterOnHardware { .. } => Finding::new("interface_not_named", interface),
        _ => Finding::new("bus_unusable", interface).with("reason", error.to_string()),
    }
}

impl CyclictestResult {
    fn new(config: &JitterConfig) -> Self {
        let missing = || Finding::new("cyclictest_missing", cyclictest::NAME);
        Self {
            finding: config.cyclictest.is_none().then(missing),
            command: String::new(),
            latency: None,
            rounds: Vec::new(),
            histogram: rt::histogram(),
        }
    }

    fn measure(&mut self, config: &JitterConfig, granted: &Granted, shutdown: &Shutdown) {
        let (Some(cyclictest), None) = (&config.cyclictest, &self.finding) else { return };
        let asked = &config.bench.real_time;
        // What we did not get it would not get either, and it would not run without.
        let settings = RealTimeConfig {
            priority: granted.priority,
            lock_memory: asked.lock_memory && granted.locked_kb > 0,
            processor: asked.processor.filter(|it| granted.processors == [*it]),
            ..asked.clone()
        };
        let call = cyclictest.call(&settings, clock::span_ns(config.bench.period_s), config.slots());
        self.command = call.join(" ");
        match cyclictest::run(&call, shutdown) {
            Ok(histogram) => {
                self.rounds.push(Percentiles::of(&histogram));
                // The same bounds: each value of one has a place in the other.
                let _ = self.histogram.add(&histogram);
            }
            Err(finding) => self.finding = Some(finding),
        }
    }
}

impl Ratios {
    /// Medians of the ratios of each round to the yardstick's round; `None` without a common round.
    fn median_of(rounds: &[Percentiles], yardstick: &[Percentiles]) -> Option<Self> {
        let pairs: Vec<_> = rounds.iter().zip(yardstick).collect();
        let median = |figure: fn(&Percentiles) -> f64| {
            middle(pairs.iter().map(|(ours, theirs)| figure(ours) / figure(theirs)))
        };
        Some(Self {
            p50: median(|it| it.p50_us)?,
            p99: median(|it| it.p99_us)?,
            p99_9: median(|it| it.p99_9_us)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::BenchConfig;

    fn percentiles(p50_us: f64) -> Percentiles {
        Percentiles {
            count: 1,
            p50_us,
            p90_us: p50_us,
            p99_us: 2.0 * p50_us,
            p99_9_us: 4.0,
            p99_99_us: 4.0,
            max_us: 4.0,
        }
    }

    #[test]
    fn ratios_are_medians_over_the_rounds_both_have() {
        let ours = [3.0, 10.0, 2.0, 100.0].map(percentiles);
        let ratios =
            Ratios::median_of(&ours, &[1.0, 1.0, 1.0].map(percentiles)).expect("three common rounds");
        assert_eq!((ratios.p50, ratios.p99, ratios.p99_9), (3.0, 3.0, 1.0));
        let even = Ratios::median_of(&ours[..2], &[1.0, 1.0].map(percentiles)).expect("two");
        assert!((even.p50 - 6.5).abs() < 1e-12);
        assert_eq!(Ratios::median_of(&ours, &[]), None);
    }

    #[test]
    fn what_cannot_be_measured_is_refused() {
        let config = |seconds, rounds, period_s| JitterConfig {
            bench: BenchConfig { period_s, ..BenchConfig::default() },
            seconds,
            rounds,
            is_interface_named: false,
            cyclictest: None,
        };
        assert!(config(1.0, 5, 0.001).check().is_ok());
        for wrong in [
            config(1.0, 0, 0.001),
            config(0.1, 5, 0.001),
            config(f64::NAN, 5, 0.001),
            config(1e9, 5, 0.001),
            config(1.0, 5, 0.2),
        ] {
            assert!(matches!(wrong.check(), Err(ProcessError::Jitter { .. })), "{wrong:?}");
        }
        assert!(matches!(config(1.0, 1, 5.0).check(), Err(ProcessError::Bench(_))));
        assert_eq!(config(1.0, 5, 0.001).slots(), 200);
    }
}
