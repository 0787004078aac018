//! The body is asked about its rotors: it feels what they do more finely than their own sensors tell.

use super::assemble::MOST_ALTERNATIVES;
use super::block_context::{Driven, Question};
use super::candidate::Plan;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::error::DiagnoseError;
use super::model_selection::{MOST_CHANCE, is_sound, joint_floors, loss, period, senses_rotors};
use super::search_result::{Found, Single};
use super::surrogate_test::luck;
use super::verdict;
use crate::model::Effect;

/// A body's squared error must differ by this share before it decides about the rotors.
const DECIDES: f64 = 0.05;
/// Sets of the rotors' that the body is asked about, beside their answer.
const ASKED: usize = 4;
/// Share of the body's squared error that another driver has to take off to be followed to the end.
const TAKES_OFF: f64 = 0.2;
/// Standard errors by which a number of the base differs plainly.
const DIFFERS: f64 = 3.0;

/// Squared error of the body, over the noise, under a set of the rotors'; which of the base's numbers the set changes, where
/// that is settled.
type Drives = (f64, Trial, Option<Vec<String>>);

impl Question<'_> {
    /// A late sensor and a late rotor look alike from the command to the reading, and not to the body: where the
    /// rotors' answers differ in their sensor, the one that leaves the body less to explain is taken.
    pub(crate) fn decide(&self, rotor: &mut Found, mut body: Found) -> Result<Found, DiagnoseError> {
        let mine = senses_rotors(&rotor.answer);
        let others: Vec<Trial> = rotor.alternatives.iter().take(MOST_ALTERNATIVES).cloned().collect();
        let mut kept = Vec::new();
        for other in others {
            if senses_rotors(&other) == mine {
                kept.push(other);
                continue;
            }
            // Numbers that moved for nothing would drive the body with their noise.
            let (settled, changed) = (self.settle)(rotor, &other);
            let Some(driven) = self.body(Some((rotor, &settled)), self.find)? else { continue };
            match prefers(&body, &driven) {
                Some(true) => {}
                None => kept.push(other),
                Some(false) => {
                    kept.clear();
                    rotor.answer = settled;
                    rotor.changed = changed;
                    body = driven;
                }
            }
        }
        if senses_rotors(&rotor.answer) != mine
            && let Some(last) = rotor.ladder.last_mut()
        {
            *last = rotor.answer.clone();
        }
        rotor.alternatives = kept;
        Ok(body)
    }

    /// A body feels what its rotors do more finely than their own sensors tell: an effect that is lost in the noise of a
    /// rate, or that its numbers take up, may stand out in the body that it drives. Where the body's numbers alone do not
    /// explain it, the rotors' effects that are no luck are tried as what drives it.
    pub(crate) fn ask(&self, rotor: &mut Found, body: Found) -> Result<Driven, DiagnoseError> {
        // Effects that were asked for stay.
        let is_asked_for = rotor.singles.is_empty() && !body.answer.effects.is_empty();
        if is_asked_for || is_explained(&body, &body.recalibrated) || verdict::is_held(&body) {
            return Ok((body, None));
        }
        // By itself first; then beside what was found in the body, where that leaves more than noise.
        let found = body.answer.effects.clone();
        let mut beside = vec![Vec::new()];
        beside.extend((!found.is_empty() && !is_explained(&body, &body.answer)).then_some(found));
        for effects in &beside {
            let looked = self.looked(rotor, &body, effects)?;
            let before = if effects.is_empty() { &body.recalibrated } else { &body.answer };
            let limit = (1.0 - TAKES_OFF) * misfit(&body, before, &body.floors);
            let Some((left, best, changed)) = looked.first().filter(|(left, ..)| *left < limit) else {
                continue;
            };
            let (settled, changed) = match changed {
                Some(changed) => (best.clone(), changed.clone()),
                None => (self.settle)(rotor, best),
            };
            let Some(driven) = self.followed(rotor, &settled)? else { continue };
            let size = |rotor: &Trial, changed: &[String], body: &Found| {
                rotor.effects.len() + changed.len() + body.answer.effects.len() + body.changed.len()
            };
            let sizes = (size(&rotor.answer, &rotor.changed, &body), size(&settled, &changed, &driven));
            if is_better(&body, &driven, sizes) {
                let is_twin = |(other, trial, _): &&Drives| {
                    *other <= (1.0 + DECIDES) * left && !trial.effects.is_empty()
                };
                rotor.alternatives =
                    looked[1..].iter().filter(is_twin).map(|(_, trial, _)| trial.clone()).collect();
                rotor.ladder.truncate(1);
                rotor.ladder.extend((!settled.effects.is_empty()).then(|| settled.clone()));
                rotor.dropped = settled.effects.iter().map(|_| rotor.recalibrated.clone()).collect();
                rotor.floors = joint_floors(&rotor.stage, &settled);
                (rotor.answer, rotor.changed) = (settled, changed);
                return Ok((driven, Some(body)));
            }
        }
        Ok((body, None))
    }

    /// The body with its own numbers and `effects` refitted, under each plausible set of the rotors, best first.
    fn looked(&self, rotor: &Found, body: &Found, effects: &[String]) -> Result<Vec<Drives>, DiagnoseError> {
        let known = self.model.known_effects()?;
        let drivers = plausible(rotor, &known).into_iter().map(|trial| (trial.clone(), None));
        let numbers = self.other_numbers(rotor, &known).map(|(trial, changed)| (trial, Some(changed)));
        let mut looked = Vec::new();
        for (trial, changed) in drivers.chain(numbers) {
            let look = |stage: Stage| (self.look)(stage, effects);
            if let Some(driven) = self.body(Some((rotor, &trial)), &look)? {
                let refitted = if effects.is_empty() { &driven.recalibrated } else { &driven.answer };
                looked.push((misfit(&driven, refitted, &body.floors), trial, changed));
            }
        }
        looked.sort_by(|a, b| a.0.total_cmp(&b.0));
        Ok(looked)
    }

    /// The base with those of its numbers changed that differ plainly, though by too little to matter to the rotors' own
    /// error, and their names.
    fn other_numbers(&self, rotor: &Found, known: &[Effect]) -> Option<(Trial, Vec<String>)> {
        let differs = |name: &&String| {
            let fitted = &rotor.recalibrated.model;
            let (to, from) = fitted.parameter(name).zip(self.model.parameter(name)).unwrap_or_default();
            fitted.standard_errors.get(*name).is_some_and(|error| (to - from).abs() > DIFFERS * error)
        };
        let names: Vec<String> = rotor.recalibrated.names.iter().filter(differs).cloned().collect();
        let is_news =
            rotor.answer.effects.is_empty() && names.iter().any(|name| !rotor.changed.contains(name));
        let start = || Plan {
            from: self.model,
            effects: Vec::new(),
            base: names.clone(),
            known,
            home: self.model,
            without: None,
        };
        is_news.then(|| (start().run(&rotor.stage), names.clone()))
    }

    /// What is missing in the body under another driver: nothing is looked for where its own numbers explain it, since what
    /// an effect of the body would still gain is how far the new driver is off.
    fn followed(&self, rotor: &Found, driver: &Trial) -> Result<Option<Found>, DiagnoseError> {
        let mut refitted = self.body(Some((rotor, driver)), &|stage| (self.look)(stage, &[]))?;
        if let Some(driven) = refitted.as_mut().filter(|driven| is_explained(driven, &driven.recalibrated)) {
            driven.ladder.truncate(1);
            return Ok(refitted);
        }
        self.body(Some((rotor, driver)), self.find)
    }

    /// Where the rotors' sensors hardly show what was found in the rotors, the body's story begins where they had not got it.
    pub(crate) fn told_from_before(
        &self,
        rotor: &Found,
        (body, before): Driven,
    ) -> Result<Found, DiagnoseError> {
        let is_news = before.is_some() || !rotor.answer.effects.is_empty();
        if !is_news || rotor.over_floor(&rotor.recalibrated).0 > rotor.at_floor() {
            return Ok(body);
        }
        let before = match before {
            None => self.body(Some((rotor, &rotor.recalibrated)), &|stage| (self.look)(stage, &[]))?,
            before => before,
        };
        let Some(before) = before else { return Ok(body) };
        let left = misfit(&body, &body.answer, &body.floors);
        let has_fallen = left < (1.0 - TAKES_OFF) * misfit(&before, &before.recalibrated, &body.floors);
        Ok(if has_fallen { told_from(&before, body, &rotor.answer.effects) } else { body })
    }
}

