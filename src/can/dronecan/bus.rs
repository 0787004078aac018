//! A bench on DroneCAN as built: every name looked up once.

use crate::signal::ROTORS;

use super::allocation::UniqueId;
use super::assembler::{Subscription, Transfer};
use super::common::Common;
use super::place::BitPlace;
use super::received::Received;
use super::transfer::Framing;

/// The command as it is sent.
#[derive(Debug, Clone, Copy)]
pub(super) struct Commanding {
    /// Name of the type, its field, and the unit of that.
    pub name: &'static str,
    pub field: &'static str,
    pub unit: &'static str,
    /// Number that a command of 1 becomes.
    pub full: f64,
    /// The number of each rotor in the message.
    pub rotors: [BitPlace; ROTORS],
    /// The first number in the message: a command without it commands nobody.
    pub first: BitPlace,
    /// [byte] of the message.
    pub length: usize,
    pub type_id: u16,
    pub subscription: Subscription,
}

impl Commanding {
    /// Index of the last ESC that a command of somebody has a number for; `None`: it commands nobody.
    #[inline]
    pub(super) fn last(&self, command: &Transfer<'_>) -> Option<u8> {
        let count = self.first.items(command.payload, command.framing)?;
        u8::try_from(count.checked_sub(1)?).ok()
    }
}

/// The `[bus]` table of a bench on DroneCAN, resolved.
#[derive(Debug, Clone)]
pub struct DronecanBus {
    /// In which frames it sends; what comes may come in either.
    pub(super) framing: Framing,
    /// 0 = an allocator has given none yet.
    pub(super) node_id: u8,
    /// Of this bench, for the allocator and who asks.
    pub(super) unique_id: UniqueId,
    pub(super) esc_index: [u8; ROTORS],
    /// What is sent, and, of the same kind or the other, what nobody else may send.
    pub(super) command: Commanding,
    pub(super) other_command: Commanding,
    pub(super) received: Vec<Received>,
    pub(super) common: Common,
    /// [s] control period.
    pub(super) period_s: f64,
}
