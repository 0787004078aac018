//! Why parameters of a node cannot be read or written.

use crate::can::CanError;
use crate::can::dronecan::ParameterValue;
use crate::guard::State;
use crate::runtime::ProcessError;

/// Why parameters cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ParameterError {
    /// The bus.
    #[error(transparent)]
    Can(#[from] CanError),
    /// A bench on this machine.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// It does not answer.
    #[error("node {node} does not answer")]
    Silent {
        /// It.
        node: u8,
    },
    /// It has no such parameter.
    #[error("node {node} has no parameter `{name}`; without a name all are shown")]
    NoSuch {
        /// The node.
        node: u8,
        /// The name.
        name: String,
    },
    /// The value is of another type.
    #[error("`{name}` is {}: `{value}` is none", kind.name())]
    WrongType {
        /// The parameter.
        name: String,
        /// What it is.
        kind: ParameterValue,
        /// What was given.
        value: String,
    },
    /// The parameter has no value, and says so of what type one would be.
    #[error("`{name}` has no value that could be replaced")]
    NoValue {
        /// The parameter.
        name: String,
    },
    /// The value is out of range.
    #[error("`{name}` takes {} to {}: {value} is out of range", shown(least), shown(greatest))]
    OutOfRange {
        /// The parameter.
        name: String,
        /// What was given.
        value: String,
        /// Least value.
        least: Option<ParameterValue>,
        /// Greatest value.
        greatest: Option<ParameterValue>,
    },
    /// The node kept another value than it was given.
    #[error("node {node} did not take the value of `{name}`: it is {}", shown(kept))]
    NotTaken {
        /// The node.
        node: u8,
        /// The parameter.
        name: String,
        /// What it is now.
        kept: Option<ParameterValue>,
    },
    /// The node does not keep its parameters.
    #[error("node {node} refuses to save its parameters")]
    NotSaved {
        /// The node.
        node: u8,
    },
    /// A bench on this machine is not disarmed.
    #[error(
        "bench `{bench}` is {state}: parameters are written only while every bench of this machine is disarmed"
    )]
    Armed {
        /// Its name.
        bench: String,
        /// What its guard says.
        state: State,
    },
    /// Nobody can say whether a bench on this machine is disarmed.
    #[error(
        "bench `{bench}` runs and does not say whether it is disarmed: parameters are written only while it is"
    )]
    Unknown {
        /// Its name.
        bench: String,
    },
    /// Somebody on the bus says that rotors may turn.
    #[error("node {node} says that the rotors may turn: parameters are written only while nobody does")]
    ArmedOnBus {
        /// Who.
        node: u8,
    },
    /// Somebody on the bus turns rotors.
    #[error("node {node} commands rotors to turn: parameters are written only while nobody does")]
    Commanded {
        /// Who.
        node: u8,
    },
    /// Another node has our number.
    #[error("another node has the number {own}: ask as one that nobody has (--node-id)")]
    Taken {
        /// The number.
        own: u8,
    },
}

fn shown(value: &Option<ParameterValue>) -> String {
    value.as_ref().map_or_else(|| "anything".to_owned(), ParameterValue::to_string)
}
