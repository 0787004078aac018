//! Where a model fails: each block by itself, driven by *measured* inputs, so that one block's error does not
//! hide in the next; then the whole chain.
//!
//! | block | driven by | answers | how |
//! |---|---|---|---|
//! | `actuator_1`, `actuator_2`, ... | command, battery | rotor rate | free run |
//! | `thrust_1`, `thrust_2`, ... | measured rotor rate | thrust | at each sample |
//! | `body` | measured rotor rates, or the torque command | body rate, angle | windows of a horizon |
//! | `sensors` | measured angle | body rate | at each sample, smoothed |
//! | `chain` | commands, battery | body rate, angle | windows of a horizon |
//!
//! The body is unstable by itself, so it is run over windows, each started at the measured state. One step
//! ahead is given beside it as a diagnostic only: it ranks models wrongly where the noise is white.
//!
//! A program that asks for it: `examples/compare.rs`.

mod block_run;
mod blocks;
mod body_drive;
mod body_windows;
mod config;
mod dependence;
mod error;
mod gyro_block;
mod noise;
mod regimes;
mod related_rows;
mod run;
mod score;
mod spectrum;
pub mod thresholds;
mod trace;
mod unknown_torque;

use block_run::BlockRun;
use dependence::relations;
use noise::{Noise, SignalNoise};
use related_rows::Related;
use thresholds::THRESHOLDS;

use serde::Serialize;

use crate::cancel;
use crate::identify;
use crate::log::{Dataset, DatasetError};
use crate::model::{Model, UndefinedRow};
use crate::screening::Finding;
use crate::screening::ScreenedLog;
use crate::screening::requirements::{check_magnitudes, check_runs};
use crate::threads::both;

pub use config::CompareConfig;
pub use dependence::{Correlation, Dependence, Direction, Regressor};
pub use error::CompareError;
pub use regimes::{Failure, Regime};
pub use run::RunMode;
pub use score::{ErrorStatistics, ScoredBlock};
pub use spectrum::Spectrum;
pub use trace::{SampleRows, Trace};
pub use unknown_torque::UnknownTorque;

/// One model on one log.
///
/// Made by [`crate::session::compare`]; `examples/compare.rs` prints one.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// Name of the model.
    pub model: String,
    /// Ids of its effects.
    pub effects: Vec<String>,
    /// The log.
    pub log: String,
    /// Blocks that could be compared, upstream first.
    pub blocks: Vec<ScoredBlock>,
    /// What torque the model lacks, over time; where a body rate was measured.
    pub unknown_torque: Option<UnknownTorque>,
    /// Cells of the log that are no measurements, and were taken as missing; rows of its rotors that are not scored.
    pub findings: Vec<Finding>,
    /// Columns of the log that can hardly be what their names say, or are of another rotor than the first model's.
    pub mistaken_columns: Vec<Finding>,
}

impl Comparison {
    /// The block whose error stands highest over its noise floor. The whole chain is no block of its own.
    #[must_use]
    pub fn worst(&self) -> Option<&ScoredBlock> {
        let single = self.blocks.iter().filter(|block| block.name != "chain");
        single.max_by(|a, b| a.error.over_floor().total_cmp(&b.error.over_floor()))
    }

    /// The log with what the model says beside it: `modelled_<block>_<signal>`, and the unknown torque.
    ///
    /// # Errors
    /// [`DatasetError`] when the log has columns of these names already.
    pub fn signals(&self, log: &Dataset) -> Result<Dataset, DatasetError> {
        let mut out = log.clone();
        let spread = |rows: &SampleRows, values: &[f64]| {
            let mut column = vec![f64::NAN; log.len()];
            for (row, value) in rows.iter().zip(values) {
                if let Some(cell) = column.get_mut(row) {
                    *cell = *value;
                }
            }
            column
        };
        for block in &self.blocks {
            let name = format!("modelled_{}_{}", block.name, block.signal);
            out.insert(name, spread(block.trace.rows(), block.trace.modelled()))?;
        }
        if let Some(torque) = &self.unknown_torque {
            out.insert("unknown_torque_nm", spread(&torque.rows, &torque.torque))?;
            out.insert("unknown_torque_error_nm", spread(&torque.rows, &torque.standard_error))?;
        }
        Ok(out)
    }

    /// Whether every block is at its noise floor.
    #[must_use]
    pub fn is_adequate(&self) -> bool {
        self.blocks.iter().all(|block| block.error.is_noise())
    }
}

/// Whether some model of each log is at its noise floor; `found` has the models of a log together.
#[must_use]
pub fn is_adequate(found: &[Vec<Comparison>]) -> bool {
    found.iter().all(|models| models.iter().any(Comparison::is_adequate))
}

