//! What `discover` answers: the JSON of this is a contract.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::diagnose::diagnosis::{ChangedParameter, ErrorSummary, FoundParameter};
use crate::diagnose::{Diagnosis, Verdict};
use crate::effect::Site;
use crate::model::{Model, UserEffect};
use crate::screening::Finding;

/// The verdict.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LawVerdict {
    /// A formula that no catalogue has explains what is missing.
    Law,
    /// Something is a smooth function of the named channels, and no formula of the library says which.
    Shape,
    /// Effects of the catalogue explain what is missing.
    Catalogue,
    /// What a diagnosis says, where it names no effect; `unknown`: nor does any function of the channels explain it.
    #[serde(untagged)]
    Diagnosed(Verdict),
}

/// A place where a law may act, and how much a smooth function there explains.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaceShare {
    /// Where it acts.
    pub site: Site,
    /// What it looks at, by name in logs.
    pub channels: Vec<String>,
    /// Whether it also looks at which way its channel went last.
    pub by_direction: bool,
    /// Share of the held-out squared error above the noise that a smooth function of these explains.
    pub explained: f64,
}

/// Which way a channel went last.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ChannelDirection {
    /// Upwards.
    Rising,
    /// Downwards.
    Falling,
}

/// A point of a shape.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShapePoint {
    /// Value of each channel, in its SI unit.
    pub at: Vec<f64>,
    /// Which way the channel went, of a function that looks at that, too.
    pub direction: Option<ChannelDirection>,
    /// What is added there, in the shape's `unit`, but for a constant.
    pub value: f64,
    /// Of `value`; `None`: the data do not determine it, or the function leaves more than noise.
    pub standard_error: Option<f64>,
    /// What the formula says there, but for a constant; `None` without one.
    pub formula: Option<f64>,
}

/// What is missing as a smooth function, without a formula.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shape {
    /// Channels that it is a function of, by name in logs.
    pub channels: Vec<String>,
    /// Whether it is one of which way its channel went last, too: hysteresis.
    pub by_direction: bool,
    /// Share of the held-out squared error above the noise that it explains.
    pub explained: f64,
    /// SI unit of `value`.
    pub unit: String,
    /// The function, knot by knot; it is straight between them. Where it looks at the direction, all knots rising, then all falling.
    pub points: Vec<ShapePoint>,
}

/// A formula that the data cannot tell from the one named.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherLaw {
    /// Where it acts.
    pub site: Site,
    /// What it adds there.
    pub expression: String,
    /// What it looks at, by name in logs.
    pub channels: Vec<String>,
    /// Its parameters.
    pub parameters: BTreeMap<String, FoundParameter>,
    /// Held-out error, in the unit of `error`.
    pub validate: f64,
    /// Largest difference to the formula named over the visited range, as a share of what that does; `None` where they look at
    /// different channels.
    pub differs_by: Option<f64>,
}

/// What would tell formulas apart.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TellApart {
    /// Channels that must move further (one), or apart from each other (several), by name in logs.
    pub channels: Vec<String>,
    /// In the SI unit of the one channel: how far, where the formulas differ most; `None` of several.
    pub to: Option<f64>,
}

/// The answer.
///
/// Made by [`crate::session::discover`].
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Discovery {
    /// The verdict.
    pub verdict: LawVerdict,
    /// `rotors` or `body`: what the law acts in; `None` without one.
    pub block: Option<String>,
    /// Where it acts.
    pub site: Option<Site>,
    /// What it looks at, by name in logs.
    pub channels: Vec<String>,
    /// How sure site and channels are: share of draws of held-out stretches in which they explain most.
    pub confidence: Option<f64>,
    /// What it adds at its site.
    pub expression: Option<String>,
    /// What kind of function each term of it is.
    pub forms: Vec<&'static str>,
    /// Parameters of the formula, by name.
    pub parameters: BTreeMap<String, FoundParameter>,
    /// The formula as a model file takes it.
    pub user_effect: Option<UserEffect>,
    /// What is missing as a smooth function.
    pub shape: Option<Shape>,
    /// The error, and how far it falls.
    pub error: ErrorSummary,
    /// Formulas that the data cannot tell from it.
    pub alternatives: Vec<OtherLaw>,
    /// Places that were looked at, those that explain most first.
    pub r#where: Vec<PlaceShare>,
    /// Effects of the catalogue that are missing (beside the law, where there is one).
    pub effects: Vec<String>,
    /// Base parameters that have changed.
    pub changed_parameters: Vec<ChangedParameter>,
    /// What would tell the formulas apart.
    pub next_experiment: Option<TellApart>,
    /// What to know about data and answer.
    pub findings: Vec<Finding>,
    /// What the catalogue says.
    #[serde(skip)]
    pub diagnosis: Diagnosis,
    /// The model with the law, refitted.
    #[serde(skip)]
    pub model: Model,
}
