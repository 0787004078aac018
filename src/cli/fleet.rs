//! `rotorbench fleet`: many benches, each diagnosed by itself, then put together.

use std::path::{Path, PathBuf};

use super::output::Force;
use super::usage_error::UsageError;
use super::watched::cancellable;
use super::{CliResult, Outcome};
use crate::file::write_atomically;
use crate::fleet::{self, Plan, Shard, ShardEvent, Writer};
use crate::report::{self, json};
use crate::session::Job;

/// Arguments of `fleet`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: FleetCommand,
}

#[derive(Debug, clap::Subcommand)]
enum FleetCommand {
    /// Write a plan of folders, one for each bench
    Plan(PlanArguments),
    /// Diagnose the benches of a plan, or a shard of them
    Run(RunArguments),
    /// Put the answers together: effects, parameters, benches unlike the others
    Merge(MergeArguments),
}

#[derive(Debug, clap::Args)]
struct PlanArguments {
    /// Folders with logs; `*` in the last part of a path stands for any name
    #[arg(required = true, value_name = "FOLDER")]
    folders: Vec<String>,
    /// Write the plan here instead of on standard output
    #[arg(short, long, value_name = "PLAN.toml")]
    output: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

#[derive(Debug, clap::Args)]
struct RunArguments {
    /// Plan: benches with their models and logs (TOML)
    #[arg(value_name = "PLAN.toml")]
    plan: PathBuf,
    /// Only every N-th bench, beginning with the I-th
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: String,
    /// Folder of the answers, the same for all shards
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Write a page beside each answer (HTML)
    #[arg(long)]
    pages: bool,
}

#[derive(Debug, clap::Args)]
struct MergeArguments {
    /// Folder of the answers
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
    /// Count only answers of this plan and of its files as they are now, and say which are missing
    #[arg(long, value_name = "PLAN.toml")]
    plan: Option<PathBuf>,
    /// Answer as JSON on standard output
    #[arg(long)]
    json: bool,
    /// Write a page (HTML); in the folder of the answers it links to the page of each bench
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    force: Force,
}

/// Runs the command: exit 1 when a bench failed or has no answer.
pub fn run(arguments: &Arguments) -> CliResult {
    match &arguments.command {
        FleetCommand::Plan(arguments) => plan(arguments),
        FleetCommand::Run(arguments) => shard(arguments),
        FleetCommand::Merge(arguments) => merge(arguments),
    }
}

fn plan(arguments: &PlanArguments) -> CliResult {
    super::output::writable(&arguments.output, [], arguments.force)?;
    let plan = Plan::of_folders(&arguments.folders)?;
    if let Some(log) = cancellable(|cancel| Ok(plan.foreign_log(&Job::unwatched(cancel))))? {
        eprintln!("{}", report::fleet::foreign_log(log));
    }
    let text = toml::to_string(&plan)?;
    match &arguments.output {
        Some(path) => write_atomically(path, text.as_bytes()).map_err(UsageError::at(path))?,
        None => print!("{text}"),
    }
    Ok(Outcome::Done)
}

fn shard(arguments: &RunArguments) -> CliResult {
    let plan = Plan::load(&arguments.plan)?;
    let shard: Shard = arguments.shard.parse()?;
    let writer = Writer {
        story: &report::fleet::story,
        has_pages: arguments.pages,
        refusal: &|error| report::findings::explained(error),
    };
    let hear = |event: ShardEvent| eprint!("{}", report::fleet::event(event));
    let failed = cancellable(|cancel| {
        let job = Job::unwatched(cancel);
        Ok(fleet::run(&plan, shard, &arguments.output, &writer, (&job, &hear))?)
    })?;
    Ok(if failed == 0 { Outcome::Done } else { Outcome::FoundWanting })
}

fn merge(arguments: &MergeArguments) -> CliResult {
    super::output::writable(&arguments.report, &arguments.plan, arguments.force)?;
    let plan = arguments.plan.as_deref().map(Plan::load).transpose()?;
    let folder: &Path = &arguments.folder;
    let fleet = fleet::merge(folder, plan.as_ref())?;
    if fleet.benches.is_empty() {
        return Err(UsageError::NoFleetAnswer { folder: folder.to_owned() }.into());
    }
    if let Some(path) = &arguments.report {
        report::fleet::page(&fleet).save(path)?;
    }
    if arguments.json {
        println!("{}", json::answer(&json::with_sentences(&fleet, &fleet.findings)?)?);
    } else {
        print!("{}", report::fleet::text(&fleet));
    }
    Ok(if fleet.is_whole() { Outcome::Done } else { Outcome::FoundWanting })
}
