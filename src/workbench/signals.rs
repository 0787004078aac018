//! What is seen of a log as a CSV: its channels, and what each model that is drawn says beside them.

use std::sync::Arc;

use super::ActError;
use super::desk::{Desk, OpenLog};
use super::download::{Download, DownloadText, ExportQuery, stem};
use super::places::plain;
use super::shown::ShownComparison;
use crate::log::csv::LogError;
use crate::log::{Dataset, DatasetError};
use crate::session::SessionError;

/// Taken from the desk under its lock, made without it.
pub(super) struct Signals {
    stem: String,
    content: Arc<OpenLog>,
    found: Option<Arc<Vec<ShownComparison>>>,
    /// [s] from where to where.
    span: (f64, f64),
}

impl Signals {
    /// What the desk has of it.
    pub fn of(desk: &Desk, query: &ExportQuery) -> Result<Self, ActError> {
        let log = desk.log(query.id.unwrap_or_default())?;
        let (mut content, mut found) = (Arc::clone(log.open()?), None);
        if !desk.shown().is_empty() {
            let compared = log.compared.as_ref().ok_or(ActError::Nothing("the models are being compared"))?;
            // Where no model has anything to say of it, its channels are what is seen.
            if let Ok(known) = &compared.found {
                (content, found) = (Arc::clone(&compared.content), Some(Arc::clone(known)));
            }
        }
        let span = (query.from.unwrap_or(f64::NEG_INFINITY), query.to.unwrap_or(f64::INFINITY));
        Ok(Self { stem: stem(log), content, found, span })
    }

    /// Makes the file.
    pub fn make(self) -> Result<Download, ActError> {
        let signals = self.table().map_err(|error| SessionError::from(LogError::from(error)))?;
        let (from, to) = self.span;
        let [first, last] = [
            signals.time().partition_point(|time| *time < from),
            signals.time().partition_point(|time| *time <= to),
        ];
        if first >= last {
            return Err(ActError::Nothing("no row of the log lies there"));
        }
        let (name, kind) = (format!("{}_signals.csv", self.stem), "text/csv");
        Ok(Download { name, kind, text: DownloadText::Rows(signals, first..last) })
    }

    fn table(&self) -> Result<Dataset, DatasetError> {
        let log = self.content.log.raw();
        let mut all = log.clone();
        let bare = log.with_columns(|_| false);
        let found: Vec<&ShownComparison> = self.found.iter().flat_map(|found| found.iter()).collect();
        let names: Vec<&str> = found.iter().map(|shown| shown.comparison.model.as_str()).collect();
        for (prefix, shown) in prefixes(&names).iter().zip(found) {
            let own = shown.comparison.signals(&bare)?;
            for (name, values) in own.names().filter_map(|name| Some((name, own.column(name)?))) {
                all.insert(format!("{prefix}{name}"), values.to_vec())?;
            }
        }
        Ok(all)
    }
}

/// What stands before the names of each model's columns. A single one has the names that `compare --signals` gives.
fn prefixes(models: &[&str]) -> Vec<String> {
    if models.len() < 2 {
        return models.iter().map(|_| String::new()).collect();
    }
    let plain_names: Vec<String> = models.iter().map(|name| plain(name)).collect();
    let own = plain_names.iter().enumerate().map(|(at, name)| {
        // Two of one name are told apart by their place.
        let is_single = plain_names.iter().filter(|other| *other == name).count() == 1;
        if is_single { format!("{name}.") } else { format!("{name}-{}.", at + 1) }
    });
    own.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_several_models_have_names_of_their_own() {
        assert_eq!(prefixes(&["step-1"]), [""]);
        assert_eq!(prefixes(&["paper", "<b>"]), ["paper.", "_b_."]);
        assert_eq!(prefixes(&["a", "b", "a"]), ["a-1.", "b.", "a-3."]);
    }
}
