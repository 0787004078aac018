//! `rotorbench dronecan`: what a bus that speaks DroneCAN has to say.

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::report::dronecan;
use crate::session;

/// Arguments of `dronecan`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    act: Act,
}

#[derive(Debug, clap::Subcommand)]
enum Act {
    /// The nodes on the bus: names, versions, health
    List(List),
}

#[derive(Debug, clap::Args)]
struct List {
    #[command(flatten)]
    bench: BenchArguments,
    /// Look at this CAN interface, and not at that of the bench file
    #[arg(long, value_name = "IFACE")]
    interface: Option<String>,
    /// Listen for this long
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = super::operate::seconds)]
    seconds: f64,
    /// Ask as this node
    #[arg(long, value_name = "N", default_value_t = 127)]
    node_id: u8,
}

impl Arguments {
    /// The bench file it was given.
    pub fn bench(&self) -> &BenchArguments {
        let Act::List(list) = &self.act;
        &list.bench
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let Act::List(list) = &arguments.act;
    let interface = match &list.interface {
        Some(interface) => interface.clone(),
        None => list.bench.load()?.bus.interface,
    };
    let nodes = session::dronecan_nodes(&interface, list.node_id, list.seconds)?;
    if nodes.is_empty() {
        eprintln!("{}", dronecan::nobody(&interface, list.seconds));
        return Ok(Outcome::FoundWanting);
    }
    print!("{}", dronecan::nodes(&nodes));
    Ok(Outcome::Done)
}
