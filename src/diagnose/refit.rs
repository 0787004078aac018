//! Given effects added and everything refitted, without a search; and the errors before and after in one measure.

use super::block_data::BlockData;
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::{over_white_floors, weigh_channels};
use super::parallel::run_all;
use super::problem::Problem;
use super::reweigh::weigh_anew;
use super::search_result::SearchResult;
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::estimation::output_error::{Fit, validate};
use crate::model::{Effect, Model};

/// What the same block was found to be on a part of the data: where the fits on all of it start.
#[derive(Debug, Clone)]
pub(crate) struct Near {
    is_rotor: bool,
    sigma: [f64; 2],
    refitted: Model,
    answer: Model,
    effects: Vec<String>,
    holds_levels: bool,
}

impl Near {
    /// Of what was found of each block on a part of the data.
    pub(crate) fn of(found: &[SearchResult]) -> Vec<Self> {
        let of = |found: &SearchResult| Self {
            is_rotor: found.split.train.is_rotor(),
            sigma: found.split.train.sigma,
            refitted: found.refitted.model.clone(),
            answer: found.answer.model.clone(),
            effects: found.answer.effects.clone(),
            holds_levels: found.split.holds_levels,
        };
        found.iter().map(of).collect()
    }
}

/// What was found of this block with these effects.
fn near_of<'a>(near: &'a [Near], split: &DataSplit, ids: &[String]) -> Option<&'a Near> {
    near.iter().find(|near| near.is_rotor == split.train.is_rotor() && near.effects == ids)
}

