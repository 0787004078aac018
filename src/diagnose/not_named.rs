//! Why a candidate that was tried is not named: a code with its numbers.

use serde::Serialize;

/// The condition that a candidate failed, and beside what.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotNamed {
    /// The set that it was added to; empty: alone, added to the refitted baseline.
    pub beside: Vec<String>,
    /// The condition.
    #[serde(flatten)]
    pub condition: Unmet,
}

/// A condition of model selection that a set of effects fails; of several the first, in this order.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "code", rename_all = "snake_case")]
pub enum Unmet {
    /// Without it nothing is left but noise, or less than the data resolve.
    NothingLeft,
    /// It takes too little off the held-out squared error.
    TooLittle {
        /// [-] share that it takes off; negative: the error rises.
        share: f64,
        /// [-] the least.
        needed: f64,
    },
    /// It takes too little off the squared error of the data fitted on.
    TooLittleFitted {
        /// [-] share that it takes off.
        share: f64,
        /// [-] the least.
        needed: f64,
    },
    /// The error falls in some stretches of the data and not in others.
    Unsteady {
        /// [standard errors] the fall, over its standard error from stretch to stretch.
        standard_errors: f64,
        /// [standard errors] the least.
        needed: f64,
    },
    /// The surrogate test: a meaningless one does as well too often.
    Chance {
        /// [-] how often: a p-value.
        p_value: f64,
        /// [-] the greatest.
        most: f64,
    },
    /// Too few different commands lie beyond the limit that it says the command has.
    NotExercised {
        /// The least.
        needed: usize,
    },
    /// A number is not distinguished from that of no effect.
    NotDetermined,
    /// It and another effect of the set cancel each other.
    Cancels,
    /// It is no part of the answer, and of a set that these data cannot tell from it.
    Indistinguishable {
        /// That set.
        set: Vec<String>,
    },
    /// It fails none of these, and another set takes more off.
    LessThanAnother,
    /// A block by itself would name it; the rotors and the body that they drive, taken together, ask for another set.
    BodyDecides,
}
