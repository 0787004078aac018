//! The roles a DBC signal can play in the command; those of sensors are [`crate::signal::Channel`].

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::signal::ROTORS;

/// A part of the command that a signal carries to the ESCs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandField {
    /// [-] u_1, 0..1.
    #[serde(rename = "rotor_1")]
    Rotor1,
    /// [-] u_2, 0..1.
    #[serde(rename = "rotor_2")]
    Rotor2,
    /// Code of the guard's state; for people who watch the bus.
    State,
}

impl CommandField {
    /// All of them.
    pub const ALL: [Self; ROTORS + 1] = [Self::Rotor1, Self::Rotor2, Self::State];

    /// As files spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Rotor1 => "rotor_1",
            Self::Rotor2 => "rotor_2",
            Self::State => "state",
        }
    }

    /// SI unit of the field.
    #[must_use]
    pub fn si(self) -> &'static str {
        "-"
    }
}

impl fmt::Display for CommandField {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}
