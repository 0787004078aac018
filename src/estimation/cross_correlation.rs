//! Where two signals resemble each other most, and how much unrelated ones would.

use super::normal_equations::dot;

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

/// A signal that others are compared with.
#[derive(Debug, Clone)]
pub struct CrossCorrelation {
    signal: Vec<f64>,
    colour: Vec<f64>,
    known: usize,
    most_lag: usize,
}

impl CrossCorrelation {
    /// Of a signal, over lags of at most `most_lag` samples to both sides; values that are not finite are missing.
    #[must_use]
    pub fn of(signal: &[f64], most_lag: usize) -> Self {
        let known = signal.iter().filter(|value| value.is_finite()).count();
        let signal = centred(signal);
        Self { colour: autocorrelation(&signal, most_lag), signal, known, most_lag }
    }

    /// Where it resembles another signal of the same samples most; `None` where nothing is in common.
    #[must_use]
    pub fn with(&self, other: &[f64]) -> Option<Peak> {
        let other = centred(other);
        let colour = autocorrelation(&other, self.most_lag);
        // Bartlett: the variance of a correlation between two coloured signals that are unrelated.
        let products = self.colour.iter().zip(&colour).skip(1).map(|(a, b)| a * b);
        let stretch: f64 = 1.0 + 2.0 * products.sum::<f64>();
        let standard_error = (stretch.max(1.0) / self.known as f64).sqrt();
        let most = self.most_lag.min(self.signal.len() / 8);
        let later = (0..=most).map(|lag| (lag as i64, overlapping(&self.signal[lag..], &other)));
        let earlier = (1..=most).map(|lag| (-(lag as i64), overlapping(&self.signal, &other[lag..])));
        let peak = later.chain(earlier).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let (lag, correlation) = peak.filter(|(_, correlation)| *correlation != 0.0)?;
        Some(Peak { lag, correlation, standard_error })
    }
}

/// Mean taken off, missing values as the mean, size one.
fn centred(values: &[f64]) -> Vec<f64> {
    let good: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = good.iter().sum::<f64>() / good.len().max(1) as f64;
    let size = good.iter().map(|value| (value - mean).powi(2)).sum::<f64>().sqrt();
    let scale = if size > 0.0 { 1.0 / size } else { 0.0 };
    values.iter().map(|value| if value.is_finite() { (value - mean) * scale } else { 0.0 }).collect()
}

fn autocorrelation(values: &[f64], most_lag: usize) -> Vec<f64> {
    (0..=4 * most_lag.min(values.len() / 8)).map(|lag| dot(values, &values[lag..])).collect()
}

/// Correlation over the samples that two signals share.
fn overlapping(a: &[f64], b: &[f64]) -> f64 {
    let both = a.len().min(b.len());
    let (a, b) = (&a[..both], &b[..both]);
    let size = (dot(a, a) * dot(b, b)).sqrt();
    if size > 0.0 { dot(a, b) / size } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lag_counts_how_much_later_the_first_signal_comes() {
        let early: Vec<f64> = (0..2_000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let late: Vec<f64> = (0..2_000).map(|k: usize| early[k.saturating_sub(10)]).collect();
        let found = CrossCorrelation::of(&late, 50).with(&early).expect("in common");
        assert!(found.lag == 10 && found.correlation > 0.99, "{found:?}");
        assert_eq!(CrossCorrelation::of(&early, 50).with(&late).expect("in common").lag, -10);
        assert_eq!(CrossCorrelation::of(&early, 50).with(&[1.0; 2_000]), None, "a constant");
    }
}
