//! Answers for tests that need one, without a search.

use std::collections::BTreeMap;

use super::diagnosis::{ChangedParameter, Diagnosis, ErrorSummary, TrainValidate, Verdict};
use crate::model::{Measure, Model};

impl ErrorSummary {
    /// Errors of a rotor, the same on both parts, over a noise of 0.83 rad/s: as it is, refitted, extended.
    pub(crate) fn of_rotor([base, refitted, extended]: [f64; 3]) -> Self {
        let both = |error| TrainValidate { train: error, validate: error };
        Self {
            measure: Measure::of_free_runs("propeller_rate_rad_s", None, "rad/s"),
            channel: String::new(),
            unit: "rad/s",
            noise_floor: 0.83,
            base: both(base),
            refitted: both(refitted),
            extended: both(extended),
        }
    }
}

impl Diagnosis {
    /// An answer that names `effects`, and says nothing else.
    pub(crate) fn of(verdict: Verdict, effects: &[&str]) -> Self {
        Self {
            verdict,
            effects: effects.iter().map(|id| (*id).to_owned()).collect(),
            alternatives: Vec::new(),
            changed_parameters: Vec::new(),
            parameters: BTreeMap::new(),
            error: ErrorSummary::of_rotor([17.7, 39.3, 9.626]),
            r#where: Vec::new(),
            ladder: Vec::new(),
            candidates: Vec::new(),
            findings: Vec::new(),
            next_experiment: None,
            alternative_errors: Vec::new(),
            turns_against_torque: false,
            model: Model::paper(),
        }
    }

    /// The same, with another number in the model.
    pub(crate) fn with_changed(self, name: &str, from: f64, to: f64) -> Self {
        let changed = ChangedParameter {
            name: name.to_owned(),
            symbol: String::new(),
            from,
            to,
            standard_error: None,
            unit: String::new(),
        };
        Self { changed_parameters: vec![changed], ..self }
    }
}
