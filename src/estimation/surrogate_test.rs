//! How often a meaningless trace does as well: the same trace, shifted in time so that it keeps its shape and loses its
//! meaning.

use rand::{RngExt, SeedableRng};

use super::normal_equations::dot;
use super::quantile::sorted;
use super::thresholds::THRESHOLDS;
use crate::threads::spread;

/// What is tried, and what counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurrogateConfig {
    /// Shifts tried: p-values to one over as many and one.
    pub surrogates: usize,
    /// One shifted trace of so many does as well as the share given.
    pub quantile: usize,
    /// [-] a p-value that this or fewer shifts could not show is taken from windows with random signs.
    pub rare_p_value: f64,
    /// Windows below which no surrogate means anything.
    pub fewest_windows: usize,
    /// Changes between rows with and without a measurement, one in so many rows, from which on a residual is patchy.
    pub patchy: usize,
    /// [-] share of the power of a shifted trace that must lie on measurements.
    pub least_shared_power: f64,
    /// No surrogate is shifted by less than one part in so many.
    pub least_shift: usize,
}

/// What shifted traces do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurrogateTest {
    /// How often one explains as much of the residual as the trace's own, counted as (1 + as good) / (1 + tried).
    pub p_value: f64,
    /// [-] share of the squared residual that one in so many of them explains at least.
    pub share: f64,
}

impl SurrogateTest {
    /// Of what `trace` explains of `residuals`, which are zero where nothing was measured; shifts are whole windows of `period`
    /// samples (1 = none).
    #[must_use]
    pub fn of(trace: &[f64], residuals: &[f64], period: usize, config: &SurrogateConfig) -> Self {
        let count = residuals.len();
        let power = dot(trace, trace);
        let windows = count / period.max(1);
        if !(power > 0.0 && power.is_finite()) || windows < config.fewest_windows {
            return Self { p_value: 1.0, share: 1.0 };
        }
        // What one factor on the trace explains: the square of its projection. Where only some rows hold a measurement, a
        // shift lays few of them on each other, or none, which says nothing; what it explains of many counts for all.
        let is_patchy = is_patchy(residuals, config);
        let explained = |shift: usize| {
            let head = dot(&trace[..count - shift], &residuals[shift..]);
            let tail = dot(&trace[count - shift..], &residuals[..shift]);
            let shared = if is_patchy { shared(trace, residuals, shift) } else { power };
            (shared >= config.least_shared_power * power).then(|| (head + tail).powi(2) / shared)
        };
        let real = explained(0).unwrap_or(0.0);
        // Shifts evenly spread, none near to none at all.
        let near = (windows / config.least_shift).max(1);
        let room = windows - 2 * near;
        let tried = config.surrogates.min(room);
        let shift = |index: usize| (near + index * room / tried) * period.max(1);
        let shifts: Vec<usize> = (0..tried).map(shift).collect();
        let shifted: Vec<Option<f64>> = if count < THRESHOLDS.parallel_residuals {
            shifts.into_iter().map(explained).collect()
        } else {
            spread(&shifts, |shift| explained(*shift))
        };
        let shifted = sorted(shifted.into_iter().flatten());
        let tried = shifted.len();
        // The same sum in another order.
        let as_good = shifted.iter().filter(|explained| **explained >= real * (1.0 - 1e-9)).count();
        let reached = shifted.iter().nth_back(tried / config.quantile).copied().unwrap_or(0.0);
        let mut p_value = (1 + as_good) as f64 / (1 + tried) as f64;
        if as_good == 0 && p_value > config.rare_p_value {
            // Too few shifts to tell how rare it is.
            p_value = p_value.min(flipped(trace, residuals, period, config.surrogates));
        }
        Self { p_value, share: (reached / dot(residuals, residuals).max(f64::MIN_POSITIVE)).min(1.0) }
    }
}

/// Whether rows with and without a measurement come in turns.
fn is_patchy(residuals: &[f64], config: &SurrogateConfig) -> bool {
    let turns = residuals.windows(2).filter(|pair| (pair[0] == 0.0) != (pair[1] == 0.0)).count();
    config.patchy * turns > residuals.len()
}

/// Power of a shifted trace over the rows that hold a measurement.
fn shared(trace: &[f64], residuals: &[f64], shift: usize) -> f64 {
    let under = residuals[shift..].iter().chain(&residuals[..shift]);
    trace.iter().zip(under).filter(|(_, under)| **under != 0.0).map(|(trace, _)| trace * trace).sum()
}

/// How often a trace explains as much when each window of it may have the other sign, which nothing that it has to do with
/// the residual survives: where there are so few windows that there are not enough shifts.
fn flipped(trace: &[f64], residuals: &[f64], period: usize, surrogates: usize) -> f64 {
    let windows = trace.chunks(period).zip(residuals.chunks(period));
    let own: Vec<f64> = windows.map(|(trace, residuals)| dot(trace, residuals)).collect();
    let real = own.iter().sum::<f64>().abs();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut sum = || -> f64 { own.iter().map(|own| if random.random() { *own } else { -own }).sum() };
    let as_good = (0..surrogates).filter(|_| sum().abs() >= real * (1.0 - 1e-9)).count();
    (1 + as_good) as f64 / (1 + surrogates) as f64
}
