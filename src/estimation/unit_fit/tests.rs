//! Fits of many units beside the general way, which keeps all derivatives.

use std::f64::consts::TAU;
use std::num::NonZeroUsize;
use std::sync::Arc;

use crate::estimation::measured_rows::MeasuredRows;
use crate::estimation::output_error::{
    self, Fit, FitConfig, Free, OutputError, UnitResiduals, fit, validate,
};
use crate::estimation::thresholds::THRESHOLDS;
use crate::threads::limited;
use std::ops::Range;

const ROWS: usize = 500;
const UNITS: usize = 1_200;

/// y = a exp(-(b + l) t) + offset of the unit, whose second local l enters far from linearly; measured in part of the rows.
struct Decays {
    measured: Vec<f64>,
    units: Vec<Range<usize>>,
    rows: Option<Arc<MeasuredRows>>,
    /// Whether a few units can be made at a time.
    is_by_units: bool,
}

/// Those of some globals.
struct At<'a>(&'a Decays, [f64; 2]);

impl UnitResiduals for At<'_> {
    fn write(&self, units: Range<usize>, locals: &[f64], out: &mut [f64]) {
        let Self(problem, [size, rate]) = *self;
        let start = problem.units[units.start].start;
        for (unit, own) in units.zip(locals.chunks(2)) {
            for (place, row) in problem.units[unit].clone().enumerate() {
                let time = 2e-3 * place as f64;
                let modelled = size * (-(rate + own[1]) * time).exp() + own[0];
                let measured = problem.measured[row];
                out[row - start] = if measured.is_finite() { (measured - modelled) / 0.1 } else { 0.0 };
            }
        }
    }
}

impl OutputError for Decays {
    fn units(&self) -> &[Range<usize>] {
        &self.units
    }
    fn locals(&self) -> usize {
        2
    }
    fn len(&self) -> usize {
        self.measured.len()
    }
    fn measured(&self) -> Option<&Arc<MeasuredRows>> {
        self.rows.as_ref()
    }
    fn by_units(&self, globals: &[f64]) -> Option<Box<dyn UnitResiduals + '_>> {
        self.is_by_units.then(|| -> Box<dyn UnitResiduals> { Box::new(At(self, [globals[0], globals[1]])) })
    }
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        At(self, [globals[0], globals[1]]).write(0..self.units.len(), locals, out);
    }
    fn local_scale(&self, _: usize) -> f64 {
        0.1
    }
}

/// Units with offsets and rates of their own, and noise of 0.1 that is not the same in any two of them.
fn decays(is_by_units: bool) -> Decays {
    let units: Vec<Range<usize>> = (0..UNITS).map(|unit| unit * ROWS..(unit + 1) * ROWS).collect();
    let mut seed = 7_u64;
    let mut uniform = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(1_u32 << 31) - 0.5
    };
    let mut measured = Vec::with_capacity(UNITS * ROWS);
    for _ in 0..UNITS {
        let (offset, rate) = (4.0 * uniform(), 4.0 + 0.02 * uniform());
        let drift = 0.2 * uniform();
        for row in 0..ROWS {
            let time = 2e-3 * row as f64;
            let value = 3.0 * (-rate * time).exp() + offset + drift * (9.0 * time).sin() + 0.3 * uniform();
            measured.push(if row % 3 == 0 { value } else { f64::NAN });
        }
    }
    let rows = MeasuredRows::of(measured.iter().map(|value| value.is_finite()), &units);
    assert!(rows.is_some() && measured.len() > THRESHOLDS.kept_slopes);
    Decays { measured, units, rows, is_by_units }
}

const FREE: [Free; 2] = [
    Free { start: 2.0, bounds: (0.0, 10.0), scale: 1.0 },
    Free { start: 3.0, bounds: (0.1, 50.0), scale: 1.0 },
];
const TO_THE_END: FitConfig =
    FitConfig { iterations: 60, tolerance: 1e-12, goal: None, reuses_slopes: false, rescues_units: true };

