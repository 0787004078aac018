//! Output-error fits of problems with known answers.

use super::*;

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
