//! What the browser saves: nothing of it is written here.

use std::path::Path;

use serde::Deserialize;

use super::ActError;
use super::desk::Desk;
use super::guesses;
use super::places::plain;
use super::saved::Saved;
use crate::compare::Comparison;
use crate::log::csv;
use crate::model::ModelError;
use crate::report::comparison;
use crate::session::SessionError;

/// A file for the browser.
#[derive(Debug)]
pub(super) struct Download {
    /// A plain name: letters, digits, `-`, `_` and `.`.
    pub name: String,
    pub kind: &'static str,
    pub text: String,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExportQuery {
    /// `model`, `report`, `signals`, `mapping`, `session`.
    pub what: String,
    /// Number of the log or of the model.
    pub id: Option<u64>,
}

/// Makes the file.
pub(super) fn export(desk: &Desk, query: &ExportQuery) -> Result<Download, ActError> {
    match query.what.as_str() {
        "model" => model(desk, query.id.unwrap_or(desk.chosen)),
        "session" => {
            let text = toml::to_string(&Saved::of(desk));
            // As a model's own text.
            let text =
                text.map_err(|error| SessionError::from(ModelError::Value { what: error.to_string() }))?;
            Ok(Download { name: "session.toml".to_owned(), kind: "application/toml", text })
        }
        "mapping" => mapping(desk, query.id.unwrap_or_default()),
        what => of_log(desk, what == "report", query.id.unwrap_or_default()),
    }
}

fn model(desk: &Desk, id: u64) -> Result<Download, ActError> {
    let model = &desk.model(id)?.model;
    let text = model.emit().map_err(SessionError::from)?;
    Ok(Download { name: format!("{}.toml", plain(&model.name)), kind: "application/toml", text })
}

/// What the columns of a foreign log are said to mean, as `import --write-mapping` writes it.
fn mapping(desk: &Desk, id: u64) -> Result<Download, ActError> {
    let log = desk.log(id)?;
    let said = log.mapping.as_ref().and_then(|it| Some((it.name.clone(), it.text.clone()?)));
    let (name, text) = match (said, &log.guess) {
        (Some(said), _) => said,
        (None, Some(guess)) => ("mapping.toml".to_owned(), guesses::text(&guess.now, &log.typed)?),
        (None, None) => return Err(ActError::NotAsked(log.typed.clone())),
    };
    Ok(Download { name, kind: "application/toml", text })
}

/// The page of `compare`, or the log with the signals of the last model shown, as `compare --report` and `--signals` write them.
fn of_log(desk: &Desk, is_report: bool, id: u64) -> Result<Download, ActError> {
    let log = desk.log(id)?;
    let open = log.open()?;
    let found = log.compared.as_ref().and_then(|compared| compared.found.as_ref().ok());
    let found = found.ok_or(ActError::Nothing("no model was compared with this log"))?;
    let stem = Path::new(&log.typed).file_stem().map(|stem| stem.to_string_lossy().into_owned());
    let stem = plain(&stem.unwrap_or_default());
    if is_report {
        let found: [Vec<Comparison>; 1] = [found.to_vec()];
        let page = comparison::page(&found, std::slice::from_ref(&open.log));
        return Ok(Download { name: format!("{stem}.html"), kind: "text/html", text: page.emit() });
    }
    let last = found.last().ok_or(ActError::Nothing("no model is shown"))?;
    let signals =
        last.signals(open.log.raw()).map_err(|error| SessionError::from(csv::LogError::from(error)))?;
    Ok(Download { name: format!("{stem}_signals.csv"), kind: "text/csv", text: csv::emit(&signals) })
}
