//! A block under a model, made linear: how the residuals move when a law is added to it, through the simulation, with the model's own
//! numbers and the initial states free to follow. One step of Gauss and Newton for any number of laws.

use std::ops::Range;

use super::law::{CandidateLaw, usual_size};
use super::measured_path::{Torques, torques, with_torques};
use super::thresholds::THRESHOLDS;
use crate::cancel;
use crate::diagnose::block_data::BlockData;
use crate::diagnose::candidate_fit::CandidateFit;
use crate::diagnose::data_split::DataSplit;
use crate::diagnose::problem::Problem;
use crate::effect::Site;
use crate::estimation::normal_equations::{dot, orthonormal, remove};
use crate::estimation::output_error::OutputError;
use crate::estimation::ridge::ridge_step;
use crate::model::{Effect, Model};

/// The id of a law that is tried.
const TRIED: &str = "tried_law";
/// Share of a law's usual size by which it is put on to see what it does: far above rounding, far below where it bends.
const STEP: f64 = 1e-3;
/// The same for the model's own numbers.
const NUMBER_STEP: f64 = 1e-6;

/// The residuals of the data fitted on, and of those held out.
pub(crate) type FittedAndHeldOut = [Vec<f64>; 2];

/// Numbers of a model by name.
pub(crate) type Numbers = Vec<(String, f64)>;

/// A block and its data under a model that has been fitted.
pub(crate) struct LinearizedBlock<'a> {
    model: &'a Model,
    known: &'a [Effect],
    data: [BlockData; 2],
    locals: [Vec<f64>; 2],
    base: FittedAndHeldOut,
    /// The model's own numbers that are free.
    names: Vec<String>,
    pairs: Vec<[Plane; 2]>,
}

/// What is left of residuals where the initial states have taken their part, of the rows that count.
struct Plane {
    counts: Vec<bool>,
    units: Vec<Range<usize>>,
    bases: Vec<Vec<Vec<f64>>>,
    residuals: Vec<f64>,
    nuisance: Vec<Vec<f64>>,
}

/// What one step does with a law.
#[derive(Debug, Clone)]
pub(crate) struct Score {
    /// Squared residuals on the data fitted on and held out.
    pub train: f64,
    pub held_out: f64,
    /// The law's coefficients (of the first fold).
    pub coefficients: Vec<f64>,
    /// By how much the model's own free numbers move beside them.
    pub steps: Vec<f64>,
    /// Their variance, as far as white noise of the residuals' size goes.
    pub variances: Vec<f64>,
    /// The held-out residuals, of all folds.
    pub residuals: Vec<f64>,
}

impl Score {
    /// Both together.
    pub fn loss(&self) -> f64 {
        self.train + self.held_out
    }
}

impl<'a> LinearizedBlock<'a> {
    /// The block under `fitted`, of whose numbers `names` are free; `known` has its effects.
    pub fn new(
        split: &'a DataSplit,
        fitted: &'a CandidateFit,
        names: &[String],
        known: &'a [Effect],
    ) -> Option<Self> {
        let model = &fitted.model;
        let is_long = split.train.readings() > THRESHOLDS.preselected_readings;
        let part = |data: &BlockData| {
            let share = data.readings().div_ceil(THRESHOLDS.preselected_readings);
            if is_long && share > 1 { data.in_long_pieces(share) } else { data.clone() }
        };
        let data = [part(&split.train), part(&split.validate)];
        let of = |data: &BlockData, own: &[f64]| {
            // A part has other units: their states are found in one step like the rest.
            let count = data.units().len() * problem(data, model, &[], known).locals();
            if own.len() == count { own.to_vec() } else { vec![0.0; count] }
        };
        let locals = [of(&data[0], &fitted.fit.locals), of(&data[1], &fitted.held_out.locals)];
        let both = |index: usize| residuals(&problem(&data[index], model, &[], known), &[], &locals[index]);
        let base = [both(0), both(1)];
        let mut linear = Self { model, known, data, locals, base, names: Vec::new(), pairs: Vec::new() };
        let columns = names.iter().filter_map(|name| Some((name.clone(), linear.number_column(name)?)));
        let (names, nuisance): (Vec<String>, Vec<FittedAndHeldOut>) = columns.unzip();
        linear.names = names;
        let local_columns = [linear.local_columns(0), linear.local_columns(1)];
        let is_short = !is_long && !split.folds.is_empty();
        let plane = |index: usize, counts: Vec<bool>| {
            let own: Vec<&Vec<f64>> = nuisance.iter().map(|both| &both[index]).collect();
            Plane::new(&linear.data[index], &linear.base[index], &own, &local_columns[index], counts)
        };
        let counting = |residuals: &[f64]| residuals.iter().map(|value| *value != 0.0).collect::<Vec<bool>>();
        linear.pairs = if is_short {
            let pairs = split.folds.iter().map(|(train, held_out)| {
                [train, held_out].map(|data| {
                    let own = residuals(&problem(data, model, &[], known), &[], &linear.locals[0]);
                    plane(0, counting(&own))
                })
            });
            pairs.collect()
        } else {
            vec![[plane(0, counting(&linear.base[0])), plane(1, counting(&linear.base[1]))]]
        };
        linear.base.iter().flatten().all(|value| value.is_finite()).then_some(linear)
    }

