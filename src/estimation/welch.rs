//! Welch's averaged periodograms: Hann windows that overlap by half.

use std::ops::Range;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftDirection};

/// The Fourier transform under a Hann window.
pub(crate) struct HannTransform {
    shape: Vec<f64>,
    transform: Radix4<f64>,
}

impl HannTransform {
    /// Of windows of so many samples, a power of two.
    pub fn new(window: usize) -> Self {
        let hann = |k: usize| 0.5 - 0.5 * (std::f64::consts::TAU * k as f64 / window as f64).cos();
        Self { shape: (0..window).map(hann).collect(), transform: Radix4::new(window, FftDirection::Forward) }
    }

    /// The windows of a stretch of so many rows.
    pub fn windows(&self, rows: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let window = self.shape.len();
        (0..(rows + 1).saturating_sub(window)).step_by(window / 2).map(move |from| from..from + window)
    }

    /// The transform of one window's values, unscaled.
    pub fn of(&self, values: impl Iterator<Item = f64>) -> Vec<Complex64> {
        let mut buffer: Vec<Complex64> =
            values.zip(&self.shape).map(|(value, shape)| Complex64::new(value * shape, 0.0)).collect();
        self.transform.process(&mut buffer);
        buffer
    }
}

/// One-sided density of the power of what is sampled every `interval` [s], averaged over windows of `window` samples: [Hz]
/// and [unit²/Hz], its integral the variance. `None` where no window fits; windows with values that are missing are left out.
pub(crate) fn power_density<'a>(
    pieces: impl Iterator<Item = &'a [f64]>,
    window: usize,
    interval: f64,
) -> Option<Vec<(f64, f64)>> {
    let transform = HannTransform::new(window);
    let weight: f64 = transform.shape.iter().map(|w| w * w).sum();
    let mut power = vec![0.0; window / 2 + 1];
    let mut count = 0.0;
    for piece in pieces {
        let whole = transform.windows(piece.len()).map(|rows| &piece[rows]);
        for part in whole.filter(|part| part.iter().all(|value| value.is_finite())) {
            let found = transform.of(part.iter().copied());
            power.iter_mut().zip(&found).for_each(|(sum, value)| *sum += value.norm_sqr());
            count += 1.0;
        }
    }
    let step = 1.0 / (window as f64 * interval);
    let density = |(k, sum): (usize, &f64)| (k as f64 * step, 2.0 * sum / count * interval / weight);
    (count > 0.0).then(|| power.iter().enumerate().map(density).collect())
}
