//! Weights of rate and angle of a body anew, by the noise that an answer leaves. The search weighs by what the base leaves: where
//! that is much, an angle that is nearly right may rule over a rate that is not.

use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::{loss, weigh_channels};
use super::parallel::run_all_near;
use super::search_result::SingleEffect;
use super::search_space::Search;
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
        weigh_channels(&mut split, best);
        let between = |split: &DataSplit| split.train.sigma[0] / split.train.sigma[1];
        let turned = between(&split) / between(&found.split);
        if turned.max(1.0 / turned) < THRESHOLDS.other_weights {
            return found;
        }
        let own = found.split.clone();
        let scaled: Option<Vec<CandidateFit>> =
            found.all().map(|fitted| fitted.in_units_of(&own, &split)).collect();
        let Some(scaled) = scaled else { return found };
        found.all().zip(scaled).for_each(|(fitted, scaled)| *fitted = scaled);
        found.fits.sort_by(|a, b| loss(&split, a).total_cmp(&loss(&split, b)));
        let near = found.fits.len().min(THRESHOLDS.most_reweighed);
        let bases = [&found.bases.0, &found.bases.1];
        let numbers: [&[String]; 2] = [&[], base];
        let of_bases =
            bases.iter().zip(numbers).map(|(fitted, names)| self.candidate(&fitted.model, &[], names));
        let of_sets = found.fits[..near].iter().map(|it| self.candidate(&it.model, &it.effects, base));
        let candidates: Vec<Candidate> = of_bases.chain(of_sets).collect();
        let mut again = run_all_near(&candidates, &split, self.progress).into_iter();
        let bases = again.next().zip(again.next());
        let mut fits: Vec<CandidateFit> = again.collect();
        let bases = bases.unwrap_or(found.bases);
        // Under the new weights the others are not where they would be: what the answer needs of them is fitted again.
        let answer = self.grow_answer(&split, &bases.1, &fits);
        let (parts, others): (Vec<CandidateFit>, Vec<CandidateFit>) = found
            .fits
            .drain(near..)
            .partition(|set| set.effects.iter().all(|id| answer.effects.contains(id)));
        let of_parts: Vec<Candidate> =
            parts.iter().map(|it| self.candidate(&it.model, &it.effects, base)).collect();
        fits.extend(run_all_near(&of_parts, &split, self.progress));
        fits.extend(others.into_iter().filter(|set| set.effects.len() == 1));
        Found { split, bases, fits, ..found }
    }
}
