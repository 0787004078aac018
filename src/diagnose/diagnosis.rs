//! What `diagnose` answers: the JSON of this is a contract.

use std::collections::BTreeMap;

use serde::Serialize;

use super::not_named::NotNamed;
use super::refusal::EffectRefusal;
use super::thresholds::THRESHOLDS;
use crate::model::{Measure, Model};
use crate::screening::Finding;
use crate::screening::attitude::inertia_in_degrees;

/// The verdict.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Effects are missing, and they are named.
    MissingEffect,
    /// Nothing is missing that these data could show.
    Adequate,
    /// No effect is missing; parameters of the base have other values.
    ParametersChanged,
    /// Something is missing, and nothing in the catalogue carries the error to the noise floor.
    Unknown,
    /// These data cannot tell.
    InsufficientData,
}

/// A base parameter that has another value than the model says.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChangedParameter {
    /// Name in the model file.
    pub name: String,
    /// Symbol in the paper.
    pub symbol: String,
    /// In the model, in `unit`.
    pub from: f64,
    /// Found in the data.
    pub to: f64,
    /// Of `to`.
    pub standard_error: Option<f64>,
    /// SI unit.
    pub unit: String,
}

impl ChangedParameter {
    /// The body's inertia.
    #[must_use]
    pub fn is_inertia(&self) -> bool {
        self.name == "inertia"
    }

    /// An inertia as much smaller than the model's as a degree is than a radian.
    #[must_use]
    pub fn is_in_degrees(&self) -> bool {
        self.is_inertia() && inertia_in_degrees(self.from, self.to).is_some()
    }
}

/// A parameter found.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundParameter {
    /// In `unit`.
    pub value: f64,
    /// `None`: the data do not determine it.
    pub standard_error: Option<f64>,
    /// SI unit.
    pub unit: String,
}

/// An error on both kinds of data.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrainValidate {
    /// On what was fitted.
    pub train: f64,
    /// On what was held out.
    pub validate: f64,
}

/// The error, and how far it falls.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorSummary {
    /// What it is, with unit.
    #[cfg_attr(test, schemars(with = "String"))]
    pub measure: Measure,
    /// The channel it is of, with its unit.
    #[serde(skip)]
    pub channel: String,
    /// The unit of every error in it.
    #[serde(skip)]
    pub unit: &'static str,
    /// What sensor noise alone would leave.
    pub noise_floor: f64,
    /// The model as it is.
    pub base: TrainValidate,
    /// Its own parameters refitted; `recalibrated` in the JSON.
    #[serde(rename = "recalibrated")]
    pub refitted: TrainValidate,
    /// With the missing effects.
    pub extended: TrainValidate,
}

/// Where the model fails.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FailurePlace {
    /// `actuator_1`, `actuator_2`, ..., `body`.
    pub block: String,
    /// Share of all that is above the noise.
    pub share_of_error: f64,
    /// The channel that the error follows most.
    pub depends_on: String,
    /// Share of the error's slow part that this channel explains.
    pub explained: f64,
}

/// One rung of the ladder.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LadderStep {
    /// Effects so far.
    pub effects: Vec<String>,
    /// Held-out error.
    pub validate: f64,
}

/// One candidate on its own.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RankedCandidate {
    /// Id.
    pub effect: String,
    /// The channel its errors are of, with its unit.
    pub channel: String,
    /// Error on training data; `None`: not tried.
    pub train: Option<f64>,
    /// Held-out error.
    pub validate: Option<f64>,
    /// [-] p-value of the surrogate test: how often a meaningless candidate does as well; `chance` in the JSON.
    #[serde(rename = "chance")]
    pub p_value: Option<f64>,
    /// Held-out error that one in twenty meaningless candidates reaches.
    #[serde(skip)]
    pub surrogate_error: Option<f64>,
    /// Held-out error of the answer without it; `None`: not in the answer.
    pub drop_one: Option<f64>,
    /// Why it was not tried, or was refused after it had been.
    pub refusal: Option<EffectRefusal>,
    /// Which condition it failed; `None`: it is named, was not tried, or is refused.
    pub not_named: Option<NotNamed>,
}

