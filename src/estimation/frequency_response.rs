//! Frequency response from data: Welch's averaged periodograms with coherence, beside that of a first-order lag.

use std::ops::Range;

use rustfft::num_complex::Complex64;
use serde::Serialize;

use super::thresholds::THRESHOLDS;
use super::welch::HannTransform;

/// Frequency response at one frequency.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ResponsePoint {
    /// [Hz]
    pub frequency: f64,
    /// [-] magnitude.
    pub magnitude: f64,
    /// [-] standard error of the magnitude.
    pub magnitude_error: f64,
    /// [deg] phase.
    pub phase_deg: f64,
    /// [-] share of the output that the input explains, 0 to 1.
    pub coherence: f64,
}

/// Input and output over one record, row by row; nothing is interpolated.
#[derive(Debug, Clone)]
pub(crate) struct InputOutput<'a> {
    /// [s] rising.
    pub time: &'a [f64],
    /// What drives the system.
    pub input: Vec<f64>,
    /// What it answers; not-a-number = not measured.
    pub output: &'a [f64],
    /// Stretches without holes.
    pub segments: &'a [Range<usize>],
    /// [s] the sampling interval.
    pub interval: f64,
}

/// Response from input to output. Only stretches that are sampled evenly enough are used.
pub(crate) fn response(records: &[InputOutput<'_>]) -> Vec<ResponsePoint> {
    let part = |signals: &InputOutput<'_>, rows: Range<usize>| {
        (signals.input[rows.clone()].to_vec(), signals.output[rows].to_vec())
    };
    let stretches: Vec<(Vec<f64>, Vec<f64>)> = records
        .iter()
        .flat_map(|signals| even_stretches(signals).into_iter().map(move |rows| part(signals, rows)))
        .collect();
    let total: usize = stretches.iter().map(|stretch| stretch.0.len()).sum();
    let interval = records.iter().map(|it| it.interval).find(|&interval| interval > 0.0).unwrap_or(0.0);
    let mut window = THRESHOLDS.longest_window;
    while window > THRESHOLDS.shortest_window && total < THRESHOLDS.fewest_windows * window / 2 {
        window /= 2;
    }
    // Where readings are missing here and there, only shorter windows fit between them.
    let reached = |window: usize| -> usize {
        let halves = stretches.iter().map(|stretch| stretch.0.len() / (window / 2));
        halves.map(|halves| halves.saturating_sub(1) * window / 2).sum()
    };
    while window > THRESHOLDS.shortest_window && reached(window) < total / THRESHOLDS.reached {
        window /= 2;
    }
    welch(&stretches, window, interval)
}

fn even_stretches(signals: &InputOutput<'_>) -> Vec<Range<usize>> {
    let InputOutput { time, output, interval, .. } = signals;
    let mut stretches = Vec::new();
    for segment in signals.segments {
        let mut start = segment.start;
        for row in segment.clone() {
            let step = if row + 1 < segment.end { time[row + 1] - time[row] } else { f64::INFINITY };
            let even = (step - interval).abs() <= THRESHOLDS.interval_jitter * interval;
            let good = output[row].is_finite();
            if !good || !even {
                let end = if good { row + 1 } else { row };
                if end > start + THRESHOLDS.shortest_window {
                    stretches.push(start..end);
                }
                start = row + 1;
            }
        }
    }
    stretches
}

/// Averages over Hann windows that overlap by half. The phase is that of samples taken at the same instants.
fn welch(stretches: &[(Vec<f64>, Vec<f64>)], window: usize, interval: f64) -> Vec<ResponsePoint> {
    let half = window / 2;
    let transform = HannTransform::new(window);
    let mut cross = vec![Complex64::ZERO; half];
    let (mut input_power, mut output_power) = (vec![0.0; half], vec![0.0; half]);
    let mut windows = 0usize;
    let spectrum = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / window as f64;
        transform.of(values.iter().map(|value| value - mean))
    };
    for (input, output) in stretches {
        for rows in transform.windows(input.len()) {
            let (x, y) = (spectrum(&input[rows.clone()]), spectrum(&output[rows]));
            for k in 0..half {
                cross[k] += x[k].conj() * y[k];
                input_power[k] += x[k].norm_sqr();
                output_power[k] += y[k].norm_sqr();
            }
            windows += 1;
        }
    }
    if windows < THRESHOLDS.fewest_windows / 2 || interval <= 0.0 {
        return Vec::new();
    }
    // Half-overlapped Hann windows count as about 0.95 independent ones each (Welch 1967: 18/19).
    let independent = 0.95 * windows as f64;
    (1..half)
        .filter(|&k| input_power[k] > 0.0 && output_power[k] > 0.0)
        .map(|k| {
            let response = cross[k] / input_power[k];
            let coherence = (cross[k].norm_sqr() / (input_power[k] * output_power[k])).min(1.0);
            let relative = ((1.0 - coherence) / (2.0 * independent * coherence.max(1e-6))).sqrt();
            ResponsePoint {
                frequency: k as f64 / (window as f64 * interval),
                magnitude: response.norm(),
                magnitude_error: response.norm() * relative,
                // A lag reaches half a turn at the Nyquist frequency: noise must not throw it to the other side.
                phase_deg: (response.arg().to_degrees() + 270.0).rem_euclid(360.0) - 270.0,
                coherence,
            }
        })
        .collect()
}

