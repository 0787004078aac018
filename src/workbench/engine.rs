//! What is done with the desk: acts, and the threads of long work. One thread reads logs and compares, always what is to be
//! seen next; a search has a thread of its own. The desk's lock is held for moments only.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use tokio::sync::watch;

use super::act::Act;
use super::choice::Choice;
use super::columns::DeskMapping;
use super::desk::{
    Compared, Desk, DeskLog, LogContent, LogUse, Looking, OpenLog, Origin, Recipe, SearchInputs, SearchKind,
    SearchState,
};
use super::guarded::{Ended, guarded};
use super::lay::{file, keep, lay_law, lay_log, lay_model, lay_saved, lightly};
use super::live::Live;
use super::places::{Places, Stamp, as_typed};
use super::reading::{FileContent, lay_seen, read};
use super::saved::Saved;
use super::search::SearchTask;
use super::shown::ShownComparison;
use super::{ActError, WorkbenchError};
use crate::cancel::Cancel;
use crate::compare::CompareConfig;
use crate::memory;
use crate::model::Model;
use crate::report::findings::explained;
use crate::session::{self, Job, OpenConfig, Progress};

/// The desk, and who works on it.
#[derive(Debug)]
pub(super) struct Engine {
    desk: Mutex<Desk>,
    woken: Condvar,
    /// Counts whatever a page may want to hear of.
    beat: watch::Sender<u64>,
    pub places: Places,
    pub live: Arc<Live>,
    ended: AtomicBool,
}

/// What is to be looked at next.
enum Look {
    Open { log: u64, path: PathBuf, mapping: Option<Arc<DeskMapping>>, choice: Choice },
    Compare { log: u64, content: Arc<OpenLog>, shown: Vec<u64>, models: Vec<Model> },
}

impl Engine {
    /// An empty desk, and the thread that reads and compares.
    pub fn start(places: Places, live: Arc<Live>) -> Result<Arc<Self>, WorkbenchError> {
        let mut desk = Desk::new();
        desk.bench = live.bench().1.map(as_typed);
        let (desk, beat) = (Mutex::new(desk), watch::Sender::new(0));
        let engine =
            Arc::new(Self { desk, woken: Condvar::new(), beat, places, live, ended: AtomicBool::new(false) });
        let looker = Arc::clone(&engine);
        let spawned = thread::Builder::new().name("look".to_owned()).spawn(move || looker.look());
        spawned.map_err(WorkbenchError::System)?;
        Ok(engine)
    }

    /// Lays the first logs and models on the desk, or what a session had.
    pub fn begin(
        &self,
        commands: Vec<String>,
        logs: &[PathBuf],
        models: &[PathBuf],
        saved: Option<Saved>,
    ) -> Result<(), WorkbenchError> {
        self.change(|desk| {
            desk.done = commands;
            let files: Vec<&PathBuf> = logs.iter().filter(|path| !path.is_dir()).collect();
            for (index, path) in files.iter().enumerate() {
                // The last of several is held out: an error is judged on what no fit has seen.
                let is_last = index > 0 && index + 1 == files.len();
                let path = self.places.file(path)?;
                let role = if is_last { LogUse::HeldOut } else { LogUse::Fit };
                lay_log(desk, path, role, Choice::default(), None);
            }
            for path in models.iter().filter(|path| path.as_os_str() != "paper") {
                let path = self.places.file(path)?;
                lay_model(desk, session::open_model(&path)?, file(&path));
            }
            if let Some(saved) = saved {
                lay_saved(desk, &self.places, saved)?;
            }
            Ok(())
        })
    }

    /// The desk, to be looked at.
    pub fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the desk, and lets everybody know.
    pub fn change<T>(&self, how: impl FnOnce(&mut Desk) -> T) -> T {
        let mut desk = self.desk();
        let done = how(&mut desk);
        desk.revision += 1;
        drop(desk);
        self.tell();
        self.woken.notify_all();
        done
    }

    /// Lets the pages know that something is further than it was.
    pub fn tell(&self) {
        self.beat.send_modify(|beat| *beat += 1);
    }

    /// Hears of every change from now on.
    pub fn listen(&self) -> watch::Receiver<u64> {
        self.beat.subscribe()
    }

