//! The benches, their noise, and how often an interval held the truth.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::identify::Estimate;
use crate::screening::rotor_data::RotorLog;

/// With a true coverage of 95 % the count of 300 has a standard deviation of 1.26 %: 90 % lies 4 below, 99 % 3.2
/// above. An estimator whose intervals hold falls outside once in a thousand times, and the seeds are fixed.
pub(crate) const RUNS: usize = 300;
pub(crate) const MEMORIES: [f64; 2] = [0.0, 0.9];

pub(crate) const C_G1: f64 = 447.1;
pub(crate) const C_G2: f64 = 1124.5;
pub(crate) const K_V: f64 = 40.0;
pub(crate) const POLE: f64 = 16.0;
pub(crate) const FULL_VOLTAGE: f64 = 12.6;
pub(crate) const THRUST: f64 = 1.5965e-5;
pub(crate) const INERTIA: f64 = 0.032;
pub(crate) const ARM: f64 = 0.25;

/// Noise of a given strength; each value remembers the one before.
pub(crate) struct ColouredNoise {
    random: ChaCha8Rng,
    memory: f64,
    last: f64,
}

impl ColouredNoise {
    pub fn new(seed: u64, memory: f64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), memory, last: 0.0 }
    }

    pub fn white(&mut self) -> f64 {
        self.random.sample(StandardNormal)
    }

    /// Of variance 1.
    pub fn next(&mut self) -> f64 {
        self.last = self.memory * self.last + (1.0 - self.memory * self.memory).sqrt() * self.white();
        self.last
    }

    pub fn on(&mut self, values: &[f64], strength: f64) -> Vec<f64> {
        values.iter().map(|value| value + strength * self.next()).collect()
    }

    pub fn white_on(&mut self, values: &[f64], strength: f64) -> Vec<f64> {
        values.iter().map(|value| value + strength * self.white()).collect()
    }
}

/// Counts, for one parameter, how often the interval held the truth.
pub(crate) struct Count {
    name: &'static str,
    truth: f64,
    inside: usize,
    errors: Vec<f64>,
}

impl Count {
    pub fn new(name: &'static str, truth: f64) -> Self {
        Self { name, truth, inside: 0, errors: Vec::new() }
    }

    pub fn take(&mut self, estimate: Estimate) {
        self.inside += usize::from(estimate.distance(self.truth) < 1.96);
        self.errors.push((estimate.value - self.truth) / estimate.standard_error);
    }

    pub fn check(&self, memory: f64) {
        let share = self.inside as f64 / RUNS as f64;
        let count = self.errors.len() as f64;
        let mean = self.errors.iter().sum::<f64>() / count;
        let spread = (self.errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / count).sqrt();
        println!("{} memory {memory}: covered {share:.3}, z {mean:+.2} ± {spread:.2}", self.name);
        assert_eq!(self.errors.len(), RUNS, "{}: not every run gave an estimate", self.name);
        assert!((0.9..=0.99).contains(&share), "{}, memory {memory}: covered {share}", self.name);
    }
}

pub(crate) fn g(u: f64) -> f64 {
    C_G1 * u * u + C_G2 * u
}

/// [V] a discharge, faster at first.
pub(crate) fn voltage(t: f64) -> f64 {
    12.2 - 0.004 * t + 0.1 * (-t / 15.0).exp()
}

/// A rotor without noise: command held over `interval` [s], midpoint steps of a twentieth of it.
pub(crate) fn rotor(command: impl Fn(f64) -> f64, interval: f64, rows: usize) -> RotorLog {
    powered(|t, _| voltage(t), command, POLE, interval, rows)
}

/// The same from a battery of `voltage(t, rate)` [V].
pub(crate) fn powered(
    voltage: impl Fn(f64, f64) -> f64,
    command: impl Fn(f64) -> f64,
    pole: f64,
    interval: f64,
    rows: usize,
) -> RotorLog {
    let step = interval / 20.0;
    let time: Vec<f64> = (0..rows).map(|row| row as f64 * interval).collect();
    let command: Vec<f64> = time.iter().map(|&t| command(t)).collect();
    let mut now = g(command[0]) - K_V * (FULL_VOLTAGE - voltage(0.0, 0.0));
    let mut rate = Vec::with_capacity(rows);
    let mut volts = Vec::with_capacity(rows);
    for (t, u) in time.iter().zip(&command) {
        rate.push(now);
        volts.push(voltage(*t, now));
        for part in 0..20 {
            let volts = |rate: f64| voltage(t + (f64::from(part) + 0.5) * step, rate);
            let slope = |rate: f64| pole * (g(*u) - K_V * (FULL_VOLTAGE - volts(rate)) - rate);
            now += step * slope(now + 0.5 * step * slope(now));
        }
    }
    let stretches = std::iter::once(0..rows).collect();
    RotorLog {
        file: "test".to_owned(),
        number: 1,
        time: time.into(),
        command: command.into(),
        command_from: None,
        delay_unknown: 0.0,
        delay_found: 0.0,
        rate: rate.into(),
        voltage: Some(volts.into()),
        voltage_gap: None,
        thrust: None,
        stretches,
        interval,
        instrument: None,
        beside: None,
    }
}

/// The same run measured: 1.5 rad/s of noise on the rate, 0.01 V on the voltage.
pub(crate) fn measured(truth: &RotorLog, noise: &mut ColouredNoise) -> RotorLog {
    let mut log = truth.clone();
    log.rate = noise.on(&truth.rate, 1.5).into();
    log.voltage = truth.voltage.as_ref().map(|volts| noise.white_on(volts, 0.01).into());
    log
}

/// Two levels that nobody can predict, each for 0.1 s: a multiplicative hash of the slot's number.
pub(crate) fn binary(t: f64) -> f64 {
    let slot = ((t + 1e-9) / 0.1).floor() as u32;
    let hash = slot.wrapping_mul(2_654_435_761) ^ (slot.wrapping_mul(40_503) >> 7);
    f64::from((hash >> 13) % 2)
}
