//! Node ids for nodes without one, on a bus where nobody else gives them.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use super::dronecan_own_id::own_node_id;
use super::dronecan_wire::{PortWire, Wire};
use super::thresholds::THRESHOLDS;
use crate::can::dronecan::{
    Allocatee, AllocationEvent, AllocationTable, GREATEST_NODE, Keep, NodeIdAllocator, NodeMonitor,
    Participant, UniqueId,
};
use crate::can::{CanError, Frame};
use crate::clock;
use crate::file;

/// The unique id under which it is asked whether there is an allocator; it is never asked to the end.
const PROBE: UniqueId = UniqueId(*b"rotorbench.probe");

/// Who gives which ids on which bus.
#[derive(Debug, Clone, PartialEq)]
pub struct AllocationTask {
    /// CAN interface.
    pub interface: String,
    /// Node id of the allocator; `None` = one that nobody has, and that it does not give.
    pub own: Option<u8>,
    /// Lowest and highest node id that is given.
    pub range: (u8, u8),
    /// File that remembers who has which.
    pub table: Option<PathBuf>,
    /// [s] after which it ends.
    pub seconds: Option<f64>,
}

/// Why node ids cannot be given.
#[derive(Debug, thiserror::Error)]
pub enum AllocateError {
    /// The bus.
    #[error(transparent)]
    Can(#[from] CanError),
    /// The table cannot be read or written.
    #[error("cannot {act} `{file}`")]
    File {
        /// `read` or `write`.
        act: &'static str,
        /// It.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// The table is none.
    #[error("{file}: {reason}")]
    Table {
        /// File name.
        file: String,
        /// What is wrong, and where.
        reason: String,
    },
    /// Somebody else gives node ids on this bus.
    #[error("node {node} gives node ids on this bus already: two allocators would give one id twice")]
    NotAlone {
        /// Who.
        node: u8,
    },
    /// Another node has our number.
    #[error("another node has the number {own}: choose one that nobody has (--node-id)")]
    Taken {
        /// The number.
        own: u8,
    },
}

/// Gives node ids until `is_over`, or for as long as it is wished; `tell` hears of each.
///
/// # Errors
/// [`AllocateError`]; nothing is given where somebody else does.
pub fn allocate_node_ids(
    task: &AllocationTask,
    tell: &dyn Fn(&AllocationEvent),
    is_over: &dyn Fn() -> bool,
) -> Result<(), AllocateError> {
    let table = task.table.as_deref().map_or_else(|| Ok(AllocationTable::new()), read)?;
    let keep: Keep<'_> = match &task.table {
        Some(path) => Box::new(|table| file::write_atomically(path, text(table).as_bytes())),
        None => Box::new(|_| Ok(())),
    };
    if let Some(path) = &task.table {
        let refuse = |source| AllocateError::File { act: "write", file: path.display().to_string(), source };
        file::check_place(path).map_err(refuse)?;
    }
    let mut wire = PortWire::open(&task.interface)?;
    let (from, to) = task.range;
    let is_kept = |id| (from..=to).contains(&id) || table.values().any(|given| *given == id);
    let mut monitor = NodeMonitor::of_allocator(own_node_id(&mut wire, task.own, is_kept)?)?;
    listen(&mut wire, &mut monitor)?;
    let allocator = NodeIdAllocator::new(monitor, task.range, table, keep)?;
    serve(&mut wire, allocator, task.seconds, tell, is_over)
}

/// Hears who is on the bus, and whether somebody gives node ids there.
fn listen(wire: &mut impl Wire, monitor: &mut NodeMonitor) -> Result<(), AllocateError> {
    let mut probe = Probe { monitor, allocatee: Allocatee::new(PROBE, 0)? };
    let until_ns = wire.now_ns().saturating_add(THRESHOLDS.allocator_listens_ns);
    while wire.turn(&mut probe, until_ns)? < until_ns {
        if let Some(node) = probe.allocatee.allocator() {
            return Err(AllocateError::NotAlone { node });
        }
    }
    let own = probe.monitor.own();
    if probe.monitor.nodes().iter().any(|node| node.id == own) {
        return Err(AllocateError::Taken { own });
    }
    Ok(())
}

fn serve(
    wire: &mut impl Wire,
    mut allocator: NodeIdAllocator<'_>,
    seconds: Option<f64>,
    tell: &dyn Fn(&AllocationEvent),
    is_over: &dyn Fn() -> bool,
) -> Result<(), AllocateError> {
    let end_ns = seconds.map_or(u64::MAX, |it| wire.now_ns().saturating_add(clock::span_ns(it)));
    while !is_over() && wire.turn(&mut allocator, end_ns)? < end_ns {
        while let Some(event) = allocator.take_event() {
            if let AllocationEvent::NotAlone { node } = event {
                return Err(AllocateError::NotAlone { node });
            }
            tell(&event);
        }
    }
    Ok(())
}

/// Hears who is there, and asks for a node id to hear whether anybody answers.
struct Probe<'a> {
    monitor: &'a mut NodeMonitor,
    allocatee: Allocatee,
}

