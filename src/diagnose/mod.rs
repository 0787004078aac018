//! Which physical effect a model is missing: the search, the verdict, and the model extended by it.
//!
//! Ten lines that ask for it stand on the [front page](crate#a-first-result); a program that extends, too: `examples/diagnose.rs`.

pub(crate) mod assemble;
mod backward;
mod battery_permutation;
mod beside_answer;
pub mod block_builder;
mod block_context;
pub mod block_data;
mod blocks;
pub mod body_block;
pub mod candidate;
pub mod candidate_fit;
pub mod candidate_set;
mod caveats;
mod config;
mod curve_caveat;
pub mod data_split;
pub mod diagnosis;
mod directions;
mod driven_body;
pub mod driver_inference;
mod error;
mod extend;
mod followed_cost;
mod forward;
mod grid_constraint;
mod grid_cost;
mod grid_fit;
mod grid_held_out;
mod grid_refine;
mod grid_search;
mod gyro_and_angle;
mod joint_scan;
mod looks;
pub(crate) mod model_selection;
mod model_uncertainty;
pub mod multistart;
pub mod not_named;
pub mod parallel;
mod parameter_selection;
mod pooled_logs;
pub mod problem;
mod progress;
mod refit;
pub mod refusal;
mod residual_evidence;
mod rest_of_body;
mod reweigh;
pub mod rotor_block;
mod rotors;
pub mod search;
pub mod search_result;
pub mod search_space;
mod stretches;
pub mod surrogate_test;
#[cfg(test)]
pub(crate) mod tests;
pub mod thresholds;
mod torque_beside;
mod two_for_one;
mod unknown_size;
mod unnamed;
pub(crate) mod verdict;
mod whole_steps;
mod wider;

use block_builder::eligible;
use blocks::Blocks;
use candidate_fit::CandidateFit;
use data_split::DataSplit;
use refit::Near;
use search_result::SearchResult;
use search_space::Search;
use stretches::Stretches;

use crate::identify;
use crate::model::{Effect, Model, UndefinedRow};
use crate::screening::ScreenedLog;
use crate::screening::requirements::{check_magnitudes, repeated};

pub use config::DiagnoseConfig;
pub use diagnosis::{Diagnosis, Verdict};
pub use error::DiagnoseError;
pub(crate) use extend::step;
pub use extend::{Extension, extend};
pub use progress::SearchEvent;
pub use rotors::{CommonNumber, RotorDiagnoses, RotorDiagnosis};

/// Finds what the model is missing; `progress` hears how far the search is.
///
/// # Errors
/// [`DiagnoseError`] when model and logs do not meet.
pub fn diagnose(
    model: &Model,
    train: &[ScreenedLog],
    validate: &[ScreenedLog],
    config: &DiagnoseConfig,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Result<Diagnosis, DiagnoseError> {
    Ok(search_blocks(model, (train, validate), config, progress, false)?.diagnosis)
}

/// A diagnosis with the data that were searched, block by block, and what was found there: for whoever goes on with what no
/// effect explains. Of long logs these are the stretches that the search saw.
pub(crate) struct SearchedBlocks {
    pub(crate) diagnosis: Diagnosis,
    pub(crate) found: Vec<SearchResult>,
    pub(crate) verdicts: Vec<Verdict>,
}

/// As [`diagnose`], with its blocks.
///
/// # Errors
/// [`DiagnoseError`] when model and logs do not meet.
pub(crate) fn diagnose_blocks(
    model: &Model,
    logs: (&[ScreenedLog], &[ScreenedLog]),
    config: &DiagnoseConfig,
    progress: &(dyn Fn(SearchEvent) + Sync),
) -> Result<SearchedBlocks, DiagnoseError> {
    search_blocks(model, logs, config, progress, true)
}

fn search_blocks(
    model: &Model,
    (train, validate): (&[ScreenedLog], &[ScreenedLog]),
    config: &DiagnoseConfig,
    progress: &(dyn Fn(SearchEvent) + Sync),
    keeps_blocks: bool,
) -> Result<SearchedBlocks, DiagnoseError> {
    let known = model.known_effects()?;
    let logs = [train, validate].concat();
    check_logs(model, &known, &logs)?;
    let findings = identify::check_columns(&logs, model)?;
    let part = Stretches::of(train, validate, config.searched_rows);
    let seen = part.as_ref().map(|part| [&part.train[..], &part.validate[..]].concat());
    let seen = seen.as_ref().unwrap_or(&logs);
    pooled_logs::check(model, &known, seen, config.horizon)?;
    let task = DiagnosisTask { model, known: &known, logs: &logs, config, progress, keeps_blocks };
    let (mut diagnosis, blocks) = match &part {
        None => task.answer(task.searched(train, validate)?, &logs),
        Some(part) => task.on_stretches(part, seen, (train, validate))?,
    };
    let said = repeated(train, validate).into_iter().chain(findings);
    let said = said.chain(caveats::seen_by_base(model, train, validate));
    diagnosis.findings.splice(0..0, said);
    Ok(SearchedBlocks { diagnosis, found: blocks.found, verdicts: blocks.verdicts })
}

/// What is asked.
struct DiagnosisTask<'a> {
    model: &'a Model,
    known: &'a [Effect],
    /// All of them: what they lack is not tried.
    logs: &'a [ScreenedLog],
    config: &'a DiagnoseConfig,
    progress: &'a (dyn Fn(SearchEvent) + Sync),
    /// Whether somebody goes on with the stretches that were searched.
    keeps_blocks: bool,
}

