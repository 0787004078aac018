//! The commands that do by hand what was done on the page.

use std::path::Path;

use super::ActError;
use super::desk::{Desk, DeskLog, LogUse};
pub(super) use crate::report::shell::quoted;

/// A command of these words, as it is typed into a shell.
pub(super) fn command(words: &[String]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    format!("rotorbench {}", quoted.join(" "))
}

/// The shown models, held beside a log.
pub(super) fn compare(desk: &Desk, log: u64) -> Result<String, ActError> {
    let mut words = vec!["compare".to_owned()];
    for model in desk.models.iter().filter(|model| model.shown) {
        words.extend(["--model".to_owned(), model.typed()]);
    }
    let log = desk.log(log)?;
    words.extend(log.mapping.iter().flat_map(|it| ["--mapping".to_owned(), it.name.clone()]));
    words.extend(bench_of_captures(desk, [log].into_iter()));
    words.extend(log.choice.options());
    words.extend(["--log".to_owned(), log.typed.clone()]);
    Ok(command(&words))
}

/// The guess of a foreign log's columns, mended, as a mapping file.
pub(super) fn write_mapping(log: &str, output: &str, mended: &[String]) -> String {
    let mut words = ["import", log, "--write-mapping", output].map(str::to_owned).to_vec();
    words.extend(mended.iter().flat_map(|it| ["--column".to_owned(), it.clone()]));
    command(&words)
}

/// A model of the bench.
pub(super) fn identify(desk: &Desk, output: &str) -> String {
    let mut words = vec!["identify".to_owned()];
    words.extend(logs(desk));
    words.extend(["-o", output].map(str::to_owned));
    command(&words)
}

/// The search for what `model` lacks, by `diagnose` or `discover`.
pub(super) fn search(desk: &Desk, command: &str, model: &str) -> String {
    let mut words = [command, "--model", model].map(str::to_owned).to_vec();
    words.extend(logs(desk));
    self::command(&words)
}

/// The same command, its result in a file.
pub(super) fn written_to(command: &str, output: &str) -> String {
    format!("{command} -o {}", quoted(output))
}

/// `model` with more effects, or, with none, its own numbers refitted.
pub(super) fn extend(desk: &Desk, model: &str, added: &[String], output: &str) -> String {
    let mut words = ["extend", "--model", model].map(str::to_owned).to_vec();
    match added {
        [] => words.push("--recalibrate".to_owned()),
        added => {
            words.push("--effect".to_owned());
            words.extend(added.iter().cloned());
        }
    }
    words.extend(logs(desk));
    words.extend(["-o", output].map(str::to_owned));
    command(&words)
}

/// The last step of the ladder of `model`, undone.
pub(super) fn step_back(model: &str, output: &str) -> String {
    command(&["extend", "--model", model, "--step-back", "-o", output].map(str::to_owned))
}

/// The loop of a bench's controller about a model.
pub(super) fn design(model: &str, bench: Option<&Path>) -> String {
    let mut words = ["design", "--model", model].map(str::to_owned).to_vec();
    if let Some(bench) = bench {
        words.extend(["--config".to_owned(), bench.display().to_string()]);
    }
    command(&words)
}

/// The options that say how those logs are read.
fn options(desk: &Desk) -> Vec<String> {
    let read = || desk.logs.iter().filter(|log| log.role != LogUse::Look);
    let mapping = read().find_map(|log| log.mapping.as_ref());
    let mut words: Vec<String> =
        mapping.iter().flat_map(|it| ["--mapping".to_owned(), it.name.clone()]).collect();
    words.extend(bench_of_captures(desk, read()));
    words.extend(read().next().iter().flat_map(|log| log.choice.options()));
    words
}

/// The same, each with a blank before it.
pub(super) fn options_typed(desk: &Desk) -> String {
    options(desk).iter().map(|word| format!(" {}", quoted(word))).collect()
}

/// The logs that are fitted on, and those that are held out.
fn logs(desk: &Desk) -> Vec<String> {
    let mut words = options(desk);
    for (option, role) in [("--log", LogUse::Fit), ("--validate", LogUse::HeldOut)] {
        let typed: Vec<String> =
            desk.logs.iter().filter(|log| log.role == role).map(|log| log.typed.clone()).collect();
        if !typed.is_empty() {
            words.push(option.to_owned());
            words.extend(typed);
        }
    }
    words
}

/// The option that names the bench file, where one of these logs was read by it.
fn bench_of_captures<'a>(desk: &Desk, mut logs: impl Iterator<Item = &'a DeskLog>) -> Vec<String> {
    let has_capture = logs.any(|log| log.open().is_ok_and(|open| open.bench.is_some()));
    let file = desk.bench.iter().filter(|_| has_capture);
    file.flat_map(|file| ["--config".to_owned(), file.display().to_string()]).collect()
}

/// Refuses logs that no single command can read: its `--mapping` is for all of them that it could be for, and so is what it
/// says of rotors and times.
pub(super) fn check_together(desk: &Desk) -> Result<(), ActError> {
    let fitted = || desk.logs.iter().filter(|log| log.role != LogUse::Look);
    let mut pairs = fitted().zip(fitted().skip(1));
    if let Some((one, other)) = pairs.find(|(one, other)| one.choice != other.choice) {
        return Err(ActError::Choices(one.typed.clone(), other.typed.clone()));
    }
    let Some(first) = fitted().find(|log| log.mapping.is_some()) else { return Ok(()) };
    let takes = |log: &&DeskLog| log.mapping.is_some() || log.open().is_ok_and(|open| open.takes_mapping);
    match fitted().filter(takes).find(|log| log.mapping != first.mapping) {
        Some(other) => Err(ActError::Mappings(first.typed.clone(), other.typed.clone())),
        None => Ok(()),
    }
}
