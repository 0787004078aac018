//! `rotorbench dronecan`: what a bus that speaks DroneCAN has to say, and what is said to its nodes.

use std::path::PathBuf;

use super::operate::BenchArguments;
use super::{CliResult, Outcome};
use crate::report::dronecan;
use crate::rt::Shutdown;
use crate::session::{self, AllocationTask, ParameterError, ParameterTask};

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
    /// Give node ids to nodes without, until Ctrl-C
    Allocate(Allocate),
    /// Parameters of a node: read, and written while nothing is armed
    Param(Param),
}

/// Which bus, and who asks.
#[derive(Debug, clap::Args)]
struct Asking {
    #[command(flatten)]
    bench: BenchArguments,
    /// Look at this CAN interface, and not at that of the bench file
    #[arg(long, value_name = "IFACE")]
    interface: Option<String>,
    /// Ask as this node; without it as the highest number that nobody on the bus has
    #[arg(long, value_name = "N")]
    node_id: Option<u8>,
}

#[derive(Debug, clap::Args)]
struct List {
    #[command(flatten)]
    asking: Asking,
    /// Listen for this long
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = super::operate::seconds)]
    seconds: f64,
}

#[derive(Debug, clap::Args)]
struct Param {
    /// The node that is asked
    #[arg(value_name = "NODE", value_parser = clap::value_parser!(u8).range(1..=127))]
    node: u8,
    /// This parameter; without it all
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// What it is to be from now on
    #[arg(value_name = "VALUE")]
    value: Option<String>,
    /// Have the node keep its parameters over a restart
    #[arg(long)]
    save: bool,
    #[command(flatten)]
    asking: Asking,
}

#[derive(Debug, clap::Args)]
struct Allocate {
    /// Lowest node id that is given
    #[arg(long, value_name = "N", default_value_t = 100)]
    from: u8,
    /// Highest node id that is given: the first one to be
    #[arg(long, value_name = "N", default_value_t = 125)]
    to: u8,
    /// Remember in this file which node has which id; it is made where there is none
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// End after this many seconds
    #[arg(long, value_name = "S", value_parser = super::operate::seconds)]
    seconds: Option<f64>,
    #[command(flatten)]
    asking: Asking,
}

impl Arguments {
    /// The bench file it was given.
    pub fn bench(&self) -> &BenchArguments {
        match &self.act {
            Act::Allocate(allocate) => &allocate.asking.bench,
            Act::List(list) => &list.asking.bench,
            Act::Param(param) => &param.asking.bench,
        }
    }
}

impl Asking {
    fn interface(&self) -> Result<String, super::CliError> {
        match &self.interface {
            Some(interface) => Ok(interface.clone()),
            None => Ok(self.bench.load()?.bus.interface),
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    match &arguments.act {
        Act::Allocate(arguments) => allocate(arguments),
        Act::List(arguments) => list(arguments),
        Act::Param(arguments) => param(arguments),
    }
}

fn list(List { asking, seconds }: &List) -> CliResult {
    let interface = asking.interface()?;
    let nodes = session::dronecan_nodes(&interface, asking.node_id, *seconds)?;
    if nodes.is_empty() {
        eprintln!("{}", dronecan::nobody(&interface, *seconds));
        return Ok(Outcome::FoundWanting);
    }
    print!("{}", dronecan::nodes(&nodes));
    Ok(Outcome::Done)
}

fn allocate(Allocate { from, to, table, seconds, asking }: &Allocate) -> CliResult {
    let shutdown = Shutdown::listen()?;
    let task = AllocationTask {
        interface: asking.interface()?,
        own: asking.node_id,
        range: (*from, *to),
        table: table.clone(),
        seconds: *seconds,
    };
    session::allocate_node_ids(&task, &|event| println!("{}", dronecan::allocation(event)), &|| {
        shutdown.is_requested()
    })?;
    Ok(Outcome::Done)
}

fn param(Param { node, name, value, save, asking }: &Param) -> CliResult {
    let task = ParameterTask { node: *node, name: name.clone(), value: value.clone(), save: *save };
    let found = session::dronecan_parameters(&asking.interface()?, asking.node_id, &task);
    let parameters = match found {
        Err(silent @ ParameterError::Silent { .. }) => {
            eprintln!("{silent}");
            return Ok(Outcome::FoundWanting);
        }
        found => found?,
    };
    if parameters.is_empty() {
        println!("{}", dronecan::no_parameters(*node));
    } else {
        print!("{}", dronecan::parameters(&parameters));
    }
    if value.is_some() && !save {
        eprintln!("{}", dronecan::NOT_SAVED);
    }
    Ok(Outcome::Done)
}
