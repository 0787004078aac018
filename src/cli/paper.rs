//! `rotorbench paper`: every table and figure of the paper, ours beside the printed one.

use std::path::PathBuf;

use super::{CliError, CliResult, Outcome};
use crate::process::paper;

/// Arguments of `paper`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Seed of the emulated bench's noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Length of the PRBS [s], simulated; the paper's is 2400
    #[arg(long, value_name = "S", default_value_t = 2400.0)]
    prbs_s: f64,
    /// Write the numbers as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Where to write the report
    #[arg(long, value_name = "FILE.html", default_value = "paper.html")]
    report: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    if !(20.0..=86_400.0).contains(&arguments.prbs_s) {
        return Err(CliError::new(format!("--prbs-s must lie in 20..86400, not {}", arguments.prbs_s)));
    }
    let run = paper::run(arguments.seed, arguments.prbs_s)?;
    run.page().save(&arguments.report)?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&run)?);
    } else {
        println!(
            "{}\n{}\n{}",
            run.identified_table().text(),
            run.gain_table().text(),
            run.flight_table().text()
        );
        println!("report: {}", arguments.report.display());
    }
    Ok(Outcome::Done)
}