    /// How the residuals move by a number of the model.
    fn number_column(&self, name: &str) -> Option<FittedAndHeldOut> {
        let value = self.model.parameter(name)?;
        let step = (NUMBER_STEP * value.abs()).max(1e-9);
        let names = [name.to_owned()];
        Some([0, 1].map(|index| {
            let problem = problem(&self.data[index], self.model, &names, self.known);
            quotient(&residuals(&problem, &[value + step], &self.locals[index]), &self.base[index], step)
        }))
    }

    /// How they move by each initial state, of all units at once.
    fn local_columns(&self, index: usize) -> Vec<Vec<f64>> {
        let problem = problem(&self.data[index], self.model, &[], self.known);
        let count = problem.locals();
        let of = |local: usize| {
            let step = 1e-3 * problem.local_scale(local);
            let mut moved = self.locals[index].clone();
            moved.iter_mut().skip(local).step_by(count.max(1)).for_each(|value| *value += step);
            quotient(&residuals(&problem, &[], &moved), &self.base[index], step)
        };
        (0..count).map(of).collect()
    }

    /// How they move by each coefficient of a law, its inner numbers held; `None` where it has no value on these data. A law that adds
    /// to the torque does so along the path that was measured, others in the simulation.
    pub fn columns(&self, law: &CandidateLaw) -> Option<Vec<FittedAndHeldOut>> {
        let names = law.coefficient_names();
        let count = names.len();
        // Behind a delay of the torque what a law adds at the pivot is not to be late.
        let is_late = self.model.equations().is_ok_and(|equations| equations.has_torque_stream());
        let along = |coefficient: usize| -> Option<[Torques; 2]> {
            let of = |data: &BlockData| torques(data, self.model, law, coefficient).filter(|_| !is_late);
            Some([of(&self.data[0])?, of(&self.data[1])?])
        };
        if let Some(torques) = (0..count).map(along).collect::<Option<Vec<_>>>() {
            let column = |torques: &[Torques; 2]| {
                self.column(law.site, self.model, &|step, index| {
                    let data = with_torques(&self.data[index], &torques[index], step);
                    residuals(&problem(&data, self.model, &[], self.known), &[], &self.locals[index])
                })
            };
            return torques.iter().map(column).collect();
        }
        let mut model = self.model.clone();
        model.user_effects.push(law.user_effect(TRIED, &vec![0.0; count]));
        let effect = model.effect(TRIED).ok()?;
        let model = model.with(&effect);
        let column = |name: String| {
            let names = [format!("{TRIED}.{name}")];
            self.column(law.site, &model, &|step, index| {
                let problem = problem(&self.data[index], &model, &names, self.known);
                residuals(&problem, &[step], &self.locals[index])
            })
        };
        names.into_iter().map(column).collect()
    }

    /// How the residuals move by a coefficient; `moved` gives them with so much of it on.
    fn column(
        &self,
        site: Site,
        model: &Model,
        moved: &dyn Fn(f64, usize) -> Vec<f64>,
    ) -> Option<FittedAndHeldOut> {
        cancel::check();
        let largest = |column: &[f64]| column.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        // A coefficient's size is not known before: what it does says how far it may go.
        let mut step = STEP * usual_size(site, model);
        let mut both: Option<FittedAndHeldOut> = None;
        for _ in 0..2 {
            let found = [0, 1].map(|index| quotient(&moved(step, index), &self.base[index], step));
            let most = largest(&found[0]).max(largest(&found[1]));
            if !most.is_finite() || most == 0.0 {
                return None;
            }
            both = Some(found);
            let wanted = THRESHOLDS.put_on / most;
            let within = THRESHOLDS.put_on_within;
            if (within.recip()..within).contains(&(step / wanted)) {
                break;
            }
            step = wanted;
        }
        both
    }

    /// What a step with these columns does.
    pub fn score(&self, columns: &[FittedAndHeldOut], ridge: f64) -> Option<Score> {
        let mut score = Score {
            train: 0.0,
            held_out: 0.0,
            coefficients: Vec::new(),
            steps: Vec::new(),
            variances: Vec::new(),
            residuals: Vec::new(),
        };
        let is_folded = self.pairs.len() > 1;
        for pair in &self.pairs {
            let of = |plane: &Plane, index: usize| -> Vec<Vec<f64>> {
                let own = columns.iter().map(|both| plane.bare(&both[if is_folded { 0 } else { index }]));
                own.collect()
            };
            let (train, held_out) = (of(&pair[0], 0), of(&pair[1], 1));
            let (solution, variances) = pair[0].solve(&train, ridge)?;
            let left = pair[0].left(&train, &solution);
            score.train += dot(&left, &left) / self.pairs.len() as f64;
            let left = pair[1].left(&held_out, &solution);
            score.held_out += dot(&left, &left);
            // Each row is held out in one fold, and zero in the others.
            score.residuals.resize(left.len(), 0.0);
            score.residuals.iter_mut().zip(&left).for_each(|(sum, value)| *sum += value);
            if score.coefficients.is_empty() {
                let own = pair[0].nuisance.len();
                score.coefficients = solution[own..].to_vec();
                score.steps = solution[..own].to_vec();
                score.variances = variances[own..].to_vec();
            }
        }
        (score.train.is_finite() && score.held_out.is_finite()).then_some(score)
    }

