//! How often a meaningless candidate does as well: the trace an effect leaves in the simulation, shifted in time
//! so that it keeps its shape and loses its meaning.

use super::trial::Trial;

/// Shifted traces tried for each candidate.
const SHIFTS: usize = 199;
/// One shifted trace of so many does as well by the luck that is told.
const ONE_IN: usize = 20;

/// What shifted traces of a candidate do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Luck {
    /// How often one explains as much of the held-out residual as the candidate's own, counted as
    /// (1 + as good) / (1 + tried).
    pub chance: f64,
    /// [-] share of the squared held-out residual that one in twenty of them explains at least.
    pub share: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What shifted traces of what `with` adds to `without` do for the held-out residual. `period` is the length of a window of
/// the residual vector (1 = none).
#[must_use]
pub fn luck(without: &Trial, with: &Trial, period: usize) -> Luck {
    let before = &without.judged.residuals;
    let trace: Vec<f64> =
        before.iter().zip(&with.judged.residuals).map(|(before, after)| before - after).collect();
    let count = before.len();
    let power = dot(&trace, &trace);
    let windows = count / period.max(1);
    if !(power > 0.0 && power.is_finite()) || windows < 20 {
        return Luck { chance: 1.0, share: 1.0 };
    }
    // What one factor on the trace explains: the square of its projection.
    let explained = |shift: usize| {
        let head = dot(&trace[..count - shift], &before[shift..]);
        let tail = dot(&trace[count - shift..], &before[..shift]);
        (head + tail).powi(2) / power
    };
    let real = explained(0);
    // Shifts evenly spread, none nearer than a fiftieth of the log to none at all.
    let near = (windows / 50).max(1);
    let room = windows - 2 * near;
    let tried = SHIFTS.min(room);
    let shift = |index: usize| (near + index * room / tried) * period.max(1);
    let mut shifted: Vec<f64> = (0..tried).map(|index| explained(shift(index))).collect();
    // The same sum in another order.
    let as_good = shifted.iter().filter(|explained| **explained >= real * (1.0 - 1e-9)).count();
    shifted.sort_by(f64::total_cmp);
    let lucky = shifted.iter().nth_back(tried / ONE_IN).copied().unwrap_or(0.0);
    Luck {
        chance: (1 + as_good) as f64 / (1 + tried) as f64,
        share: (lucky / dot(before, before).max(f64::MIN_POSITIVE)).min(1.0),
    }
}
