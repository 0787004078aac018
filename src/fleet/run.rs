//! One shard of a plan, bench by bench.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde_json::Value;

use super::{BenchAnswer, FleetBench, FleetError, Plan, inputs};
use crate::cancel::Cancelled;
use crate::compare::{CompareConfig, Comparison};
use crate::diagnose::{DiagnoseConfig, Diagnosis};
use crate::file::write_atomically;
use crate::model::Model;
use crate::screening::ScreenedLog;
use crate::session::{self, Job, OpenConfig, SessionError};

/// Part `number` of `of`, from 1: every `of`-th bench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    number: usize,
    of: usize,
}

impl Default for Shard {
    fn default() -> Self {
        Self { number: 1, of: 1 }
    }
}

impl FromStr for Shard {
    type Err = FleetError;

    fn from_str(text: &str) -> Result<Self, FleetError> {
        let parts =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        let shard = parts.map(|(number, of)| Self { number, of });
        let is_one = |it: &Self| it.number >= 1 && it.number <= it.of;
        shard.filter(is_one).ok_or_else(|| FleetError::Shard(text.to_owned()))
    }
}

impl Shard {
    fn holds(self, index: usize) -> bool {
        index % self.of == self.number - 1
    }
}

/// What is heard while a shard runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ShardEvent<'a> {
    /// A bench begins.
    Begins {
        /// Its name.
        bench: &'a str,
        /// Its number in the shard, from 1.
        number: usize,
        /// How many the shard has.
        of: usize,
    },
    /// Its answer was there already.
    Present,
    /// It was diagnosed.
    Answered,
    /// It could not be, and why.
    Failed(&'a str),
}

/// A bench that was diagnosed: what its page is made of.
pub struct Diagnosed<'a> {
    /// The bench.
    pub bench: &'a FleetBench,
    /// The model that it began with.
    pub model: &'a Model,
    /// Logs fitted on.
    pub train: &'a [ScreenedLog],
    /// Logs held out.
    pub validate: &'a [ScreenedLog],
    /// What was found.
    pub diagnosis: &'a Diagnosis,
    /// The model as it is beside the extended one, on the logs of [`Self::shown`]; `None` where no page is wanted.
    pub compared: Option<Vec<Vec<Comparison>>>,
}

impl Diagnosed<'_> {
    /// The logs that a page shows: those held out, where there are any.
    #[must_use]
    pub fn shown(&self) -> &[ScreenedLog] {
        if self.validate.is_empty() { self.train } else { self.validate }
    }
}

/// The answer of a bench as JSON, and its page where one is wanted.
pub type AnswerAndPage = (Value, Option<String>);

/// What an answer is made of, and how a failure is said.
pub struct Writer<'a> {
    /// Answer and page of a bench.
    pub story: &'a dyn Fn(&Diagnosed) -> Result<AnswerAndPage, FleetError>,
    /// Whether a page is written beside each answer.
    pub has_pages: bool,
    /// The sentence of an error.
    pub refusal: &'a dyn Fn(&FleetError) -> String,
}

/// A shard that runs.
struct Work<'a> {
    folder: &'a Path,
    writer: &'a Writer<'a>,
    job: &'a Job<'a>,
    hear: &'a dyn Fn(ShardEvent),
}

/// Diagnoses every bench of a shard whose answer is not in `folder` yet. A bench that fails leaves an answer that says why, and
/// the others go on. Returns how many failed, those of earlier runs with them.
///
/// # Errors
/// [`FleetError`] when the folder cannot be written, or the work is cancelled.
pub fn run(
    plan: &Plan,
    shard: Shard,
    folder: &Path,
    writer: &Writer,
    (job, hear): (&Job, &dyn Fn(ShardEvent)),
) -> Result<usize, FleetError> {
    fs::create_dir_all(folder).map_err(FleetError::file(folder))?;
    let benches = plan.benches.iter().enumerate();
    let mine: Vec<&FleetBench> =
        benches.filter(|(index, _)| shard.holds(*index)).map(|(_, bench)| bench).collect();
    let work = Work { folder, writer, job, hear };
    let mut failed = 0;
    for (index, bench) in mine.iter().enumerate() {
        hear(ShardEvent::Begins { bench: &bench.name, number: index + 1, of: mine.len() });
        failed += usize::from(!work.bench(bench)?);
    }
    Ok(failed)
}