    /// The model's own free numbers as they are and where a step puts them: as they go, and as their reciprocals do, of which a body's
    /// motion is linear in its inertia. None changes its sign.
    pub fn numbers_after(&self, score: &Score) -> [Numbers; 3] {
        let moved = |go: &dyn Fn(f64, f64) -> f64| -> Numbers {
            let pairs = self.names.iter().zip(&score.steps);
            let number = |(name, step): (&String, &f64)| {
                let value = self.model.parameter(name)?;
                let after = go(value, *step);
                Some((name.clone(), if after * value > 0.0 && after.is_finite() { after } else { value }))
            };
            pairs.filter_map(number).collect()
        };
        let reciprocal = |value: f64, step: f64| value / (1.0 - step / value);
        [moved(&|value, _| value), moved(&|value, step| value + step), moved(&reciprocal)]
    }

    /// The columns of what moves nothing.
    pub fn nothing(&self) -> FittedAndHeldOut {
        [0, 1].map(|index| vec![0.0; self.base[index].len()])
    }

    /// What is there without a law.
    pub fn without(&self) -> Option<Score> {
        self.score(&[], 0.0)
    }

    /// The residuals of the data fitted on, channel 0, where each piece lies: what a search for lines looks at.
    pub fn residuals(&self) -> (&BlockData, &[f64]) {
        (&self.data[0], &self.base[0])
    }
}

impl Plane {
    fn new(
        data: &BlockData,
        residuals: &[f64],
        nuisance: &[&Vec<f64>],
        local_columns: &[Vec<f64>],
        counts: Vec<bool>,
    ) -> Self {
        let masked = |column: &[f64]| -> Vec<f64> {
            column.iter().zip(&counts).map(|(value, counts)| if *counts { *value } else { 0.0 }).collect()
        };
        let local_columns: Vec<Vec<f64>> = local_columns.iter().map(|column| masked(column)).collect();
        let units = data.units().to_vec();
        let bases = units.iter().map(|unit| orthonormal(&local_columns, unit)).collect();
        let mut plane = Self { counts, units, bases, residuals: Vec::new(), nuisance: Vec::new() };
        plane.residuals = plane.bare(residuals);
        plane.nuisance = nuisance.iter().map(|column| plane.bare(column)).collect();
        plane
    }

    /// A column without what the initial states take up.
    fn bare(&self, column: &[f64]) -> Vec<f64> {
        let pairs = column.iter().zip(&self.counts);
        let mut bare: Vec<f64> = pairs.map(|(value, counts)| if *counts { *value } else { 0.0 }).collect();
        for (unit, basis) in self.units.iter().zip(&self.bases) {
            remove(basis, &mut bare[unit.clone()]);
        }
        bare
    }

    /// The step of the model's own numbers and of the columns that lowers the squares most, and its variances. What of the columns is
    /// nearly the same as another number stays where it is.
    fn solve(&self, columns: &[Vec<f64>], ridge: f64) -> Option<(Vec<f64>, Vec<f64>)> {
        let all: Vec<&[f64]> = self.nuisance.iter().chain(columns).map(Vec::as_slice).collect();
        ridge_step(&all, self.nuisance.len(), &self.residuals, ridge)
    }

    /// The residuals after a step.
    fn left(&self, columns: &[Vec<f64>], step: &[f64]) -> Vec<f64> {
        let mut left = self.residuals.clone();
        for (column, change) in self.nuisance.iter().chain(columns).zip(step) {
            left.iter_mut().zip(column).for_each(|(value, slope)| *value += change * slope);
        }
        left
    }
}

fn problem<'a>(data: &'a BlockData, model: &Model, names: &[String], known: &[Effect]) -> Problem<'a> {
    let inside: Vec<&Effect> = known.iter().filter(|effect| model.has(&effect.id)).collect();
    Problem::new(data, model.clone(), names.to_vec(), &inside)
}

fn residuals(problem: &Problem, globals: &[f64], locals: &[f64]) -> Vec<f64> {
    let mut residuals = vec![0.0; problem.len()];
    problem.residuals(globals, locals, &mut residuals);
    residuals
}

fn quotient(moved: &[f64], base: &[f64], step: f64) -> Vec<f64> {
    moved.iter().zip(base).map(|(moved, base)| (moved - base) / step).collect()
}
