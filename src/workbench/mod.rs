//! The workbench: a page on the user's own machine that opens logs and models, shows where they part, asks what is missing and
//! adds it, by the same functions of `session` that the commands call.
//!
//! The server ([`serve`]) listens on 127.0.0.1 alone and lets in who has its token (`door.rs`). What lies on the workbench is
//! one [`Desk`](desk::Desk), the same for every tab. Long work runs on threads of its own (`engine.rs`); the threads of the
//! server only look at the desk and answer. The page asks for changes by an [`Act`](act::Act) and reads the desk as JSON
//! (`view.rs`, `plots.rs`); it draws, and computes nothing that a command prints.
//!
//! What is exported, the browser saves. The server writes two things alone: the demonstration's logs in `rotorbench-demo/`, where no
//! log was named, and the file that leads the browser here, which goes again. Nothing here
//! reaches a bench: no command, no arming, no bus; what is shown of a running one is heard (`live.rs`).

mod act;
mod against;
mod answers;
mod assets;
mod bands;
mod bench_file;
mod by_hand;
mod choice;
mod chunks;
mod columns;
mod curves;
mod demo;
mod desk;
mod door;
mod download;
mod engine;
mod error;
mod export;
mod guarded;
mod guesses;
mod kept;
mod lay;
mod live;
mod margins;
mod places;
mod plots;
mod reading;
mod routes;
mod saved;
mod search;
mod server;
mod shown;
mod signals;
#[cfg(test)]
mod tests;
pub mod thresholds;
mod view;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use crate::bench::BenchConfig;
use crate::cancel::Cancel;

use bench_file::ChosenBench;
use demo::demo_logs;
use door::Door;
use engine::Engine;
use live::Live;
use places::{Places, whole};
use saved::Saved;

use error::ActError;
pub use error::WorkbenchError;

/// What is on the workbench when it opens, and where it listens.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WorkbenchConfig {
    /// Logs, the first ones to fit on, the last one held out; a folder is not opened, and may be looked through. None and no
    /// session: the two logs of the demonstration.
    pub logs: Vec<PathBuf>,
    /// Model files beside the paper's.
    pub models: Vec<PathBuf>,
    /// A session that was saved before.
    pub session: Option<PathBuf>,
    /// The bench that the live view listens to, and whose controller closes the loop.
    pub bench: BenchConfig,
    /// The file that says it; the bench that is built in has none.
    pub bench_file: Option<PathBuf>,
    /// Port on 127.0.0.1; 0 = any that is free.
    pub port: u16,
}

/// Serves the page until `cancel` is requested. `ready` hears the address, with its token, as soon as a browser may open it;
/// what it returns is dropped when that address was opened, or at the end.
///
/// # Errors
/// [`WorkbenchError`] when the port is taken, or what the configuration names cannot be opened.
pub fn serve<Shown: Send + 'static>(
    config: &WorkbenchConfig,
    cancel: &Cancel,
    ready: impl FnOnce(&str) -> Shown,
) -> Result<(), WorkbenchError> {
    let engine = open(config)?;
    let listener = server::listen(config.port)?;
    let port = listener.local_addr().map_err(WorkbenchError::System)?.port();
    let door = Door::new(port)?;
    let shown = Mutex::new(Some(ready(&door.address())));
    let opened = Arc::new(move || drop(shown.lock().unwrap_or_else(PoisonError::into_inner).take()));
    let served = server::run(listener, (door, Arc::clone(&opened) as _), &engine, cancel);
    opened();
    engine.end();
    served
}

/// Lays out what the configuration names.
fn open(config: &WorkbenchConfig) -> Result<Arc<Engine>, WorkbenchError> {
    let saved = config.session.as_deref().map(saved::read).transpose()?;
    // Its commands name files from its folder: what is named here is found from there, too.
    let config = &WorkbenchConfig {
        logs: config.logs.iter().map(|path| whole(path)).collect(),
        models: config.models.iter().map(|path| whole(path)).collect(),
        bench_file: config.bench_file.as_deref().map(whole),
        ..config.clone()
    };
    let moved = saved.as_ref().and_then(Saved::go_to_folder);
    let demo = config.logs.is_empty() && config.session.is_none();
    let demo = if demo { demo_logs()? } else { demo::DemoLogs::default() };
    let logs = if demo.logs.is_empty() { &config.logs } else { &demo.logs };
    let mut places = Places::of(logs.iter().chain(&config.models))?;
    if let Some(saved) = &saved {
        places.admit(saved.files())?;
    }
    let remembered = saved.as_ref().and_then(|saved| saved.bench.as_deref());
    let bench = ChosenBench::of((&config.bench, config.bench_file.as_deref()), remembered, &places);
    let engine = Engine::start(places, Live::new(bench.config, bench.file))?;
    if let Some(lost) = bench.lost {
        engine.change(|desk| {
            desk.notices.push(lost.to_string());
            desk.lost_bench = Some(lost.file);
        });
    }
    engine.begin(demo.commands, logs, &config.models, saved)?;
    if let Some(moved) = moved {
        engine.change(|desk| desk.notices.push(moved.to_string()));
    }
    Ok(engine)
}
