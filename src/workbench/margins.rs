//! The loop of the bench's controller about a model, and its margins.

use std::path::Path;

use serde_json::{Value, json};

use super::ActError;
use super::by_hand;
use super::desk::Desk;
use crate::bench::BenchConfig;
use crate::model::Model;
use crate::report::design::Design;
use crate::session::{ControlLoop, SessionError};

/// A model whose loop is designed; the desk is not needed for it any more.
pub(super) struct MarginsTask {
    model: Model,
    typed: String,
}

impl MarginsTask {
    pub fn of(desk: &Desk, model: u64) -> Result<Self, ActError> {
        let model = desk.model(model)?;
        Ok(Self { model: model.model.clone(), typed: model.typed() })
    }

    /// What `design` says of it, and the command that says so.
    pub fn answer(&self, (bench, file): (&BenchConfig, Option<&Path>)) -> Result<Value, ActError> {
        let task = ControlLoop::of(&self.model, bench.controller.clone(), bench.period_s, 0.0)
            .map_err(SessionError::from)?;
        let made = task.design().map_err(SessionError::from)?;
        Ok(json!({ "design": Design::of(&task, &made, None), "command": by_hand::design(&self.typed, file) }))
    }
}
