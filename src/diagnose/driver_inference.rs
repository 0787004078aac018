//! What the body shows of its rotors: it feels what they do more finely than their own sensors do.

use super::block_context::{BlockContext, DrivenBody};
use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::driven_body::{TriedDriver, is_better, is_explained, misfit, prefers, sort_by_what_is_missing};
use super::error::DiagnoseError;
use super::model_selection::{is_identifiable, joint_floors, loss, period, senses_rotors};
use super::not_named::{NotNamed, Unmet};
use super::rest_of_body::rest_follows;
use super::search_result::{SearchResult, SingleEffect};
use super::surrogate_test::surrogate;
use super::thresholds::THRESHOLDS;
use crate::model::Effect;

/// Squared error of the body, over the noise, under a set of the rotors'; which of the base's numbers the set changes, where
/// parameters are selected.
type DriverScore = (f64, CandidateFit, Option<Vec<String>>);

impl BlockContext<'_> {
    /// A delay of the sensor and one of the rotor look the same from the command to the reading, and not to the body: where the
    /// rotors' answers differ in their sensor, the one that leaves the body less to explain is taken.
    pub(crate) fn decide_sensor_lag(
        &self,
        rotor: &mut SearchResult,
        mut body: SearchResult,
    ) -> Result<SearchResult, DiagnoseError> {
        let own = senses_rotors(&rotor.answer);
        let others = rotor.alternatives.clone();
        let mut kept = Vec::new();
        for (place, other) in others.into_iter().enumerate() {
            if senses_rotors(&other) == own {
                kept.push(other);
                continue;
            }
            // Each of the others asks for a body of its own.
            if place >= THRESHOLDS.most_alternatives {
                continue;
            }
            let (selected, changed) = self.with_its_numbers(rotor, &other);
            let Some(driven) = self.body(Some((rotor, &selected)), self.find)? else { continue };
            match prefers(&body, &driven) {
                Some(true) => {}
                None => kept.push(other),
                Some(false) => {
                    kept.clear();
                    rotor.two_for_one.clear();
                    rotor.answer = selected;
                    rotor.changed = changed;
                    body = driven;
                }
            }
        }
        if senses_rotors(&rotor.answer) != own
            && let Some(last) = rotor.ladder.last_mut()
        {
            *last = rotor.answer.clone();
        }
        rotor.alternatives = kept;
        Ok(body)
    }

    /// The body with nothing named, where what was found in it may be what its rotors are off by; what was tried is kept, with the reason.
    pub(crate) fn without_what_lags(
        &self,
        rotor: &SearchResult,
        body: SearchResult,
    ) -> Result<SearchResult, DiagnoseError> {
        if !may_be_of_lagging_rotors(rotor, &body) {
            return Ok(body);
        }
        let refitted = self.body(Some((rotor, &rotor.answer)), &|split| (self.refit)(split, &[]))?;
        let Some(refitted) = refitted else { return Ok(body) };
        let nothing_left = NotNamed { beside: Vec::new(), condition: Unmet::NothingLeft };
        let of_tried = |single: SingleEffect| {
            let not_named = single.refusal.is_none().then(|| nothing_left.clone());
            SingleEffect { not_named, ..single }
        };
        Ok(SearchResult { singles: body.singles.into_iter().map(of_tried).collect(), ..refitted })
    }

    /// A body feels what its rotors do more finely than their own sensors tell: an effect that is lost in the noise of a
    /// rate, or that its numbers take up, may stand out in the body that it drives. Where the body's numbers alone do not
    /// explain it, the rotors' effects that pass the surrogate test are tried as what drives it.
    pub(crate) fn infer_driver(
        &self,
        rotor: &mut SearchResult,
        body: SearchResult,
    ) -> Result<DrivenBody, DiagnoseError> {
        // Effects that were requested stay.
        let is_requested = rotor.singles.is_empty() && !body.answer.effects.is_empty();
        if is_requested || is_explained(&body, &body.refitted) {
            return Ok((body, None));
        }
        let near = self.near_drivers(rotor, &body)?;
        let mut drivers = self.drivers(rotor, near, &body.floors)?;
        if drivers.is_empty() {
            return Ok((body, None));
        }
        let least = drivers.remove(0);
        let before = self.size(rotor, (&rotor.answer, &rotor.changed), &body);
        if !is_better(&body, &least.body, (before, least.size)) {
            return Ok((body, None));
        }
        rotor.alternatives = least.as_good(drivers, &body.floors).collect();
        rotor.two_for_one.clear();
        answer_with(rotor, least.selected, least.changed);
        Ok((least.body, Some(body)))
    }

    /// Sets of the rotors that leave the body less by plenty, those with the least and those with nearly as little.
    fn near_drivers(
        &self,
        rotor: &SearchResult,
        body: &SearchResult,
    ) -> Result<Vec<DriverScore>, DiagnoseError> {
        // By itself first; then beside what was found in the body, where that leaves more than noise.
        let found = body.answer.effects.clone();
        let mut beside = vec![Vec::new()];
        beside.extend((!found.is_empty() && !is_explained(body, &body.answer)).then_some(found));
        let mut near: Vec<DriverScore> = Vec::new();
        for effects in &beside {
            let mut scored = self.scored(rotor, body, effects)?;
            // What ran away leaves no number.
            scored.retain(|score| score.0.is_finite());
            let before = if effects.is_empty() { &body.refitted } else { &body.answer };
            let limit = (1.0 - THRESHOLDS.driver_gain) * misfit(body, before, &body.floors);
            let nearly =
                scored.first().map_or(0.0, |best| (1.0 + THRESHOLDS.decides_between_drivers) * best.0);
            let is_new = |score: &DriverScore| {
                !near.iter().any(|known| known.1.effects == score.1.effects && known.2 == score.2)
            };
            let new =
                scored.into_iter().filter(|score| score.0 < limit && score.0 <= nearly && is_new(score));
            let new: Vec<DriverScore> = new.collect();
            near.extend(new);
        }
        Ok(near)
    }

    /// The drivers with what is found in the body under each: first the one that explains it with least missing in all. A rotor that
    /// answers late may be taken for one that is read late, and then the torque is late, too.
    fn drivers(
        &self,
        rotor: &SearchResult,
        scored: Vec<DriverScore>,
        floors: &[f64; 2],
    ) -> Result<Vec<TriedDriver>, DiagnoseError> {
        let mut drivers = Vec::new();
        for (_, fitted, changed) in scored {
            let (selected, changed) = match changed {
                Some(changed) => (fitted, changed),
                None => self.with_its_numbers(rotor, &fitted),
            };
            let Some(body) = self.search_driven(rotor, &selected)? else { continue };
            let size = self.size(rotor, (&selected, &changed), &body);
            drivers.push(TriedDriver { selected, changed, body, size });
        }
        sort_by_what_is_missing(&mut drivers, floors);
        Ok(drivers)
    }

    /// What is missing or changed in the rotors and the body that they drive. Estimates that follow are no change of the bench.
    fn size(
        &self,
        rotor: &SearchResult,
        (answer, changed): (&CandidateFit, &[String]),
        body: &SearchResult,
    ) -> usize {
        let changed = if self.has_estimates(rotor) { 0 } else { changed.len() };
        answer.effects.len() + changed + body.answer.effects.len() + body.changed.len()
    }

    /// The body with its own numbers and `effects` refitted, under each plausible set of the rotors, best first.
    fn scored(
        &self,
        rotor: &SearchResult,
        body: &SearchResult,
        effects: &[String],
    ) -> Result<Vec<DriverScore>, DiagnoseError> {
        let known = self.model.known_effects()?;
        let drivers = plausible(rotor, &known).into_iter().map(|fitted| (fitted.clone(), None));
        let numbers = self.other_numbers(rotor, &known).map(|(fitted, changed)| (fitted, Some(changed)));
        let mut scored = Vec::new();
        for (fitted, changed) in drivers.chain(numbers) {
            let refit = |split: DataSplit| (self.refit)(split, effects);
            if let Some(driven) = self.body(Some((rotor, &fitted)), &refit)? {
                let refitted = if effects.is_empty() { &driven.refitted } else { &driven.answer };
                scored.push((misfit(&driven, refitted, &body.floors), fitted, changed));
            }
        }
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(scored)
    }

    /// The base with those of its numbers changed that differ plainly, though by too little to matter to the rotors' own
    /// error, and their names.
    fn other_numbers(&self, rotor: &SearchResult, known: &[Effect]) -> Option<(CandidateFit, Vec<String>)> {
        let names = self.plainly_other(&rotor.refitted);
        let is_news =
            rotor.answer.effects.is_empty() && names.iter().any(|name| !rotor.changed.contains(name));
        let start = || Candidate {
            from: self.model,
            effects: Vec::new(),
            base: names.clone(),
            known,
            nominal: self.model,
            without: None,
        };
        is_news.then(|| (start().run(&rotor.split), names.clone()))
    }

    /// Whether the rotors' own numbers were identified on logs.
    fn has_estimates(&self, rotor: &SearchResult) -> bool {
        let own = rotor.split.base_parameters(self.model);
        own.iter().any(|name| self.model.standard_errors.contains_key(name))
    }

    /// A set of the rotors' with the base's numbers that it drives the body with, and the names of those that it changes. Numbers that
    /// moved for nothing would drive it with their noise; identified ones took up a part of what the set is.
    fn with_its_numbers(&self, rotor: &SearchResult, fitted: &CandidateFit) -> (CandidateFit, Vec<String>) {
        if self.has_estimates(rotor) && !fitted.effects.is_empty() {
            return (fitted.clone(), rotor.split.base_parameters(self.model));
        }
        (self.select_parameters)(rotor, fitted)
    }

    /// The base's own numbers that a fit has plainly other than the model.
    fn plainly_other(&self, fitted: &CandidateFit) -> Vec<String> {
        let differs = |name: &&String| {
            let (to, from) = fitted.model.parameter(name).zip(self.model.parameter(name)).unwrap_or_default();
            let error = fitted.model.standard_errors.get(*name);
            error.is_some_and(|error| (to - from).abs() > THRESHOLDS.base_differs * error)
        };
        fitted.names.iter().filter(differs).cloned().collect()
    }

    /// Where several of the rotors' own numbers were changed, the bench is another than the model's; and where they were identified on
    /// a bench that has an effect more than the model, they took up a part of it. Then all are changed that plainly differ. The few that
    /// the rotors' sensors need stand in for the others, and the body feels by how much they fail to.
    pub(crate) fn change_all_that_differ(&self, rotor: &mut SearchResult) -> Result<(), DiagnoseError> {
        let all = rotor.split.all_base_parameters(self.model);
        let have_taken_up = !rotor.answer.effects.is_empty() && self.has_estimates(rotor);
        if rotor.changed.len() < THRESHOLDS.numbers_of_another && !have_taken_up {
            return Ok(());
        }
        let known = self.model.known_effects()?;
        let effects: Vec<&Effect> =
            known.iter().filter(|effect| rotor.answer.effects.contains(&effect.id)).collect();
        let from = rotor.answer.model.clone();
        let fit = |base: Vec<String>| {
            let effects = effects.clone();
            Candidate { from: &from, effects, base, known: &known, nominal: self.model, without: None }
                .run(&rotor.split)
        };
        let changed: Vec<String> = if have_taken_up {
            all
        } else {
            let other = self.plainly_other(&fit(all.clone()));
            let differs = |name: &String| rotor.changed.contains(name) || other.contains(name);
            all.into_iter().filter(differs).collect()
        };
        if changed.len() == rotor.changed.len() {
            return Ok(());
        }
        let answer = fit(changed.clone());
        let is_whole = answer.effects.is_empty() || is_identifiable(&rotor.split, &answer, &known);
        if is_whole && loss(&rotor.split, &answer) <= loss(&rotor.split, &rotor.answer) {
            if let Some(last) = rotor.ladder.last_mut().filter(|last| !last.effects.is_empty()) {
                *last = answer.clone();
            }
            rotor.floors = joint_floors(&rotor.split, &answer);
            (rotor.answer, rotor.changed) = (answer, changed);
        }
        Ok(())
    }

    /// What is missing in the body under another driver: nothing is looked for where its own numbers explain it, since what
    /// an effect of the body would still gain is how far the new driver is off.
    fn search_driven(
        &self,
        rotor: &SearchResult,
        driver: &CandidateFit,
    ) -> Result<Option<SearchResult>, DiagnoseError> {
        let mut refitted = self.body(Some((rotor, driver)), &|split| (self.refit)(split, &[]))?;
        let leaves_noise = |driven: &SearchResult| {
            is_explained(driven, &driven.refitted) && rest_follows(driven, &driven.refitted).is_none()
        };
        if let Some(driven) = refitted.as_mut().filter(|driven| leaves_noise(driven)) {
            driven.ladder.truncate(1);
            return Ok(refitted);
        }
        self.body(Some((rotor, driver)), self.find)
    }

    /// Where the rotors' sensors hardly show what was found in the rotors, the body's ladder begins where they had not got it.
    pub(crate) fn error_before_driver(
        &self,
        rotor: &SearchResult,
        (body, before): DrivenBody,
    ) -> Result<SearchResult, DiagnoseError> {
        let is_news = before.is_some() || !rotor.answer.effects.is_empty();
        if !is_news || rotor.over_floor(&rotor.refitted).0 > rotor.at_floor() {
            return Ok(body);
        }
        let before = match before {
            None => self.body(Some((rotor, &rotor.refitted)), &|split| (self.refit)(split, &[]))?,
            before => before,
        };
        let Some(before) = before else { return Ok(body) };
        let left = misfit(&body, &body.answer, &body.floors);
        let has_fallen =
            left < (1.0 - THRESHOLDS.driver_gain) * misfit(&before, &before.refitted, &body.floors);
        Ok(if has_fallen { with_error_before(&before, body, &rotor.answer.effects) } else { body })
    }
}

