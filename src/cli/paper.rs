//! `rotorbench paper`: every table and figure of the paper, ours beside the printed one.

use std::path::PathBuf;

use super::output::{Force, writable};
use super::progress::ProgressLine;
use super::usage_error::UsageError;
use super::{CliResult, Outcome};
use crate::report::findings::step;
use crate::rt::Shutdown;
use crate::studies::paper::{self, PaperError, PaperSettings};

/// Arguments of `paper`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Seed of the emulated bench's noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Length of the PRBS [s], simulated; the paper's is 2400
    #[arg(long, value_name = "S", default_value_t = 2400.0)]
    prbs_s: f64,
    /// Length of each of the six constant commands [s], simulated
    #[arg(long, value_name = "S", default_value_t = 300.0)]
    hold_s: f64,
    #[command(flatten)]
    force: Force,
    /// Write the numbers as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Where to write the report
    #[arg(long, value_name = "FILE.html", default_value = "paper.html")]
    report: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    for (option, value) in [("--prbs-s", arguments.prbs_s), ("--hold-s", arguments.hold_s)] {
        let (low, high) = (20.0, 86_400.0);
        if !(low..=high).contains(&value) {
            return Err(UsageError::Range { option, value, low, high }.into());
        }
    }
    writable([&arguments.report], [], arguments.force)?;
    let settings = PaperSettings { seed: arguments.seed, prbs_s: arguments.prbs_s, hold_s: arguments.hold_s };
    let progress = ProgressLine::start();
    let shutdown = Shutdown::listen()?;
    let run = paper::run(&settings, &shutdown, &mut |what, share| progress.share(step(what), share));
    drop(progress);
    let run = match run {
        Err(PaperError::Interrupted { what, reason }) => {
            eprintln!("{}", crate::report::paper::interrupted(&what, reason));
            return Ok(Outcome::FoundWanting);
        }
        run => run?,
    };
    run.page().save(&arguments.report)?;
    if arguments.json {
        let mut value = serde_json::to_value(&run)?;
        value["identification"] = run.identification.json()?;
        println!("{}", crate::report::json::answer(&value)?);
    } else {
        println!(
            "{}\n{}\n\n{}\n{}\n{}",
            run.identified_table().text(),
            run.remarks().join("\n"),
            run.given_table().text(),
            run.gain_table().text(),
            run.run_table().text()
        );
        println!("report: {}", arguments.report.display());
    }
    Ok(Outcome::Done)
}
