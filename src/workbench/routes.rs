//! What is answered under which path. Whoever comes here was let in.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::{DefaultBodyLimit, Query, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderName, HeaderValue, Response, StatusCode, Uri};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response as Answer};
use axum::routing::{get, post};
use futures_util::{StreamExt as _, stream};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::watch;

use super::act::Act;
use super::against::{AgainstQuery, AgainstTask};
use super::download::{DownloadText, ExportQuery};
use super::engine::Engine;
use super::export::ExportTask;
use super::margins::MarginsTask;
use super::plots::{PlotQuery, PlotTask, failure};
use super::thresholds::THRESHOLDS;
use super::{assets, view};
use crate::log::csv;
use crate::report::findings::explained;

/// Scripts, styles and pictures of this server alone, nothing inline, in no other page's frame.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// How often the time of a search is said.
const SECOND: Duration = Duration::from_secs(1);

type Shared = State<Arc<Engine>>;

/// The paths.
pub(super) fn router(engine: Arc<Engine>) -> Router {
    Router::new()
        .route("/api/desk", get(desk))
        .route("/api/events", get(events))
        .route("/api/act", post(act))
        .route("/api/files", get(files))
        .route("/api/plot", get(plot))
        .route("/api/live", get(live))
        .route("/api/failure", get(block_failure))
        .route("/api/against", get(against))
        .route("/api/margins", get(margins))
        .route("/api/export", get(download))
        .fallback(get(asset))
        .layer(DefaultBodyLimit::max(THRESHOLDS.largest_body))
        .with_state(engine)
}

/// What every answer says to the browser.
pub(super) fn protect(response: &mut Answer) {
    let headers = response.headers_mut();
    let mut say = |name: HeaderName, value| drop(headers.insert(name, HeaderValue::from_static(value)));
    say(CONTENT_SECURITY_POLICY, POLICY);
    say(X_CONTENT_TYPE_OPTIONS, "nosniff");
    say(REFERRER_POLICY, "no-referrer");
    say(CACHE_CONTROL, "no-store");
    say(HeaderName::from_static("cross-origin-opener-policy"), "same-origin");
    say(HeaderName::from_static("cross-origin-resource-policy"), "same-origin");
}

