//! Sums of products of two signals at many lags: by Fourier transforms of short pieces, whose products are summed up before
//! one transform leads back. Each sample costs the same, however long the signals are.

use std::ops::Range;

use rustfft::algorithm::Radix4;
use rustfft::num_complex::Complex64;
use rustfft::{Fft, FftDirection};

use super::moments::squares_about_mean;
use crate::cancel;

/// [samples] of a transform: much longer than the lags, and short enough for the processor's caches.
const LONG: usize = 4_096;
const SHORT: usize = 1_024;

/// A signal with its mean taken off and its size made one; missing values are zero. It is not laid out a second time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Centred<'a> {
    values: &'a [f64],
    mean: f64,
    scale: f64,
}

impl<'a> Centred<'a> {
    pub fn of(values: &'a [f64]) -> Self {
        let (mean, squares) = squares_about_mean(values.iter().copied().filter(|value| value.is_finite()));
        let size = squares.sqrt();
        Self { values, mean, scale: if size > 0.0 { 1.0 / size } else { 0.0 } }
    }

    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether it is more than a constant.
    pub fn moves(&self) -> bool {
        self.scale > 0.0
    }

    pub fn part(&self, rows: Range<usize>) -> impl ExactSizeIterator<Item = f64> + use<'a> {
        let Self { mean, scale, .. } = *self;
        let at = move |value: &f64| if value.is_finite() { (value - mean) * scale } else { 0.0 };
        self.values[rows].iter().map(at)
    }
}

/// Σ a(k + lag) b(k) over the samples that are there, at lags from minus the first number to the second, in that order.
/// Both signals have the same length.
pub(crate) fn lagged_products(a: &Centred, b: &Centred, (before, after): (usize, usize)) -> Vec<f64> {
    let lags = before + after + 1;
    let size = if lags <= SHORT / 4 { SHORT } else { LONG.max((4 * lags).next_power_of_two()) };
    let forward = Radix4::new(size, FftDirection::Forward);
    let mut scratch = vec![Complex64::default(); forward.get_inplace_scratch_len()];
    let mut buffer = vec![Complex64::default(); size];
    let mut sums = vec![Complex64::default(); size / 2 + 1];
    // A piece of b, and what of a lies within the lags of it: the transform, which is periodic, has room for both.
    let step = size - (lags - 1);
    for start in (0..b.len()).step_by(step) {
        cancel::check();
        let end = (start + step).min(b.len());
        // Two real signals as one complex one.
        buffer.fill(Complex64::default());
        let (from, to) = (start.saturating_sub(before), (end + after).min(a.len()));
        let offset = before + from - start;
        buffer[offset..].iter_mut().zip(a.part(from..to)).for_each(|(cell, value)| cell.re = value);
        buffer.iter_mut().zip(b.part(start..end)).for_each(|(cell, value)| cell.im = value);
        forward.process_with_scratch(&mut buffer, &mut scratch);
        for (at, sum) in sums.iter_mut().enumerate() {
            let (here, there) = (buffer[at], buffer[(size - at) % size].conj());
            let (a, b) = (0.5 * (here + there), Complex64::new(0.0, -0.5) * (here - there));
            *sum += a * b.conj();
        }
    }
    // A real sum has a spectrum that mirrors itself.
    let spectrum = (0..size).map(|at| if at <= size / 2 { sums[at] } else { sums[size - at].conj() });
    let mut buffer: Vec<Complex64> = spectrum.collect();
    Radix4::new(size, FftDirection::Inverse).process(&mut buffer);
    buffer.iter().take(lags).map(|value| value.re / size as f64).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_the_sums_of_the_definition() {
        for (length, before, after) in
            [(1, 0, 0), (30, 3, 0), (924, 50, 50), (5_000, 50, 50), (9_000, 0, 200), (9_000, 700, 1)]
        {
            let wave = |k: usize| (0.1 * k as f64).sin() + (k * 7_919 % 101) as f64 / 101.0;
            let (a, b): (Vec<f64>, Vec<f64>) = (0..length).map(|k| (wave(k), wave(3 * k + 11))).unzip();
            let (a, b) = (Centred::of(&a), Centred::of(&b));
            let found = lagged_products(&a, &b, (before, after));
            let (a, b): (Vec<f64>, Vec<f64>) = (a.part(0..length).collect(), b.part(0..length).collect());
            assert_eq!(found.len(), before + after + 1);
            for (place, found) in found.iter().enumerate() {
                let there = (0..length).filter_map(|k| Some(b[k] * a.get((k + place).checked_sub(before)?)?));
                let sum: f64 = there.sum();
                // Rounding: the sums of squares are one.
                assert!((found - sum).abs() < 1e-14, "{length}, {place}: {found} is not {sum}");
            }
        }
    }
}
