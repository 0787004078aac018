//! Output-error fits of problems with known answers.

use std::ops::Range;

use crate::estimation::output_error::*;

/// y = a exp(-b t) + offset of the unit.
struct Decay {
    time: Vec<f64>,
    measured: Vec<f64>,
    units: Vec<Range<usize>>,
}

impl OutputError for Decay {
    fn units(&self) -> &[Range<usize>] {
        &self.units
    }
    fn locals(&self) -> usize {
        1
    }
    fn len(&self) -> usize {
        self.time.len()
    }
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        for (unit, local) in self.units.iter().zip(locals) {
            for row in unit.clone() {
                out[row] = self.measured[row] - globals[0] * (-globals[1] * self.time[row]).exp() - local;
            }
        }
    }
    fn local_scale(&self, _: usize) -> f64 {
        1.0
    }
}

fn decay(noise: impl Fn(usize) -> f64) -> Decay {
    let time: Vec<f64> = (0..300).map(|k| 0.01 * f64::from(k % 100)).collect();
    let offset = |row: usize| [0.5, -2.0, 7.0][row / 100];
    let measured = time.iter().enumerate().map(|(row, t)| 3.0 * (-4.0 * t).exp() + offset(row) + noise(row));
    Decay { measured: measured.collect(), time, units: vec![0..100, 100..200, 200..300] }
}

const FREE: [Free; 2] = [
    Free { start: 1.0, bounds: (0.0, 10.0), scale: 1.0 },
    Free { start: 1.0, bounds: (0.1, 50.0), scale: 1.0 },
];

#[test]
fn finds_globals_and_locals() {
    let found = fit(&decay(|_| 0.0), &FREE, None, &FitConfig { tolerance: 1e-14, ..FitConfig::default() });
    assert!((found.globals[0] - 3.0).abs() < 1e-6 && (found.globals[1] - 4.0).abs() < 1e-6, "{found:?}");
    assert!((found.locals[2] - 7.0).abs() < 1e-6);
}

#[test]
fn a_bound_holds() {
    let free = [FREE[0], Free { bounds: (0.1, 2.0), ..FREE[1] }];
    let found = fit(&decay(|_| 0.0), &free, None, &FitConfig::default());
    assert_eq!(found.globals[1], 2.0);
}

/// A log that runs away makes a start, and with it the bounds, no number or the wrong way round.
#[test]
fn absurd_bounds_are_survived() {
    for bounds in [(f64::NAN, f64::NAN), (10.0, 0.1), (f64::NEG_INFINITY, f64::NAN)] {
        let free = [FREE[0], Free { bounds, ..FREE[1] }];
        let found = fit(&decay(|_| 0.0), &free, None, &FitConfig::default());
        assert_eq!(found.globals.len(), 2, "{bounds:?}");
    }
}

/// Errors over repeated noise: two thirds of them lie within one standard error, 95 of 100 within two.
#[test]
fn standard_errors_hold() {
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};
    let mut generator = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let normal = Normal::new(0.0, 0.1).expect("a normal distribution");
    let mut within = 0;
    for _ in 0..200 {
        let noise: Vec<f64> = (0..300).map(|_| normal.sample(&mut generator)).collect();
        let found = fit(&decay(|row| noise[row]), &FREE, None, &FitConfig::default());
        within += usize::from((found.globals[1] - 4.0).abs() < 2.0 * found.standard_errors[1]);
    }
    // Binomial with 95 %: 200 draws lie between 180 and 200 but once in ten thousand times.
    assert!(within >= 180, "{within} of 200");
}

/// A problem that counts how often it is simulated, and of which only some residuals count.
struct Counted {
    problem: Decay,
    counts: fn(usize) -> bool,
    runs: std::sync::atomic::AtomicUsize,
}

impl Counted {
    fn new(counts: fn(usize) -> bool) -> Self {
        // A wave that is no part of the law, so that something is left.
        let problem = decay(|row| 0.05 * (1.7 * row as f64).sin());
        Self { problem, counts, runs: std::sync::atomic::AtomicUsize::new(0) }
    }

    fn runs(&self) -> usize {
        self.runs.swap(0, std::sync::atomic::Ordering::Relaxed)
    }
}

impl OutputError for Counted {
    fn units(&self) -> &[Range<usize>] {
        self.problem.units()
    }
    fn locals(&self) -> usize {
        self.problem.locals()
    }
    fn len(&self) -> usize {
        self.problem.len()
    }
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        self.runs.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        self.problem.residuals(globals, locals, out);
        out.iter_mut()
            .enumerate()
            .filter(|(row, _)| !(self.counts)(*row))
            .for_each(|(_, value)| *value = 0.0);
    }
    fn local_scale(&self, index: usize) -> f64 {
        self.problem.local_scale(index)
    }
}