/// Makes a set, of which nothing but its fit is known, the rotors' answer.
fn answer_with(rotor: &mut SearchResult, selected: CandidateFit, changed: Vec<String>) {
    rotor.ladder.truncate(1);
    rotor.ladder.extend((!selected.effects.is_empty()).then(|| selected.clone()));
    rotor.dropped = selected.effects.iter().map(|_| rotor.refitted.clone()).collect();
    rotor.floors = joint_floors(&rotor.split, &selected);
    (rotor.answer, rotor.changed) = (selected, changed);
}

/// Effects of the rotors that pass the surrogate test, beside their answer, nearest first.
fn plausible<'a>(rotor: &'a SearchResult, known: &[Effect]) -> Vec<&'a CandidateFit> {
    let split = &rotor.split;
    let limit = loss(split, &rotor.refitted)
        .min((1.0 + THRESHOLDS.decides_between_drivers) * loss(split, &rotor.answer));
    // One with a refusal was refused after it had been tried.
    let is_significant = |single: &&SingleEffect| {
        single.refusal.is_none()
            && single.surrogate.is_some_and(|surrogate| surrogate.p_value <= THRESHOLDS.significance_level)
    };
    let singles = rotor.singles.iter().filter(is_significant);
    let fits = singles.filter_map(|single| single.fitted.as_ref());
    let mut fits: Vec<&CandidateFit> = fits
        .filter(|fitted| {
            loss(split, fitted) < limit
                && fitted.effects != rotor.answer.effects
                && is_identifiable(split, fitted, known)
        })
        .collect();
    fits.sort_by(|a, b| loss(split, a).total_cmp(&loss(split, b)));
    fits.truncate(THRESHOLDS.drivers_tried);
    fits
}

