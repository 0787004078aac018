//! At which frequencies an error lives.

use super::thresholds::THRESHOLDS;
use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection};
use serde::Serialize;

/// Power of an error over frequency.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spectrum {
    /// [Hz] where low ends and high begins: the rotor's pole, or 1 Hz for the body.
    pub corner_hz: f64,
    /// [-] share of the error's power below the corner.
    pub low: f64,
    /// [-] share above it.
    pub high: f64,
    /// [Hz] and [unit/√Hz], density over frequency.
    #[serde(skip)]
    pub density: Vec<(f64, f64)>,
}

/// Welch's estimate over pieces of a residual that is sampled every `interval` [s]. `None` where no piece is
/// long enough.
pub(crate) fn spectrum<'a>(
    pieces: impl Iterator<Item = &'a [f64]>,
    interval: f64,
    corner_hz: f64,
) -> Option<Spectrum> {
    let transform = Radix4::new(THRESHOLDS.spectrum_piece, FftDirection::Forward);
    let window: Vec<f64> = (0..THRESHOLDS.spectrum_piece)
        .map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / THRESHOLDS.spectrum_piece as f64).cos())
        .collect();
    let weight: f64 = window.iter().map(|w| w * w).sum();
    let mut power = vec![0.0; THRESHOLDS.spectrum_piece / 2 + 1];
    let mut count = 0.0;
    for piece in pieces {
        for start in (0..piece.len().saturating_sub(THRESHOLDS.spectrum_piece - 1))
            .step_by(THRESHOLDS.spectrum_piece / 2)
        {
            let part = &piece[start..start + THRESHOLDS.spectrum_piece];
            if part.iter().any(|value| !value.is_finite()) {
                continue;
            }
            let mut buffer: Vec<Complex<f64>> =
                part.iter().zip(&window).map(|(value, w)| Complex::new(value * w, 0.0)).collect();
            transform.process(&mut buffer);
            for (sum, value) in power.iter_mut().zip(&buffer) {
                *sum += value.norm_sqr();
            }
            count += 1.0;
        }
    }
    if count == 0.0 {
        return None;
    }
    let step = 1.0 / (THRESHOLDS.spectrum_piece as f64 * interval);
    // One-sided density, so that its integral is the variance.
    let density: Vec<(f64, f64)> = power
        .iter()
        .enumerate()
        .map(|(k, sum)| (k as f64 * step, 2.0 * sum / count * interval / weight))
        .collect();
    let total: f64 = density.iter().map(|(_, density)| density).sum();
    let below: f64 = density.iter().filter(|(at, _)| *at < corner_hz).map(|(_, density)| density).sum();
    let low = if total > 0.0 { below / total } else { 0.0 };
    let density = density.into_iter().skip(1).map(|(at, density)| (at, density.sqrt())).collect();
    Some(Spectrum { corner_hz, low, high: 1.0 - low, density })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_is_found_on_its_side_of_the_corner_with_its_power() {
        // Exactly on the grid of a 512-sample piece at 100 Hz: 16 × 0.1953 Hz.
        let hertz = 16.0 * 100.0 / 512.0;
        let tone: Vec<f64> =
            (0..4_096).map(|k| (std::f64::consts::TAU * hertz * 0.01 * f64::from(k)).sin()).collect();
        let found = spectrum(std::iter::once(tone.as_slice()), 0.01, 1.0).unwrap();
        assert!(found.high > 0.99, "{}", found.high);
        let power: f64 = found.density.iter().map(|(_, d)| d * d).sum::<f64>() * 100.0 / 512.0;
        assert!((power - 0.5).abs() < 1e-3, "a sine of size one has a variance of a half: {power}");
        assert!(spectrum(std::iter::once(&tone[..100]), 0.01, 1.0).is_none());
    }
}