/// Response of p/(s + p) behind a transport delay: what [`response`] measures of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagResponse {
    /// [rad/s] p.
    pub pole: f64,
    /// [s] transport delay.
    pub delay: f64,
}

impl LagResponse {
    /// Magnitude [-] and phase [deg], unwound, in continuous time: the black line of [LPC16] Fig. 5.
    #[must_use]
    pub fn continuous(&self, frequency: f64) -> (f64, f64) {
        let turning = std::f64::consts::TAU * frequency;
        let lag = Complex64::new(self.pole, 0.0) / Complex64::new(self.pole, turning);
        (lag.norm(), (lag.arg() - turning * self.delay).to_degrees())
    }

    /// Magnitude [-] and phase [deg], unwound, behind a zero-order hold and sampled every `interval` [s] at the instants
    /// of the changes of its input.
    #[must_use]
    pub fn sampled(&self, interval: f64, frequency: f64) -> (f64, f64) {
        let forward = Complex64::from_polar(1.0, std::f64::consts::TAU * frequency * interval);
        let whole = (self.delay / interval + 1e-9).floor();
        // The input changes this long before the end of an interval.
        let left = interval - (self.delay - whole * interval).max(0.0);
        let (decay, held_part) = ((-self.pole * interval).exp(), (-self.pole * left).exp());
        let input = Complex64::new(1.0 - held_part, 0.0) + (held_part - decay) / forward;
        let lag = input / (forward - decay);
        let phase = lag.arg().to_degrees() - 360.0 * frequency * interval * whole;
        (lag.norm(), near(phase, self.continuous(frequency).1))
    }
}

/// [deg] `phase` by whole turns as near to `other` as it comes.
pub(crate) fn near(phase: f64, other: f64) -> f64 {
    other + (phase - other + 180.0).rem_euclid(360.0) - 180.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    #[test]
    fn finds_the_sampled_lag_and_says_how_sure_it_is() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let decay = (-16.0f64 * 0.02).exp();
        let input: Vec<f64> =
            (0..60_000).map(|_| if random.random::<bool>() { 50.0 } else { -50.0 }).collect();
        let mut state = 0.0;
        let output: Vec<f64> = input
            .iter()
            .map(|z| {
                let noise: f64 = random.sample(StandardNormal);
                let now = state + 1.5 * noise;
                state = decay * state + (1.0 - decay) * z;
                now
            })
            .collect();
        let points = welch(&[(input, output)], 1024, 0.02);
        let mut inside = 0;
        for point in &points {
            let lag = LagResponse { pole: 16.0, delay: 0.0 };
            let (magnitude, phase) = lag.sampled(0.02, point.frequency);
            inside += usize::from((point.magnitude - magnitude).abs() < 2.0 * point.magnitude_error);
            if point.coherence > 0.9 {
                let away = (point.phase_deg - phase + 540.0).rem_euclid(360.0) - 180.0;
                // 1 % of noise over 58 windows, and the window's own leak.
                assert!(away.abs() < 5.0, "{point:?} against {phase}");
            }
        }
        let share = inside as f64 / points.len() as f64;
        assert!((0.85..=1.0).contains(&share), "{share}");
    }

    /// The lag in a thousand Euler steps an interval, its input delayed by one and a half intervals.
    #[test]
    fn the_sampled_response_knows_a_delay_between_two_samples() {
        let (pole, interval, delay) = (16.0, 0.02, 0.031);
        let turning = std::f64::consts::TAU * 6.0;
        let (mut state, mut sum) = (0.0, Complex64::ZERO);
        let held = |time: f64| (turning * interval * (time / interval).floor()).cos();
        // Twice 100 intervals are whole turns of 6 Hz; the first hundred are for the start to be forgotten.
        for row in 0..200 {
            let time = f64::from(row) * interval;
            if row >= 100 {
                sum += Complex64::from_polar(2.0 / 100.0, -turning * time) * state;
            }
            for step in 0..1000 {
                let now = time + (f64::from(step) + 0.5) * interval / 1000.0 - delay;
                state += pole * interval / 1000.0 * (held(now) - state);
            }
        }
        let (magnitude, phase) = LagResponse { pole, delay }.sampled(interval, 6.0);
        // Euler is off by half a step: 1e-5 s of 6 Hz is 0.02 degrees.
        assert!((magnitude - sum.norm()).abs() < 1e-3 * magnitude, "{magnitude} {}", sum.norm());
        assert!((phase - near(sum.arg().to_degrees(), phase)).abs() < 0.1, "{phase} {}", sum.arg());
        // Unwound: a lag of nearly a quarter turn, 31 ms and half an interval of 6 Hz.
        assert!((-180.0..-130.0).contains(&phase), "{phase}");
    }
}
