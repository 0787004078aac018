//! The pole of the rotor, and with it everything that enters linearly, by output error.
//!
//! The model is `ω̇ = -p ω + p Σ c_j x_j(t)`, [LPC16] Eq. (2), second line, with inputs `x_j` held between
//! samples. It is solved exactly at the true sample times, irregular or not:
//! `ω(t + h) = a ω(t) + (1 - a) x(t)`, `a = exp(-p h)`. Every stretch between holes starts from a state of its
//! own, which is fitted too.
//!
//! The fit is variable projection (Golub, Pereyra 1973, with Kaufman's derivative): for a given p the
//! coefficients and initial states are linear and eliminated, so that only p is searched. One pass over the
//! record gathers all inner products that a Gauss-Newton step needs; no column is ever stored.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::linear::{self, invert};

/// Below this the initial state has no part in the output any more.
const FORGOTTEN: f64 = 1e-9;
/// ⟨e, e⟩ from which an initial state counts as known: its standard error is then at most three times the noise.
/// Less comes from stretches whose beginning was not measured, and blows up when carried back to it.
const KNOWN: f64 = 0.1;
/// Rows of the record that the coarse search looks at.
const COARSE_ROWS: usize = 6000;
/// [rad/s] poles among which the coarse search starts, each 1.5 times the one before.
const SLOWEST: f64 = 0.1;
const COARSE_POLES: i32 = 22;
/// Relative change of p at which the search ends.
const TOLERANCE: f64 = 1e-9;
const MOST_STEPS: usize = 40;

/// What is fitted: the measured output and the inputs at each sample.
#[derive(Debug, Clone)]
pub struct Record<const M: usize> {
    /// [s] rising.
    pub time: Vec<f64>,
    /// [rad/s] measured output; not-a-number = not measured or not to be scored.
    pub output: Vec<f64>,
    /// Inputs x_j from this sample to the next.
    pub inputs: Vec<[f64; M]>,
    /// Stretches without holes.
    pub segments: Vec<Range<usize>>,
}

impl<const M: usize> Record<M> {
    /// The first `rows` rows.
    #[must_use]
    pub fn head(&self, rows: usize) -> Self {
        let mut head = self.clone();
        head.time.truncate(rows);
        head.output.truncate(rows);
        head.inputs.truncate(rows);
        head.segments.iter_mut().for_each(|segment| segment.end = segment.end.min(rows));
        head.segments.retain(|segment| segment.start < segment.end);
        head
    }
}

/// A fitted first-order lag.
#[derive(Debug, Clone)]
pub struct LagFit {
    /// [rad/s]
    pub pole: f64,
    /// One for each input.
    pub coefficients: Vec<f64>,
    /// Covariance of the coefficients and, last, of the pole.
    pub covariance: DMatrix<f64>,
    /// [rad/s] rms of the residual over the scored samples.
    pub residual_rms: f64,
    /// Lag-one correlation of the residual.
    pub residual_correlation: f64,
    /// Scored samples.
    pub samples: usize,
    /// [rad/s] state at the start of each stretch; not-a-number where nothing was measured while it lasted.
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
    fit_from(record, coarse_pole(record)?)
}

