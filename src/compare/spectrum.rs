//! At which frequencies an error lives.

use super::thresholds::THRESHOLDS;
use serde::Serialize;

use crate::estimation::welch::power_density;

/// Power of an error over frequency.
#[cfg_attr(test, derive(schemars::JsonSchema))]
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
    let density = power_density(pieces, THRESHOLDS.spectrum_piece, interval)?;
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
