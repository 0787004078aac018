//! Columns that are not read for their name: the log lacks the one that they nearly are.

use crate::log::guess::meant_by;
use crate::log::{Dataset, LOG_SIGNALS};
use crate::screening::Finding;
use crate::screening::suspicion::Suspicion;
use crate::unit::UNITS;

/// Those of a log that are another unit's spelling of one that the log lacks.
pub(crate) fn check(log: &Dataset) -> Vec<Suspicion> {
    let mut found = Vec::new();
    for signal in LOG_SIGNALS.iter().filter(|signal| log.column(signal.name).is_none()) {
        let suffix = format!("_{}", signal.unit.to_lowercase().replace(' ', "").replace('/', "_"));
        let Some(stem) = signal.name.strip_suffix(suffix.as_str()) else { continue };
        let finding = |code, column: &str| {
            let finding = Finding::new(code, column).of(log.source_name()).with("expected", signal.name);
            finding.with("meaning", signal.meaning).with("expected_unit", signal.unit)
        };
        for column in log.names().filter(|column| *column != signal.name) {
            if column == stem {
                found.push(Suspicion::said(finding("column_without_unit", column)));
            }
            let Some(unit) = column.strip_prefix(stem).and_then(|rest| rest.strip_prefix('_')) else {
                continue;
            };
            let spelled = unit.replace('_', "/");
            let fits =
                |it: &&crate::unit::Unit| it.si == signal.unit && it.name.eq_ignore_ascii_case(&spelled);
            if let Some(unit) = UNITS.iter().find(fits) {
                found
                    .push(Suspicion::said(finding("column_in_another_unit", column).with("unit", unit.name)));
            }
        }
    }
    found.extend(of_no_signal(log, &found));
    found
}

/// Columns that are carried along under their own names, and that may be meant for signals that the log lacks.
fn of_no_signal(log: &Dataset, found: &[Suspicion]) -> Option<Suspicion> {
    let is_said = |name: &str| found.iter().any(|it| it.finding.subject == name);
    let lacking = |name: &str| meant_by(name).filter(|signal| log.column(signal).is_none());
    let meant = log.names().filter(|name| !is_said(name)).filter_map(|name| Some((name, lacking(name)?)));
    let (columns, signals): (Vec<String>, Vec<String>) =
        meant.map(|(name, signal)| (name.to_owned(), signal)).unzip();
    (!columns.is_empty()).then(|| {
        let finding = Finding::new("column_of_no_signal", "").of(log.source_name());
        Suspicion::said(finding.with("columns", columns).with("meant", signals))
    })
}
