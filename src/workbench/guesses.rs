//! Foreign columns: what they may mean, mended and confirmed by somebody before anything is read.

use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};

use super::columns::{DeskMapping, Guess, reads_like, unit_of};
use super::desk::{Desk, LogContent};
use super::places::plain;
use super::{ActError, by_hand};
use crate::log::guess::{GuessedColumn, own_name};
use crate::log::mended::conversions;
use crate::log::signals::{LOG_SIGNALS, MOST_ROTORS, of_rotor, rotor_of};
use crate::report::guess::{certainty, mapping_file};
use crate::session::GuessedLog;

/// Rotors whose signals are offered, and one more than the columns name.
const OFFERED_ROTORS: usize = 4;

/// Says what a column becomes.
pub(super) fn mend(
    desk: &mut Desk,
    log: u64,
    (column, signal, unit): (&str, &str, Option<&str>),
) -> Result<(), ActError> {
    let log = desk.log_mut(log)?;
    match (&log.content, &mut log.guess) {
        (LogContent::Guessed, Some(guess)) => Ok(guess.now.mend(column, signal, unit)?),
        _ => Err(ActError::NotAsked(log.typed.clone())),
    }
}

/// Reads a log by its columns as they are said, or by a mapping that another log has, or a shipped one.
pub(super) fn confirm(desk: &mut Desk, id: u64, like: Option<&str>) -> Result<(), ActError> {
    let log = desk.log(id)?;
    let (LogContent::Guessed, Some(guess)) = (&log.content, &log.guess) else {
        return Err(ActError::NotAsked(log.typed.clone()));
    };
    let mapping = match like {
        Some(name) if guess.now.shipped == Some(name) => {
            Arc::new(DeskMapping { name: name.to_owned(), text: None })
        }
        Some(name) => {
            let fits = fitting(desk, &guess.now).into_iter().find(|it| it.name == *name);
            fits.ok_or_else(|| ActError::NoMapping(name.to_owned()))?
        }
        None => {
            if guess.now.mapping.time.is_none() {
                return Err(ActError::NoTime(log.typed.clone()));
            }
            let text = text(&guess.now, &log.typed)?;
            let name = fresh_name(desk, &log.typed);
            let command = by_hand::write_mapping(&log.typed, &name, &guess.mended());
            let mapping = DeskMapping { name, text: Some(text) };
            let reads = mapping.load()?;
            let is_same =
                |other: &&Arc<DeskMapping>| other.load().is_ok_and(|other| reads_like(&other, &reads));
            match desk.logs.iter().filter_map(|log| log.mapping.as_ref()).find(is_same) {
                // One file of both logs: a command takes one.
                Some(same) => Arc::clone(same),
                None => {
                    desk.done.push(command);
                    Arc::new(mapping)
                }
            }
        }
    };
    let log = desk.log_mut(id)?;
    (log.mapping, log.content, log.compared) = (Some(mapping), LogContent::Opening, None);
    Ok(())
}

/// Back to the columns, to mend them again.
pub(super) fn ask_again(desk: &mut Desk, id: u64) -> Result<(), ActError> {
    let log = desk.log_mut(id)?;
    if log.mapping.take().is_none() {
        return Err(ActError::NotAsked(log.typed.clone()));
    }
    log.content = if log.guess.is_some() { LogContent::Guessed } else { LogContent::Opening };
    (log.compared, log.again) = (None, false);
    // What is read just now by the mapping that is taken away would come as if nobody had asked.
    desk.leave_log(id);
    desk.look_anew();
    Ok(())
}

/// The text of the mapping file, as `import --write-mapping` writes it.
pub(super) fn text(guess: &GuessedLog, log: &str) -> Result<String, ActError> {
    mapping_file(guess, log).map_err(|error| ActError::Spelling(error.to_string()))
}

/// A name that no mapping has here: that of its file when it is saved.
fn fresh_name(desk: &Desk, log: &str) -> String {
    let stem = Path::new(log).file_stem().map(|stem| plain(&stem.to_string_lossy())).unwrap_or_default();
    let names =
        std::iter::once(format!("{stem}.toml")).chain((2..).map(|number| format!("{stem}-{number}.toml")));
    // A name that a command had stays with what it wrote, and one that a file has with that file.
    let is_free = |name: &String| {
        !Path::new(name).exists()
            && !desk.done.iter().any(|it| it.contains(&format!("--write-mapping {name}")))
            && desk.models.iter().all(|model| model.typed() != *name)
    };
    let mut names = names.filter(is_free);
    names.next().unwrap_or_default()
}

/// The mappings of other logs whose columns are all here.
fn fitting(desk: &Desk, guess: &GuessedLog) -> Vec<Arc<DeskMapping>> {
    let mut found: Vec<Arc<DeskMapping>> = Vec::new();
    for mapping in desk.logs.iter().filter_map(|log| log.mapping.as_ref()) {
        let has = |column: &str| guess.columns.iter().any(|it| it.column == column);
        let fits = mapping.load().is_ok_and(|it| it.columns().all(has));
        if fits && !found.contains(mapping) {
            found.push(Arc::clone(mapping));
        }
    }
    found
}

/// The guess as the page shows it.
pub(super) fn view(desk: &Desk, guess: &Guess) -> Value {
    let now = &guess.now;
    json!({
        "columns": now.columns.iter().map(|it| column(now, it)).collect::<Vec<_>>(),
        "signals": offered(now),
        "has_time": now.mapping.time.is_some(),
        "shipped": now.shipped,
        "like": fitting(desk, now).iter().map(|it| &it.name).collect::<Vec<_>>(),
    })
}

fn column(guess: &GuessedLog, it: &GuessedColumn) -> Value {
    let others = guess.columns.iter().filter(|other| other.column != it.column);
    json!({
        "column": it.column,
        "signal": it.signal,
        "own": own_name(&it.column, others.map(|other| other.signal.as_str())),
        "is_read": it.certainty.is_read(),
        "certainty": it.certainty,
        "how_sure": certainty(it.certainty),
        "unit": unit_of(it),
        "units": conversions(&it.signal).iter().map(|it| it.name).collect::<Vec<_>>(),
        "samples": it.samples,
    })
}

/// The signals that a column may become.
fn offered(guess: &GuessedLog) -> Vec<String> {
    let named = guess.columns.iter().filter_map(|it| rotor_of(&it.signal)).max().unwrap_or(0);
    let rotors = OFFERED_ROTORS.max(named + 1).min(MOST_ROTORS);
    let of = |name: &'static str| -> Vec<String> {
        match rotor_of(name) {
            None => vec![name.to_owned()],
            // The table names the two of a bench.
            Some(1) => (1..=rotors).filter_map(|rotor| of_rotor(name, rotor)).collect(),
            Some(_) => Vec::new(),
        }
    };
    LOG_SIGNALS.iter().flat_map(|known| of(known.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests run in the project's folder, which has a `Cargo.toml`.
    #[test]
    fn a_mapping_is_not_named_as_a_file_that_is_there() {
        assert_eq!(fresh_name(&Desk::new(), "stand.csv"), "stand.toml");
        assert_eq!(fresh_name(&Desk::new(), "Cargo.csv"), "Cargo-2.toml");
    }
}
