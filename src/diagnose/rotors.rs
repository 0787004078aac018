//! The rotors of a machine that has more of them than an attitude bench: what each is missing, and what they have in common.

use std::collections::BTreeMap;

use serde::Serialize;

use super::diagnosis::{Diagnosis, FoundParameter, Verdict};
use super::verdict::joint;

/// What one rotor is missing.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct RotorDiagnosis {
    /// Its number in the logs, from 1.
    pub rotor: usize,
    /// What it is missing.
    #[serde(flatten)]
    pub diagnosis: Diagnosis,
}

/// A number that every rotor has.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CommonNumber {
    /// In `unit`: the least of the rotors' values.
    pub least: f64,
    /// In `unit`: the greatest.
    pub greatest: f64,
    /// SI unit.
    pub unit: String,
}

/// What each rotor is missing, and what they have in common.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct RotorDiagnoses {
    /// Of all rotors the verdict that asks most of the user.
    pub verdict: Verdict,
    /// Effects that every rotor is missing.
    pub effects: Vec<String>,
    /// Numbers that were found of every rotor: parameters of effects, and numbers of the base that have changed.
    pub parameters: BTreeMap<String, CommonNumber>,
    /// Rotor by rotor.
    pub rotors: Vec<RotorDiagnosis>,
}

impl RotorDiagnoses {
    /// Puts the rotors together.
    #[must_use]
    pub fn of(rotors: Vec<RotorDiagnosis>) -> Self {
        let verdicts: Vec<Verdict> = rotors.iter().map(|rotor| rotor.diagnosis.verdict).collect();
        let in_all = |id: &&String| rotors.iter().all(|rotor| rotor.diagnosis.effects.contains(id));
        let first = rotors.first().map(|rotor| &rotor.diagnosis);
        let effects =
            first.map_or_else(Vec::new, |first| first.effects.iter().filter(in_all).cloned().collect());
        let numbers: Vec<BTreeMap<String, FoundParameter>> =
            rotors.iter().map(|rotor| numbers(&rotor.diagnosis)).collect();
        let common = |name: &String| {
            let values: Option<Vec<&FoundParameter>> = numbers.iter().map(|own| own.get(name)).collect();
            let values = values?;
            let unit = values.first()?.unit.clone();
            let value = |pick: fn(f64, f64) -> f64| values.iter().map(|it| it.value).reduce(pick);
            Some((name.clone(), CommonNumber { least: value(f64::min)?, greatest: value(f64::max)?, unit }))
        };
        let parameters = numbers.first().into_iter().flat_map(BTreeMap::keys).filter_map(common).collect();
        Self { verdict: joint(&verdicts), effects, parameters, rotors }
    }
}

/// Parameters of a rotor's effects, and its base parameters that have changed, by name.
fn numbers(diagnosis: &Diagnosis) -> BTreeMap<String, FoundParameter> {
    let mut numbers = diagnosis.parameters.clone();
    numbers.extend(diagnosis.changed_parameters.iter().map(|changed| {
        let (value, standard_error, unit) = (changed.to, changed.standard_error, changed.unit.clone());
        (changed.name.clone(), FoundParameter { value, standard_error, unit })
    }));
    numbers
}
