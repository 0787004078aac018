//! Effects of the user's own, as the model file has them.

use serde::{Deserialize, Serialize};

use crate::effect::Site;

/// A parameter of a user's own effect.
///
/// In a program: `examples/own_effect.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UserParameter {
    /// Name in the expression.
    pub name: String,
    /// SI unit, for the report.
    #[serde(default)]
    pub unit: String,
    /// Where a fit starts.
    pub start: f64,
    /// Smallest value a fit may take.
    pub lower: f64,
    /// Largest value a fit may take.
    pub upper: f64,
}

/// An effect of the user's own, which competes with the catalogue.
///
/// In a program: `examples/own_effect.rs`.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UserEffect {
    /// Its id.
    pub id: String,
    /// Where it acts.
    pub site: Site,
    /// What it adds to the quantity of its site.
    pub expression: String,
    /// Its parameters.
    #[serde(default)]
    pub parameters: Vec<UserParameter>,
    /// One line for the report.
    #[serde(default)]
    pub meaning: String,
}
