//! The end of a fit with a grid: the grid, the numbers of laws ahead of it, and what bends beside them.

use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::grid_constraint::WithoutSlope;
use super::grid_refine::{self, Around};
use super::grid_search;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use super::whole_steps::best_of_whole_steps;
use crate::estimation::output_error::{Fit, fit};
use crate::model::Model;

impl Candidate<'_> {
    /// The parameter of a law in jumps, and the rest of the numbers beside it: they depend on each other.
    pub(super) fn fit_grid(
        &self,
        problem: &Problem,
        (index, name, names): (usize, &str, &[String]),
        split: &DataSplit,
        best: &mut Fit,
    ) -> Vec<Vec<f64>> {
        let model = problem.model(&best.globals);
        let without_slope = self.without_slope(index, names, &model);
        self.move_grid(problem, (&without_slope, names), split, best);
        if self.from.parameter(name).is_some() {
            self.search_grid_again(problem, (name, names), split, best);
        }
        let moves = self.moves(names, &problem.model(&best.globals));
        let around = Around { problem, data: &split.train, places: &without_slope, moves: &moves };
        let locals = best.locals.clone();
        let follow = |globals: &[f64]| {
            let frees = self.frees(names, &problem.model(globals));
            fit(problem, &frees, Some(&locals), &THRESHOLDS.fold_fit)
        };
        // On a bent curve the first place that fits is not the best one.
        let further = best_of_whole_steps(&around, &best.globals, &locals).map(|at| follow(&at));
        if let Some(further) = further.filter(|further| further.cost < best.cost) {
            *best = further;
        }
        grid_refine::refine_with_error(&around, follow, best)
    }

    /// Places and sizes of the numbers that may move beside a grid.
    pub(super) fn moves(&self, names: &[String], model: &Model) -> Vec<(usize, f64)> {
        let frees = self.frees(names, model);
        let movable = (0..names.len()).filter(|at| !self.has_no_slope(&names[*at], model));
        movable.map(|at| (at, frees[at].scale)).collect()
    }

    /// A grid, and the numbers beside it, moved in turns.
    fn move_grid(
        &self,
        problem: &Problem,
        (without_slope, names): (&WithoutSlope, &[String]),
        split: &DataSplit,
        best: &mut Fit,
    ) {
        let moves = self.moves(names, &problem.model(&best.globals));
        for _ in 0..THRESHOLDS.grid_rounds {
            let before = (best.globals.clone(), best.cost);
            grid_refine::refine(problem, &split.train, without_slope, &moves, best);
            let frees = self.frees(names, &problem.model(&best.globals));
            let again = fit(problem, &frees, Some(&best.locals), &THRESHOLDS.full_fit);
            let is_better = again.cost < before.1;
            let gains_much = again.cost < THRESHOLDS.promising_share * before.1;
            if is_better {
                *best = again;
            } else {
                best.globals = before.0;
            }
            if !gains_much {
                return;
            }
        }
    }

    /// A grid that was found while something else was missing may be another than the one beside it.
    fn search_grid_again(
        &self,
        problem: &Problem,
        (name, names): (&str, &[String]),
        split: &DataSplit,
        best: &mut Fit,
    ) {
        let Some(parameter) = self.parameter(name) else { return };
        let mut model = problem.model(&best.globals);
        let inside = self.inside(&model);
        let beside = self.beside_grid(names, &model);
        let ahead = names.iter().find(|it| self.is_ahead_of_grid(it, &model)).map(String::as_str);
        let named = (name, ahead);
        let grids = grid_search::grids(&split.train, &model, named, parameter.bounds, (&inside, &beside));
        if let Some(grid) = grids.first() {
            grid.put_into(&mut model, named);
            let again = fit(problem, &self.frees(names, &model), Some(&best.locals), &THRESHOLDS.full_fit);
            if again.cost < best.cost {
                *best = again;
            }
        }
    }
}
