//! What `arm`, `disarm` and `stop` have in common.

use std::path::PathBuf;

use super::{CliResult, Outcome};
use crate::bench::{BenchConfig, BenchError};
use crate::guard::{OperatorAct, State};
use crate::runtime::operator;

/// Which bench.
#[derive(Debug, clap::Args)]
pub struct BenchArguments {
    /// Bench file; without one, the bench that is built in
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
}

impl BenchArguments {
    /// The bench file, read and checked.
    ///
    /// # Errors
    /// [`BenchError`] with the place.
    pub fn load(&self) -> Result<BenchConfig, BenchError> {
        BenchConfig::load(self.config.as_deref())
    }
}

/// How a process that drives a bus begins and ends.
#[derive(Debug, clap::Args)]
pub struct ArmAndEnd {
    /// Arm as soon as the checks pass; on a virtual interface only, for scripted runs on the emulator
    #[arg(long)]
    pub(super) arm: bool,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub(super) seconds: Option<f64>,
}

/// [s] of `--seconds`.
///
/// # Errors
/// What it has to be.
pub fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|seconds: &f64| seconds.is_finite() && *seconds > 0.0);
    number.ok_or_else(|| "it must be a positive number".to_owned())
}

/// Asks, and says what came of it.
pub fn run(bench: &BenchArguments, act: OperatorAct) -> CliResult {
    let answer = operator::act(&bench.load()?, act)?;
    crate::report::guard::heard(&answer).iter().for_each(|line| eprintln!("{line}"));
    println!("{}", crate::report::guard::state(&answer));
    let is_latched = matches!(answer.state, State::FailsafeLatched | State::EmergencyStop);
    if is_latched && !answer.obeyed && act == OperatorAct::Arm {
        eprintln!("{}", crate::report::guard::LATCHED);
    }
    Ok(if answer.obeyed { Outcome::Done } else { Outcome::FoundWanting })
}