fn differ(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).abs() / b.abs().max(1e-3)).fold(0.0, f64::max)
}

/// The rate and each unit's own are one too many: the mean of the latter is taken up by the former only as far as they are not free.
fn free_and_held() -> [Free; 2] {
    [FREE[0], Free { bounds: (4.0, 4.0), start: 4.0, ..FREE[1] }]
}

#[test]
fn a_fit_of_many_units_is_that_which_keeps_all_derivatives() {
    let (few, all) = (decays(true), decays(false));
    let free = free_and_held();
    let (found, expected) = (fit(&few, &free, None, &TO_THE_END), fit(&all, &free, None, &TO_THE_END));
    assert!((expected.globals[0] - 3.0).abs() < 0.05, "{:?}", expected.globals);
    // What the locals make of three values shows a parabola, whose lowest point lies where the fit ends.
    let error = expected.standard_errors[0];
    let profile = |at: f64| validate(&few, &[found.globals[0] + at * error, 4.0]).cost;
    let [below, at, above] = [-1.0, 0.0, 1.0].map(profile);
    let lowest = 0.5 * (below - above) / (below - 2.0 * at + above);
    assert!(lowest.abs() < 0.1, "{lowest} standard errors from {} ± {error}", found.globals[0]);
    // The other way takes its locals' derivatives once, where they are 5 % off.
    let apart = (found.globals[0] - expected.globals[0]).abs();
    assert!(apart < 0.3 * error, "{} and {} ± {error}", found.globals[0], expected.globals[0]);
    let errors = (&found.standard_errors[..1], &expected.standard_errors[..1]);
    assert!(differ(errors.0, errors.1) < 0.02, "{errors:?}");
    assert_eq!(found.standard_errors[1], f64::INFINITY, "it is held");
    // In variances of a residual.
    assert!(found.cost < expected.cost + 2.0 * THRESHOLDS.predicted, "{} {}", found.cost, expected.cost);
    assert_eq!(found.residuals.len(), few.len());
    let kept = found.residuals.measured();
    assert_eq!(kept.len(), expected.residuals.measured().len());
    let squares: f64 = kept.iter().map(|value| value * value).sum();
    assert!((squares / found.cost - 1.0).abs() < 1e-12, "what is kept is of the end");
}

#[test]
fn locals_alone_are_fitted_as_by_the_way_that_keeps_all_derivatives() {
    let globals = [3.1, 3.9];
    let (found, expected) = (validate(&decays(true), &globals), validate(&decays(false), &globals));
    assert_eq!((found.globals, found.standard_errors), (globals.to_vec(), vec![f64::INFINITY; 2]));
    // Derivatives that are taken anew find a lower place than those of the start alone.
    assert!(found.cost <= expected.cost, "{} {}", found.cost, expected.cost);
    for (index, step) in [(0, 1e-3), (0, -1e-3), (1, 1e-3), (1, -1e-3)] {
        let mut moved = found.locals.clone();
        moved.iter_mut().skip(index).step_by(2).for_each(|local| *local += step);
        let around = super::cost(&decays(true), &globals, &moved).expect("many");
        assert!(around > found.cost * (1.0 - 1e-6), "{index} {step}: {around} {}", found.cost);
    }
}

#[test]
fn a_bound_and_a_goal_hold_for_many_units() {
    let problem = decays(true);
    let free = [Free { bounds: (0.0, 2.5), ..FREE[0] }, free_and_held()[1]];
    assert_eq!(fit(&problem, &free, None, &TO_THE_END).globals[0], 2.5);
    let found = fit(&problem, &free_and_held(), None, &TO_THE_END);
    let given_up = FitConfig { goal: Some(0.5 * found.cost), ..TO_THE_END };
    assert!(fit(&problem, &free_and_held(), None, &given_up).iterations <= found.iterations);
}

