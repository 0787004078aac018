//! The `[bus]` table of the bench file, as people write it.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::dronecan::{DronecanConfig, ESC_TIMEOUT_S};
use super::field::CommandField;
use crate::signal::{Channel, Sensor};

/// What the bus speaks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProtocolName {
    /// Frames that DBC files describe.
    #[default]
    Dbc,
    /// DroneCAN v0.
    Dronecan,
}

impl ProtocolName {
    /// [s] without a command after which ESCs that speak it stop their rotors as they come from the maker, where that is much
    /// the same for all.
    #[must_use]
    pub fn esc_timeout_s(self) -> Option<f64> {
        match self {
            Self::Dbc => None,
            Self::Dronecan => Some(ESC_TIMEOUT_S),
        }
    }
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Interface, DBC files, and which DBC signal plays which role.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BusConfig {
    /// Network interface, such as `can0`.
    pub interface: String,
    /// What the bus speaks.
    #[serde(skip_serializing_if = "is_default")]
    pub protocol: ProtocolName,
    /// [bit/s] of the arbitration phase (of everything, on a classic bus); only the bus load needs it, the
    /// interface's own setting rules the wire.
    pub bit_rate: u32,
    /// Send and receive CAN FD frames.
    pub fd: bool,
    /// [bit/s] of the FD data phase.
    pub data_bit_rate: u32,
    /// DBC files.
    pub database: Vec<DatabaseConfig>,
    /// Which signal feeds which sensor.
    pub sensors: BTreeMap<Channel, SignalConfig>,
    /// Which signal carries which command.
    pub commands: BTreeMap<CommandField, SignalConfig>,
    /// What the DBC file cannot say of a message, by the message's name.
    pub messages: BTreeMap<String, MessageConfig>,
    /// What DroneCAN needs beside.
    #[serde(skip_serializing_if = "is_default")]
    pub dronecan: DronecanConfig,
}

/// A DBC file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatabaseConfig {
    /// Path, from where the bench file is; or `bench`, `vesc` or `odrive`, which are built in.
    pub file: String,
    /// Bits of the identifier that hold the node, where a role substitutes one: VESC 0xFF, ODrive 0x7E0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node_mask: Option<u32>,
}

/// A signal in a role.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalConfig {
    /// `MESSAGE.signal`, names of the DBC file; on DroneCAN the type's full name and the path of a field.
    pub signal: String,
    /// Node whose message it is, put into the identifier's node bits; `None` = the identifier of the DBC file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub node: Option<u32>,
    /// On DroneCAN the ESC index that the message must have; `None` = that of the rotor, of the first one where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub esc: Option<u32>,
    /// Unit of the signal, where the DBC file names none or a wrong one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Pole pairs of the motor, which turn `ERPM` into a rotor's speed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pole_pairs: Option<u32>,
    /// Factor onto the value in SI: -1 for a sensor mounted the other way round.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub factor: f64,
    /// Least allowed value, in SI after `factor`; `None` = the DBC file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub minimum: Option<f64>,
    /// Greatest allowed value, in SI after `factor`; `None` = the DBC file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub maximum: Option<f64>,
}

/// What the DBC file cannot say of a message.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MessageConfig {
    /// Signal that the sender steps by one with each frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter: Option<String>,
    /// [s] period at which it is sent; `None` = the control period.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub period_s: Option<f64>,
}

fn one() -> f64 {
    1.0
}

fn is_one(factor: &f64) -> bool {
    *factor == 1.0
}

impl SignalConfig {
    /// `MESSAGE.signal`, everything else as the DBC file says.
    #[must_use]
    pub fn new(signal: &str) -> Self {
        Self {
            signal: signal.to_owned(),
            node: None,
            esc: None,
            unit: None,
            pole_pairs: None,
            factor: 1.0,
            minimum: None,
            maximum: None,
        }
    }
}

/// The bench of `dbc/bench.dbc` on `vcan0`.
impl Default for BusConfig {
    fn default() -> Self {
        let roles = |sensor: Sensor| sensor.channels().iter().copied().zip(sensor.row().bus);
        let signals = Sensor::ALL.into_iter().flat_map(roles);
        let commands = [
            (CommandField::Rotor1, "COMMAND.rotor_1"),
            (CommandField::Rotor2, "COMMAND.rotor_2"),
            (CommandField::State, "COMMAND.state"),
        ];
        let counter = || MessageConfig { counter: Some("counter".to_owned()), period_s: None };
        let counted = ["COMMAND", "GYRO", "ACCELEROMETER", "ESC_1_STATUS", "ESC_2_STATUS"];
        Self {
            interface: "vcan0".to_owned(),
            protocol: ProtocolName::Dbc,
            bit_rate: 1_000_000,
            fd: false,
            data_bit_rate: 4_000_000,
            database: vec![DatabaseConfig { file: "bench".to_owned(), node_mask: None }],
            sensors: signals.map(|(channel, signal)| (channel, SignalConfig::new(signal))).collect(),
            commands: commands.map(|(field, signal)| (field, SignalConfig::new(signal))).into(),
            messages: counted.map(|message| (message.to_owned(), counter())).into(),
            dronecan: DronecanConfig::default(),
        }
    }
}
