//! How often a meaningless candidate does as well: the trace an effect leaves in the simulation, shifted in time
//! so that it keeps its shape and loses its meaning.

use rand::{RngExt, SeedableRng};

use super::candidate_fit::CandidateFit;
use super::thresholds::THRESHOLDS;
use crate::estimation::normal_equations::dot;

/// What shifted traces of a candidate do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurrogateTest {
    /// How often one explains as much of the held-out residual as the candidate's own, counted as
    /// (1 + as good) / (1 + tried).
    pub p_value: f64,
    /// [-] share of the squared held-out residual that one in twenty of them explains at least.
    pub share: f64,
}

/// Whether rows with and without a measurement come in turns.
fn is_patchy(residuals: &[f64]) -> bool {
    let turns = residuals.windows(2).filter(|pair| (pair[0] == 0.0) != (pair[1] == 0.0)).count();
    THRESHOLDS.patchy * turns > residuals.len()
}

/// Power of a shifted trace over the rows that hold a measurement.
fn shared(trace: &[f64], residuals: &[f64], shift: usize) -> f64 {
    let under = residuals[shift..].iter().chain(&residuals[..shift]);
    trace.iter().zip(under).filter(|(_, under)| **under != 0.0).map(|(trace, _)| trace * trace).sum()
}

/// What shifted traces of what `with` adds to `without` do for the held-out residual. `period` is the length of a window of
/// the residual vector (1 = none).
#[must_use]
pub fn surrogate(without: &CandidateFit, with: &CandidateFit, period: usize) -> SurrogateTest {
    let before = &without.held_out.residuals;
    let trace: Vec<f64> =
        before.iter().zip(&with.held_out.residuals).map(|(before, after)| before - after).collect();
    let count = before.len();
    let power = dot(&trace, &trace);
    let windows = count / period.max(1);
    if !(power > 0.0 && power.is_finite()) || windows < THRESHOLDS.fewest_windows {
        return SurrogateTest { p_value: 1.0, share: 1.0 };
    }
    // What one factor on the trace explains: the square of its projection. Where only some rows hold a measurement, a
    // shift lays few of them on each other, or none, which says nothing; what it explains of many counts for all.
    let is_patchy = is_patchy(before);
    let explained = |shift: usize| {
        let head = dot(&trace[..count - shift], &before[shift..]);
        let tail = dot(&trace[count - shift..], &before[..shift]);
        let shared = if is_patchy { shared(&trace, before, shift) } else { power };
        (shared >= THRESHOLDS.least_shared_power * power).then(|| (head + tail).powi(2) / shared)
    };
    let real = explained(0).unwrap_or(0.0);
    // Shifts evenly spread, none nearer than a fiftieth of the log to none at all.
    let near = (windows / THRESHOLDS.least_surrogate_shift).max(1);
    let room = windows - 2 * near;
    let tried = THRESHOLDS.surrogates.min(room);
    let shift = |index: usize| (near + index * room / tried) * period.max(1);
    let mut shifted: Vec<f64> = (0..tried).filter_map(|index| explained(shift(index))).collect();
    let tried = shifted.len();
    // The same sum in another order.
    let as_good = shifted.iter().filter(|explained| **explained >= real * (1.0 - 1e-9)).count();
    shifted.sort_by(f64::total_cmp);
    let reached = shifted.iter().nth_back(tried / THRESHOLDS.surrogate_quantile).copied().unwrap_or(0.0);
    let mut p_value = (1 + as_good) as f64 / (1 + tried) as f64;
    if as_good == 0 && p_value > THRESHOLDS.rare_p_value {
        // Too few shifts to tell how rare it is.
        p_value = p_value.min(flipped(&trace, before, period));
    }
    SurrogateTest { p_value, share: (reached / dot(before, before).max(f64::MIN_POSITIVE)).min(1.0) }
}

/// How often a trace explains as much when each window of it may have the other sign, which nothing that it has to do with
/// the residual survives: for logs of so few windows that there are not enough shifts.
fn flipped(trace: &[f64], residuals: &[f64], period: usize) -> f64 {
    let windows = trace.chunks(period).zip(residuals.chunks(period));
    let own: Vec<f64> = windows.map(|(trace, residuals)| dot(trace, residuals)).collect();
    let real = own.iter().sum::<f64>().abs();
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut sum = || -> f64 { own.iter().map(|own| if random.random() { *own } else { -own }).sum() };
    let as_good = (0..THRESHOLDS.surrogates).filter(|_| sum().abs() >= real * (1.0 - 1e-9)).count();
    (1 + as_good) as f64 / (1 + THRESHOLDS.surrogates) as f64
}
