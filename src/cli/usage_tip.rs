//! What was probably meant where the command line has a word too many.

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

use crate::report::usage_tip;

/// The error about the words of this process, with a tip where one helps.
pub(super) fn with_tip(error: Error, program: &Command) -> Error {
    let words: Vec<String> = std::env::args().skip(1).collect();
    tipped(error, program, &words)
}

fn tipped(mut error: Error, program: &Command, words: &[String]) -> Error {
    if error.kind() != ErrorKind::UnknownArgument {
        return error;
    }
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidArg) else { return error };
    let unknown = unknown.clone();
    let Some(command) = words.iter().find_map(|word| program.find_subcommand(word)) else { return error };
    let tip = if unknown.starts_with('-') { of_kind(&unknown, command) } else { of_file(&unknown, command) };
    if let Some(tip) = tip {
        let value = ContextValue::StyledStrs(vec![StyledStr::from(tip)]);
        error.insert(ContextKind::Suggested, value);
    }
    error
}

/// A file without the option that it is for: a TOML is the bench file, or the model where there is none; everything else a log.
fn of_file(unknown: &str, command: &Command) -> Option<String> {
    let takes = |option: &&str| command.get_arguments().any(|it| it.get_long() == Some(*option));
    let is_settings = unknown.to_ascii_lowercase().ends_with(".toml");
    let options = if is_settings { &["config", "model"][..] } else { &["log"] };
    let option = options.iter().copied().find(|option| takes(option))?;
    Some(usage_tip::of_file(option, unknown))
}

/// An option of a kind of the command, without the kind.
fn of_kind(unknown: &str, command: &Command) -> Option<String> {
    let long = unknown.trim_start_matches('-').split('=').next().unwrap_or_default();
    let has = |kind: &&Command| kind.get_arguments().any(|it| it.get_long() == Some(long));
    let kinds: Vec<&str> = command.get_subcommands().filter(has).map(Command::get_name).collect();
    // The one that shows most, where it is among them.
    let first = *kinds.iter().find(|kind| **kind == "prbs").or(kinds.first())?;
    let others: Vec<&str> = kinds.iter().copied().filter(|kind| *kind != first).collect();
    Some(usage_tip::of_kind(command.get_name(), long, first, &others))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(line: &str) -> String {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        let mut program = super::super::command();
        program.build();
        let all = std::iter::once("rotorbench".to_owned()).chain(words.iter().cloned());
        let error = program.clone().try_get_matches_from(all).expect_err("a word too many");
        tipped(error, &program, &words).render().to_string()
    }

    #[test]
    fn a_word_too_many_gets_the_option_it_needs() {
        for (line, tip) in [
            ("check bench.toml", "tip: a file needs its option: `--config bench.toml`"),
            ("diagnose src.csv", "tip: a file needs its option: `--log src.csv`"),
            ("identify x.csv", "tip: a file needs its option: `--log x.csv`"),
            ("compare x.csv", "tip: a file needs its option: `--log x.csv`"),
            (
                "experiment --duration 5",
                "tip: the kind comes first: `rotorbench experiment prbs --duration ...` (or `chirp`)",
            ),
        ] {
            let said = said(line);
            assert!(said.contains(tip), "{line}: {said}");
        }
        assert!(!said("check nonsense").contains("tip: a file"), "no file");
        assert!(said("compare --modle m.toml").contains("--model"), "clap's own tips stay");
    }
}
