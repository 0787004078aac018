//! What a grid on the command costs: its step, and where a law ahead of it puts it.

use super::block_data::BlockData;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::normal_equations::{orthonormal, remove};
use crate::estimation::output_error::OutputError;
use crate::estimation::pseudo_huber::pseudo_huber;
use crate::model::{Effect, LagPath, Model};

/// Share of its typical size by which a number is moved to see what it takes up.
const SLOPE_STEP: f64 = 1e-4;

/// A number that a fit may move beside a grid.
#[derive(Debug, Clone)]
pub(crate) struct MovableNumber {
    /// What the model calls it.
    pub name: String,
    /// The size it typically has, in its unit.
    pub scale: f64,
}

/// The robust cost of grids, whatever numbers beside them can take up taken away: a grid a hair wider is a curve a hair steeper, too.
pub(crate) struct GridCost<'a> {
    problem: Problem<'a>,
    /// The step, then the number ahead of the grid where there is one, then those beside.
    globals: Vec<f64>,
    locals: Vec<f64>,
    taken_up: Vec<Vec<f64>>,
    /// Of the runs, where their rotors are lags: nothing that is looked at moves them.
    paths: Vec<LagPath>,
    residuals: Vec<f64>,
    /// The number ahead of the grid, as the template has it.
    ahead: Option<f64>,
    /// Places within a step that it is looked at with.
    places: u32,
}

impl<'a> GridCost<'a> {
    pub(crate) fn new(
        (data, template): (&'a BlockData, &Model),
        (name, ahead, places): (&str, Option<&str>, u32),
        (inside, beside): (&[&Effect], &[&MovableNumber]),
    ) -> Self {
        let names = [name].into_iter().chain(ahead).chain(beside.iter().map(|it| it.name.as_str()));
        let names: Vec<String> = names.map(str::to_owned).collect();
        let mut globals: Vec<f64> =
            names.iter().map(|name| template.parameter(name).unwrap_or(0.0)).collect();
        globals[0] = 0.0;
        let problem = Problem::new(data, template.clone(), names, inside);
        let locals = vec![0.0; problem.units().len() * problem.locals()];
        // Without a grid the number ahead of it has a slope, too: it bends the curve.
        let sizes = ahead.map(|_| 1.0).into_iter().chain(beside.iter().map(|it| it.scale));
        let moves: Vec<(usize, f64)> = sizes.enumerate().map(|(at, size)| (at + 1, size)).collect();
        let taken_up = taken_up(&problem, &globals, &locals, &moves);
        let ahead = ahead.map(|_| globals[1]);
        let is_long = problem.len() > THRESHOLDS.most_searched_rows;
        let paths = if is_long { Vec::new() } else { problem.lag_paths(&globals) };
        Self { residuals: vec![0.0; problem.len()], problem, globals, locals, taken_up, paths, ahead, places }
    }

    /// Of a step, with the grid where it fits best.
    pub(crate) fn at(&mut self, step: f64) -> f64 {
        self.globals[0] = step;
        let Some(ahead) = self.ahead else { return self.cost() };
        let places = shifts(ahead, step, self.places);
        places.map(|place| self.with_ahead(place)).fold(f64::INFINITY, f64::min)
    }

    /// The best step about one, with the grid where that one fits best.
    pub(crate) fn closer(&mut self, step: f64, spacing: f64, looks: i32) -> f64 {
        if let Some(place) = self.ahead_at(step, self.places) {
            self.globals[1] = place;
        }
        let at = |step: f64| {
            self.globals[0] = step;
            self.cost()
        };
        fine(at, step, spacing, looks).0
    }

    /// Where a grid of this step fits best, of so many places: the number ahead of it.
    pub(crate) fn ahead_at(&mut self, step: f64, places: u32) -> Option<f64> {
        let ahead = self.ahead?;
        self.globals[0] = step;
        let places = shifts(ahead, step, places);
        let costs = places.map(|place| (self.with_ahead(place), place)).filter(|it| it.0.is_finite());
        costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|it| it.1)
    }

    fn with_ahead(&mut self, place: f64) -> f64 {
        self.globals[1] = place;
        self.cost()
    }

    fn cost(&mut self) -> f64 {
        let at = (self.globals.as_slice(), self.locals.as_slice());
        self.problem.residuals_along(&self.paths, at, &mut self.residuals);
        remove(&self.taken_up, &mut self.residuals);
        pseudo_huber(&self.residuals, THRESHOLDS.grid_robust_width)
    }
}

/// Values, so many within a step, by which a number ahead of a grid of this step may put it elsewhere.
fn shifts(ahead: f64, step: f64, count: u32) -> impl Iterator<Item = f64> {
    let shift = move |at: u32| ahead + step * (f64::from(at) / f64::from(count) - 0.5);
    (0..count).map(shift).map(move |value| if value < 0.0 { value + step } else { value })
}

/// What some numbers of a problem can take up of its residuals, near where they are: an orthonormal basis. `moves` are their places
/// and sizes.
pub(crate) fn taken_up(
    problem: &Problem,
    globals: &[f64],
    locals: &[f64],
    moves: &[(usize, f64)],
) -> Vec<Vec<f64>> {
    // On a long log the grid of a part of it is near, and columns of all rows would be many.
    if problem.len() > THRESHOLDS.most_searched_rows {
        return Vec::new();
    }
    let simulated = |globals: &[f64]| {
        let mut residuals = vec![0.0; problem.len()];
        problem.residuals(globals, locals, &mut residuals);
        residuals
    };
    let here = simulated(globals);
    let slope = |(place, size): &(usize, f64)| {
        let mut moved = globals.to_vec();
        moved[*place] += SLOPE_STEP * size;
        simulated(&moved).iter().zip(&here).map(|(moved, here)| moved - here).collect::<Vec<f64>>()
    };
    let mut slopes: Vec<Vec<f64>> = moves.iter().map(slope).collect();
    // A simulation that ran away has no slope.
    slopes.retain(|slope| slope.iter().all(|value| value.is_finite()));
    orthonormal(&slopes, &(0..problem.len()))
}

/// The best of the values about one, and its cost, in `looks` that come closer and closer.
pub(crate) fn fine(mut cost: impl FnMut(f64) -> f64, about: f64, spacing: f64, looks: i32) -> (f64, f64) {
    let mut best = (about, cost(about));
    let mut width = spacing;
    for _ in 0..looks {
        let middle = best.0;
        for step in (-THRESHOLDS.grid_fine_values..=THRESHOLDS.grid_fine_values).filter(|step| *step != 0) {
            let value = middle + width * f64::from(step) / f64::from(THRESHOLDS.grid_fine_values);
            let scored = (value, cost(value));
            if scored.1 < best.1 {
                best = scored;
            }
        }
        width *= THRESHOLDS.grid_overlap / f64::from(THRESHOLDS.grid_fine_values);
    }
    best
}
