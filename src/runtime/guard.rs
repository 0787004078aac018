//! The guard of a bench.

use std::path::Path;

use super::ProcessError;
use crate::bench::BenchConfig;
use crate::guard::Guard;
use crate::model::Model;

/// The bench's guard, with its model where the speeds are held against it.
///
/// # Errors
/// [`ProcessError::Guard`] names the setting; [`ProcessError::Model`] when the model cannot be read.
pub fn of_bench(config: &BenchConfig) -> Result<Guard, ProcessError> {
    if !config.guard.speed_check.on {
        return Ok(config.guard.build(config.period_s)?);
    }
    Ok(config.guard.build_on(config.period_s, &Model::load(Path::new(&config.model))?)?)
}
