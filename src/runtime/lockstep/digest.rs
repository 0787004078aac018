//! One number for all that a run gave: two runs are the same to the last bit when, and only when, it is.

use sha2::{Digest as _, Sha256};

use super::Slot;
use crate::emulate::Truth;
use crate::recording::{encode, encode_given};

/// SHA-256 of every slot: what was measured, wanted, let through, and what really was.
#[derive(Debug, Clone, Default)]
pub struct Digest {
    hash: Sha256,
    bytes: Vec<u8>,
}

impl Digest {
    /// Takes a slot in.
    pub fn add(&mut self, slot: &Slot) {
        self.hash.update(slot.slot.to_le_bytes());
        // A sensor that the bench lacks leaves the digest as it was before there were such sensors.
        encode_given(&slot.sensors, &mut self.bytes);
        self.hash.update(&self.bytes);
        // A slot without an answer is not a slot with an answer of zeros.
        self.hash.update([u8::from(slot.command.is_some())]);
        encode(&slot.command.unwrap_or_default(), &mut self.bytes);
        self.hash.update(&self.bytes);
        encode(&slot.applied, &mut self.bytes);
        self.hash.update(&self.bytes);
        let Truth { body_angle, body_rate, battery_voltage, disturbance_torque, .. } = slot.truth;
        for value in [body_angle, body_rate, battery_voltage, disturbance_torque] {
            self.hash.update(value.to_bits().to_le_bytes());
        }
        for pair in [slot.truth.propeller_rate, slot.truth.thrust, slot.truth.current] {
            pair.iter().for_each(|value| self.hash.update(value.to_bits().to_le_bytes()));
        }
    }

    /// In hexadecimal.
    #[must_use]
    pub fn text(&self) -> String {
        self.hash.clone().finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}