#[test]
fn many_units_give_the_same_on_any_number_of_threads() {
    let problem = decays(true);
    let one = |threads: usize| -> (Fit, Fit) {
        limited(NonZeroUsize::new(threads), || {
            (fit(&problem, &free_and_held(), None, &FitConfig::default()), validate(&problem, &[3.0, 4.0]))
        })
    };
    let first = one(1);
    assert!(first == one(2) && first == one(5));
    let fit = &first.1;
    let cost = super::cost(&problem, &fit.globals, &fit.locals).expect("many");
    assert!((cost / fit.cost - 1.0).abs() < 1e-12);
    assert!(super::cost(&decays(false), &fit.globals, &fit.locals).is_none());
    let _: &dyn output_error::OutputError = &problem;
}

/// y = a x + b z + offset of the unit, where z is x and a `part` of something else.
struct Planes {
    measured: Vec<f64>,
    units: Vec<Range<usize>>,
    part: f64,
}

struct AtPlane<'a>(&'a Planes, [f64; 2]);

fn plane(row: usize, part: f64, [a, b]: [f64; 2]) -> f64 {
    // Whole periods in each unit: no offset takes anything of them up.
    let turns = |of: f64| TAU * of * row as f64 / ROWS as f64;
    let x = turns(5.0).sin();
    a * x + b * (x + part * turns(18.0).cos())
}

impl UnitResiduals for AtPlane<'_> {
    fn write(&self, units: Range<usize>, locals: &[f64], out: &mut [f64]) {
        let Self(problem, slopes) = *self;
        let start = problem.units[units.start].start;
        for (unit, offset) in units.zip(locals) {
            for row in problem.units[unit].clone() {
                out[row - start] = (problem.measured[row] - plane(row, problem.part, slopes) - offset) / 0.1;
            }
        }
    }
}

impl OutputError for Planes {
    fn units(&self) -> &[Range<usize>] {
        &self.units
    }
    fn locals(&self) -> usize {
        1
    }
    fn len(&self) -> usize {
        self.measured.len()
    }
    fn by_units(&self, globals: &[f64]) -> Option<Box<dyn UnitResiduals + '_>> {
        Some(Box::new(AtPlane(self, [globals[0], globals[1]])))
    }
    fn residuals(&self, globals: &[f64], locals: &[f64], out: &mut [f64]) {
        AtPlane(self, [globals[0], globals[1]]).write(0..self.units.len(), locals, out);
    }
    fn local_scale(&self, _: usize) -> f64 {
        0.1
    }
}

/// All goes as predicted, and the first step ends where it must not: at the bound of a, or half way along the valley of a and b.
#[test]
fn a_step_that_goes_as_predicted_is_not_the_last_where_it_was_cut_short() {
    let units: Vec<Range<usize>> = (0..UNITS).map(|unit| unit * ROWS..(unit + 1) * ROWS).collect();
    for (part, most, expected) in [(0.5, 2.5, None), (0.01, 10.0, Some([4.0, 3.0]))] {
        let noise = |row: usize| 0.02 * f64::from((row * 37 % 5) as u32) - 0.04;
        let measured = (0..UNITS * ROWS).map(|row| plane(row, part, [4.0, 3.0]) + noise(row)).collect();
        let problem = Planes { measured, units: units.clone(), part };
        let free = [Free { bounds: (0.0, most), ..FREE[0] }, Free { bounds: (-9.0, 9.0), ..FREE[1] }];
        let found = fit(&problem, &free, None, &TO_THE_END);
        let cost = |b: f64| validate(&problem, &[found.globals[0], b]).cost;
        let [below, at, above] = [-1e-3, 0.0, 1e-3].map(|step| cost(found.globals[1] + step));
        assert!(at < below && at < above, "{part}: {:?}", found.globals);
        let far = expected.map_or(0.0, |truth| differ(&found.globals, &truth));
        assert!(far < 0.02, "{part}: {:?}", found.globals);
    }
}