/// What to do next.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextExperiment {
    /// The sets it would tell apart.
    pub separates: Vec<Vec<String>>,
    /// What to run.
    pub run: String,
}

/// The answer.
///
/// Made by [`crate::session::diagnose`]; `examples/diagnose.rs` prints one and goes on with it.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// The whole set that is missing, in the order added.
    pub effects: Vec<String>,
    /// Sets that the data cannot tell from it: one with two effects in the place of one first, then nearest first.
    pub alternatives: Vec<Vec<String>>,
    /// More such sets, further away.
    pub further_alternatives: Vec<Vec<String>>,
    /// Of `effects` those that every set has which was tried and which the data cannot tell from it, listed or not.
    pub common_effects: Vec<String>,
    /// Base parameters that have changed.
    pub changed_parameters: Vec<ChangedParameter>,
    /// Parameters of the effects, by `effect.parameter`.
    pub parameters: BTreeMap<String, FoundParameter>,
    /// The error, and how far it falls.
    pub error: ErrorSummary,
    /// Where the model fails.
    pub r#where: Vec<FailurePlace>,
    /// The error falling.
    pub ladder: Vec<LadderStep>,
    /// Every candidate.
    pub candidates: Vec<RankedCandidate>,
    /// What to know about data and answer.
    pub findings: Vec<Finding>,
    /// What would tell more.
    pub next_experiment: Option<NextExperiment>,
    /// Of each of `alternatives` the held-out error, and its unit.
    #[serde(skip)]
    pub alternative_errors: Vec<(f64, &'static str)>,
    /// A body that moves, and not as the torque on it would have it, which no effect explains.
    #[serde(skip)]
    pub turns_against_torque: bool,
    /// A commanded torque drives the body of a log, and no rotor does.
    #[serde(skip)]
    pub is_torque_driven: bool,
    /// The model with the effects, refitted.
    #[serde(skip)]
    pub model: Model,
}

impl Diagnosis {
    /// This answer of all rows, with what the search on a part of them tried.
    pub(super) fn searched_on(self, part: Self, findings: Vec<Finding>) -> Self {
        Self {
            alternatives: part.alternatives,
            further_alternatives: part.further_alternatives,
            common_effects: part.common_effects,
            alternative_errors: part.alternative_errors,
            candidates: part.candidates,
            next_experiment: part.next_experiment,
            findings: findings.into_iter().chain(self.findings).collect(),
            ..self
        }
    }
}

impl ErrorSummary {
    /// Whether it is given in the channel of a candidate.
    #[must_use]
    pub fn is_of(&self, channel: &str) -> bool {
        self.channel == channel
    }

    /// Whether the base refitted does worse on what was held out than as it is.
    #[must_use]
    pub fn is_refitted_worse(&self) -> bool {
        self.refitted.validate > THRESHOLDS.refitted_worse * self.base.validate
    }

    /// The held-out error without the effects: as it is, or refitted where that does better.
    #[must_use]
    pub fn without_effects(&self) -> f64 {
        self.base.validate.min(self.refitted.validate)
    }

    /// The share of the held-out squared error above the noise that the extension takes off what is left without it.
    #[must_use]
    pub fn explained(&self) -> f64 {
        let above = |error: f64| error.powi(2) - self.noise_floor.powi(2);
        let share = 1.0 - above(self.extended.validate) / above(self.without_effects());
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 17.7 as it is, 39.3 refitted, 9.6 extended over 0.83 of noise: what the effects take off is counted from 17.7.
    #[test]
    fn what_effects_explain_is_counted_from_the_better_of_both_baselines() {
        let summary = |base, refitted| ErrorSummary::of_rotor([base, refitted, 9.626]);
        let share = summary(17.7, 39.3).explained();
        assert!((share - 0.706).abs() < 1e-3, "{share}");
        assert!((summary(39.3, 17.7).explained() - share).abs() < 1e-12);
    }
}
