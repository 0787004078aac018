//! A grid on data that it was not fitted on. Where it lies is known to a difference of the commands fitted on; a new command that falls
//! between may come to one level or to the one beside it, a whole step off. That is no error of the law: all numbers count that the
//! fitted data hardly tell from the best.

use super::candidate::with_errors;
use super::candidate_fit::noise_multiple;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::grid_cost::taken_up;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::normal_equations::{remove, sum_of_squares};
use crate::estimation::output_error::{Fit, OutputError, fit, validate};
use crate::model::Model;

impl Candidate<'_> {
    /// The model with the numbers of its grid where the held-out data have them, of those that the fitted data tell `hardly_worse` ones,
    /// with both its fits; `None` where they leave as little as the fitted data do, or hardly less there.
    pub(super) fn moved_on_held_out(
        &self,
        (model, names): (&Model, &[String]),
        (fitted, held_out): (&Fit, &Fit),
        hardly_worse: &[Vec<f64>],
        split: &DataSplit,
    ) -> Option<(Model, (Fit, Fit))> {
        let is_much = noise_multiple(held_out, &split.validate)
            > (1.0 + THRESHOLDS.least_gain) * noise_multiple(fitted, &split.train);
        if hardly_worse.is_empty() || !split.folds.is_empty() || !is_much {
            return None;
        }
        let inside = self.inside(model);
        let problem = |data| Problem::new(data, model.clone(), names.to_vec(), &inside);
        let (train, validation) = (problem(&split.train), problem(&split.validate));
        let mut without_grid = fitted.globals.clone();
        for (number, _) in without_grid.iter_mut().zip(names).filter(|(_, name)| self.is_discontinuous(name))
        {
            *number = 0.0;
        }
        // The curve follows the grid; on the fitted data, below.
        let taken_up = taken_up(&validation, &without_grid, &held_out.locals, &self.moves(names, model));
        let mut left = vec![0.0; validation.len()];
        let mut cost = |globals: &[f64]| {
            validation.residuals(globals, &held_out.locals, &mut left);
            remove(&taken_up, &mut left);
            sum_of_squares(&left)
        };
        let before = cost(&fitted.globals);
        let every = hardly_worse.len().div_ceil(THRESHOLDS.most_hardly_worse);
        let scored = hardly_worse.iter().step_by(every).map(|globals| (globals, cost(globals)));
        let (globals, least) = scored.min_by(|a, b| a.1.total_cmp(&b.1))?;
        if least > (1.0 - THRESHOLDS.least_gain) * before {
            return None;
        }
        let frees = self.frees(names, &train.model(globals));
        let mut followed = fit(&train, &frees, Some(&fitted.locals), &THRESHOLDS.fold_fit);
        let used = fitted.residuals.measured().iter().filter(|left| **left != 0.0).count().max(1);
        let limit = fitted.cost * (1.0 + THRESHOLDS.hardly_worse_errors.powi(2) / used as f64);
        let judged = validate(&validation, &followed.globals);
        if followed.cost > limit || judged.cost > held_out.cost {
            return None;
        }
        let free = followed.standard_errors.iter_mut().zip(&fitted.standard_errors).zip(names);
        for ((error, known), _) in free.filter(|(_, name)| self.has_no_slope(name, model)) {
            *error = *known;
        }
        Some((with_errors(&train, names, &followed), (followed, judged)))
    }
}
