//! Standard errors of an answer that allow for what is not in it: a fit takes its own structure for true, and a small effect that
//! nobody named moves its numbers by more than they say.
//!
//! Three things show by how much. With the base's own numbers free, which the answer holds where they gain nothing, a number moves by
//! what it took over from them. Beside an effect that gains too little to be named it moves by what it took over from that. And fitted
//! to other data (the held-out logs, or each part of a single log) it moves by what is not the same in them. Of two fits the variance of
//! one is half their squared difference; of parts left out in turn it is the jackknife's (Efron, Stein 1981). Where commands step between
//! rows a dead time of theirs is not known better than that.

use super::candidate_fit::{CandidateFit, is_command_delay};
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::is_identifiable;
use super::search_result::SearchResult;
use super::search_space::Search;
use crate::estimation::jackknife::{of_left_out, of_two};
use crate::estimation::thresholds::THRESHOLDS as ESTIMATION;
use crate::model::Model;
use crate::threads::spread;

/// Values of one parameter in several fits.
type Values = Vec<Option<f64>>;

impl Search<'_> {
    /// Widens the standard errors of the numbers that an answer found.
    pub(crate) fn allow_for_what_is_missing(&self, found: &mut SearchResult) {
        let (answer, split) = (&found.answer, &found.split);
        if answer.names.is_empty() || answer.is_exact(split) {
            return;
        }
        let with_base = self.with_base(answer, split).map(|fitted| fitted.model);
        let others = self.on_other_data(answer, split);
        let shifts = self.unnamed_shifts(found);
        let mut of_unnamed = Vec::new();
        let mut model = answer.model.clone();
        for name in &answer.names {
            let (Some(value), Some(error)) =
                (answer.model.parameter(name), answer.model.standard_errors.get(name))
            else {
                continue;
            };
            let from_base = with_base.as_ref().and_then(|model| model.parameter(name));
            let from_base = from_base.map_or(0.0, |other| (other - value).powi(2));
            let others: Values = others.iter().map(|model| model.parameter(name)).collect();
            let between = between(value, &others, split.folds.is_empty());
            let of_steps = if is_command_delay(name) { split.train.delay_unknown() } else { 0.0 };
            let known = error.powi(2).max(between) + from_base + of_steps.powi(2);
            let unnamed = shifts.iter().find(|unnamed| unnamed.parameter == *name);
            let from_unnamed = unnamed.map_or(0.0, |unnamed| unnamed.shift.powi(2));
            model.standard_errors.insert(name.clone(), (known + from_unnamed).sqrt());
            of_unnamed.extend(unnamed.filter(|_| from_unnamed > known).cloned());
        }
        found.shifts = of_unnamed;
        found.answer.model = model;
    }

    /// The answer with all of the base's own numbers free; `None` where they are, or where they could take its effects' place.
    fn with_base(&self, answer: &CandidateFit, split: &DataSplit) -> Option<CandidateFit> {
        let base = split.all_base_parameters(self.base);
        let is_free = |name: &String| answer.names.contains(name);
        if answer.effects.is_empty() || base.iter().all(is_free) {
            return None;
        }
        let fitted = self.fit_near(answer, &base, split);
        is_identifiable(split, &fitted, self.known).then_some(fitted)
    }

    /// The answer's numbers fitted to the held-out data; of a single log, to each part that a fold is fitted on.
    fn on_other_data(&self, answer: &CandidateFit, split: &DataSplit) -> Vec<Model> {
        let swapped =
            |(fitted, held_out): (&_, &_)| DataSplit::new(Clone::clone(fitted), Some(Clone::clone(held_out)));
        let splits: Vec<DataSplit> = if split.folds.is_empty() {
            vec![swapped((&split.validate, &split.train))]
        } else {
            split.folds.iter().map(|(train, held_out)| swapped((train, held_out))).collect()
        };
        let base: Vec<String> = answer.names.iter().filter(|name| !name.contains('.')).cloned().collect();
        let can_tell = |split: &&DataSplit| split.insufficient_data().is_none();
        let splits: Vec<&DataSplit> = splits.iter().filter(can_tell).collect();
        let refitted = |split: &&DataSplit| self.fit_near(answer, &base, split).model;
        // A fit of a long log keeps every core busy by itself, and three at once would leave one of two alone with the last.
        if splits.iter().any(|split| split.train.len() > ESTIMATION.kept_slopes) {
            return splits.iter().map(refitted).collect();
        }
        spread(&splits, refitted)
    }

    /// The answer's effects, from where it has them, with these numbers of the base free.
    fn fit_near(&self, answer: &CandidateFit, base: &[String], split: &DataSplit) -> CandidateFit {
        let candidate =
            Candidate { effects: self.lookup(&answer.effects), ..self.start(&answer.model, base) };
        candidate.fit_alone(candidate.starting_points(split), split)
    }
}

/// The variance of `value` as far as fits to other data show it: of one on data that it has not seen, or of several that each lack a part.
fn between(value: f64, others: &Values, is_apart: bool) -> f64 {
    let others: Vec<f64> = others.iter().copied().flatten().filter(|other| other.is_finite()).collect();
    if is_apart { others.first().map_or(0.0, |other| of_two(value, *other)) } else { of_left_out(&others) }
}
