//! What can be wrong with a DBC file, a role or a bus.

use std::io;

/// An error of the CAN room; each says the place.
#[derive(Debug, thiserror::Error)]
pub enum CanError {
    /// A file cannot be read.
    #[error("cannot read `{file}`")]
    Read {
        /// Path as given.
        file: String,
        /// Why.
        source: io::Error,
    },
    /// A DBC file is not DBC.
    #[error("{file}:{line}:{column}: {reason}")]
    Syntax {
        /// File name.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was expected.
        reason: String,
    },
    /// A DBC file says something that cannot be.
    #[error("{file}:{line}: {reason}")]
    Database {
        /// File name.
        file: String,
        /// Line of the message or signal, from 1.
        line: usize,
        /// What is wrong with which message and signal.
        reason: String,
    },
    /// A role of the `[bus]` table cannot be filled.
    #[error("bus.{place}: {reason}")]
    Role {
        /// Key below `[bus]`.
        place: String,
        /// Why.
        reason: String,
    },
    /// The frames of the roles do not fit on the bus.
    #[error(
        "the bus would be {percent:.1} % loaded at worst, over {limit:.0} %: send less often or raise bit_rate"
    )]
    Overload {
        /// [%] worst-case load.
        percent: f64,
        /// [%] limit.
        limit: f64,
    },
    /// The interface cannot be used.
    #[error("CAN interface `{interface}`: {reason}")]
    Interface {
        /// Name of the interface.
        interface: String,
        /// Why, and what mends it.
        reason: String,
    },
    /// The operating system refused something on an interface that is there.
    #[error("CAN interface `{interface}`: {action}")]
    Socket {
        /// Name of the interface.
        interface: String,
        /// What was tried.
        action: &'static str,
        /// Why it failed.
        source: io::Error,
    },
}

impl CanError {
    /// No interface of this name can be there.
    pub(crate) fn no_can(interface: &str) -> Self {
        let reason = "this machine's kernel has no CAN (without any: `mcast:0` carries frames over UDP on this machine; `emulate --shm` with \
                      `control`; `run --lockstep`. `tools/vcan COMMAND` has a virtual bus)";
        Self::Interface { interface: interface.to_owned(), reason: reason.to_owned() }
    }
}
