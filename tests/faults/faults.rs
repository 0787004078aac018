//! The fault campaign in lockstep: each fault of the matrix, drawn from a seed, on the bench over a bus in memory.
//!
//! `faults table [--seed N]` prints the matrix, which `tools/faults` writes into docs/evidence/faults.md, `faults row NAME --seed N`
//! shows one run, `faults check` runs thousands. Its tests hold every promise over every run, and the page's table against what its seed gives.

mod bench;
mod bus;
mod disk;
mod fault;
mod injector;
mod nodes;
mod outcome;
mod table;
#[cfg(test)]
mod tests;

use std::error::Error;
use std::process::ExitCode;

use clap::Parser;

use table::{RATES, SEED};

#[derive(Parser)]
enum CommandLine {
    /// Print the matrix as Markdown
    Table {
        /// First seed
        #[arg(long, default_value_t = SEED)]
        seed: u64,
    },
    /// Fly every row with many more seeds, and say only what was broken
    Check {
        /// First seed
        #[arg(long, default_value_t = 1000)]
        seed: u64,
        /// Draws of each row at each rate
        #[arg(long, default_value_t = 200)]
        draws: u64,
    },
    /// Fly one row and say what came of it
    Row {
        /// Beginning of its name
        name: String,
        /// Seed of the run
        #[arg(long, default_value_t = SEED)]
        seed: u64,
    },
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let mut broken = 0;
    match CommandLine::parse() {
        CommandLine::Table { seed } => {
            let matrix = table::matrix(seed);
            println!("{}", table::markdown(&matrix));
            for runs in &matrix {
                for what in runs.outcomes.iter().flatten().flat_map(|outcome| &outcome.broken) {
                    eprintln!("{}: {what}", runs.row.name);
                    broken += 1;
                }
            }
        }
        CommandLine::Check { seed, draws } => {
            let (runs, found) = table::check(seed, draws);
            found.iter().for_each(|what| eprintln!("{what}"));
            println!("{runs} runs of {} rows from seed {seed}: {} broken", fault::ROWS.len(), found.len());
            broken = found.len();
        }
        CommandLine::Row { name, seed } => {
            let row = fault::ROWS.iter().find(|row| row.name.starts_with(&name));
            let row = row.ok_or_else(|| format!("no row begins with `{name}`"))?;
            for (rate_hz, _) in RATES {
                println!(
                    "{} at {rate_hz} Hz, seed {seed}: {:#?}",
                    row.name,
                    bench::run_row(row, rate_hz, seed)
                );
            }
        }
    }
    Ok(if broken == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
