//! What the browser saves: nothing of it is written here.

use std::sync::Arc;

use super::ActError;
use super::desk::{Desk, OpenLog};
use super::download::{Download, DownloadText, ExportQuery, stem};
use super::guesses;
use super::places::plain;
use super::saved::Saved;
use super::shown::ShownComparison;
use super::signals::Signals;
use crate::model::ModelError;
use crate::report::comparison;
use crate::session::SessionError;

/// What a file is made of: taken from the desk under its lock, made without it.
pub(super) enum ExportTask {
    /// It takes no time.
    Made(Download),
    /// The page of `compare`.
    Report(OfLog),
    /// The log with the signals of the models shown.
    Signals(Signals),
}

/// A log, and the models that were held beside it.
pub(super) struct OfLog {
    /// Name of the log's file, without its ending.
    stem: String,
    content: Arc<OpenLog>,
    found: Arc<Vec<ShownComparison>>,
}

impl ExportTask {
    /// What the desk has of it.
    pub fn of(desk: &Desk, query: &ExportQuery) -> Result<Self, ActError> {
        match query.what.as_str() {
            "model" => model(desk, query.id.unwrap_or(desk.chosen)).map(Self::Made),
            "session" => {
                let text = toml::to_string(&Saved::of(desk));
                // As a model's own text.
                let text =
                    text.map_err(|error| SessionError::from(ModelError::Value { what: error.to_string() }))?;
                let (name, kind) = ("session.toml".to_owned(), "application/toml");
                Ok(Self::Made(Download { name, kind, text: DownloadText::Whole(text) }))
            }
            "mapping" => mapping(desk, query.id.unwrap_or_default()).map(Self::Made),
            "report" => OfLog::of(desk, query.id.unwrap_or_default()).map(Self::Report),
            _ => Signals::of(desk, query).map(Self::Signals),
        }
    }

    /// Makes the file: as `compare --report` and `--signals` write them.
    pub fn make(self) -> Result<Download, ActError> {
        match self {
            Self::Made(made) => Ok(made),
            Self::Report(OfLog { stem, content, found }) => {
                let found = [found.iter().map(|shown| shown.comparison.clone()).collect::<Vec<_>>()];
                let page = comparison::page(&found, std::slice::from_ref(&content.log));
                let text = DownloadText::Whole(page.emit());
                Ok(Download { name: format!("{stem}.html"), kind: "text/html", text })
            }
            Self::Signals(signals) => signals.make(),
        }
    }
}

impl OfLog {
    fn of(desk: &Desk, id: u64) -> Result<Self, ActError> {
        let log = desk.log(id)?;
        log.open()?;
        let compared = log.compared.as_ref();
        let found = compared.and_then(|compared| Some((compared, compared.found.as_ref().ok()?)));
        let (compared, found) = found.ok_or(ActError::Nothing("no model was compared with this log"))?;
        Ok(Self { stem: stem(log), content: Arc::clone(&compared.content), found: Arc::clone(found) })
    }
}

fn model(desk: &Desk, id: u64) -> Result<Download, ActError> {
    let model = &desk.model(id)?.model;
    let text = DownloadText::Whole(model.emit().map_err(SessionError::from)?);
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
    Ok(Download { name, kind: "application/toml", text: DownloadText::Whole(text) })
}
