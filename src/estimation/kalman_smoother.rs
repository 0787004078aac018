//! The state of a linear system over time from noisy readings: forwards by a Kalman filter (Kalman 1960), backwards by the
//! smoother of Rauch, Tung and Striebel (1965). (The one of de Jong, 1989, needs no inverse and half the time, but loses the standard
//! errors of the first samples where readings are good to a millionth of what was known before.)

use nalgebra::{RowSVector, SMatrix, SVector};

use crate::cancel;

/// Samples over which the filter's states are kept at a time, on the way back.
const KEPT: usize = 1_024;

/// A linear system of `N` states, `M` of whose combinations are read at each sample.
pub(crate) trait LinearSystem<const N: usize, const M: usize> {
    /// How many samples there are.
    fn samples(&self) -> usize;

    /// State and covariance before the first sample is read.
    fn start(&self) -> Belief<N>;

    /// What was read at a sample.
    fn readings(&self, sample: usize) -> [Measurement<N>; M];

    /// How the state goes on to the next sample.
    fn step(&self, sample: usize) -> Transition<N>;
}

/// What is known of a state.
#[derive(Clone, Copy)]
pub(crate) struct Belief<const N: usize> {
    pub state: SVector<f64, N>,
    pub covariance: SMatrix<f64, N, N>,
}

/// One reading.
pub(crate) struct Measurement<const N: usize> {
    /// Not-a-number = missing.
    pub value: f64,
    /// Its standard deviation.
    pub noise: f64,
    /// What is read: this times the state.
    pub of: RowSVector<f64, N>,
}

/// From a sample to the next: the state becomes `transition` times it, plus `input`.
pub(crate) struct Transition<const N: usize> {
    pub transition: SMatrix<f64, N, N>,
    pub input: SVector<f64, N>,
    /// Variances that are added to those of the states.
    pub variance: SVector<f64, N>,
}

/// The filter at a sample: before and after its readings.
struct Passed<const N: usize> {
    before: Belief<N>,
    after: Belief<N>,
    /// From the sample to the next.
    transition: SMatrix<f64, N, N>,
}

/// The filter on its way.
struct Filter<'a, S, const N: usize, const M: usize> {
    system: &'a S,
    /// Before the next sample is read.
    belief: Belief<N>,
}

/// What the likelihood of readings is made of.
#[derive(Clone, Copy, Default)]
pub(crate) struct Likelihood {
    /// Sum of the squared innovations, each over its variance.
    squares: f64,
    /// Sum of the logarithms of those variances.
    logs: f64,
    readings: f64,
}

impl Likelihood {
    fn add(&mut self, innovation: f64, variance: f64) {
        self.squares += innovation * innovation / variance;
        self.logs += variance.ln();
        self.readings += 1.0;
    }

    /// Its logarithm, a constant apart, where all variances are known.
    pub(crate) fn known(&self) -> f64 {
        -0.5 * (self.squares + self.logs)
    }

    /// Its logarithm, a constant apart, at the likeliest common factor of all variances.
    pub(crate) fn at_best_scale(&self) -> f64 {
        let readings = self.readings.max(1.0);
        -0.5 * (readings * (self.squares / readings).max(f64::MIN_POSITIVE).ln() + self.logs)
    }
}

impl<'a, S: LinearSystem<N, M>, const N: usize, const M: usize> Filter<'a, S, N, M> {
    fn of(system: &'a S) -> Self {
        Self { system, belief: system.start() }
    }

    /// Takes in what was read at a sample, and goes on to the next. `tell` hears how far each reading was from what was predicted of
    /// it, and the variance of that.
    #[inline]
    fn pass(&mut self, sample: usize, mut tell: impl FnMut(f64, f64)) -> Passed<N> {
        let Self { system, belief } = self;
        let before = *belief;
        let Belief { state, covariance } = belief;
        for Measurement { value, noise, of } in system.readings(sample) {
            if !value.is_finite() {
                continue;
            }
            let innovation = value - (of * *state)[0];
            // Vectors first: two matrices take four times as many products.
            let read = of * *covariance;
            let variance = (read * of.transpose())[0] + noise * noise;
            let gain = read.transpose() / variance;
            *state += gain * innovation;
            *covariance -= gain * read;
            tell(innovation, variance);
        }
        let after = Belief { state: *state, covariance: *covariance };
        let Transition { transition, input, variance } = system.step(sample);
        *state = transition * *state + input;
        *covariance = around(&transition, covariance);
        for (index, variance) in variance.iter().enumerate() {
            covariance[(index, index)] += variance;
        }
        Passed { before, after, transition }
    }
}

