//! Where two signals resemble each other most, and how much unrelated ones would.

use std::ops::Range;

use super::lagged_products::{Centred, lagged_products};
use super::thresholds::THRESHOLDS;

/// Where the cross-correlation of a signal with another is largest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// [samples] by how much the first signal comes later than the second.
    pub lag: i64,
    /// [-] correlation there, over the samples that both share.
    pub correlation: f64,
    /// [-] standard error of a correlation between two unrelated signals of the same colour (Bartlett).
    pub standard_error: f64,
}

/// A signal, and how it resembles itself some samples later.
#[derive(Debug, Clone)]
pub struct Coloured<'a> {
    signal: Centred<'a>,
    colour: Vec<f64>,
    known: usize,
    most_lag: usize,
}

impl<'a> Coloured<'a> {
    /// A signal that is to be compared over lags of at most `most_lag` samples to both sides; values that are not finite
    /// are missing.
    #[must_use]
    pub fn of(signal: &'a [f64], most_lag: usize) -> Self {
        let known = signal.iter().filter(|value| value.is_finite()).count();
        let signal = Centred::of(signal);
        // Bartlett's sum needs the colour until it has died away.
        let reach = THRESHOLDS.colour_lags * most_lag.min(signal.len() / THRESHOLDS.shortest_of_lag);
        Self { colour: lagged_products(&signal, &signal, (0, reach)), signal, known, most_lag }
    }

    /// Where it resembles another signal of the same samples most; `None` where nothing is in common.
    #[must_use]
    pub fn with(&self, other: &Self) -> Option<Peak> {
        if !(self.signal.moves() && other.signal.moves()) {
            return None;
        }
        // Bartlett: the variance of a correlation between two coloured signals that are unrelated.
        let products = self.colour.iter().zip(&other.colour).skip(1).map(|(a, b)| a * b);
        let stretch: f64 = 1.0 + 2.0 * products.sum::<f64>();
        let standard_error = (stretch.max(1.0) / self.known as f64).sqrt();
        let most = self.most_lag.min(self.signal.len() / THRESHOLDS.shortest_of_lag);
        let products = lagged_products(&self.signal, &other.signal, (most, most));
        let at = |lag: i64| {
            let (late, early) = (lag.max(0) as usize, (-lag).max(0) as usize);
            let (a, b) = (Part::of(&self.signal, late, early), Part::of(&other.signal, early, late));
            (lag, overlapping(&a, &b, products[(most as i64 + lag) as usize]))
        };
        let peak = (0..=most as i64).chain((1..=most as i64).map(|lag| -lag)).map(at);
        let peak = peak.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (lag, correlation) = peak.filter(|(_, correlation)| *correlation != 0.0)?;
        Some(Peak { lag, correlation, standard_error })
    }
}

/// A centred signal without some samples at its beginning and its end.
struct Part<'a> {
    signal: &'a Centred<'a>,
    rows: Range<usize>,
    /// The sum of the squares of what is left; of all of it that is one.
    power: f64,
}

impl<'a> Part<'a> {
    fn of(signal: &'a Centred<'a>, first: usize, last: usize) -> Self {
        let rows = first..signal.len() - last;
        let outside = signal.part(0..rows.start).chain(signal.part(rows.end..signal.len()));
        Self { signal, rows, power: 1.0 - outside.map(|value| value * value).sum::<f64>() }
    }

    fn times(&self, other: &Self) -> f64 {
        self.signal
            .part(self.rows.clone())
            .zip(other.signal.part(other.rows.clone()))
            .map(|(a, b)| a * b)
            .sum()
    }
}

/// Correlation over the samples that two signals share, given the sum of their products.
fn overlapping(a: &Part, b: &Part, product: f64) -> f64 {
    // Where nearly all of a signal lies in the samples that are left out, rounding is all that differences would show.
    if a.power.min(b.power) < 1e-4 {
        let size = (a.times(a) * b.times(b)).sqrt();
        return if size > 0.0 { a.times(b) / size } else { 0.0 };
    }
    product / (a.power * b.power).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn peak(signal: &[f64], other: &[f64]) -> Option<Peak> {
        Coloured::of(signal, 50).with(&Coloured::of(other, 50))
    }

    #[test]
    fn the_lag_counts_how_much_later_the_first_signal_comes() {
        let early: Vec<f64> = (0..2_000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let late: Vec<f64> = (0..2_000).map(|k: usize| early[k.saturating_sub(10)]).collect();
        let found = peak(&late, &early).expect("in common");
        assert!(found.lag == 10 && found.correlation > 0.99, "{found:?}");
        assert_eq!(peak(&early, &late).expect("in common").lag, -10);
        assert_eq!(peak(&early, &[1.0; 2_000]), None, "a constant");
    }

    /// As the definition has it, at each lag from the samples themselves; missing values and a spike at the end included.
    #[test]
    fn correlation_and_error_are_those_of_the_definition() {
        let noise = |seed: u64, k: u64| ((k + seed) * 2_654_435_761 % 1_009) as f64 / 504.5 - 1.0;
        let mut signal: Vec<f64> = (0..5_000).map(|k| noise(7, k) + (0.02 * k as f64).sin()).collect();
        let mut other: Vec<f64> = (0..5_000).map(|k| noise(90, k) + (0.02 * k as f64 - 0.4).sin()).collect();
        signal[17] = f64::NAN;
        other[4_990] = 200.0;
        for other in [other.clone(), other[..4_900].iter().copied().chain([0.0; 100]).collect()] {
            let found = peak(&signal, &other).expect("in common");
            let centred = |values| -> Vec<f64> { Centred::of(values).part(0..5_000).collect() };
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let (a, b) = (centred(&signal), centred(&other));
            let by_hand = |lag: i64| {
                let (late, early) = (lag.max(0) as usize, (-lag).max(0) as usize);
                let (a, b) = (&a[late..5_000 - early], &b[early..5_000 - late]);
                dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
            };
            let largest = (-50..=50)
                .map(by_hand)
                .fold(0.0, |most: f64, it| if it.abs() > most.abs() { it } else { most });
            // Rounding of 5,000 terms.
            assert!((found.correlation - largest).abs() < 1e-13, "{found:?}, {largest}");
            let own = |x: &[f64], lag: usize| dot(x, &x[lag..]);
            let stretch: f64 = 1.0 + 2.0 * (1..=200).map(|lag| own(&a, lag) * own(&b, lag)).sum::<f64>();
            assert!((found.standard_error - (stretch.max(1.0) / 4_999.0).sqrt()).abs() < 1e-13, "{found:?}");
        }
    }
}
