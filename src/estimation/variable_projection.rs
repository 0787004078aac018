//! The pole of a first-order lag, and with it everything that enters linearly, by output error.
//!
//! The model is `y' = -p y + p Σ c_j x_j(t)` with inputs `x_j` held between samples. It is solved exactly at the true
//! sample times, irregular or not: `y(t + h) = a y(t) + (1 - a) x(t)`, `a = exp(-p h)`. Every stretch between holes
//! starts from a state of its own, which is fitted too.
//!
//! The fit is variable projection (Golub, Pereyra 1973, with Kaufman's derivative): for a given p the
//! coefficients and initial states are linear and eliminated, so that only p is searched. One pass over the
//! record gathers all inner products that a Gauss-Newton step needs ([`lag_products`](super::lag_products)); no column
//! of the record's length is ever stored.

use nalgebra::{DMatrix, DVector};

use super::autocorrelation::{lag_one_correlation, memory};
use super::inversion::invert;
pub use super::lag_products::Record;
use super::lag_products::{FORGOTTEN, Gram, RowBlock, run};
use super::robust_errors::{blocks, widened};
use super::thresholds::THRESHOLDS;
use crate::threads::spread;

/// What a cost may rise by rounding alone, as a share of the sum of squares it is the small difference of: near the
/// minimum no step would pass otherwise, and each would be halved to nothing in vain.
const ROUNDING: f64 = 1e-13;
/// Relative change of p at which the search ends, and the same in standard errors of p.
const TOLERANCE: f64 = 1e-9;
const TOLERANCE_IN_ERRORS: f64 = 1e-5;

/// A fitted first-order lag.
#[derive(Debug, Clone)]
pub struct LagFit {
    /// [rad/s] p.
    pub pole: f64,
    /// One for each input.
    pub coefficients: Vec<f64>,
    /// Covariance of the coefficients and, last, of the pole.
    pub covariance: DMatrix<f64>,
    /// The same for white noise of one unit of the output.
    pub(crate) per_noise: DMatrix<f64>,
    /// [unit of the output] rms of the residual over the scored samples.
    pub residual_rms: f64,
    /// Lag-one correlation of the residual.
    pub residual_correlation: f64,
    /// Scored samples.
    pub samples: usize,
    /// [unit of the output] state at the start of each stretch; not-a-number where nothing was measured while it lasted.
    pub initial: Vec<f64>,
}

impl LagFit {
    /// [rad/s] standard error of the pole.
    #[must_use]
    pub fn pole_error(&self) -> f64 {
        self.error(self.coefficients.len())
    }

    /// Standard error of a coefficient.
    #[must_use]
    pub fn error(&self, index: usize) -> f64 {
        self.covariance[(index, index)].max(0.0).sqrt()
    }
}

/// Fits pole and coefficients; `None` when the record does not determine them.
#[must_use]
pub fn fit<const M: usize>(record: &Record<M>) -> Option<LagFit> {
    fit_from(record, near_pole(record)?)
}

/// The same from a pole [rad/s] that is known to be near.
pub(crate) fn fit_from<const M: usize>(record: &Record<M>, near: f64) -> Option<LagFit> {
    search(record, near)?.finish(record, M + 1)
}

/// The coefficients at a pole [rad/s] that is known: what it may be off by is not in their standard errors.
pub(crate) fn fit_at<const M: usize>(record: &Record<M>, pole: f64) -> Option<LagFit> {
    Projection::new(record, pole)?.finish(record, M)
}

/// Gauss-Newton on the pole alone.
fn search<const M: usize>(record: &Record<M>, near: f64) -> Option<Projection<M>> {
    let mut at = Projection::new(record, near)?;
    for _ in 0..THRESHOLDS.most_pole_steps {
        // The profile is not a parabola far from its minimum.
        let (least, most) = THRESHOLDS.pole_step;
        let mut step = (at.step / at.pole).clamp(least, most);
        if step.abs() < TOLERANCE || at.step_in_errors() < TOLERANCE_IN_ERRORS {
            break;
        }
        let mut better = None;
        for _ in 0..THRESHOLDS.most_halvings {
            let trial = Projection::new(record, at.pole * (1.0 + step));
            if let Some(trial) = trial.filter(|trial| trial.cost <= at.cost + ROUNDING * at.total) {
                better = Some(trial);
                break;
            }
            step *= 0.5;
        }
        match better {
            Some(trial) => at = trial,
            // No descent left: the minimum to working precision.
            None => break,
        }
    }
    Some(at)
}

/// [unit of the output] measured minus modelled output at every row, also those the fit was not scored on; not-a-number where
/// nothing was measured.
pub(crate) fn errors<const M: usize>(record: &Record<M>, fit: &LagFit) -> Vec<f64> {
    let mut errors = vec![f64::NAN; record.time.len()];
    for (segment, x0) in record.segments.iter().zip(&fit.initial) {
        run(record, segment, fit.pole, |row, f, _, e, _| {
            let forced = f.iter().zip(&fit.coefficients).map(|(f, c)| f * c).sum::<f64>();
            // An unknown initial state leaves an unknown error while it lasts.
            let model = if e > 0.0 { forced + x0 * e } else { forced };
            errors[row] = record.output[row] - model;
        });
    }
    errors
}

