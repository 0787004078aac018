//! `rotorbench discover`: the law itself, where no effect of the catalogue explains what is missing.

use std::path::PathBuf;

use super::output::{AnswerArguments, writable};
use super::search_arguments::SearchArguments;
use super::watched::{cancellable, searching};
use super::{CliResult, Outcome};
use crate::diagnose::Verdict;
use crate::discover::LawVerdict;
use crate::report::{self, json};
use crate::session::{self, Job};

/// Arguments of `discover`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) search: SearchArguments,
    /// Model file to write: the model with the law, where one is found
    #[arg(short, long)]
    output: Option<PathBuf>,
    #[command(flatten)]
    answer: AnswerArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let search = &arguments.search;
    writable(
        arguments.output.iter().chain(&arguments.answer.report),
        search.inputs(),
        arguments.answer.force,
    )?;
    let model = session::open_model(&search.model)?;
    let (mut found, page) = cancellable(|cancel| {
        let (train, validate) = search.open(cancel)?;
        let found =
            searching(cancel, |job| session::discover(&model, &train, &validate, &search.config(), job))?;
        let Some(path) = &arguments.answer.report else { return Ok((found, None)) };
        let shown = if validate.is_empty() { &train } else { &validate };
        let job = Job::unwatched(cancel);
        let compared = session::compare_extension(&model, &found.model, shown, &search.windows(), &job)?;
        let page = report::discovery::page(&found, &compared, shown);
        Ok((found, Some((path, page))))
    })?;
    let law_file = arguments.output.as_ref().filter(|_| found.verdict == LawVerdict::Law);
    if let Some(path) = law_file {
        session::name_after(&mut found.model, path);
        session::save_model(&found.model, path)?;
    }
    if let Some((path, page)) = page {
        page.save(path)?;
    }
    if arguments.answer.json {
        println!("{}", json::answer(&json::with_sentences(&found, &found.findings)?)?);
    } else {
        print!("{}", report::discovery::text(&found, arguments.search.notes.detail()));
        if let Some(path) = &arguments.output {
            println!("{}", report::discovery::written(law_file.is_some(), path));
        }
    }
    let is_done = matches!(found.verdict, LawVerdict::Law | LawVerdict::Diagnosed(Verdict::Adequate));
    Ok(if is_done { Outcome::Done } else { Outcome::FoundWanting })
}
