//! `rotorbench diagnose`: which physical effect is missing.

use std::path::PathBuf;

use super::output::{AnswerArguments, writable};
use super::search_arguments::SearchArguments;
use super::usage_error::UsageError;
use super::watched::{cancellable, searching};
use super::{CliError, CliResult, Outcome};
use crate::cancel::Cancel;
use crate::diagnose::{Diagnosis, RotorDiagnoses, Verdict};
use crate::model::Model;
use crate::report::next_steps::NextStep;
use crate::report::shell::quoted;
use crate::report::{self, json, rotors};
use crate::screening::ScreenedLog;
use crate::session::{self, Job};

/// Arguments of `diagnose`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) search: SearchArguments,
    #[command(flatten)]
    answer: AnswerArguments,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let search = &arguments.search;
    writable(&arguments.answer.report, search.inputs(), arguments.answer.force)?;
    let model = session::open_model(&search.model)?;
    let (answer, page) = cancellable(|cancel| {
        let (train, validate) = search.open(cancel)?;
        let rotors = session::many_rotors(&train);
        if !rotors.is_empty() {
            let found = each_rotor(arguments, &model, (&train, &validate), &rotors, cancel)?;
            return Ok((Answer::Rotors(found), None));
        }
        let diagnosis =
            searching(cancel, |job| session::diagnose(&model, &train, &validate, &search.config(), job))?;
        let next = next_steps(search, &diagnosis);
        let shown = if validate.is_empty() { &train } else { &validate };
        let job = Job::unwatched(cancel);
        let page = arguments.answer.report.as_ref().map(|path| {
            let compared =
                session::compare_extension(&model, &diagnosis.model, shown, &search.windows(), &job)?;
            Ok::<_, CliError>((path, report::diagnosis::page(&diagnosis, &compared, shown, &next)))
        });
        let page = page.transpose()?;
        Ok((Answer::Bench(Box::new(diagnosis), next), page))
    })?;
    if let Some((path, page)) = page {
        page.save(path)?;
    }
    let verdict = match &answer {
        Answer::Bench(diagnosis, next) => {
            if arguments.answer.json {
                println!("{}", json::answer(&json::diagnosis(diagnosis)?)?);
            } else {
                print!("{}", report::story::diagnosis(diagnosis, next, search.notes.detail()));
            }
            diagnosis.verdict
        }
        Answer::Rotors(found) => {
            if arguments.answer.json {
                println!("{}", json::answer(&rotors::diagnoses_json(found)?)?);
            } else {
                let whole = whole_story(search, found);
                let detail = search.notes.detail();
                print!("{}", rotors::diagnoses(found, &extensions(search, found), &whole, detail));
            }
            found.verdict
        }
    };
    Ok(if verdict == Verdict::Adequate { Outcome::Done } else { Outcome::FoundWanting })
}

/// What was asked of the logs.
enum Answer {
    /// An attitude bench, or a rotor or two.
    Bench(Box<Diagnosis>, Vec<NextStep>),
    /// A machine with more rotors than that.
    Rotors(RotorDiagnoses),
}

fn each_rotor(
    arguments: &Arguments,
    model: &Model,
    logs: (&[ScreenedLog], &[ScreenedLog]),
    rotors: &[usize],
    cancel: &Cancel,
) -> Result<RotorDiagnoses, CliError> {
    if arguments.answer.report.is_some() {
        return Err(UsageError::ReportOfRotors { count: rotors.len(), first: rotors[0] }.into());
    }
    let config = arguments.search.config();
    Ok(searching(cancel, |job| session::diagnose_each(model, logs, rotors, &config, job))?)
}

fn named(paths: &[PathBuf]) -> Vec<String> {
    paths.iter().map(|path| quoted(&path.display().to_string())).collect()
}

/// What to do next.
fn next_steps(search: &SearchArguments, diagnosis: &Diagnosis) -> Vec<NextStep> {
    let model = quoted(&search.model.display().to_string());
    let logs = (&named(&search.log)[..], &named(&search.validate)[..]);
    report::next_steps::next_steps(diagnosis, &model, logs, &search.as_typed())
}

/// The command that takes over what was found of each rotor, as far as there is one.
fn extensions(search: &SearchArguments, found: &RotorDiagnoses) -> Vec<String> {
    let own = found.rotors.iter().filter_map(|of| {
        let model = quoted(&search.model.display().to_string());
        let options = search.as_typed_of_rotor(of.rotor);
        let logs = (&named(&search.log)[..], &named(&search.validate)[..]);
        let steps = report::next_steps::next_steps_of_rotor(&of.diagnosis, of.rotor, &model, logs, &options);
        steps.into_iter().find_map(|step| step.command)
    });
    own.collect()
}

/// The command that tells the whole story of the first rotor.
fn whole_story(search: &SearchArguments, found: &RotorDiagnoses) -> String {
    let rotor = found.rotors.first().map_or(1, |of| of.rotor);
    let model = quoted(&search.model.display().to_string());
    let logs = (&named(&search.log)[..], &named(&search.validate)[..]);
    report::next_steps::diagnose(&model, logs, &search.as_typed_of_rotor(rotor))
}
