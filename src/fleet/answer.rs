//! The answer of one bench as it lies in its file.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::FleetError;

/// What came of one bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BenchAnswer {
    /// Name of the bench.
    pub bench: String,
    /// SHA-256 of its inputs.
    pub inputs_sha256: String,
    /// Model file, or `paper`.
    pub model: String,
    /// Logs fitted on.
    pub log: Vec<String>,
    /// Logs held out.
    pub validate: Vec<String>,
    /// Why there is no diagnosis; `None` where there is one.
    pub error: Option<String>,
    /// The answer of `diagnose --json`; `None` where there is none.
    pub diagnosis: Option<Value>,
}

/// What a fleet takes of a diagnosis.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct DiagnosisExtract {
    /// See `diagnose --json`.
    pub verdict: String,
    /// See `diagnose --json`.
    pub effects: Vec<String>,
    /// See `diagnose --json`.
    pub alternatives: Vec<Vec<String>>,
    /// See `diagnose --json`.
    pub parameters: BTreeMap<String, ExtractedParameter>,
    /// See `diagnose --json`.
    pub changed_parameters: Vec<ExtractedChange>,
    /// See `diagnose --json`.
    pub error: Errors,
    /// See `diagnose --json`.
    #[serde(default)]
    pub candidates: Vec<TriedCandidate>,
}

/// An effect that was tried, or was not.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct TriedCandidate {
    /// Its id.
    pub effect: String,
    /// See `diagnose --json`.
    #[serde(default)]
    pub refusal: Option<RefusedEffect>,
}

/// Why an effect was not tried.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct RefusedEffect {
    /// See `diagnose --json`.
    pub code: String,
}

impl DiagnosisExtract {
    /// Effects that the model has already.
    pub(super) fn in_model(&self) -> Vec<String> {
        let has = |it: &&TriedCandidate| it.refusal.as_ref().is_some_and(|why| why.code == "in_model");
        self.candidates.iter().filter(has).map(|it| it.effect.clone()).collect()
    }
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ExtractedParameter {
    /// In `unit`.
    pub value: Option<f64>,
    /// SI unit.
    pub unit: String,
}

/// A parameter of the model that has another value.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct ExtractedChange {
    /// Name in the model file.
    pub name: String,
    /// In `unit`.
    pub to: Option<f64>,
    /// SI unit.
    pub unit: String,
}

/// The error and how far it falls.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct Errors {
    /// What it is, with unit.
    pub measure: String,
    /// What sensor noise alone would leave.
    pub noise_floor: Option<f64>,
    /// The model as it is.
    pub base: HeldOut,
    /// Its own parameters refitted.
    pub recalibrated: HeldOut,
    /// With the missing effects.
    pub extended: HeldOut,
}

/// An error on held-out data.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct HeldOut {
    /// In the unit of the measure.
    pub validate: Option<f64>,
}

impl BenchAnswer {
    /// The file of an answer in `folder`.
    pub(super) fn place(folder: &Path, bench: &str, inputs: &str) -> PathBuf {
        folder.join(format!("{bench}-{}.json", inputs.get(..16).unwrap_or(inputs)))
    }

    /// Reads one, and what is in its diagnosis.
    ///
    /// # Errors
    /// [`FleetError::File`]; [`FleetError::Answer`] of a file that is none.
    pub fn load(path: &Path) -> Result<(Self, Option<DiagnosisExtract>), FleetError> {
        let bytes = fs::read(path).map_err(FleetError::file(path))?;
        let wrong = |error: serde_json::Error| FleetError::Answer {
            path: path.to_owned(),
            reason: error.to_string(),
        };
        let answer: Self = serde_json::from_slice(&bytes).map_err(wrong)?;
        let found =
            answer.diagnosis.as_ref().map(DiagnosisExtract::deserialize).transpose().map_err(wrong)?;
        if found.is_none() && answer.error.is_none() {
            let reason = "it has neither a diagnosis nor an error".to_owned();
            return Err(FleetError::Answer { path: path.to_owned(), reason });
        }
        Ok((answer, found))
    }
}
