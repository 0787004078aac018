//! `rotorbench check`: resolve and check a bench file: signals, units, bus load.

use std::path::Path;

use super::operate::BenchArguments;
use super::{CliResult, Outcome, output};
use crate::bench::{BenchConfig, BenchError};
use crate::can::protocol;
use crate::model::Model;
use crate::report::check;
use crate::runtime::{controller_plant, emulate, guard};
use crate::session::BenchCheck;

/// Arguments of `check`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Instead: print a commented bench file to start from
    #[arg(long, value_name = "BENCH", num_args = 0..=1, default_missing_value = "bench", conflicts_with_all = ["config", "json"])]
    template: Option<Template>,
    /// Write the result as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// A bench file to start from; the same are in `examples/benches/`.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub(super) enum Template {
    /// The bench that is built in, every usual key with its default
    Bench,
    /// Two VESCs and an IMU
    Vesc,
    /// Two ODrives and an IMU
    Odrive,
    /// Two ESCs, an IMU and a battery on DroneCAN
    Dronecan,
}

impl Template {
    /// The bench that it is.
    pub(super) fn bench(self) -> Result<BenchConfig, BenchError> {
        BenchConfig::parse(self.text(), Path::new("the built-in bench file"))
    }

    fn text(self) -> &'static str {
        match self {
            Self::Bench => include_str!("../../examples/benches/bench.toml"),
            Self::Vesc => include_str!("../../examples/benches/vesc.toml"),
            Self::Odrive => include_str!("../../examples/benches/odrive.toml"),
            Self::Dronecan => include_str!("../../examples/benches/dronecan.toml"),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    if let Some(template) = arguments.template {
        print!("{}", template.text());
        return Ok(Outcome::Done);
    }
    let config = arguments.bench.load()?;
    let spoken = protocol(&config.bus, config.period_s)?;
    let guard = guard::of_bench(&config)?;
    controller_plant::command_source(&config)?;
    let model = Model::load(Path::new(&config.model))?;
    config.real_time.check()?;
    emulate::emulator(&config)?;
    let resolved = BenchCheck::of(&config, &*spoken, (&guard, &model))?;
    output::say(arguments.json, &check::answer(&resolved), || check::text(&resolved))?;
    resolved.caveats.iter().for_each(|it| eprintln!("warning: {}", check::sentence(it)));
    resolved.obstacles.iter().for_each(|it| eprintln!("found wanting: {}", check::sentence(it)));
    Ok(if resolved.obstacles.is_empty() { Outcome::Done } else { Outcome::FoundWanting })
}
