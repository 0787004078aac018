//! Weights of rate and angle of a body anew, by the noise that an answer leaves. The search weighs by what the base leaves: where
//! that is much, an angle that is nearly right may rule over a rate that is not.

use std::collections::BTreeMap;

use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::{loss, period, weigh_channels};
use super::parallel::run_all_near;
use super::search_result::SingleEffect;
use super::search_space::Search;
use super::surrogate_test::surrogate;
use super::thresholds::THRESHOLDS;

/// What a search of a block has found so far.
pub(crate) struct Found {
    pub split: DataSplit,
    /// The nominal and the refitted baseline.
    pub bases: (CandidateFit, CandidateFit),
    pub singles: Vec<SingleEffect>,
    pub fits: Vec<CandidateFit>,
}

impl Found {
    fn all(&mut self) -> impl Iterator<Item = &mut CandidateFit> {
        let singles = self.singles.iter_mut().filter_map(|single| single.fitted.as_mut());
        [&mut self.bases.0, &mut self.bases.1].into_iter().chain(singles).chain(&mut self.fits)
    }
}

impl Search<'_> {
    /// The same with each channel weighed by what `best` leaves of it, where that is another weight: what comes near is fitted again
    /// from where it is.
    pub(crate) fn reweighed(&self, mut found: Found, base: &[String], best: &CandidateFit) -> Found {
        if found.split.train.channels().len() < 2 || best.effects.is_empty() {
            return found;
        }
        let mut split = found.split.clone();
        if !weigh_anew(&mut split, best) {
            return found;
        }
        let own = found.split.clone();
        let scaled: Option<Vec<CandidateFit>> =
            found.all().map(|fitted| fitted.in_units_of(&own, &split)).collect();
        let Some(scaled) = scaled else { return found };
        found.all().zip(scaled).for_each(|(fitted, scaled)| *fitted = scaled);
        let names: [&[String]; 2] = [&[], base];
        let bases = [&found.bases.0, &found.bases.1];
        let bases =
            bases.iter().zip(names).map(|(it, names)| self.candidate(&it.model, &[], names)).collect();
        let again = |candidates: Vec<Candidate>| run_all_near(&candidates, &split, self.progress);
        let [nominal, refitted] = &again(bases)[..] else { return Found { split, ..found } };
        found.fits.sort_by(|a, b| loss(&split, a).total_cmp(&loss(&split, b)));
        let (near, far) = near_of_each_size(std::mem::take(&mut found.fits), best.effects.len());
        let sets = |fits: &[CandidateFit]| {
            again(fits.iter().map(|it| self.candidate(&it.model, &it.effects, base)).collect())
        };
        let mut fits = sets(&near);
        // Under the new weights the others are not where they would be: what the answer needs of them is fitted again.
        let answer = self.grow_answer(&split, refitted, &fits);
        let is_part = |set: &CandidateFit| set.effects.iter().all(|id| answer.effects.contains(id));
        let parts: Vec<CandidateFit> = far.into_iter().filter(is_part).collect();
        fits.extend(sets(&parts));
        for single in &mut found.singles {
            single.fitted = fits.iter().find(|it| it.effects == [single.effect.clone()]).cloned();
            let surrogate = single.fitted.as_ref().map(|fitted| surrogate(refitted, fitted, period(&split)));
            single.surrogate = surrogate.or(single.surrogate);
        }
        let bases = (nominal.clone(), refitted.clone());
        Found { bases, split, fits, ..found }
    }
}

/// Weighs rate and angle by what `best` leaves of them, where that is another weight of the one to the other; whether it is.
pub(crate) fn weigh_anew(split: &mut DataSplit, best: &CandidateFit) -> bool {
    let before = split.train.sigma;
    weigh_channels(split, best);
    let between = |sigma: [f64; 2]| sigma[0] / sigma[1];
    let turned = between(split.train.sigma) / between(before);
    let is_other = split.train.channels().len() > 1 && turned.max(1.0 / turned) >= THRESHOLDS.other_weights;
    if !is_other {
        split.set_sigma(before);
    }
    is_other
}

/// Of sets, best first, those that are fitted again: every single effect, many as large as the answer, a few of those beyond it; and
/// the others.
fn near_of_each_size(fits: Vec<CandidateFit>, answer: usize) -> (Vec<CandidateFit>, Vec<CandidateFit>) {
    let (many, few) = THRESHOLDS.most_reweighed;
    let mut taken: BTreeMap<usize, usize> = BTreeMap::new();
    fits.into_iter().partition(|set| {
        let size = set.effects.len();
        let most = match size {
            1 => usize::MAX,
            _ if size <= answer => many,
            _ => few,
        };
        let taken = taken.entry(size).or_default();
        *taken += 1;
        *taken <= most
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::leaves;
    use super::*;

    /// Larger sets always leave less: they must not crowd out those that the answer is compared with.
    #[test]
    fn sets_as_large_as_the_answer_are_fitted_again_whatever_larger_ones_leave() {
        let of_size = |size: usize| CandidateFit { effects: vec![String::new(); size], ..leaves(vec![1.0]) };
        let sizes = |count: usize, size: usize| std::iter::repeat_n(size, count);
        let fits = sizes(20, 3).chain(sizes(20, 2)).chain(sizes(20, 1)).map(of_size).collect();
        let (near, far) = near_of_each_size(fits, 2);
        let count =
            |of: &[CandidateFit], size: usize| of.iter().filter(|it| it.effects.len() == size).count();
        assert_eq!([1, 2, 3].map(|size| count(&near, size)), [20, 12, 4]);
        assert_eq!([1, 2, 3].map(|size| count(&far, size)), [0, 8, 16]);
    }
}