/// An error as the page shows it.
pub(super) fn refuse(status: StatusCode, error: &(dyn std::error::Error + 'static)) -> Answer {
    answer(status, &json!({ "error": explained(error) }))
}

fn answer(status: StatusCode, value: &Value) -> Answer {
    (status, [(CONTENT_TYPE, "application/json")], value.to_string()).into_response()
}

async fn asset(uri: Uri) -> Answer {
    match assets::find(uri.path()) {
        Some(asset) => ([(CONTENT_TYPE, asset.kind)], asset.text).into_response(),
        None => answer(StatusCode::NOT_FOUND, &json!({ "error": "there is nothing here" })),
    }
}

async fn desk(State(engine): Shared) -> Answer {
    working(move || Ok(view::desk(&engine.desk()))).await
}

/// Progress, as long as the page listens: what has changed in between is one message.
async fn events(State(engine): Shared) -> Answer {
    let heard = engine.listen();
    let messages = stream::unfold((heard, engine, true), |(mut heard, engine, is_first)| async move {
        if !is_first {
            changed(&mut heard, &engine).await?;
        }
        let text = json!(view::Tick::of(&engine.desk())).to_string();
        Some((Ok::<_, Infallible>(Event::default().data(text)), (heard, engine, false)))
    });
    Sse::new(messages).keep_alive(KeepAlive::default()).into_response()
}

/// Waits for something to say: a change, or another second of a search, which may have nothing to say itself. `None` at the end.
async fn changed(heard: &mut watch::Receiver<u64>, engine: &Engine) -> Option<()> {
    loop {
        match tokio::time::timeout(SECOND, heard.changed()).await {
            Ok(changed) => {
                changed.ok()?;
                tokio::time::sleep(Duration::from_millis(THRESHOLDS.message_period_ms)).await;
                heard.borrow_and_update();
                return Some(());
            }
            Err(_) if engine.desk().is_searching() => return Some(()),
            Err(_) => {}
        }
    }
}

async fn act(State(engine): Shared, body: Bytes) -> Answer {
    let act: Act = match serde_json::from_slice(&body) {
        Ok(act) => act,
        Err(error) => return refuse(StatusCode::BAD_REQUEST, &error),
    };
    working(move || engine.act(act).map(|()| json!({}))).await
}

#[derive(Deserialize)]
struct FilesQuery {
    folder: Option<std::path::PathBuf>,
}

async fn files(State(engine): Shared, Query(query): Query<FilesQuery>) -> Answer {
    working(move || Ok(json!(engine.places.list(query.folder.as_deref())?))).await
}

async fn plot(State(engine): Shared, Query(query): Query<PlotQuery>) -> Answer {
    working(move || {
        let task = PlotTask::of(&engine.desk(), query)?;
        Ok(json!(task.draw()))
    })
    .await
}

#[derive(Deserialize)]
struct LiveQuery {
    since: u64,
}

async fn live(State(engine): Shared, Query(query): Query<LiveQuery>) -> Answer {
    working(move || Ok(engine.live.look(query.since))).await
}

#[derive(Deserialize)]
struct BlockQuery {
    log: u64,
    block: String,
    signal: String,
}

async fn block_failure(State(engine): Shared, Query(query): Query<BlockQuery>) -> Answer {
    working(move || failure(&engine.desk(), query.log, &query.block, &query.signal)).await
}

async fn against(State(engine): Shared, Query(query): Query<AgainstQuery>) -> Answer {
    working(move || {
        let task = AgainstTask::of(&engine.desk(), query)?;
        Ok(json!(task.answer()))
    })
    .await
}

#[derive(Deserialize)]
struct ModelQuery {
    model: u64,
}

async fn margins(State(engine): Shared, Query(query): Query<ModelQuery>) -> Answer {
    working(move || {
        let task = MarginsTask::of(&engine.desk(), query.model)?;
        task.answer(engine.live.bench())
    })
    .await
}

async fn download(State(engine): Shared, Query(query): Query<ExportQuery>) -> Answer {
    let make = move || {
        let task = ExportTask::of(&engine.desk(), &query)?;
        task.make()
    };
    let made = tokio::task::spawn_blocking(make).await;
    match made {
        Ok(Ok(file)) => Response::builder()
            .header(CONTENT_TYPE, file.kind)
            .header(CONTENT_DISPOSITION, format!("attachment; filename=\"{}\"", file.name))
            .body(body(file.text))
            .unwrap_or_default(),
        Ok(Err(error)) => refuse(StatusCode::CONFLICT, &error),
        Err(error) => refuse(StatusCode::INTERNAL_SERVER_ERROR, &error),
    }
}

/// Rows are written while the browser takes them, beside the server's own thread.
fn body(text: DownloadText) -> Body {
    let (log, rows) = match text {
        DownloadText::Whole(text) => return Body::from(text),
        DownloadText::Rows(log, rows) => (Arc::new(log), rows),
    };
    let header = csv::emit_header(&log);
    let pieces = stream::iter(csv::blocks(rows)).then(move |rows| {
        let log = Arc::clone(&log);
        tokio::task::spawn_blocking(move || csv::emit_rows(&log, rows))
    });
    Body::from_stream(stream::once(async { Ok(header) }).chain(pieces))
}

/// An answer that takes a while to make: the server goes on meanwhile.
async fn working(work: impl FnOnce() -> Result<Value, super::ActError> + Send + 'static) -> Answer {
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(value)) => answer(StatusCode::OK, &value),
        Ok(Err(error)) => refuse(StatusCode::CONFLICT, &error),
        Err(error) => refuse(StatusCode::INTERNAL_SERVER_ERROR, &error),
    }
}