/// The same from a pole [rad/s] that is known to be near.
pub(super) fn fit_from<const M: usize>(record: &Record<M>, near: f64) -> Option<LagFit> {
    let mut at = Projection::new(record, near)?;
    for _ in 0..MOST_STEPS {
        // At most a factor of two per step: the profile is not a parabola far from its minimum.
        let mut step = (at.step / at.pole).clamp(-0.5, 1.0);
        if step.abs() < TOLERANCE {
            break;
        }
        let mut better = None;
        for _ in 0..20 {
            let trial = Projection::new(record, at.pole * (1.0 + step));
            if let Some(trial) = trial.filter(|trial| trial.cost <= at.cost) {
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
    at.finish(record)
}

/// [rad/s] measured minus modelled output at every row, also those the fit was not scored on; not-a-number where
/// nothing was measured.
pub(super) fn errors<const M: usize>(record: &Record<M>, fit: &LagFit) -> Vec<f64> {
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

/// [rad/s] the best pole of a coarse grid on the beginning of the record, or on all of it when that says nothing.
fn coarse_pole<const M: usize>(record: &Record<M>) -> Option<f64> {
    let best = |record: &Record<M>| {
        (0..COARSE_POLES)
            .map(|power| SLOWEST * 1.5f64.powi(power))
            .filter_map(|pole| Projection::new(record, pole))
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .map(|projection| projection.pole)
    };
    best(&record.head(COARSE_ROWS)).or_else(|| best(record))
}

/// Inner products over one stretch of w = [φ_1..φ_M, δ_1..δ_M, y] (φ the lagged inputs, δ = ∂φ/∂p), and with
/// e = exp(-p (t - t_0)), the response to the initial state, and g = ∂e/∂p.
struct Gram<const M: usize> {
    ff: [[f64; M]; M],
    fd: [[f64; M]; M],
    dd: [[f64; M]; M],
    fy: [f64; M],
    dy: [f64; M],
    yy: f64,
    ef: [f64; M],
    ed: [f64; M],
    ey: f64,
    ee: f64,
    gf: [f64; M],
    gd: [f64; M],
    gy: f64,
    ge: f64,
    gg: f64,
    samples: usize,
}

/// Runs the lag over one stretch; `visit(row, φ, δ, e, g)` sees every row.
fn run<const M: usize>(
    record: &Record<M>,
    segment: &Range<usize>,
    pole: f64,
    mut visit: impl FnMut(usize, &[f64; M], &[f64; M], f64, f64),
) {
    let (mut lagged, mut slope) = ([0.0; M], [0.0; M]);
    let (mut initial, mut elapsed) = (1.0, 0.0);
    let (mut interval, mut decay) = (f64::NAN, 1.0);
    for row in segment.clone() {
        visit(row, &lagged, &slope, initial, -elapsed * initial);
        if row + 1 >= segment.end {
            break;
        }
        let exact = record.time[row + 1] - record.time[row];
        // The exponential is the slow part; a regular grid differs from itself by rounding only.
        if (exact - interval).abs() > 1e-9 * exact || interval.is_nan() {
            interval = exact;
            decay = (-pole * interval).exp();
        }
        for ((lagged, slope), input) in lagged.iter_mut().zip(&mut slope).zip(&record.inputs[row]) {
            let away = *lagged - input;
            *slope = decay * (*slope - interval * away);
            *lagged = decay * away + input;
        }
        elapsed += interval;
        initial = if initial > FORGOTTEN { initial * decay } else { 0.0 };
    }
}

impl<const M: usize> Gram<M> {
    fn gather(record: &Record<M>, segment: &Range<usize>, pole: f64) -> Self {
        let mut gram = Self {
            ff: [[0.0; M]; M],
            fd: [[0.0; M]; M],
            dd: [[0.0; M]; M],
            fy: [0.0; M],
            dy: [0.0; M],
            yy: 0.0,
            ef: [0.0; M],
            ed: [0.0; M],
            ey: 0.0,
            ee: 0.0,
            gf: [0.0; M],
            gd: [0.0; M],
            gy: 0.0,
            ge: 0.0,
            gg: 0.0,
            samples: 0,
        };
        run(record, segment, pole, |row, f, d, e, g| {
            let y = record.output[row];
            if y.is_nan() {
                return;
            }
            for i in 0..M {
                for j in 0..M {
                    gram.ff[i][j] += f[i] * f[j];
                    gram.fd[i][j] += f[i] * d[j];
                    gram.dd[i][j] += d[i] * d[j];
                }
                gram.fy[i] += f[i] * y;
                gram.dy[i] += d[i] * y;
            }
            gram.yy += y * y;
            gram.samples += 1;
            if e > 0.0 {
                for i in 0..M {
                    gram.ef[i] += e * f[i];
                    gram.ed[i] += e * d[i];
                    gram.gf[i] += g * f[i];
                    gram.gd[i] += g * d[i];
                }
                gram.ey += e * y;
                gram.ee += e * e;
                gram.gy += g * y;
                gram.ge += g * e;
                gram.gg += g * g;
            }
        });
        gram
    }

    /// Takes the free initial state out of every product: ⟨a, b⟩ becomes ⟨a, b⟩ - ⟨a, e⟩⟨e, b⟩ / ⟨e, e⟩.
    fn without_initial_state(mut self) -> Self {
        let ee = self.ee;
        if ee < FORGOTTEN {
            return self;
        }
        for i in 0..M {
            for j in 0..M {
                self.ff[i][j] -= self.ef[i] * self.ef[j] / ee;
                self.fd[i][j] -= self.ef[i] * self.ed[j] / ee;
                self.dd[i][j] -= self.ed[i] * self.ed[j] / ee;
            }
            self.fy[i] -= self.ef[i] * self.ey / ee;
            self.dy[i] -= self.ed[i] * self.ey / ee;
            self.gf[i] -= self.ge * self.ef[i] / ee;
            self.gd[i] -= self.ge * self.ed[i] / ee;
        }
        self.yy -= self.ey * self.ey / ee;
        self.gy -= self.ge * self.ey / ee;
        self.gg -= self.ge * self.ge / ee;
        self
    }
}

/// The linear problem solved at one pole, and the Gauss-Newton step to the next.
struct Projection<const M: usize> {
    pole: f64,
    coefficients: DVector<f64>,
    /// [rad/s] state at the start of each stretch, and whether the record determines it.
    initial: Vec<(f64, bool)>,
    cost: f64,
    /// Normal matrix of coefficients and pole, initial states eliminated.
    normal: DMatrix<f64>,
    /// [rad/s] change of p that Gauss-Newton asks for.
    step: f64,
    /// ⟨J, e⟩/⟨e, e⟩ of each stretch: what the elimination takes from each column.
    shares: Vec<DVector<f64>>,
    samples: usize,
}

impl<const M: usize> Projection<M> {
    fn new(record: &Record<M>, pole: f64) -> Option<Self> {
        let segments = &record.segments;
        let grams: Vec<Gram<M>> = segments
            .iter()
            .map(|segment| Gram::gather(record, segment, pole).without_initial_state())
            .collect();
        let sum = |entry: &dyn Fn(&Gram<M>) -> f64| grams.iter().map(entry).sum::<f64>();
        let samples = grams.iter().map(|gram| gram.samples).sum::<usize>();
        let ff = DMatrix::from_fn(M, M, |i, j| sum(&|gram| gram.ff[i][j]));
        let fy = DVector::from_fn(M, |i, _| sum(&|gram| gram.fy[i]));
        if samples <= M + 1 + segments.len() {
            return None;
        }
        let inverse = invert(&ff)?;
        let coefficients = &inverse * &fy;
        let cost = (sum(&|gram| gram.yy) - coefficients.dot(&fy)).max(0.0);
        let dot = |products: &[f64; M]| -> f64 {
            products.iter().zip(coefficients.iter()).map(|(product, c)| product * c).sum()
        };
        let start = |gram: &Gram<M>| {
            let seen = gram.ee >= FORGOTTEN;
            (if seen { (gram.ey - dot(&gram.ef)) / gram.ee } else { 0.0 }, gram.ee >= KNOWN)
        };
        let initial: Vec<(f64, bool)> = grams.iter().map(start).collect();
        // s = ∂ω/∂p = Σ c_j δ_j + x_0 g, with the initial states taken out.
        let each = || grams.iter().zip(initial.iter().map(|state| state.0));
        let sf =
            DVector::from_fn(M, |i, _| each().map(|(gram, x0)| dot(&gram.fd[i]) + x0 * gram.gf[i]).sum());
        let sy: f64 = each().map(|(gram, x0)| dot(&gram.dy) + x0 * gram.gy).sum();
        let ss: f64 = each()
            .map(|(gram, x0)| {
                let quadratic: f64 = (0..M).map(|i| coefficients[i] * dot(&gram.dd[i])).sum();
                quadratic + 2.0 * x0 * dot(&gram.gd) + x0 * x0 * gram.gg
            })
            .sum();
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
        let shares = each().map(|(gram, x0)| shares(gram, x0, &dot)).collect();
        let step = (sy - coefficients.dot(&sf)) / curvature;
        Some(Self { pole, coefficients, initial, cost, normal, step, shares, samples })
    }

    /// Residuals and standard errors at the minimum.
    fn finish(self, record: &Record<M>) -> Option<LagFit> {
        let inverse = invert(&self.normal)?;
        let freedom = self.samples.checked_sub(M + 1 + self.initial.len()).filter(|&n| n > 0)?;
        let white = &inverse * (self.cost / freedom as f64);
        let mut residuals = Vec::with_capacity(self.samples);
        let mut scores: Vec<DVector<f64>> =
            linear::blocks(self.samples).map(|_| DVector::zeros(M + 1)).collect();
        let blocks = scores.len();
        let coefficients = &self.coefficients;
        let each = record.segments.iter().zip(&self.initial).zip(&self.shares);
        for ((segment, (x0, _)), share) in each {
            run(record, segment, self.pole, |row, f, d, e, g| {
                let y = record.output[row];
                if y.is_nan() {
                    return;
                }
                let mut model = x0 * e;
                let mut slope = x0 * g;
                for i in 0..M {
                    model += coefficients[i] * f[i];
                    slope += coefficients[i] * d[i];
                }
                let residual = y - model;
                let block = (residuals.len() * blocks / self.samples).min(blocks - 1);
                let score = &mut scores[block];
                for i in 0..M {
                    score[i] += (f[i] - e * share[i]) * residual;
                }
                score[M] += (slope - e * share[M]) * residual;
                residuals.push(residual);
            });
        }
        let squares: f64 = residuals.iter().map(|residual| residual * residual).sum();
        Some(LagFit {
            pole: self.pole,
            coefficients: coefficients.iter().copied().collect(),
            covariance: linear::widened(&white, &inverse, &scores),
            residual_rms: (squares / residuals.len() as f64).sqrt(),
            residual_correlation: linear::lag_one_correlation(&residuals),
            samples: residuals.len(),
            initial: self.initial.iter().map(|(x0, known)| if *known { *x0 } else { f64::NAN }).collect(),
        })
    }
}

/// ⟨J, e⟩/⟨e, e⟩ for the columns J = [φ_1..φ_M, s] of one stretch.
fn shares<const M: usize>(gram: &Gram<M>, x0: f64, dot: &dyn Fn(&[f64; M]) -> f64) -> DVector<f64> {
    DVector::from_fn(M + 1, |index, _| {
        if gram.ee < FORGOTTEN {
            return 0.0;
        }
        let product = if index < M { gram.ef[index] } else { dot(&gram.ed) + x0 * gram.ge };
        product / gram.ee
    })
}
