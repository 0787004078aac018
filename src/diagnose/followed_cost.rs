//! What the numbers of a grid leave when those that may move beside them have followed.

use super::grid_cost::taken_up;
use super::problem::Problem;
use crate::estimation::normal_equations::{remove, sum_of_squares};
use crate::estimation::output_error::OutputError;

/// Sums of squares of a problem under numbers near some.
pub(super) struct FollowedCost<'a> {
    problem: &'a Problem<'a>,
    locals: Vec<f64>,
    taken_up: Vec<Vec<f64>>,
    left: Vec<f64>,
}

impl<'a> FollowedCost<'a> {
    /// Near numbers of which the one at `grid` is the step; `moves` are places and sizes of those that follow. On a grid they have no
    /// slope: it is that without.
    pub fn near(
        problem: &'a Problem<'a>,
        (globals, grid): (&[f64], usize),
        locals: &[f64],
        moves: &[(usize, f64)],
    ) -> Self {
        let mut without_grid = globals.to_vec();
        without_grid[grid] = 0.0;
        let taken_up = taken_up(problem, &without_grid, locals, moves);
        Self { problem, locals: locals.to_vec(), taken_up, left: vec![0.0; problem.len()] }
    }

    pub fn at(&mut self, globals: &[f64]) -> f64 {
        self.problem.residuals(globals, &self.locals, &mut self.left);
        remove(&self.taken_up, &mut self.left);
        sum_of_squares(&self.left)
    }
}