impl Participant for Probe<'_> {
    fn receive(&mut self, frame: &Frame, now_ns: u64) {
        self.monitor.receive(frame, now_ns);
        self.allocatee.receive(frame, now_ns);
    }

    fn due_frames(&mut self, now_ns: u64) -> Vec<Frame> {
        let mut frames = self.monitor.due_frames(now_ns);
        // The first part only: whoever answers it is found.
        if self.allocatee.allocator().is_none() {
            frames.extend(self.allocatee.due_frames(now_ns));
        }
        frames
    }
}

/// The table of a file; nothing where there is none.
fn read(path: &Path) -> Result<AllocationTable, AllocateError> {
    let name = || path.display().to_string();
    let text = match file::read_settings_text(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(AllocationTable::new()),
        Err(source) => return Err(AllocateError::File { act: "read", file: name(), source }),
    };
    let refuse = |reason: String| AllocateError::Table { file: name(), reason };
    let lines: BTreeMap<String, u8> =
        toml::from_str(&text).map_err(|error| refuse(file::toml_error(&text, &error)))?;
    let mut table = AllocationTable::new();
    for (key, node_id) in lines {
        let line = text.lines().position(|line| line.trim_start().starts_with(&key)).map_or(1, |at| at + 1);
        let unique_id = UniqueId::parse(&key)
            .ok_or_else(|| refuse(format!("line {line}: a unique id has 32 hexadecimal digits")))?;
        if !(1..=GREATEST_NODE).contains(&node_id) {
            return Err(refuse(format!("line {line}: {node_id} is no node id of 1 to {GREATEST_NODE}")));
        }
        if table.values().any(|known| *known == node_id) {
            return Err(refuse(format!("line {line}: node id {node_id} is there twice")));
        }
        table.insert(unique_id, node_id);
    }
    Ok(table)
}

/// The text of a table.
fn text(table: &AllocationTable) -> String {
    table.iter().map(|(unique_id, node_id)| format!("{unique_id} = {node_id}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_read_as_it_was_written_and_what_is_none_is_refused() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("nodes.toml");
        assert_eq!(read(&path).expect("nothing yet"), AllocationTable::new());
        let table: AllocationTable =
            [(UniqueId([0; 16]), 125), (UniqueId([0xAB; 16]), 1), (UniqueId(*b"rotorbench.bench"), 100)]
                .into();
        std::fs::write(&path, text(&table)).expect("written");
        assert_eq!(read(&path).expect("as written"), table);
        let key = "0".repeat(32);
        for (written, said) in [
            ("# x\nnode = 5".to_owned(), "line 2: a unique id has 32 hexadecimal digits"),
            (format!("{key} = 0"), "line 1: 0 is no node id of 1 to 127"),
            (format!("{key} = 128"), "line 1: 128 is no node id of 1 to 127"),
            (format!("{key} = 5\n{} = 5", "1".repeat(32)), "line 2: node id 5 is there twice"),
            (format!("{key} = \"5\""), "line 1, column 36: invalid type"),
        ] {
            std::fs::write(&path, &written).expect("written");
            let error = read(&path).expect_err(&written).to_string();
            assert!(error.ends_with(said) || error.contains(said), "{error}");
            assert!(error.contains("nodes.toml"), "{error}");
        }
        assert!(matches!(read(directory.path()), Err(AllocateError::File { act: "read", .. })));
    }
}
