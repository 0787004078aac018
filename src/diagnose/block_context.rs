//! What the rotors and the body are built and searched with: logs, settings, and the search itself as functions.

use super::block_builder::{Driver, body_split};
use super::candidate_fit::CandidateFit;
use super::data_split::DataSplit;
use super::error::DiagnoseError;
use super::search_result::SearchResult;
use crate::model::Model;
use crate::screening::ScreenedLog;

/// Logs and settings of a diagnosis.
pub(crate) struct BlockContext<'a> {
    pub(crate) model: &'a Model,
    pub(crate) train: &'a [ScreenedLog],
    pub(crate) validate: &'a [ScreenedLog],
    pub(crate) horizon: f64,
    pub(crate) find: &'a dyn Fn(DataSplit) -> SearchResult,
    pub(crate) refit: Refit<'a>,
    pub(crate) select_parameters: SelectParameters<'a>,
}

/// Refits a block's own numbers with the given effects, without a search.
pub(crate) type Refit<'a> = &'a dyn Fn(DataSplit, &[String]) -> SearchResult;

/// The body, and what it was under the rotors that drove it before they were inferred from it.
pub(crate) type DrivenBody = (SearchResult, Option<SearchResult>);

/// Takes back what a set changed of the base's own numbers for nothing: the set, and the names of the changed ones.
pub(crate) type SelectParameters<'a> =
    &'a dyn Fn(&SearchResult, &CandidateFit) -> (CandidateFit, Vec<String>);

impl BlockContext<'_> {
    /// The body as one answer about the rotors drives it; `None` when the logs hold no body.
    pub(crate) fn body(
        &self,
        rotor: Option<(&SearchResult, &CandidateFit)>,
        find: &dyn Fn(DataSplit) -> SearchResult,
    ) -> Result<Option<SearchResult>, DiagnoseError> {
        let equations = rotor.map_or(self.model, |(_, answer)| &answer.model).equations()?;
        let driver = Driver {
            equations: &equations,
            fitted: rotor.map(|(_, answer)| answer),
            split: rotor.map(|(found, _)| &found.split),
        };
        Ok(body_split(self.train, self.validate, &driver, self.horizon)?.map(find))
    }
}