/// [rad/s] a pole to start from, found on the beginning of the record, or on all of it when that says nothing.
fn near_pole<const M: usize>(record: &Record<M>) -> Option<f64> {
    if record.time.len() <= THRESHOLDS.coarse_rows {
        return coarse_pole(record);
    }
    let head = record.head(THRESHOLDS.coarse_rows);
    let Some(coarse) = coarse_pole(&head) else { return coarse_pole(record) };
    // Steps over the beginning are cheap and save some over the whole.
    let refined = search(&head, coarse).map(|found| found.pole);
    let factor = THRESHOLDS.refined_factor;
    refined.filter(|pole| (coarse / factor..coarse * factor).contains(pole)).or(Some(coarse))
}

/// [rad/s] the best pole of a coarse grid.
fn coarse_pole<const M: usize>(record: &Record<M>) -> Option<f64> {
    (0..THRESHOLDS.coarse_poles)
        .map(|power| THRESHOLDS.slowest_pole * THRESHOLDS.coarse_ratio.powi(power))
        .filter_map(|pole| Projection::new(record, pole))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
        .map(|projection| projection.pole)
}

/// Σ c_j of these products.
fn weighted<const M: usize>(products: &[f64; M], coefficients: &DVector<f64>) -> f64 {
    products.iter().zip(coefficients.iter()).map(|(product, c)| product * c).sum()
}

/// Products of s = ∂y/∂p = Σ c_j δ_j + x_0 g, with the initial states taken out: with the inputs, the output and itself.
fn along_the_pole<'a, const M: usize, I: Iterator<Item = (&'a Gram<M>, f64)>>(
    each: impl Fn() -> I,
    coefficients: &DVector<f64>,
) -> (DVector<f64>, f64, f64) {
    let dot = |products: &[f64; M]| weighted(products, coefficients);
    let sf = DVector::from_fn(M, |i, _| each().map(|(gram, x0)| dot(&gram.fd[i]) + x0 * gram.gf[i]).sum());
    let sy: f64 = each().map(|(gram, x0)| dot(&gram.dy) + x0 * gram.gy).sum();
    let ss: f64 = each()
        .map(|(gram, x0)| {
            let quadratic: f64 = (0..M).map(|i| coefficients[i] * dot(&gram.dd[i])).sum();
            quadratic + 2.0 * x0 * dot(&gram.gd) + x0 * x0 * gram.gg
        })
        .sum();
    (sf, sy, ss)
}

/// The linear problem solved at one pole, and the Gauss-Newton step to the next.
struct Projection<const M: usize> {
    pole: f64,
    coefficients: DVector<f64>,
    /// [unit of the output] state at the start of each stretch, and whether the record determines it.
    initial: Vec<(f64, bool)>,
    cost: f64,
    /// Sum of squares of the output, initial states eliminated.
    total: f64,
    /// Normal matrix of coefficients and pole, initial states eliminated.
    normal: DMatrix<f64>,
    /// [rad/s] change of p that Gauss-Newton asks for.
    step: f64,
    /// Second derivative of half the cost along p, coefficients and initial states following.
    curvature: f64,
    /// ⟨J, e⟩/⟨e, e⟩ of each stretch: what the elimination takes from each column.
    projections: Vec<DVector<f64>>,
    samples: usize,
    /// Initial states that took part.
    states: usize,
}

/// The products of each stretch, its initial state left out; those of a long record on every core.
fn grams<const M: usize>(record: &Record<M>, pole: f64) -> Vec<Gram<M>> {
    let gather = |segment: &std::ops::Range<usize>, block: &mut RowBlock<M>| {
        Gram::gather(record, segment, pole, block).without_initial_state()
    };
    if record.time.len() < THRESHOLDS.parallel_residuals {
        let mut block = RowBlock::EMPTY;
        record.segments.iter().map(|segment| gather(segment, &mut block)).collect()
    } else {
        spread(&record.segments, |segment| {
            let mut block = RowBlock::EMPTY;
            gather(segment, &mut block)
        })
    }
}

