//! The blocks of a model one after the other: the rotors, then the body that they drive.

use super::assemble;
use super::block_builder::{is_body_held, rotor_split};
use super::block_context::{BlockContext, Refit, SelectParameters};
use super::config::DiagnoseConfig;
use super::data_split::DataSplit;
use super::diagnosis::{ErrorSummary, Verdict};
use super::error::DiagnoseError;
use super::search_result::SearchResult;
use super::verdict;
use crate::log::Dataset;
use crate::model::Model;
use crate::screening::{ScreenedLog, ScreeningError};

/// The blocks of a model beside their data, each with what was found.
pub(crate) struct Blocks {
    pub(crate) found: Vec<SearchResult>,
    pub(crate) verdicts: Vec<Verdict>,
}

impl Blocks {
    /// Builds the rotor block, then the body block that its answer drives; `find` looks into each, `refit` only refits a
    /// block's own numbers and the effects it is given.
    pub(crate) fn build(
        model: &Model,
        train: &[ScreenedLog],
        validate: &[ScreenedLog],
        config: &DiagnoseConfig,
        (find, refit): (&dyn Fn(DataSplit) -> SearchResult, Refit),
        select_parameters: SelectParameters,
    ) -> Result<Self, DiagnoseError> {
        let context =
            BlockContext { model, train, validate, horizon: config.horizon, find, refit, select_parameters };
        let mut rotor = rotor_split(train, validate).map(|split| find(split.judged_by(model)));
        let is_body_asked = !is_body_held(train) && train.iter().any(|log| log.body().is_some());
        if let Some(rotor) = rotor.as_mut().filter(|_| is_body_asked) {
            context.change_all_that_differ(rotor)?;
        }
        let body = match &rotor {
            // Beside rotors a body that was held still says nothing.
            Some(_) if is_body_held(train) => None,
            rotor => context.body(rotor.as_ref().map(|found| (found, &found.answer)), find)?,
        };
        let body = match (&mut rotor, body) {
            (Some(rotor), Some(body)) => {
                let body = context.decide_sensor_lag(rotor, body)?;
                let body = context.without_what_lags(rotor, body)?;
                let driven = context.infer_driver(rotor, body)?;
                Some(context.error_before_driver(rotor, driven)?)
            }
            (_, body) => body,
        };
        let found: Vec<SearchResult> = rotor.into_iter().chain(body).collect();
        if found.is_empty() {
            let logs: Vec<&Dataset> = train.iter().chain(validate).map(ScreenedLog::dataset).collect();
            return Err(ScreeningError::nothing_in_common(&logs).into());
        }
        let verdicts = found.iter().map(verdict::verdict).collect();
        Ok(Self { found, verdicts })
    }

    /// Whether each block that says something is left with nothing but noise.
    pub(crate) fn is_at_floor(&self) -> bool {
        let held_out =
            self.found.iter().zip(&self.verdicts).filter(|(_, it)| **it != Verdict::InsufficientData);
        held_out.into_iter().all(|(found, _)| found.over_floor(&found.answer).0 <= found.at_floor())
    }

    /// The model with what each block found.
    pub(crate) fn merged(&self, model: &Model) -> Model {
        assemble::merged(model, &self.found, &self.verdicts)
    }

    /// The error in the block and channel where it says most.
    pub(crate) fn error_summary(&self, config: &DiagnoseConfig) -> ErrorSummary {
        let (main, channel) = assemble::main_block(&self.found);
        assemble::error_summary(main, channel, config)
    }
}
