//! A grid on data that it was not fitted on. Where it lies is known to a difference of the commands fitted on; a new command that falls
//! between may come to one level or to the one beside it, a whole step off. That is no error of the law: all numbers count that the
//! fitted data hardly tell from the best.

use super::candidate::with_errors;
use super::candidate_fit::noise_multiple;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::followed_cost::FollowedCost;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::output_error::{Fit, fit, validate};
use crate::model::Model;

impl Candidate<'_> {
    /// The model with those of the `hardly_worse` numbers of its grid that leave least held out, and both its fits; `None` where its own
    /// leave hardly more there, or as little as on the fitted data.
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
        let grid = names.iter().position(|name| self.is_discontinuous(name))?;
        // The curve follows the grid; on the fitted data, below.
        let (numbers, moves) = ((fitted.globals.as_slice(), grid), self.moves(names, model));
        let mut cost = FollowedCost::near(&validation, numbers, &held_out.locals, &moves);
        let before = cost.at(&fitted.globals);
        let every = hardly_worse.len().div_ceil(THRESHOLDS.most_hardly_worse);
        let scored = hardly_worse.iter().step_by(every).map(|globals| (globals, cost.at(globals)));
        let (globals, least) = scored.min_by(|a, b| a.1.total_cmp(&b.1))?;
        // What is no number is no gain, here and below.
        let gains = least <= (1.0 - THRESHOLDS.least_gain) * before;
        if !gains {
            return None;
        }
        let frees = self.frees(names, &train.model(globals));
        let mut followed = fit(&train, &frees, Some(&fitted.locals), &THRESHOLDS.fold_fit);
        let used = fitted.residuals.measured().iter().filter(|left| **left != 0.0).count().max(1);
        let limit = fitted.cost * (1.0 + THRESHOLDS.hardly_worse_errors.powi(2) / used as f64);
        let judged = validate(&validation, &followed.globals);
        let is_as_good = followed.cost <= limit && judged.cost <= held_out.cost;
        if !is_as_good {
            return None;
        }
        let free = followed.standard_errors.iter_mut().zip(&fitted.standard_errors).zip(names);
        for ((error, known), _) in free.filter(|(_, name)| self.has_no_slope(name, model)) {
            *error = *known;
        }
        Some((with_errors(&train, names, &followed), (followed, judged)))
    }
}
