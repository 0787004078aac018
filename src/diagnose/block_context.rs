//! What the rotors and the body are built and searched with: logs, settings, and the search itself as functions.

use super::block_builder::{Driver, body_stage};
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::error::DiagnoseError;
use super::search_result::Found;
use crate::log::Dataset;
use crate::model::Model;

/// Logs and settings of a diagnosis.
pub(crate) struct Question<'a> {
    pub(crate) model: &'a Model,
    pub(crate) train: &'a [Dataset],
    pub(crate) validate: &'a [Dataset],
    pub(crate) horizon: f64,
    pub(crate) find: &'a dyn Fn(Stage) -> Found,
    pub(crate) look: Look<'a>,
    pub(crate) settle: Settle<'a>,
}

/// Refits a block's own numbers with the given effects, without a search.
pub(crate) type Look<'a> = &'a dyn Fn(Stage, &[String]) -> Found;

/// The body, and what it was under the rotors that drove it before it was asked.
pub(crate) type Driven = (Found, Option<Found>);

/// Takes back what a set changed of the base's own numbers for nothing: the set, and the names of the changed ones.
pub(crate) type Settle<'a> = &'a dyn Fn(&Found, &Trial) -> (Trial, Vec<String>);

impl Question<'_> {
    /// The body as one answer about the rotors drives it; `None` when the logs hold no body.
    pub(crate) fn body(
        &self,
        rotor: Option<(&Found, &Trial)>,
        find: &dyn Fn(Stage) -> Found,
    ) -> Result<Option<Found>, DiagnoseError> {
        let equations = rotor.map_or(self.model, |(_, answer)| &answer.model).equations()?;
        let driver = Driver {
            equations: &equations,
            trial: rotor.map(|(_, answer)| answer),
            stage: rotor.map(|(found, _)| &found.stage),
        };
        Ok(body_stage(self.train, self.validate, &driver, self.horizon)?.map(find))
    }
}