/// `by` times a symmetric matrix times the transpose of `by`; symmetric to the last digit, so that rounding does not add up.
#[inline]
fn around<const N: usize>(by: &SMatrix<f64, N, N>, middle: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    // Of [column][row], and half of the second product: quicker than products of whole matrices.
    let (by, middle) = (&by.data.0, &middle.data.0);
    let (mut half, mut all) = ([[0.0; N]; N], [[0.0; N]; N]);
    for column in 0..N {
        for between in 0..N {
            for row in 0..N {
                half[column][row] += by[between][row] * middle[column][between];
            }
        }
    }
    for column in 0..N {
        for between in 0..N {
            for row in column..N {
                all[column][row] += half[between][row] * by[between][column];
            }
        }
    }
    SMatrix::from_fn(|row, column| all[row.min(column)][row.max(column)])
}

/// The likelihood of the first `samples`.
pub(crate) fn likelihood<const N: usize, const M: usize>(
    system: &impl LinearSystem<N, M>,
    samples: usize,
) -> Likelihood {
    let (mut filter, mut likelihood) = (Filter::of(system), Likelihood::default());
    for sample in 0..system.samples().min(samples) {
        cancel::check_at(sample);
        let _ = filter.pass(sample, |innovation, variance| likelihood.add(innovation, variance));
    }
    likelihood
}

/// One of the states and its standard error at each sample, from all samples; not-a-number where nothing is known.
#[cfg(test)]
fn smoothed<const N: usize, const M: usize>(
    system: &impl LinearSystem<N, M>,
    index: usize,
) -> Vec<(f64, f64)> {
    let mut found = vec![(f64::NAN, f64::NAN); system.samples()];
    smooth(system, index, |sample, state, error| found[sample] = (state, error));
    found
}

/// Tells one of the states and its standard error at each sample, from all samples, from the last sample on; nothing of samples of
/// which nothing is known. All states of a long record take many times its memory: some are kept, and what follows each of them is
/// computed again.
pub(crate) fn smooth<const N: usize, const M: usize>(
    system: &impl LinearSystem<N, M>,
    index: usize,
    mut tell: impl FnMut(usize, f64, f64),
) {
    let samples = system.samples();
    let mut filter = Filter::of(system);
    let mut starts = Vec::new();
    for sample in 0..samples {
        if sample.is_multiple_of(KEPT) {
            cancel::check();
            starts.push((sample, filter.belief));
        }
        filter.pass(sample, |_, _| ());
    }
    let mut behind: Option<Smoothed<N>> = None;
    for (start, belief) in starts.into_iter().rev() {
        cancel::check();
        filter.belief = belief;
        let again = (start..(start + KEPT).min(samples)).map(|sample| filter.pass(sample, |_, _| ()));
        let passed: Vec<Passed<N>> = again.collect();
        for (sample, here) in passed.iter().enumerate().rev() {
            let smoothed = match &behind {
                None => Some(here.after),
                Some(behind) => behind.carried_to(here),
            };
            let Some(all) = smoothed else { return };
            tell(start + sample, all.state[index], all.covariance[(index, index)].max(0.0).sqrt());
            behind = Some(Smoothed { all, predicted: here.before });
        }
    }
}

/// What is known of a sample.
struct Smoothed<const N: usize> {
    /// From all samples.
    all: Belief<N>,
    /// From those before it alone.
    predicted: Belief<N>,
}

