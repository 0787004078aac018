//! The `[bus.dronecan]` table of the bench file, as people write it.

use std::fs::File;
use std::io::Read;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::can::error::CanError;
use crate::signal::ROTORS;

/// Greatest size of a file of DSDL [byte].
const LARGEST_FILE: u64 = 1 << 20;

/// Word for a node id that an allocator gives.
const DYNAMIC: &str = "dynamic";

/// Which message carries the commands.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CommandKind {
    /// `uavcan.equipment.esc.RawCommand`: a share of what the ESC can do.
    #[default]
    Raw,
    /// `uavcan.equipment.esc.RPMCommand`: a speed, which the ESC holds.
    Rpm,
}

/// The number of a node of ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeId {
    /// This one.
    Fixed(u8),
    /// One that an allocator gives; it has given none yet.
    Dynamic,
    /// The one that it gave.
    Allocated(u8),
}

impl NodeId {
    /// The number, if there is one.
    #[must_use]
    pub fn number(self) -> Option<u8> {
        match self {
            Self::Fixed(number) | Self::Allocated(number) => Some(number),
            Self::Dynamic => None,
        }
    }
}

/// As people write it: a number, or a word for one that is given.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum WrittenNodeId {
    Number(u8),
    Word(String),
}

impl Serialize for NodeId {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let written = match self {
            Self::Fixed(number) => WrittenNodeId::Number(*number),
            Self::Dynamic | Self::Allocated(_) => WrittenNodeId::Word(DYNAMIC.to_owned()),
        };
        written.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for NodeId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match WrittenNodeId::deserialize(deserializer) {
            Ok(WrittenNodeId::Number(number)) => Ok(Self::Fixed(number)),
            Ok(WrittenNodeId::Word(word)) if word == DYNAMIC => Ok(Self::Dynamic),
            _ => Err(D::Error::custom("a node id of 1 to 127 or \"dynamic\" is expected")),
        }
    }
}

/// The `[bus.dronecan]` table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DronecanConfig {
    /// Node id of the bridge, 1 to 127, or `dynamic`: an allocator on the bus gives one.
    pub node_id: NodeId,
    /// Index that the ESC of each rotor has in commands and in what it reports.
    pub esc_index: [u8; ROTORS],
    /// Which message carries the commands.
    pub command: CommandKind,
    /// Raw command that a command of 1 becomes, 1 to 8191.
    pub raw_maximum: u16,
    /// [1/min] speed that a command of 1 becomes, with `command = "rpm"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpm_maximum: Option<u32>,
    /// Files of DSDL beside the published types.
    pub dsdl: Vec<DsdlConfig>,
}

/// A file of DSDL.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DsdlConfig {
    /// Path, from where the bench file is: `ID.Type.uavcan`, or `Type.uavcan` of what is only a part of others.
    pub file: String,
    /// Namespace of the type, such as `com.hobbywing.esc`.
    pub namespace: String,
}

impl Default for DronecanConfig {
    fn default() -> Self {
        Self {
            node_id: NodeId::Fixed(100),
            esc_index: [0, 1],
            command: CommandKind::Raw,
            raw_maximum: 8191,
            rpm_maximum: None,
            dsdl: Vec::new(),
        }
    }
}

impl DsdlConfig {
    /// The text of the file: what somebody needs to understand recorded frames later.
    ///
    /// # Errors
    /// [`CanError::Read`]; what lies beyond a megabyte is not read.
    pub fn text(&self) -> Result<String, CanError> {
        let read = || {
            let mut text = String::new();
            File::open(&self.file)?.take(LARGEST_FILE).read_to_string(&mut text)?;
            Ok(text)
        };
        read().map_err(|source| CanError::Read { file: self.file.clone(), source })
    }
}
