//! Reading a log: what it is, what was found in it, and how that comes onto the desk.

use std::path::Path;
use std::sync::Arc;

use super::bands::Bands;
use super::bench_file::hash_of;
use super::columns::{DeskMapping, Guess};
use super::desk::{Desk, LogContent, OpenLog};
use super::error::{Changed, OtherBench, OtherColumns};
use super::guarded::Ended;
use super::kept;
use super::places::Stamp;
use super::shown::ShownChannel;
use crate::cancel::Cancel;
use crate::report::findings::sentence;
use crate::report::import::note_lines;
use crate::session::{self, Job, OpenConfig, SessionError};

/// What reading a log gives.
pub(super) enum FileContent {
    Open(Box<OpenLog>),
    Guess(Box<Guess>),
    /// The file holds several logs, and none was chosen.
    Parts(Vec<(usize, Option<f64>)>),
}

/// Reads a log, or guesses what its columns mean where nobody has said it.
pub(super) fn read(
    path: &Path,
    mapping: Option<&DeskMapping>,
    config: &OpenConfig,
    cancel: &Cancel,
) -> Result<FileContent, SessionError> {
    let job = Job::unwatched(cancel);
    // Before it is read: what is written meanwhile is seen the next time.
    let stamp = Stamp::of(path);
    let opened = if let Some(mapping) = mapping {
        session::open_mapped(path, &mapping.load()?, config, &job)
    } else {
        if let Some(guessed) = session::guess_columns(path, &job)? {
            return Ok(FileContent::Guess(Box::new(Guess::new(guessed))));
        }
        session::open(path, config, &job)
    };
    let opened = match opened {
        Err(error) => return error.parts().map(FileContent::Parts).ok_or(error),
        Ok(opened) => opened,
    };
    let found = opened.log.findings().map(sentence);
    let notes = note_lines(&opened.notes).into_iter().chain(found).collect();
    let (bands, channels) = (Bands::of(&opened.log), ShownChannel::all_of(opened.log.raw()));
    // Our own say themselves what they are.
    let bench = opened.frames.is_some().then(|| hash_of(config.bench.as_deref()));
    let takes_mapping = bench.is_none() && !["CSV", "recording"].contains(&opened.format);
    let (format, log, part) = (opened.format, opened.log, opened.notes.part);
    Ok(FileContent::Open(Box::new(OpenLog {
        stamp,
        bands,
        channels,
        notes,
        format,
        bench,
        takes_mapping,
        part,
        log,
    })))
}

/// Puts what reading a log gave on the desk.
pub(super) fn lay_seen(desk: &mut Desk, id: u64, seen: Result<FileContent, Ended>) {
    desk.looking = None;
    // Whoever ended it wants it anew.
    if matches!(seen, Err(Ended::Cancelled)) {
        return;
    }
    let bench = desk.bench.as_ref().map(|file| file.display().to_string());
    // It may have been taken away meanwhile.
    let Ok(log) = desk.log_mut(id) else { return };
    let (mut is_other, mut means_other) = (false, false);
    let is_again = std::mem::take(&mut log.again) && matches!(log.content, LogContent::Open(_));
    log.stuck = None;
    log.content = match seen {
        // What was read before stays: the file may be put back.
        Ok(FileContent::Guess(_) | FileContent::Parts(_)) if is_again => {
            return log.stuck = Some(OtherColumns.to_string());
        }
        Ok(FileContent::Guess(guess)) => {
            log.guess = Some(guess);
            LogContent::Guessed
        }
        Ok(FileContent::Parts(parts)) => LogContent::Parts(parts),
        Ok(FileContent::Open(open)) => {
            let remembered = log.remembered.take().filter(|it| !it.sha256.is_empty());
            if let Some(remembered) = remembered {
                let now = open.read_from();
                is_other = remembered.sha256 != now.sha256;
                means_other = remembered.bench.is_some() && remembered.bench != now.bench;
            }
            LogContent::Open(Arc::from(open))
        }
        // A file that is being written may end within a row.
        Err(Ended::Failed(why)) if is_again => return log.stuck = Some(why),
        Err(Ended::Failed(why)) => LogContent::Failed(why),
        Err(Ended::Cancelled) => return,
    };
    let (name, is_failed) =
        (log.typed.clone(), matches!(log.content, LogContent::Failed(_) | LogContent::Parts(_)));
    if is_other {
        desk.notices.push(Changed(name.clone()).to_string());
    } else if means_other {
        let bench = bench.unwrap_or_else(|| "the built-in bench".to_owned());
        desk.notices.push(OtherBench { log: name, bench }.to_string());
        return kept::drop_of_log(desk, id, "the bench file");
    }
    if is_other || is_failed {
        kept::drop_of_log(desk, id, &name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workbench::choice::Choice;
    use crate::workbench::desk::LogUse;
    use crate::workbench::lay::lay_log;

    /// Whoever ended a reading wants the log read anew.
    #[test]
    fn a_log_whose_reading_was_ended_is_still_to_be_read() {
        let mut desk = Desk::new();
        lay_log(&mut desk, "here.csv".into(), LogUse::Fit, Choice::default(), None);
        desk.logs[0].again = true;
        let id = desk.logs[0].id;
        lay_seen(&mut desk, id, Err(Ended::Cancelled));
        assert!(desk.logs[0].again && desk.looking.is_none());
        lay_seen(&mut desk, id, Err(Ended::Failed("gone".to_owned())));
        assert!(!desk.logs[0].again);
    }
}