/// Whether what was found in a body may be what its rotors are off by: their readings lag, so that nobody has seen the rates that drive
/// it, and its own numbers alone leave no more than the scatter of the noise floor.
fn may_be_of_lagging_rotors(rotor: &SearchResult, body: &SearchResult) -> bool {
    let is_searched = !rotor.singles.is_empty() && !body.answer.effects.is_empty();
    is_searched && senses_rotors(&rotor.answer) && body.over_floor(&body.refitted).0 <= THRESHOLDS.at_floor
}

/// A driven body whose ladder begins where the rotors had not got the effects yet.
fn with_error_before(before: &SearchResult, mut driven: SearchResult, effects: &[String]) -> SearchResult {
    let of = |fitted: &CandidateFit| fitted.in_units_of(&before.split, &driven.split);
    let (Some(nominal), Some(refitted)) = (of(&before.nominal), of(&before.refitted)) else {
        return driven;
    };
    let with = |fitted: &CandidateFit| CandidateFit {
        effects: [effects, &fitted.effects[..]].concat(),
        ..fitted.clone()
    };
    let rungs = driven.ladder.iter().map(with);
    driven.ladder = std::iter::once(refitted.clone()).chain(rungs).collect();
    if driven.answer.effects.is_empty() {
        driven.ladder.truncate(1);
        driven.ladder.extend((!effects.is_empty()).then(|| with(&driven.answer)));
    }
    // Candidates of the body are compared under the same driver as the base; beside them stands what drives it now.
    let now = with(&driven.answer);
    let mut singles = before.singles.clone();
    for single in &mut singles {
        single.fitted = single.fitted.as_ref().and_then(of);
    }
    if let ([effect], []) = (effects, &driven.answer.effects[..]) {
        let (effect, surrogate) = (effect.clone(), Some(surrogate(&refitted, &now, period(&driven.split))));
        singles.push(SingleEffect { effect, surrogate, fitted: Some(now), refusal: None, not_named: None });
    }
    // `extend` has looked for none.
    if !before.singles.is_empty() {
        driven.singles = singles;
    }
    (driven.nominal, driven.refitted) = (nominal, refitted);
    driven
}
