//! How often a meaningless candidate does as well: the trace an effect leaves in the simulation, shifted in time
//! so that it keeps its shape and loses its meaning.

use super::trial::Trial;

/// Shifted traces tried for each candidate.
const SHIFTS: usize = 199;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// How often a shifted trace of what `with` adds to `without` explains as much of the held-out residual, counted
/// as (1 + as good) / (1 + tried). `period` is the length of a window of the residual vector (1 = none).
#[must_use]
pub fn chance(without: &Trial, with: &Trial, period: usize) -> f64 {
    let before = &without.judged.residuals;
    let trace: Vec<f64> =
        before.iter().zip(&with.judged.residuals).map(|(before, after)| before - after).collect();
    let count = before.len();
    let power = dot(&trace, &trace);
    let windows = count / period.max(1);
    if !(power > 0.0 && power.is_finite()) || windows < 20 {
        return 1.0;
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
    let as_good = (0..tried)
        .filter(|index| {
            let shift = (near + index * room / tried) * period.max(1);
            // The same sum in another order.
            explained(shift) >= real * (1.0 - 1e-9)
        })
        .count();
    (1 + as_good) as f64 / (1 + tried) as f64
}