/// Effects of the rotors that are no luck, beside their answer, nearest first.
fn plausible<'a>(rotor: &'a Found, known: &[Effect]) -> Vec<&'a Trial> {
    let stage = &rotor.stage;
    let limit = loss(stage, &rotor.recalibrated).min((1.0 + DECIDES) * loss(stage, &rotor.answer));
    // One with a note was refused after it had been tried.
    let is_no_luck = |single: &&Single| {
        single.note.is_empty() && single.luck.is_some_and(|luck| luck.chance <= MOST_CHANCE)
    };
    let singles = rotor.singles.iter().filter(is_no_luck);
    let trials = singles.filter_map(|single| single.trial.as_ref());
    let mut trials: Vec<&Trial> = trials
        .filter(|trial| {
            loss(stage, trial) < limit
                && trial.effects != rotor.answer.effects
                && is_sound(stage, trial, known)
        })
        .collect();
    trials.sort_by(|a, b| loss(stage, a).total_cmp(&loss(stage, b)));
    trials.truncate(ASKED);
    trials
}

/// Whether a trial leaves nothing but noise, on the data fitted on as on those held out.
fn is_explained(found: &Found, trial: &Trial) -> bool {
    let limit = found.at_floor();
    let fitted = |channel: usize| trial.channel_error(&found.stage, channel, false) / found.floors[channel];
    found.over_floor(trial).0 <= limit
        && (0..found.stage.train.channels().len()).all(|channel| fitted(channel) <= limit)
}

