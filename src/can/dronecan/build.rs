//! From the `[bus]` table to a bench on DroneCAN, and what that is to the rest of the program.

use crate::can::config::BusConfig;
use crate::can::error::CanError;
use crate::can::load::BusLoad;
use crate::can::protocol::{BenchEnd, BridgeEnd, MessageDescription, Protocol};
use crate::can::resolve::{check_interface, fail};
use crate::can::thresholds::THRESHOLDS;

use super::assembler::Subscription;
use super::bench::DronecanBenchEnd;
use super::bridge::Bridge;
use super::bus::{Commanding, DronecanBus};
use super::common::{Common, name};
use super::config::{CommandKind, DsdlConfig};
use super::describe::{descriptions, load};
use super::join::unique_id;
use super::library::{Definition, Library};
use super::place::BitPlace;
use super::received::receive;
use super::transfer::{Framing, GREATEST_NODE, TransferKind};

/// Index of the last ESC that a command reaches.
const LAST_ESC: u8 = 19;

impl Protocol for DronecanBus {
    fn bridge_end(&self) -> Box<dyn BridgeEnd> {
        Box::new(Bridge::new(self))
    }

    fn bench_end(&self, now_ns: u64) -> Box<dyn BenchEnd> {
        Box::new(DronecanBenchEnd::new(self, now_ns))
    }

    fn bench_end_without_ids(&self, now_ns: u64) -> Option<Box<dyn BenchEnd>> {
        Some(Box::new(DronecanBenchEnd::asking(self, now_ns)))
    }

    fn messages(&self) -> Vec<MessageDescription> {
        descriptions(self)
    }

    fn load(&self, config: &BusConfig) -> BusLoad {
        load(self, config)
    }
}

impl DronecanBus {
    /// Reads the files of DSDL and finds every number that the roles name.
    ///
    /// # Errors
    /// [`CanError::Read`] and [`CanError::Database`] for a file, [`CanError::Role`] for a role that cannot be filled, and
    /// [`CanError::Overload`] when the frames cannot all be on the bus.
    pub fn build(config: &BusConfig, period_s: f64) -> Result<Self, CanError> {
        check_interface(config)?;
        let own = &config.dronecan;
        check_table(config)?;
        let definitions = own.dsdl.iter().map(read_definition).collect::<Result<Vec<_>, _>>()?;
        let library = Library::build(&definitions)?;
        let raw = commanding(&library, CommandKind::Raw, config)?;
        let rpm = commanding(&library, CommandKind::Rpm, config)?;
        let (command, other_command) = if own.command == CommandKind::Raw { (raw, rpm) } else { (rpm, raw) };
        let received = receive(config, &library, period_s)?;
        let bus = Self {
            framing: Framing::of_bus(config.fd),
            // Nobody's, until an allocator has given one: what is said before is left unsaid.
            node_id: own.node_id.number().unwrap_or(0),
            unique_id: unique_id(config),
            esc_index: own.esc_index,
            command,
            other_command,
            received,
            common: Common::build(&library)?,
            period_s,
        };
        let percent = load(&bus, config).percent;
        if percent > THRESHOLDS.maximum_percent {
            return Err(CanError::Overload { percent, limit: THRESHOLDS.maximum_percent });
        }
        Ok(bus)
    }
}

fn check_table(config: &BusConfig) -> Result<(), CanError> {
    let own = &config.dronecan;
    let default = BusConfig::default();
    if config.database != default.database {
        return Err(fail("database", "DBC files say nothing of DroneCAN: see bus.dronecan.dsdl".to_owned()));
    }
    if config.commands != default.commands {
        return Err(fail("commands", "the commands of DroneCAN are said in bus.dronecan".to_owned()));
    }
    if let Some(number) = own.node_id.number().filter(|it| !(1..=GREATEST_NODE).contains(it)) {
        let reason = format!("{number} is no node id of 1 to {GREATEST_NODE}");
        return Err(fail("dronecan.node_id", reason));
    }
    if own.esc_index[0] == own.esc_index[1] || own.esc_index.iter().any(|index| *index > LAST_ESC) {
        let reason = format!("two different indices of 0 to {LAST_ESC} are needed");
        return Err(fail("dronecan.esc_index", reason));
    }
    if !(1..=8191).contains(&own.raw_maximum) {
        return Err(fail("dronecan.raw_maximum", format!("{} is not in 1..8191", own.raw_maximum)));
    }
    match (own.command, own.rpm_maximum) {
        (CommandKind::Rpm, None) => {
            let reason = "a command in rpm needs the speed that a command of 1 stands for".to_owned();
            Err(fail("dronecan.rpm_maximum", reason))
        }
        (_, Some(rpm)) if !(1..=131_071).contains(&rpm) => {
            Err(fail("dronecan.rpm_maximum", format!("{rpm} is not in 1..131071")))
        }
        _ => Ok(()),
    }
}

fn read_definition(config: &DsdlConfig) -> Result<Definition, CanError> {
    Definition::new(&config.file, &config.namespace, config.text()?)
}

/// A command message, long enough for both rotors.
fn commanding(library: &Library, kind: CommandKind, config: &BusConfig) -> Result<Commanding, CanError> {
    let own = &config.dronecan;
    let (type_name, field, unit, full) = match kind {
        CommandKind::Raw => (name::RAW_COMMAND, "cmd", "", f64::from(own.raw_maximum)),
        CommandKind::Rpm => (name::RPM_COMMAND, "rpm", "rpm", f64::from(own.rpm_maximum.unwrap_or(1))),
    };
    let missing = || fail("dronecan", format!("no type `{type_name}`"));
    let compound = library.get(type_name).ok_or_else(missing)?;
    let (message, type_id) = compound.message().zip(compound.id).ok_or_else(missing)?;
    let place = |index: u8| {
        BitPlace::find(message, &format!("{field}[{index}]"))
            .map_err(|reason| fail("dronecan.esc_index", reason))
    };
    let rotors = [place(own.esc_index[0])?, place(own.esc_index[1])?];
    let length =
        rotors.iter().map(|place| place.end(Framing::of_bus(config.fd))).max().unwrap_or(0).div_ceil(8);
    let subscription =
        Subscription::new(type_id, TransferKind::Message, compound.signature, message.most_bits());
    let first = place(0)?;
    Ok(Commanding { name: type_name, field, unit, full, rotors, first, length, type_id, subscription })
}