/// How far two fits are apart, in standard errors of the first.
fn apart(one: &Fit, other: &Fit) -> f64 {
    let distance =
        |index: usize| (one.globals[index] - other.globals[index]).abs() / one.standard_errors[index];
    (0..one.globals.len()).map(distance).fold(0.0, f64::max)
}

/// Steps without derivatives of their own lead to the same place, with fewer simulations.
#[test]
fn going_on_with_known_slopes_ends_where_new_ones_lead() {
    let problem = Counted::new(|_| true);
    let config = FitConfig::default();
    let anew = fit(&problem, &FREE, None, &config);
    let runs = problem.runs();
    let on = fit(&problem, &FREE, None, &FitConfig { reuses_slopes: true, ..config });
    assert!(apart(&anew, &on) < 0.01, "{:?} {:?}", anew.globals, on.globals);
    let errors = anew.standard_errors.iter().zip(&on.standard_errors);
    assert!(errors.clone().all(|(anew, on)| (on / anew - 1.0).abs() < 0.05), "{errors:?}");
    let fewer = problem.runs();
    assert!(fewer < runs, "{fewer} of {runs}");
}

/// A part of the data, fitted from where all of them led: the same with the slopes that are known there, in fewer simulations.
#[test]
fn a_part_fitted_with_the_slopes_of_all_is_fitted_as_by_itself() {
    let part = |row: usize| row / 20 % 3 != 1;
    let (all, problem) = (Counted::new(|_| true), Counted::new(part));
    let (whole, slopes) = fit_from(&all, &FREE, None, &FitConfig::default(), None);
    let free = [0, 1].map(|index| Free { start: whole.globals[index], ..FREE[index] });
    let config = FitConfig { reuses_slopes: true, ..FitConfig::default() };
    let alone = fit(&problem, &free, Some(&whole.locals), &FitConfig::default());
    let runs = problem.runs();
    let (seeded, _) = fit_from(&problem, &free, Some(&whole.locals), &config, Some(&slopes));
    assert!(apart(&whole, &alone) > 0.05, "a part is not the whole: {:?}", alone.globals);
    assert!(apart(&alone, &seeded) < 0.01, "{:?} {:?}", alone.globals, seeded.globals);
    let fewer = problem.runs();
    assert!(fewer < runs, "{fewer} of {runs}");
    // What was left out is judged in the same way.
    let rest = Counted::new(|row| row / 20 % 3 == 1);
    let from = slopes.of_locals();
    let judged = validate_from(&rest, &alone.globals, Some((&whole.locals, &from)));
    let without = validate(&rest, &alone.globals);
    assert!((judged.cost / without.cost - 1.0).abs() < 1e-6, "{} {}", judged.cost, without.cost);
}

/// A wave of unknown frequency, whose squares have a valley at every other one.
struct Wave(Vec<f64>, Vec<Range<usize>>);

impl OutputError for Wave {
    fn units(&self) -> &[Range<usize>] {
        &self.1
    }
    fn locals(&self) -> usize {
        0
    }
    fn len(&self) -> usize {
        self.0.len()
    }
    fn residuals(&self, globals: &[f64], _: &[f64], out: &mut [f64]) {
        let runs = out.iter_mut().zip(&self.0).enumerate();
        runs.for_each(|(row, (out, measured))| *out = measured - (0.01 * globals[0] * row as f64).sin());
    }
    fn local_scale(&self, _: usize) -> f64 {
        1.0
    }
}

fn from(start: f64) -> Vec<Free> {
    vec![Free { start, bounds: (0.0, 100.0), scale: 1.0 }]
}

/// Of many starts those are followed that are best behind one step, and end where they would alone.
#[test]
fn of_many_starts_the_best_are_followed() {
    let measured = (0..500).map(|row| (0.05 * f64::from(row)).sin()).collect();
    let wave = Wave(measured, std::iter::once(0..500).collect());
    let starts: Vec<Vec<Free>> = [20.0, 5.3, 12.0, 4.6, 33.0, 50.0].into_iter().map(from).collect();
    let config = FitConfig { rescues_units: false, ..FitConfig::default() };
    let best = fit_best(&wave, &starts, &config, 2);
    let alone = [1, 3].map(|start: usize| fit(&wave, &starts[start], None, &config));
    assert_eq!(best.len(), 2);
    assert!(best.iter().all(|found| alone.contains(found)), "{best:?}, not {alone:?}");
    assert!(best.iter().all(|found| (found.globals[0] - 5.0).abs() < 1e-6), "{best:?}");
    assert!(best[0].cost <= best[1].cost);
    // As few as are to be followed go all the way, however they begin.
    let few = fit_best(&wave, &starts[4..], &config, 2);
    assert_eq!(few.len(), 2);
    assert!(few.iter().all(|found| (found.globals[0] - 5.0).abs() > 1.0), "{few:?}");
    assert!(fit_best(&wave, &[], &config, 2).is_empty());
}