impl Search<'_> {
    /// The given effects added and everything refitted.
    #[must_use]
    pub fn refit(&self, split: DataSplit, ids: &[String]) -> SearchResult {
        self.refit_near(split, ids, &[])
    }

    /// The same from where the fits on a part of the data ended.
    pub(crate) fn refit_near(&self, mut split: DataSplit, ids: &[String], near: &[Near]) -> SearchResult {
        let (nominal, refitted, best) = self.first_fits(&mut split, ids, near);
        let (answer, changed) = self.select_parameters(&split, &nominal, &refitted, &best);
        drop(best);
        SearchResult::of_one(split, [nominal, refitted, answer], changed)
    }

    /// The same for a rung of a ladder: fitted again with each channel weighed by what is left with the effects in, and all
    /// errors in one measure.
    #[must_use]
    pub(crate) fn rung(&self, mut split: DataSplit, ids: &[String], near: &[Near]) -> SearchResult {
        if ids.is_empty() {
            let (nominal, refitted, best) = self.first_fits(&mut split, ids, near);
            let (answer, changed) = self.select_parameters(&split, &nominal, &refitted, &best);
            drop(best);
            return self.measured_rung(split, [nominal.into(), refitted.into()], answer, changed);
        }
        let (start, found) = match near_of(near, &split, ids) {
            // What a part has shown weighs the channels, too.
            Some(near) => {
                split.set_sigma(near.sigma);
                split.holds_levels = near.holds_levels;
                (near.refitted.clone(), self.as_found(&near.answer, ids, &split))
            }
            None => {
                let (_, refitted, best) = self.first_fits(&mut split, ids, near);
                (refitted.model, best)
            }
        };
        weigh_channels(&mut split, &found);
        // Of a long log what a fit leaves of each row is long: of each no more is kept than is asked of it.
        let found = found.into_model();
        let names = split.base_parameters(self.base);
        let bases = [(self.base, &[][..]), (&start, &names[..])];
        let bases = bases.map(|(from, names)| self.base_of_rung(from, names, &split));
        let best = self.candidate(&found, ids, &names).run_near(&split);
        let (answer, changed) = self.select_beside_effects(&split, best);
        self.measured_rung(split, bases, answer, changed)
    }

    /// A base of a rung, these of its numbers fitted. Where all are measured in one unit afterwards its numbers are enough.
    fn base_of_rung(&self, from: &Model, names: &[String], split: &DataSplit) -> FittedModel {
        let candidate = self.candidate(from, &[], names);
        if !split.folds.is_empty() {
            return candidate.run_near(split).into();
        }
        if names.is_empty() {
            return FittedModel::as_it_is(from);
        }
        let found = candidate.fit_alone(candidate.starting_points(split).near(), split);
        FittedModel { left: None, ..found.into() }
    }

    /// The nominal and the refitted baseline, and the fit with the effects.
    fn first_fits(
        &self,
        split: &mut DataSplit,
        ids: &[String],
        near: &[Near],
    ) -> (CandidateFit, CandidateFit, CandidateFit) {
        let Some(near) = near_of(near, split, ids) else {
            let (nominal, mut refitted) = self.bases(split);
            // Who asks for other numbers means all of them.
            if split.holds_levels && ids.is_empty() {
                refitted = self.with_free_levels(split);
            }
            let best = self.with(&refitted, ids, &split.base_parameters(self.base), split);
            if split.holds_levels {
                // A search looks for effects beside free levels, too, where they do little beside held ones.
                let mut free = split.clone();
                let free_base = self.with_free_levels(&mut free);
                let beside_free = self.with(&free_base, ids, &free.base_parameters(self.base), &free);
                if beside_free.validate(&free) < best.validate(split) {
                    *split = free;
                    return (nominal, free_base, beside_free);
                }
            }
            return (nominal, refitted, best);
        };
        split.set_sigma(near.sigma);
        split.holds_levels = near.holds_levels;
        let base_names = split.base_parameters(self.base);
        let first = self.as_found(&near.refitted, &[], split);
        weigh_channels(split, &first);
        let first = first.into_model();
        if !ids.is_empty() {
            // As the search on the part did.
            let answer = self.as_found(&near.answer, ids, split);
            weigh_anew(split, &answer);
        }
        let nominal = self.candidate(self.base, &[], &[]).run(split);
        let refitted = self.candidate(&first, &[], &base_names).run_near(split);
        let best = if ids.is_empty() {
            refitted.clone()
        } else {
            self.candidate(&near.answer, ids, &base_names).run_near(split)
        };
        (nominal, refitted, best)
    }

    /// A model with its numbers as a part of the data has them, only initial states fitted, on what is fitted on: so near the end of a
    /// fit it tells as much of each channel's noise.
    fn as_found(&self, model: &Model, ids: &[String], split: &DataSplit) -> CandidateFit {
        let inside: Vec<&Effect> = self.known.iter().filter(|effect| model.has(&effect.id)).collect();
        let fit = validate(&Problem::new(&split.train, model.clone(), Vec::new(), &inside), &[]);
        let (effects, held_out) = (ids.to_vec(), fit.clone());
        CandidateFit { effects, model: model.clone(), names: Vec::new(), fit, held_out }
    }

    /// One after another as the search goes, and by joint estimation: the first finds the way where they are far from where they
    /// start, the second where they only make sense together. Where both leave more than noise, in the order in which each
    /// next one leaves least, too.
    fn with(
        &self,
        refitted: &CandidateFit,
        ids: &[String],
        base_names: &[String],
        split: &DataSplit,
    ) -> CandidateFit {
        let mut best = refitted.clone();
        for count in 1..=ids.len() {
            best = self.candidate(&best.model, &ids[..count], base_names).run(split);
        }
        if ids.len() > 1 {
            let joint = self.candidate(&refitted.model, ids, base_names).run(split);
            best = if joint.fit.cost < best.fit.cost { joint } else { best };
        }
        if ids.len() > 1 && over_white_floors(split, &best) > THRESHOLDS.at_floor {
            let ordered = self.in_best_order(refitted, ids, base_names, split);
            best = if ordered.fit.cost < best.fit.cost { ordered } else { best };
        }
        best
    }

    /// One after another, each time the one that leaves least.
    fn in_best_order(
        &self,
        refitted: &CandidateFit,
        ids: &[String],
        base_names: &[String],
        split: &DataSplit,
    ) -> CandidateFit {
        let mut best = refitted.clone();
        for _ in ids {
            let left = ids.iter().filter(|id| !best.effects.contains(id));
            let sets: Vec<Vec<String>> =
                left.map(|id| [&best.effects[..], std::slice::from_ref(id)].concat()).collect();
            let candidates: Vec<Candidate> =
                sets.iter().map(|set| self.candidate(&best.model, set, base_names)).collect();
            let fits = run_all(&candidates, split, self.progress);
            let Some(next) = fits.into_iter().min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost)) else { break };
            best = next;
        }
        best.effects = ids.to_vec();
        best
    }

    /// A rung of its bases and its answer, their errors with initial states that the noise alone weighs: a model's error is the same then,
    /// whatever it was fitted beside, and the rungs of a ladder agree. Not where parts of the logs that are fitted on are held out:
    /// there each part has a fit of its own.
    fn measured_rung(
        &self,
        mut split: DataSplit,
        bases: [FittedModel; 2],
        answer: CandidateFit,
        changed: Vec<String>,
    ) -> SearchResult {
        let [nominal, refitted] = bases;
        if split.folds.is_empty() {
            let inertia = answer.model.body.inertia;
            split.set_sigma(split.train.white_floors(&answer.fit.residuals, inertia));
        }
        let answer = FittedModel::from(answer);
        let fits = [nominal, refitted, answer].map(|fitted| self.measured(fitted, &split));
        SearchResult::of_one(split, fits, changed)
    }

    fn measured(&self, fitted: FittedModel, split: &DataSplit) -> CandidateFit {
        let FittedModel { effects, model, names, left } = fitted;
        if let Some((fit, held_out)) = left.filter(|_| !split.folds.is_empty()) {
            return CandidateFit { effects, model, names, fit, held_out };
        }
        let inside: Vec<&Effect> = self.known.iter().filter(|effect| model.has(&effect.id)).collect();
        let of = |data: &BlockData| validate(&Problem::new(data, model.clone(), Vec::new(), &inside), &[]);
        let (fit, held_out) = (of(&split.train), of(&split.validate));
        CandidateFit { effects, model, names, fit, held_out }
    }
}

/// A candidate after its fit; what it leaves on both parts where that is still asked for.
struct FittedModel {
    effects: Vec<String>,
    model: Model,
    names: Vec<String>,
    left: Option<(Fit, Fit)>,
}

impl FittedModel {
    fn as_it_is(model: &Model) -> Self {
        Self { effects: Vec::new(), model: model.clone(), names: Vec::new(), left: None }
    }
}

impl From<CandidateFit> for FittedModel {
    fn from(fitted: CandidateFit) -> Self {
        let CandidateFit { effects, model, names, fit, held_out } = fitted;
        Self { effects, model, names, left: Some((fit, held_out)) }
    }
}