/// Squared error of a trial, fitted and held out, over the noise.
fn misfit(found: &Found, trial: &Trial, floors: &[f64; 2]) -> f64 {
    let share = |channel: usize, held_out| {
        (trial.channel_error(&found.stage, channel, held_out) / floors[channel]).powi(2)
    };
    (0..found.stage.train.channels().len()).map(|channel| share(channel, false) + share(channel, true)).sum()
}

/// Whether the body that another set drives is better explained; `sizes` count what each of the two asks for.
fn is_better(body: &Found, driven: &Found, sizes: (usize, usize)) -> bool {
    let explained = (is_explained(body, &body.answer), is_explained(driven, &driven.answer));
    match explained {
        (true, false) => false,
        (false, true) => true,
        // As many for the one as for the other: the rotors' own sensors speak for the other, too.
        (true, true) => sizes.1 <= sizes.0,
        _ => {
            misfit(driven, &driven.answer, &body.floors)
                < (1.0 - TAKES_OFF) * misfit(body, &body.answer, &body.floors)
        }
    }
}

/// A driven body whose story begins where the rotors had not got the effects yet.
fn told_from(before: &Found, mut driven: Found, effects: &[String]) -> Found {
    let of = |trial: &Trial| trial.in_units_of(&before.stage, &driven.stage);
    let (Some(stale), Some(recalibrated)) = (of(&before.stale), of(&before.recalibrated)) else {
        return driven;
    };
    let with = |trial: &Trial| Trial { effects: [effects, &trial.effects[..]].concat(), ..trial.clone() };
    let rungs = driven.ladder.iter().map(with);
    driven.ladder = std::iter::once(recalibrated.clone()).chain(rungs).collect();
    if driven.answer.effects.is_empty() {
        driven.ladder.truncate(1);
        driven.ladder.extend((!effects.is_empty()).then(|| with(&driven.answer)));
    }
    // Candidates of the body are held against the same driver as the base; beside them stands what drives it now.
    let now = with(&driven.answer);
    let mut singles = before.singles.clone();
    for single in &mut singles {
        single.trial = single.trial.as_ref().and_then(of);
    }
    if let ([effect], []) = (effects, &driven.answer.effects[..]) {
        let (effect, luck) = (effect.clone(), Some(luck(&recalibrated, &now, period(&driven.stage))));
        singles.push(Single { effect, luck, trial: Some(now), note: String::new() });
    }
    // `extend` has looked for none.
    if !before.singles.is_empty() {
        driven.singles = singles;
    }
    (driven.stale, driven.recalibrated) = (stale, recalibrated);
    driven
}

/// Whether the first body is the simpler explanation; `None` where both are as good.
fn prefers(one: &Found, other: &Found) -> Option<bool> {
    let at_floor = |found: &Found| found.over_floor(&found.answer).0 <= found.at_floor();
    if at_floor(one) != at_floor(other) {
        return Some(at_floor(one));
    }
    let size = |found: &Found| found.answer.effects.len() + found.changed.len();
    if size(one) != size(other) {
        return Some(size(one) < size(other));
    }
    let channels = 0..one.stage.train.channels().len();
    let score = |found: &Found| {
        let share = |channel: usize| {
            (found.answer.channel_error(&found.stage, channel, true) / one.floors[channel]).powi(2)
        };
        channels.clone().map(share).sum::<f64>()
    };
    let (a, b) = (score(one), score(other));
    ((a - b).abs() > DECIDES * a.min(b)).then_some(a < b)
}
