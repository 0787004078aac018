//! What the search of one block found.

use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::model_selection::{floor, joint_floors, over_floor};
use super::not_named::NotNamed;
use super::refusal::EffectRefusal;
use super::surrogate_test::SurrogateTest;
use super::thresholds::THRESHOLDS;
use crate::screening::Finding;

/// A candidate on its own.
#[derive(Debug, Clone)]
pub struct SingleEffect {
    /// Id.
    pub effect: String,
    /// Its fit; `None` when the log lacks what it needs.
    pub fitted: Option<CandidateFit>,
    /// What its shifted traces do; `None` when it was not tried.
    pub surrogate: Option<SurrogateTest>,
    /// Why it was not tried, or why it was refused after it had been.
    pub refusal: Option<EffectRefusal>,
    /// Which condition it failed in the search of its block; `None` where it was named, not tried or refused.
    pub not_named: Option<NotNamed>,
}

/// An effect that nobody named and that moves a number of the answer.
#[derive(Debug, Clone, PartialEq)]
pub struct UnnamedShift {
    /// The number.
    pub parameter: String,
    /// The effect.
    pub effect: String,
    /// By how much, in the number's unit.
    pub shift: f64,
}

/// What the search of one block found.
#[derive(Debug, Clone)]
pub struct SearchResult {
    /// The data it was found on.
    pub split: DataSplit,
    /// The nominal baseline: the base as it is.
    pub nominal: CandidateFit,
    /// The refitted baseline: the base with its own parameters refitted.
    pub refitted: CandidateFit,
    /// Every candidate on its own.
    pub singles: Vec<SingleEffect>,
    /// The answer: the best set, and of the base's own parameters only those refitted whose change it needs.
    pub answer: CandidateFit,
    /// The refitted baseline, then sets on the way to the answer, the answer last.
    pub ladder: Vec<CandidateFit>,
    /// Sets that the data cannot tell from the answer, nearest first.
    pub alternatives: Vec<CandidateFit>,
    /// Sets with two effects in the place of one of the answer's that the data cannot tell from it, or that leave a little less.
    pub two_for_one: Vec<CandidateFit>,
    /// For each effect of the answer, the fit without it.
    pub dropped: Vec<CandidateFit>,
    /// Noise floor of each channel in its unit.
    pub floors: [f64; 2],
    /// Base parameters without whose change the answer is worse.
    pub changed: Vec<String>,
    /// What the standard errors of the answer allow for, where that is more than all else.
    pub shifts: Vec<UnnamedShift>,
}

impl SearchResult {
    /// That of an answer which was not searched for: nothing else was tried, and its ladder is one step.
    pub(crate) fn of_one(
        split: DataSplit,
        [nominal, refitted, answer]: [CandidateFit; 3],
        changed: Vec<String>,
    ) -> Self {
        let floors = joint_floors(&split, &answer);
        let ladder = vec![refitted.clone(), answer.clone()];
        let (singles, alternatives, dropped) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            split,
            nominal,
            refitted,
            singles,
            answer,
            ladder,
            alternatives,
            two_for_one: Vec::new(),
            dropped,
            floors,
            changed,
            shifts: Vec::new(),
        }
    }

    /// The largest held-out error of a fit over its noise floor, and the channel it is in.
    #[must_use]
    pub fn over_floor(&self, fitted: &CandidateFit) -> (f64, usize) {
        over_floor(&self.split, fitted, &self.floors)
    }

    /// The factor of the noise floor within which nothing is left to explain.
    #[must_use]
    pub fn at_floor(&self) -> f64 {
        if self.split.train.is_driven_by_rotors() { THRESHOLDS.at_floor_driven } else { THRESHOLDS.at_floor }
    }

    /// Effects that nobody named and that most of the standard error of a number shown is for, each with those numbers and what they would be
    /// beside it.
    pub(crate) fn unnamed_effects(&self) -> Vec<Finding> {
        let is_shown = |unnamed: &&UnnamedShift| match unnamed.parameter.split_once('.') {
            Some((effect, _)) => self.answer.effects.iter().any(|named| named == effect),
            None => self.changed.contains(&unnamed.parameter),
        };
        let mut shown: Vec<&UnnamedShift> = self.shifts.iter().filter(is_shown).collect();
        shown.sort_by(|a, b| a.effect.cmp(&b.effect));
        let beside = |shift: &&UnnamedShift| {
            self.answer.model.parameter(&shift.parameter).unwrap_or(f64::NAN) + shift.shift
        };
        let of_effect = |shifts: &[&UnnamedShift]| {
            let numbers: Vec<String> = shifts.iter().map(|shift| shift.parameter.clone()).collect();
            Finding::new("error_for_unnamed", shifts[0].effect.clone())
                .with("numbers", numbers)
                .with("beside_it", shifts.iter().map(beside).collect::<Vec<f64>>())
        };
        shown.chunk_by(|a, b| a.effect == b.effect).map(of_effect).collect()
    }

    /// The share of what the refitted baseline leaves above the noise that the answer explains.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let (before, after) = (self.refitted.validate(&self.split), self.answer.validate(&self.split));
        let room = before - floor(&self.split, &self.floors);
        if room > 0.0 { ((before - after) / room).clamp(0.0, 1.0) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ROWS, leaves, split};
    use super::*;

    /// Numbers that the answer does not show, of the base as it is or of an effect that is not in it, are none of the reader's.
    #[test]
    fn of_an_effect_that_nobody_named_the_numbers_shown_are_said_together() {
        let mut answer = leaves(vec![0.0; ROWS]);
        let base = answer.clone();
        answer.effects = vec!["transport_delay".to_owned()];
        answer.model.set_parameter("pole", 16.0);
        let mut found = SearchResult::of_one(split(), [base.clone(), base, answer], vec!["pole".to_owned()]);
        let shift = |parameter: &str, effect: &str, shift: f64| {
            let (parameter, effect) = (parameter.to_owned(), effect.to_owned());
            UnnamedShift { parameter, effect, shift }
        };
        found.shifts = vec![
            shift("pole", "telemetry_lag", -0.5),
            shift("steady_rate_linear", "telemetry_lag", 3.0),
            shift("transport_delay.delay", "quadratic_rotor_drag", 0.001),
            shift("slew_rate_limit.rate", "telemetry_lag", 9.0),
        ];
        let said = found.unnamed_effects();
        let numbers = |finding: &Finding| (finding.subject.clone(), finding.texts("numbers").to_vec());
        let said_of = |effect: &str, number: &str| (effect.to_owned(), vec![number.to_owned()]);
        assert_eq!(
            said.iter().map(numbers).collect::<Vec<_>>(),
            [said_of("quadratic_rotor_drag", "transport_delay.delay"), said_of("telemetry_lag", "pole")]
        );
        assert_eq!(said[1].numbers("beside_it"), [15.5]);
        found.shifts[2].effect = "telemetry_lag".to_owned();
        let together = found.unnamed_effects();
        assert_eq!(together.len(), 1, "one sentence of one effect: {together:?}");
        assert_eq!(together[0].texts("numbers"), ["pole", "transport_delay.delay"]);
    }
}
