//! `rotorbench doctor`: what this machine can and cannot do, and the command that mends it.

use std::path::PathBuf;

use serde::Serialize;

use super::{CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::shm;

mod bus;
mod machine;

/// Arguments of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Bench file: its interface and what it left; without one, the built-in bench's interface and what any bench left
    #[arg(long, value_name = "FILE")]
    pub(super) config: Option<PathBuf>,
    /// Remove what dead benches left in shared memory
    #[arg(long)]
    fix: bool,
    /// Findings as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// How bad a finding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Grade {
    /// As it should be, or nothing that matters.
    Good,
    /// It works, less well than it could.
    Warning,
    /// Something of the program cannot work.
    Bad,
    /// It was bad, and has been mended just now.
    Mended,
}

/// One thing looked at.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    check: &'static str,
    grade: Grade,
    /// What was found, and what it means.
    found: String,
    /// The one command that mends it.
    #[serde(skip_serializing_if = "Option::is_none")]
    mend: Option<String>,
}

impl Finding {
    fn good(check: &'static str, found: impl Into<String>) -> Self {
        Self { check, grade: Grade::Good, found: found.into(), mend: None }
    }

    fn warning(check: &'static str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { check, grade: Grade::Warning, found: found.into(), mend: Some(mend.into()) }
    }

    fn bad(check: &'static str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { check, grade: Grade::Bad, found: found.into(), mend: Some(mend.into()) }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = BenchConfig::load(arguments.config.as_deref())?;
    let mut findings = machine::versions();
    findings.extend(bus::findings(&config.bus));
    findings.extend(machine::findings(&config));
    let only = arguments.config.as_ref().map(|_| config.name.as_str());
    findings.extend(leftovers(only, arguments.fix));
    if arguments.json {
        println!("{}", crate::report::json::answer(&findings)?);
    } else {
        for finding in &findings {
            let mark = match finding.grade {
                Grade::Good => "ok  ",
                Grade::Warning => "warn",
                Grade::Bad => "BAD ",
                Grade::Mended => "done",
            };
            println!("{mark} {:<22}{}", finding.check, finding.found);
            if let Some(mend) = &finding.mend {
                println!("     {:<22}→ {mend}", "");
            }
        }
    }
    let wanting = findings.iter().any(|it| matches!(it.grade, Grade::Warning | Grade::Bad));
    Ok(if wanting { Outcome::FoundWanting } else { Outcome::Done })
}

/// Benches that nobody is on any more.
fn leftovers(only: Option<&str>, fix: bool) -> Vec<Finding> {
    const CHECK: &str = "dead benches";
    let mut left = shm::leftovers();
    left.retain(|it| only.is_none_or(|only| it.bench == only));
    if left.is_empty() {
        return vec![Finding::good(CHECK, "none has left anything in shared memory")];
    }
    let describe = |it: &shm::Leftover| {
        format!("bench `{}` has no process and left {} files, {} kB", it.bench, it.files, it.bytes / 1024)
    };
    let tell = |it: &shm::Leftover| {
        if !fix {
            return Finding::warning(CHECK, describe(it), "rotorbench doctor --fix");
        }
        match it.remove() {
            Ok(_) => Finding { grade: Grade::Mended, ..Finding::good(CHECK, describe(it) + ": removed") },
            Err(error) => {
                Finding::bad(CHECK, format!("{}: {error}", describe(it)), "sudo rotorbench doctor --fix")
            }
        }
    };
    left.iter().map(tell).collect()
}
