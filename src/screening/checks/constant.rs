//! A column that never changes.

use crate::screening::column::{CheckedColumn, Remark};

/// Says so, with the value. That the guard was armed throughout is how it should be.
pub(crate) fn check(column: &CheckedColumn) -> Vec<Remark> {
    if !column.is_constant() || column.name.starts_with("guard_") {
        return Vec::new();
    }
    vec![Remark {
        finding: column.finding("constant").with("value", column.range()[0]),
        stretches: Vec::new(),
    }]
}
