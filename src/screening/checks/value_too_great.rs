//! Values that no bench measures, and whose squares are no numbers.

use crate::log::Dataset;
use crate::screening::Finding;
use crate::screening::suspicion::Suspicion;
use crate::screening::thresholds::THRESHOLDS;

/// The code: a value that no bench measures.
pub const VALUE_TOO_GREAT: &str = "value_too_great";

/// The first of each column.
pub(crate) fn check(log: &Dataset) -> Vec<Suspicion> {
    let first = |column: &str| {
        let values = log.column(column).unwrap_or(&[]);
        let row = values.iter().position(|value| value.abs() > THRESHOLDS.greatest_value)?;
        let finding = Finding::new(VALUE_TOO_GREAT, column).of(log.source_name());
        Some(Suspicion::impossible(finding.with("value", values[row]).with("at_s", log.time()[row])))
    };
    log.names().filter_map(first).collect()
}