    /// Ends all work.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
        self.change(|desk| {
            if let Some(looking) = &desk.looking {
                looking.cancel.request();
            }
            if let Some(search) = &desk.search {
                search.cancel.request();
            }
        });
        self.live.end();
    }

    /// Does what a page asks for, or begins it.
    pub fn act(self: &Arc<Self>, act: Act) -> Result<(), ActError> {
        match act {
            Act::Identify => self.search(SearchKind::Identify, Vec::new()),
            Act::Diagnose => self.search(SearchKind::Diagnose, Vec::new()),
            Act::Try { effects } => self.search(SearchKind::Try, effects),
            Act::Add { effects } if self.keep_tried(&effects) => Ok(()),
            Act::Add { effects } => self.search(SearchKind::Extend, effects),
            Act::Discover => self.search(SearchKind::Discover, Vec::new()),
            Act::AddLaw => self.change(|desk| lay_law(desk, Origin::Made)),
            Act::TryLaw => self.change(|desk| lay_law(desk, Origin::Tried)),
            Act::Recalibrate => self.search(SearchKind::Recalibrate, Vec::new()),
            Act::OpenLog { path, choice } => {
                let path = self.places.file(&path)?;
                self.change(|desk| {
                    let role = if desk.logs.is_empty() { LogUse::Fit } else { LogUse::Look };
                    lay_log(desk, path, role, choice, None);
                });
                Ok(())
            }
            Act::Reread { log } => self.reread(log),
            Act::OpenModel { path } => {
                let path = self.places.file(&path)?;
                let model = session::open_model(&path)?;
                self.change(|desk| lay_model(desk, model, file(&path)));
                Ok(())
            }
            light => self.change(|desk| lightly(desk, light)),
        }
    }

    /// Has a log read again where its file has changed since. Where it has not, nobody hears of it.
    fn reread(&self, id: u64) -> Result<(), ActError> {
        let (path, stamp) = {
            let desk = self.desk();
            let log = desk.log(id)?;
            (log.path.clone(), log.open()?.stamp)
        };
        if Stamp::of(&path) != stamp {
            self.change(|desk| desk.log_mut(id).map(|log| log.again = true))?;
        }
        Ok(())
    }

    /// Begins a search.
    fn search(self: &Arc<Self>, kind: SearchKind, added: Vec<String>) -> Result<(), ActError> {
        let (task, search) = self.change(|desk| {
            let task = SearchTask::of(desk, kind, added)?;
            let search = task.begin(desk);
            Ok::<_, ActError>((task, search))
        })?;
        let engine = Arc::clone(self);
        let spawned = thread::Builder::new().name("search".to_owned()).spawn(move || {
            let hear = |progress: Progress| engine.hear(&progress);
            let ended = guarded(|| task.run(&search, &hear));
            // What was found is made ready for the page, which may fail as the search itself.
            let laid = guarded(|| {
                engine.change(|desk| task.end(desk, &search, ended));
                Ok(())
            });
            if let Err(broken) = laid {
                engine.change(|desk| task.end(desk, &search, Err(broken)));
            }
            memory::give_back();
        });
        if let Err(error) = spawned {
            self.change(|desk| {
                if let Some(search) = &mut desk.search {
                    search.state = SearchState::Failed(error.to_string());
                }
            });
        }
        Ok(())
    }

    /// A search has gone on. It is no change of the desk: nothing but its progress is new.
    fn hear(&self, progress: &Progress) {
        if let Some(search) = &mut self.desk().search {
            match progress {
                Progress::Candidate { fitted } => search.fitted = *fitted,
                Progress::Tried { effects, over_noise } => search.take(effects, *over_noise),
                Progress::Leading { effects } => search.leading = effects.to_vec(),
                Progress::Step { .. } => {}
            }
        }
        self.tell();
    }

    /// Adds the model that was tried with just these effects, which need not be fitted again.
    fn keep_tried(&self, effects: &[String]) -> bool {
        self.change(|desk| {
            let recipe = Recipe { added: effects.to_vec(), of: SearchInputs::of(desk) };
            let tried = desk.models.iter_mut().find(|it| it.origin == Origin::Tried);
            let Some(tried) = tried.filter(|it| it.recipe.as_ref() == Some(&recipe)) else { return false };
            let id = tried.id;
            let is_kept = keep(desk, id).is_ok();
            if is_kept {
                desk.chosen = id;
            }
            is_kept
        })
    }

    /// Reads and compares until the end.
    fn look(&self) {
        while let Some((next, cancel)) = self.next_look() {
            self.tell();
            match next {
                Look::Open { log, path, mapping, choice } => {
                    let opened = self.read(&path, mapping.as_deref(), &choice, &cancel);
                    let laid = guarded(|| {
                        self.change(|desk| lay_seen(desk, log, opened));
                        Ok(())
                    });
                    if let Err(broken) = laid {
                        self.change(|desk| lay_seen(desk, log, Err(broken)));
                    }
                }
                Look::Compare { log, content, shown, models } => {
                    let logs = std::slice::from_ref(&content.log);
                    let job = Job::unwatched(&cancel);
                    let found = guarded(|| {
                        let found = session::compare(&models, logs, &CompareConfig::default(), &job)?;
                        Ok(found.into_iter().flatten().map(ShownComparison::of).collect())
                    });
                    self.change(|desk| {
                        desk.looking = None;
                        let found = match found {
                            Ok(found) => Ok(Arc::new(found)),
                            // What is to be seen has changed: it is compared anew.
                            Err(Ended::Cancelled) => return,
                            Err(Ended::Failed(why)) => Err(why),
                        };
                        if let Ok(log) = desk.log_mut(log) {
                            log.compared = Some(Compared { content, models: shown, found });
                        }
                    });
                }
            }
            memory::give_back();
        }
    }

    /// Reads a log, if it still lies where it may be opened; a capture as the bench file says.
    fn read(
        &self,
        path: &Path,
        mapping: Option<&DeskMapping>,
        choice: &Choice,
        cancel: &Cancel,
    ) -> Result<FileContent, Ended> {
        // By the path as it was typed, which a model's ladder keeps.
        self.places.file(path).map_err(|error| Ended::Failed(explained(&error)))?;
        let bench = self.live.bench().1.map(Path::to_owned);
        let config = choice.within(OpenConfig { bench, ..OpenConfig::default() });
        guarded(|| read(path, mapping, &config, cancel))
    }

    /// Waits for something to look at; `None` at the end.
    fn next_look(&self) -> Option<(Look, Cancel)> {
        let mut desk = self.desk();
        loop {
            if self.ended.load(Ordering::Relaxed) {
                return None;
            }
            if let Some((next, name)) = next_look(&desk) {
                let cancel = Cancel::default();
                let reads = match &next {
                    Look::Open { log, .. } => Some(*log),
                    Look::Compare { .. } => None,
                };
                desk.looking = Some(Looking { name, cancel: cancel.clone(), reads });
                return Some((next, cancel));
            }
            desk = self.woken.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// A log that waits to be read, or else one that waits to be compared with what is shown.
fn next_look(desk: &Desk) -> Option<(Look, String)> {
    let waits = |log: &&DeskLog| matches!(log.content, LogContent::Opening) || log.again;
    if let Some(log) = desk.logs.iter().find(waits) {
        let (path, mapping, choice) = (log.path.clone(), log.mapping.clone(), log.choice.clone());
        return Some((Look::Open { log: log.id, path, mapping, choice }, log.typed.clone()));
    }
    let shown = desk.shown();
    let is_due = |log: &&DeskLog| {
        let is_of = |open: &Arc<OpenLog>, compared: &Compared| {
            compared.models == shown && Arc::ptr_eq(&compared.content, open)
        };
        log.open().is_ok_and(|open| log.compared.as_ref().is_none_or(|compared| !is_of(open, compared)))
    };
    let log = desk.logs.iter().filter(|_| !shown.is_empty()).find(is_due)?;
    let content = Arc::clone(log.open().ok()?);
    let models = desk.models.iter().filter(|model| model.shown).map(|model| model.model.clone()).collect();
    Some((Look::Compare { log: log.id, content, shown, models }, log.typed.clone()))
}