impl<'a> DiagnosisTask<'a> {
    /// A search in which nothing is eligible: it fits what it is given.
    fn fits(&self) -> Search<'a> {
        Search { base: self.model, known: self.known, eligible: Vec::new(), progress: self.progress }
    }

    /// A search among the effects that this block and the logs can show.
    fn among_eligible(&self, split: &DataSplit) -> Search<'a> {
        let eligible = eligible((self.known, self.model), split, self.logs);
        Search { eligible, ..self.fits() }
    }

    fn search(&self, split: DataSplit) -> SearchResult {
        self.among_eligible(&split).run(split)
    }

    /// The blocks of these logs, each looked into by `find`.
    fn blocks(
        &self,
        (train, validate): (&[ScreenedLog], &[ScreenedLog]),
        find: &dyn Fn(DataSplit) -> SearchResult,
    ) -> Result<Blocks, DiagnoseError> {
        let select_parameters = |found: &SearchResult, fitted: &CandidateFit| {
            self.fits().select_parameters(&found.split, &found.nominal, &found.refitted, fitted)
        };
        let refit = |split: DataSplit, effects: &[String]| self.fits().refit(split, effects);
        Blocks::build(self.model, train, validate, self.config, (find, &refit), &select_parameters)
    }

    /// The blocks of these logs, searched.
    fn searched(&self, train: &[ScreenedLog], validate: &[ScreenedLog]) -> Result<Blocks, DiagnoseError> {
        self.blocks((train, validate), &|split| self.search(split))
    }

    fn answer(&self, mut blocks: Blocks, logs: &[ScreenedLog]) -> (Diagnosis, Blocks) {
        for found in &mut blocks.found {
            self.among_eligible(&found.split).allow_for_what_is_missing(found);
        }
        self.take_back(&mut blocks);
        let found = (&blocks.found[..], &blocks.verdicts[..]);
        (assemble::conclude(self.model, self.known, found, logs, self.config), blocks)
    }

    /// Takes back what could be none. Of rotors that drive a body this may be what only the body shows; and of a set that was not searched
    /// for on these rows nobody knows whether another does as well.
    fn take_back(&self, blocks: &mut Blocks) {
        let [found] = &mut blocks.found[..] else { return };
        if found.singles.is_empty() || !unknown_size::is_nothing(found) {
            return;
        }
        let (split, nominal, refitted) = (&found.split, &found.nominal, &found.refitted);
        let base = self.fits().select_parameters(split, nominal, refitted, refitted);
        unknown_size::withdraw(found, base);
        blocks.verdicts = blocks.found.iter().map(verdict::verdict).collect();
    }

    /// Searched on a part of the logs, `seen`, and fitted and judged on all their rows.
    fn on_stretches(
        &self,
        part: &Stretches,
        seen: &[ScreenedLog],
        logs: (&[ScreenedLog], &[ScreenedLog]),
    ) -> Result<(Diagnosis, Blocks), DiagnoseError> {
        let (of_part, mut blocks) = self.answer(self.searched(&part.train, &part.validate)?, seen);
        let near = Near::of(&blocks.found);
        if !self.keeps_blocks {
            // What it holds of each row is not needed beside that of all rows.
            blocks = Blocks { found: Vec::new(), verdicts: Vec::new() };
        }
        let find = |split: DataSplit| {
            let acts_here = |id: &&String| self.known.iter().any(|it| it.id == **id && split.holds(it));
            let inside: Vec<String> = of_part.effects.iter().filter(acts_here).cloned().collect();
            self.fits().refit_near(split, &inside, &near)
        };
        let (whole, _) = self.answer(self.blocks(logs, &find)?, self.logs);
        Ok((whole.searched_on(of_part, part.findings.clone()), blocks))
    }
}

/// Refuses logs and expressions that no fit can start from.
pub(crate) fn check_logs(
    model: &Model,
    effects: &[Effect],
    logs: &[ScreenedLog],
) -> Result<(), DiagnoseError> {
    for log in logs {
        check_magnitudes(log)?;
        let log = log.dataset();
        let undefined = model.first_undefined_row(effects, log.time(), &|name| log.column(name))?;
        if let Some(UndefinedRow { effect, time, signals }) = undefined {
            return Err(DiagnoseError::NotANumber {
                effect,
                log: log.source_name().to_owned(),
                time,
                signals,
            });
        }
    }
    Ok(())
}
