//! The loop of the bench's controller about a model, and its margins.

use std::path::Path;

use serde_json::{Value, json};

use super::ActError;
use super::by_hand;
use super::desk::Desk;
use crate::bench::BenchConfig;
use crate::report::design::Design;
use crate::session::{ControlLoop, SessionError};

/// What `design` says of a model, and the command that says it.
pub(super) fn margins_of(
    desk: &Desk,
    (bench, file): (&BenchConfig, Option<&Path>),
    model: u64,
) -> Result<Value, ActError> {
    let model = desk.model(model)?;
    let task = ControlLoop::of(&model.model, bench.controller.clone(), bench.period_s, 0.0)
        .map_err(SessionError::from)?;
    let made = task.design().map_err(SessionError::from)?;
    Ok(json!({ "design": Design::of(&task, &made, None), "command": by_hand::design(&model.typed(), file) }))
}