/// Compares every model with one log. The noise of each sensor is estimated once, from what no model and no
/// smooth curve explains, so that the models are compared with the same floor.
///
/// # Errors
/// [`CompareError`] when the log is too short, or nothing in it can be compared.
pub fn compare(
    models: &[Model],
    log: &ScreenedLog,
    config: &CompareConfig,
) -> Result<Vec<Comparison>, CompareError> {
    if !CompareConfig::HORIZONS_S.contains(&config.horizon_s) {
        return Err(CompareError::Horizon(config.horizon_s));
    }
    check_runs(log)?;
    let samples = log.raw().len();
    if samples < THRESHOLDS.fewest_samples {
        return Err(CompareError::TooShort {
            log: log.source_name().to_owned(),
            samples,
            needed: THRESHOLDS.fewest_samples,
        });
    }
    check_magnitudes(log)?;
    let runs = models.iter().map(|model| run(model, log, config)).collect::<Result<Vec<_>, _>>()?;
    if runs.iter().all(Vec::is_empty) {
        return Err(log.nothing_scored().into());
    }
    // Findings, nothing is refused: a comparison may be what somebody looks at to find that out.
    let beside = |model| identify::mistaken_and_lacking(std::slice::from_ref(log), model);
    let (shown, [mistaken, lacking]) =
        both(|| SignalNoise::of(log.dataset()), || models.first().map(beside).unwrap_or_default());
    let noise = Noise::estimate(log.dataset(), &shown, &runs);
    let of_log = log.findings().filter(|it| !mistaken.contains(it));
    let warnings: Vec<Finding> = of_log.chain(&lacking).cloned().collect();
    let mut comparisons = Vec::new();
    for (model, run) in models.iter().zip(runs) {
        cancel::check();
        let Scored { blocks, unknown_torque, rows_related } = scored(run, model, log, &noise, config)?;
        let on_part = rows_related.map(|rows| related_on_part(log, rows));
        comparisons.push(Comparison {
            model: model.name.clone(),
            effects: model.effects.iter().map(|added| added.id.clone()).collect(),
            log: log.source_name().to_owned(),
            blocks,
            unknown_torque,
            findings: warnings.iter().cloned().chain(on_part).collect(),
            mistaken_columns: mistaken.clone(),
        });
    }
    Ok(comparisons)
}

/// What is said where not all rows of a long log were asked what the errors have to do with its channels.
fn related_on_part(log: &ScreenedLog, rows: usize) -> Finding {
    let found = Finding::new("related_on_part", "").of(log.source_name()).rows(rows);
    let found = found.with("rows_related", rows).with("rows_scored", log.raw().len());
    found.with("stretches", THRESHOLDS.related_stretches)
}

/// The scores of a model's blocks, and the torque that it lacks.
struct Scored {
    blocks: Vec<ScoredBlock>,
    unknown_torque: Option<UnknownTorque>,
    /// How many rows were asked what an error has to do with the channels, where that was not all.
    rows_related: Option<usize>,
}

fn scored(
    runs: Vec<BlockRun>,
    model: &Model,
    screened: &ScreenedLog,
    noise: &Noise,
    config: &CompareConfig,
) -> Result<Scored, CompareError> {
    let log = screened.dataset();
    // One run after the other, each let go of before the next: of a long log all of them fill the memory.
    let score = || -> (Vec<ScoredBlock>, Vec<Related>) {
        runs.into_iter().map(|run| run.score(model, log, noise, config)).unzip()
    };
    let ((mut blocks, related), unknown_torque) =
        both(score, || unknown_torque::estimate(model, screened, noise));
    let mut unknown_torque = unknown_torque?;
    let of_torque =
        unknown_torque.as_ref().map(|torque| Related::of(&torque.parts, torque.torque[..].into()));
    let mut errors: Vec<&Related> = related.iter().collect();
    if let Some(of_torque) = &of_torque {
        // What the body lacks is a torque; its dependences are clearer than those of an integrated error.
        let of_body = errors.iter_mut().zip(&blocks).filter(|(_, block)| block.name == "body");
        of_body.for_each(|(error, _)| *error = of_torque);
        errors.push(of_torque);
    }
    let relations = relations(log, &errors, log.median_interval());
    if let (Some(torque), Some(of_torque)) = (&mut unknown_torque, relations.get(blocks.len())) {
        torque.dependences = of_torque.dependences.clone();
        torque.keep(config);
    }
    for (block, relations) in blocks.iter_mut().zip(relations) {
        block.failure.dependences = relations.dependences;
        block.failure.correlations = relations.correlations;
    }
    let rows_related = errors.iter().filter(|it| it.is_part()).map(|it| it.samples()).max();
    Ok(Scored { blocks, unknown_torque, rows_related })
}

/// Runs the blocks of a model, after its expressions were found to be defined on every row.
fn run(model: &Model, log: &ScreenedLog, config: &CompareConfig) -> Result<Vec<BlockRun>, CompareError> {
    cancel::check();
    let added: Vec<_> =
        model.effects.iter().map(|added| model.effect(&added.id)).collect::<Result<_, _>>()?;
    let data = log.dataset();
    let undefined = model.first_undefined_row(&added, data.time(), &|name| data.column(name))?;
    if let Some(UndefinedRow { effect, time, signals }) = undefined {
        let (model, log) = (model.name.clone(), log.source_name().to_owned());
        return Err(CompareError::NotANumber { model, effect, log, time, signals });
    }
    blocks::blocks(model, log, config)
}