impl<const M: usize> Projection<M> {
    fn new(record: &Record<M>, pole: f64) -> Option<Self> {
        let grams = grams(record, pole);
        let sum = |entry: &dyn Fn(&Gram<M>) -> f64| grams.iter().map(entry).sum::<f64>();
        let samples = grams.iter().map(|gram| gram.samples).sum::<usize>();
        // A stretch without a sample has no state to be fitted.
        let states = grams.iter().filter(|gram| gram.samples > 0).count();
        let ff = DMatrix::from_fn(M, M, |i, j| sum(&|gram| gram.ff[i][j]));
        let fy = DVector::from_fn(M, |i, _| sum(&|gram| gram.fy[i]));
        if samples <= M + 1 + states {
            return None;
        }
        let inverse = invert(&ff)?;
        let coefficients = &inverse * &fy;
        let total = sum(&|gram| gram.yy);
        let cost = (total - coefficients.dot(&fy)).max(0.0);
        let dot = |products: &[f64; M]| weighted(products, &coefficients);
        let start = |gram: &Gram<M>| {
            let seen = gram.ee >= FORGOTTEN;
            (if seen { (gram.ey - dot(&gram.ef)) / gram.ee } else { 0.0 }, gram.ee >= THRESHOLDS.known_state)
        };
        let initial: Vec<(f64, bool)> = grams.iter().map(start).collect();
        let each = || grams.iter().zip(initial.iter().map(|state| state.0));
        let (sf, sy, ss) = along_the_pole(each, &coefficients);
        let curvature = ss - sf.dot(&(&inverse * &sf));
        // A pole that changes nothing in the output cannot be fitted.
        if curvature.is_nan() || curvature <= 1e-12 * ss.max(f64::MIN_POSITIVE) {
            return None;
        }
        let normal = DMatrix::from_fn(M + 1, M + 1, |i, j| match (i < M, j < M) {
            (true, true) => ff[(i, j)],
            (true, false) => sf[i],
            (false, true) => sf[j],
            (false, false) => ss,
        });
        let projections = each().map(|(gram, x0)| projections(gram, x0, &dot)).collect();
        let step = (sy - coefficients.dot(&sf)) / curvature;
        Some(Self {
            pole,
            coefficients,
            initial,
            cost,
            total,
            normal,
            step,
            curvature,
            projections,
            samples,
            states,
        })
    }

    /// The step in standard errors of p, correlation left aside.
    fn step_in_errors(&self) -> f64 {
        let variance = self.cost / self.samples as f64;
        self.step.abs() * (self.curvature / variance.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Residuals and standard errors at the minimum of the first `free` of coefficients and pole; what is not free has
    /// none.
    fn finish(self, record: &Record<M>, free: usize) -> Option<LagFit> {
        let inverse = invert(&self.normal.view((0, 0), (free, free)).into_owned())?;
        let freedom = self.samples.checked_sub(free + self.states).filter(|&n| n > 0)?;
        let white = &inverse * (self.cost / freedom as f64);
        let (residuals, scores) = self.residuals_and_scores(record);
        let scores: Vec<_> = scores.into_iter().map(|score| score.rows(0, free).into_owned()).collect();
        let whole = |part: DMatrix<f64>| part.resize(M + 1, M + 1, 0.0);
        let squares: f64 = residuals.iter().map(|residual| residual * residual).sum();
        Some(LagFit {
            pole: self.pole,
            coefficients: self.coefficients.iter().copied().collect(),
            covariance: whole(widened(&white, &inverse, &scores, residuals.len(), memory(&residuals))),
            per_noise: whole(inverse),
            residual_rms: (squares / residuals.len() as f64).sqrt(),
            residual_correlation: lag_one_correlation(&residuals),
            samples: residuals.len(),
            initial: self.initial.iter().map(|(x0, known)| if *known { *x0 } else { f64::NAN }).collect(),
        })
    }

    /// [unit of the output] the residual of every scored row, and the sums of scores over blocks of them.
    fn residuals_and_scores(&self, record: &Record<M>) -> (Vec<f64>, Vec<DVector<f64>>) {
        let coefficients: [f64; M] = std::array::from_fn(|i| self.coefficients[i]);
        let mut residuals = Vec::with_capacity(self.samples);
        let mut scores = Vec::new();
        let mut blocks = blocks(self.samples);
        let mut end = blocks.next().map_or(0, |block| block.end);
        let mut sum = ([0.0; M], 0.0);
        let each = record.segments.iter().zip(&self.initial).zip(&self.projections);
        for ((segment, (x0, _)), share) in each {
            let taken: [f64; M] = std::array::from_fn(|i| share[i]);
            run(record, segment, self.pole, |row, f, d, e, g| {
                let y = record.output[row];
                if y.is_nan() {
                    return;
                }
                let (mut model, mut slope) = (x0 * e, x0 * g);
                for i in 0..M {
                    model += coefficients[i] * f[i];
                    slope += coefficients[i] * d[i];
                }
                let residual = y - model;
                for i in 0..M {
                    sum.0[i] += (f[i] - e * taken[i]) * residual;
                }
                sum.1 += (slope - e * share[M]) * residual;
                residuals.push(residual);
                if residuals.len() == end {
                    scores.push(DVector::from_fn(M + 1, |i, _| sum.0.get(i).copied().unwrap_or(sum.1)));
                    sum = ([0.0; M], 0.0);
                    end = blocks.next().map_or(usize::MAX, |block| block.end);
                }
            });
        }
        (residuals, scores)
    }
}

/// ⟨J, e⟩/⟨e, e⟩ for the columns J = [φ_1..φ_M, s] of one stretch.
fn projections<const M: usize>(gram: &Gram<M>, x0: f64, dot: &dyn Fn(&[f64; M]) -> f64) -> DVector<f64> {
    DVector::from_fn(M + 1, |index, _| {
        if gram.ee < FORGOTTEN {
            return 0.0;
        }
        let product = if index < M { gram.ef[index] } else { dot(&gram.ed) + x0 * gram.ge };
        product / gram.ee
    })
}
