//! A file for the browser, and what of the desk it is asked for as.

use std::ops::Range;
use std::path::Path;

use serde::Deserialize;

use super::desk::DeskLog;
use super::places::plain;
use crate::log::Dataset;

/// A file for the browser.
#[derive(Debug)]
pub(super) struct Download {
    /// A plain name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    pub kind: &'static str,
    pub text: DownloadText,
}

/// What is in it.
#[derive(Debug)]
pub(super) enum DownloadText {
    Whole(String),
    /// Rows of a log, which are written as they are taken.
    Rows(Dataset, Range<usize>),
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExportQuery {
    /// `model`, `report`, `signals`, `mapping`, `session`.
    pub what: String,
    /// Number of the log or of the model.
    pub id: Option<u64>,
    /// [s] the part of the time that is seen, of `signals`; all of it.
    pub from: Option<f64>,
    pub to: Option<f64>,
}

/// The name of a log's file, without its ending.
pub(super) fn stem(log: &DeskLog) -> String {
    let stem = Path::new(&log.typed).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    plain(&stem.unwrap_or_default())
}