impl Work<'_> {
    /// One bench: whether it has a diagnosis.
    fn bench(&self, bench: &FleetBench) -> Result<bool, FleetError> {
        let unreadable = BenchAnswer::place(self.folder, &bench.name, UNREADABLE);
        let sum = match inputs::hash(bench) {
            Ok(sum) => sum,
            // A log that is not there has no hash: the bench fails under the name of that, until the log is there.
            Err(error @ FleetError::File { .. }) => {
                return self.fails(bench, &unreadable, "", &error.to_string());
            }
            Err(error) => return Err(error),
        };
        remove(&unreadable)?;
        let place = BenchAnswer::place(self.folder, &bench.name, &sum);
        if place.exists() {
            (self.hear)(ShardEvent::Present);
            return Ok(BenchAnswer::load(&place)?.0.error.is_none());
        }
        match self.caught(bench) {
            Ok(Ok((diagnosis, page))) => {
                if let Some(page) = page {
                    let place = place.with_extension("html");
                    write_atomically(&place, page.as_bytes()).map_err(FleetError::file(&place))?;
                }
                // The answer is last: where it is, everything is.
                write(&place, &answer(bench, &sum, None, Some(diagnosis)))?;
                (self.hear)(ShardEvent::Answered);
                Ok(true)
            }
            Ok(Err(FleetError::Session(SessionError::Cancelled(cancelled)))) => Err(cancelled.into()),
            Ok(Err(error)) => self.fails(bench, &place, &sum, &(self.writer.refusal)(&error)),
            Err(panic) => self.fails(bench, &place, &sum, &format!("an error of this program: {panic}")),
        }
    }

    fn fails(&self, bench: &FleetBench, place: &Path, sum: &str, error: &str) -> Result<bool, FleetError> {
        write(place, &answer(bench, sum, Some(error.to_owned()), None))?;
        (self.hear)(ShardEvent::Failed(error));
        Ok(false)
    }

    /// Answer and page, an error, or what a panic said: one bench must not end the shard.
    fn caught(&self, bench: &FleetBench) -> Result<Result<AnswerAndPage, FleetError>, String> {
        catch_unwind(AssertUnwindSafe(|| self.diagnose(bench))).or_else(|panic| {
            if panic.is::<Cancelled>() {
                return Ok(Err(SessionError::Cancelled(Cancelled).into()));
            }
            let text = panic.downcast_ref::<String>().map(String::as_str);
            Err(text
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("no reason given")
                .to_owned())
        })
    }

    fn diagnose(&self, bench: &FleetBench) -> Result<AnswerAndPage, FleetError> {
        let model = session::open_model(&bench.model)?;
        let open = OpenConfig {
            mapping: bench.mapping.clone(),
            rotors: bench.rotors.clone(),
            ..OpenConfig::default()
        };
        let train = session::open_all(&bench.log, &open, self.job)?;
        let validate = session::open_all(&bench.validate, &open, self.job)?;
        let horizon = bench.horizon_s.unwrap_or(DiagnoseConfig::default().horizon);
        let config = DiagnoseConfig { horizon, ..DiagnoseConfig::default() };
        let diagnosis = session::diagnose(&model, &train, &validate, &config, self.job)?;
        let mut diagnosed = Diagnosed {
            bench,
            model: &model,
            train: &train,
            validate: &validate,
            diagnosis: &diagnosis,
            compared: None,
        };
        if self.writer.has_pages {
            let windows = CompareConfig { horizon_s: horizon, ..CompareConfig::default() };
            let shown = diagnosed.shown();
            let compared = session::compare_extension(&model, &diagnosis.model, shown, &windows, self.job)?;
            diagnosed.compared = Some(compared);
        }
        (self.writer.story)(&diagnosed)
    }
}

/// In the name of an answer that no hash can be in.
pub(super) const UNREADABLE: &str = "unreadable";

fn answer(bench: &FleetBench, sum: &str, error: Option<String>, diagnosis: Option<Value>) -> BenchAnswer {
    let names = |paths: &[PathBuf]| paths.iter().map(|path| path.display().to_string()).collect();
    BenchAnswer {
        bench: bench.name.clone(),
        inputs_sha256: sum.to_owned(),
        model: bench.model.display().to_string(),
        log: names(&bench.log),
        validate: names(&bench.validate),
        error,
        diagnosis,
    }
}

fn write(place: &Path, answer: &BenchAnswer) -> Result<(), FleetError> {
    let text = serde_json::to_string_pretty(answer)? + "\n";
    write_atomically(place, text.as_bytes()).map_err(FleetError::file(place))
}

fn remove(place: &Path) -> Result<(), FleetError> {
    match fs::remove_file(place) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(FleetError::file(place)(error)),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_part_a_plan() {
        let shards: Vec<Shard> = (1..=3).map(|number| format!("{number}/3").parse().expect("one")).collect();
        for index in 0..10 {
            assert_eq!(shards.iter().filter(|shard| shard.holds(index)).count(), 1);
        }
        for wrong in ["0/3", "4/3", "3", "a/b", "1/0", "-1/2"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
