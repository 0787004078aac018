//! Frequency response from data: Welch's averaged periodograms with coherence, beside the model's.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;
use serde::Serialize;

use super::rotor_log::RotorLog;

/// Samples in a window at most; at least eight windows must fit.
const LONGEST_WINDOW: usize = 2048;
const FEWEST_WINDOWS: usize = 8;
/// Sampling intervals may differ this much from their median in a record taken as uniform.
const JITTER: f64 = 0.2;

/// Frequency response ω_p over z at one frequency.
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

/// Response of the rotor from z = g(u) - k_V (v_bmax - v_b) to the measured rate.
///
/// Only stretches that are sampled evenly enough are used; nothing is interpolated.
pub(super) fn response(rotors: &[RotorLog], z: impl Fn(&RotorLog, usize) -> f64) -> Vec<ResponsePoint> {
    let mut stretches: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    for rotor in rotors {
        for rows in even_stretches(rotor) {
            stretches.push(rows.map(|row| (z(rotor, row), rotor.rate[row])).unzip());
        }
    }
    let total: usize = stretches.iter().map(|stretch| stretch.0.len()).sum();
    let interval = rotors.iter().map(|rotor| rotor.interval).find(|&interval| interval > 0.0).unwrap_or(0.0);
    let mut window = LONGEST_WINDOW;
    while window > 64 && total < FEWEST_WINDOWS * window / 2 {
        window /= 2;
    }
    welch(&stretches, window, interval)
}

fn even_stretches(rotor: &RotorLog) -> Vec<std::ops::Range<usize>> {
    let mut stretches = Vec::new();
    for segment in &rotor.segments {
        let mut start = segment.start;
        for row in segment.clone() {
            let step =
                if row + 1 < segment.end { rotor.time[row + 1] - rotor.time[row] } else { f64::INFINITY };
            let even = (step - rotor.interval).abs() <= JITTER * rotor.interval;
            let good = rotor.rate[row].is_finite();
            if !good || !even {
                let end = if good { row + 1 } else { row };
                if end > start + 64 {
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
    let shape: Vec<f64> =
        (0..window).map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / window as f64).cos()).collect();
    let transform = FftPlanner::new().plan_fft_forward(window);
    let mut cross = vec![Complex64::ZERO; half];
    let (mut input_power, mut output_power) = (vec![0.0; half], vec![0.0; half]);
    let mut windows = 0usize;
    let spectrum = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / window as f64;
        let mut buffer: Vec<Complex64> = values
            .iter()
            .zip(&shape)
            .map(|(value, shape)| Complex64::new((value - mean) * shape, 0.0))
            .collect();
        transform.process(&mut buffer);
        buffer
    };
    for (input, output) in stretches {
        let mut start = 0;
        while start + window <= input.len() {
            let (x, y) = (spectrum(&input[start..start + window]), spectrum(&output[start..start + window]));
            for k in 0..half {
                cross[k] += x[k].conj() * y[k];
                input_power[k] += x[k].norm_sqr();
                output_power[k] += y[k].norm_sqr();
            }
            windows += 1;
            start += half;
        }
    }
    if windows < FEWEST_WINDOWS / 2 || interval <= 0.0 {
        return Vec::new();
    }
    // Half-overlapped Hann windows are worth about 0.95 independent ones each (Welch 1967: 18/19).
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

/// Magnitude [-] and phase [deg] of p/(s + p) behind a zero-order hold, sampled every `interval` [s] at the
/// instants of the commands: what [`response`] measures when the model is right.
#[must_use]
pub fn sampled_lag(pole: f64, interval: f64, frequency: f64) -> (f64, f64) {
    let decay = (-pole * interval).exp();
    let forward = Complex64::from_polar(1.0, std::f64::consts::TAU * frequency * interval);
    let response = Complex64::new(1.0 - decay, 0.0) / (forward - decay);
    (response.norm(), response.arg().to_degrees())
}

/// Magnitude [-] and phase [deg] of the continuous-time p/(s + p): the black line of [LPC16] Fig. 5.
#[must_use]
pub fn continuous_lag(pole: f64, frequency: f64) -> (f64, f64) {
    let response = Complex64::new(pole, 0.0) / Complex64::new(pole, std::f64::consts::TAU * frequency);
    (response.norm(), response.arg().to_degrees())
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
            let (magnitude, phase) = sampled_lag(16.0, 0.02, point.frequency);
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
}