impl<const N: usize> Smoothed<N> {
    /// What is known of the sample before.
    #[inline]
    fn carried_to(&self, here: &Passed<N>) -> Option<Belief<N>> {
        // P F' (P⁻)⁻¹, by the Cholesky factor of P⁻, which is positive definite by its added noise.
        let factor = self.predicted.covariance.cholesky()?;
        let gain = factor.solve(&(here.transition * here.after.covariance)).transpose();
        let state = here.after.state + gain * (self.all.state - self.predicted.state);
        let news = around(&gain, &(self.all.covariance - self.predicted.covariance));
        Some(Belief { state, covariance: here.after.covariance + news })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_likelihood_that_nobody_wants_any_more_is_left() {
        assert!(cancel::is_left_within(|| likelihood(&walk(10), 10)));
    }

    /// A random walk that is read with noise, now and then not at all.
    struct Walk {
        read: Vec<f64>,
        step: f64,
    }

    const NOISE: f64 = 0.5;

    impl LinearSystem<1, 1> for Walk {
        fn samples(&self) -> usize {
            self.read.len()
        }

        fn start(&self) -> Belief<1> {
            Belief { state: SVector::from([0.3]), covariance: SMatrix::from([[4.0]]) }
        }

        fn readings(&self, sample: usize) -> [Measurement<1>; 1] {
            [Measurement { value: self.read[sample], noise: NOISE, of: RowSVector::from([[1.0]]) }]
        }

        fn step(&self, _sample: usize) -> Transition<1> {
            Transition {
                transition: SMatrix::from([[1.0]]),
                input: SVector::from([0.1]),
                variance: SVector::from([self.step * self.step]),
            }
        }
    }

    fn walk(samples: usize) -> Walk {
        let read = |at: usize| if at % 7 == 3 { f64::NAN } else { 0.1 * at as f64 + (0.7 * at as f64).sin() };
        Walk { read: (0..samples).map(read).collect(), step: 0.2 }
    }

    /// The same from the joint normal distribution of all values and readings: mean and standard deviation given the readings,
    /// and the logarithm of the readings' density.
    fn jointly(walk: &Walk) -> (Vec<(f64, f64)>, f64) {
        let samples = walk.read.len();
        let prior = DMatrix::from_fn(samples, samples, |i, j| 4.0 + walk.step * walk.step * i.min(j) as f64);
        let there: Vec<usize> = (0..samples).filter(|at| walk.read[*at].is_finite()).collect();
        let covariance = DMatrix::from_fn(there.len(), there.len(), |i, j| {
            prior[(there[i], there[j])] + if i == j { NOISE * NOISE } else { 0.0 }
        });
        let mean = |at: usize| 0.3 + 0.1 * at as f64;
        let off = DVector::from_iterator(there.len(), there.iter().map(|at| walk.read[*at] - mean(*at)));
        let factor = covariance.cholesky().expect("positive definite");
        let given = |at: usize| {
            let cross = DVector::from_iterator(there.len(), there.iter().map(|it| prior[(at, *it)]));
            let variance = prior[(at, at)] - cross.dot(&factor.solve(&cross));
            (mean(at) + cross.dot(&factor.solve(&off)), variance.sqrt())
        };
        let log_determinant = 2.0 * factor.l().diagonal().map(f64::ln).sum();
        let likelihood = -0.5 * (off.dot(&factor.solve(&off)) + log_determinant);
        ((0..samples).map(given).collect(), likelihood)
    }

    #[test]
    fn filter_and_smoother_find_what_the_joint_distribution_says() {
        let walk = walk(60);
        let (states, log_likelihood) = jointly(&walk);
        // Both solve the same equations: they differ by rounding.
        for (found, expected) in smoothed(&walk, 0).iter().zip(&states) {
            assert!((found.0 - expected.0).abs() < 1e-10 && (found.1 - expected.1).abs() < 1e-10);
        }
        assert!((likelihood(&walk, 1_000).known() - log_likelihood).abs() < 1e-9);
        let first = jointly(&Walk { read: walk.read[..20].to_vec(), ..walk }).1;
        assert!((likelihood(&self::walk(60), 20).known() - first).abs() < 1e-9);
    }

    /// A place and how fast it moves, which pull at each other; both read with noise, now and then one of them or none.
    struct Moving {
        place: Vec<f64>,
        speed: Vec<f64>,
        /// Of both readings.
        noise: [f64; 2],
    }

    /// A step from a sample to the next.
    const FORWARD: [[f64; 2]; 2] = [[1.0, 0.1], [-0.2, 0.9]];

    impl LinearSystem<2, 2> for Moving {
        fn samples(&self) -> usize {
            self.place.len()
        }

        fn start(&self) -> Belief<2> {
            Belief {
                state: SVector::from([0.2, -0.1]),
                covariance: SMatrix::from_diagonal(&[1.0, 1.0].into()),
            }
        }

        fn readings(&self, sample: usize) -> [Measurement<2>; 2] {
            [
                Measurement { value: self.place[sample], noise: self.noise[0], of: [[1.0], [0.0]].into() },
                Measurement { value: self.speed[sample], noise: self.noise[1], of: [[0.3], [1.0]].into() },
            ]
        }

        fn step(&self, _sample: usize) -> Transition<2> {
            let [[a, b], [c, d]] = FORWARD;
            Transition {
                transition: SMatrix::from([[a, c], [b, d]]),
                input: [0.01, 0.02].into(),
                variance: [1e-4, 4e-4].into(),
            }
        }
    }

    fn moving(samples: usize, noise: [f64; 2]) -> Moving {
        let read = |at: usize, gap: usize| if at % gap == 2 { f64::NAN } else { (0.3 * at as f64).sin() };
        let column = |gap: usize| (0..samples).map(|at| read(at, gap)).collect();
        Moving { place: column(3), speed: column(5), noise }
    }

    /// State and standard error of each sample, from the normal equations of all states together.
    fn by_least_squares(system: &Moving) -> Vec<[(f64, f64); 2]> {
        let size = 2 * system.samples();
        let (mut information, mut pull) = (DMatrix::<f64>::zeros(size, size), DVector::<f64>::zeros(size));
        // One equation: what these states come to, each times its weight, and how well that is known.
        let mut add = |terms: &[(usize, f64)], value: f64, variance: f64| {
            for (row, weight) in terms {
                pull[*row] += weight * value / variance;
                terms
                    .iter()
                    .for_each(|(column, other)| information[(*row, *column)] += weight * other / variance);
            }
        };
        let start = system.start();
        for index in 0..2 {
            add(&[(index, 1.0)], start.state[index], start.covariance[(index, index)]);
        }
        for sample in 0..system.samples() {
            for Measurement { value, noise, of } in system.readings(sample) {
                let terms = [(2 * sample, of[0]), (2 * sample + 1, of[1])];
                if value.is_finite() {
                    add(&terms, value, noise * noise);
                }
            }
            let Transition { input, variance, .. } = system.step(sample);
            for index in (0..2).filter(|_| sample + 1 < system.samples()) {
                let [from, to] = [2 * sample, 2 * sample + 2];
                let [one, other] = FORWARD[index];
                add(&[(to + index, 1.0), (from, -one), (from + 1, -other)], input[index], variance[index]);
            }
        }
        let factor = information.cholesky().expect("positive definite");
        let (states, covariance) = (factor.solve(&pull), factor.inverse());
        let of = |at: usize| (states[at], covariance[(at, at)].sqrt());
        (0..system.samples()).map(|sample| [of(2 * sample), of(2 * sample + 1)]).collect()
    }

    /// Readings far better than what was known before among them: the standard errors of the first samples stay right.
    #[test]
    fn states_that_pull_at_each_other_are_those_of_least_squares() {
        for noise in [[0.5, 0.2], [1e-3, 0.2], [1e-6, 1e-5]] {
            let system = moving(40, noise);
            let expected = by_least_squares(&system);
            for index in [0, 1] {
                for (sample, found) in smoothed(&system, index).into_iter().enumerate() {
                    let (state, error) = expected[sample][index];
                    // Of the normal equations twelve digits are lost where readings are a millionth of the prior.
                    let is_near =
                        (found.0 - state).abs() < 1e-3 * error && (found.1 / error - 1.0).abs() < 1e-3;
                    assert!(is_near, "{noise:?}, {sample}: {found:?}, {state} ± {error}");
                }
            }
        }
    }

    /// Over more samples than are kept at a time, the seams do not show.
    #[test]
    fn a_long_record_is_smoothed_as_a_short_one() {
        let long = smoothed(&walk(3 * KEPT + 5), 0);
        // What lies 500 samples away has no weight left that a number can hold.
        for seam in [KEPT, 2 * KEPT] {
            let walk = walk(3 * KEPT + 5);
            let around = Walk { read: walk.read[seam - 500..seam + 500].to_vec(), ..walk };
            let short = smoothed(&around, 0);
            for at in 480..520 {
                let (one, other) = (long[seam - 500 + at], short[at]);
                assert!((one.0 - other.0).abs() < 1e-9 && (one.1 - other.1).abs() < 1e-9, "{at}");
            }
        }
    }
}
