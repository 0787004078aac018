//! What breaks on an emulated rotor, and when.

use serde::{Deserialize, Serialize};

use crate::clock;
use crate::signal::ROTORS;

use super::error::EmulateError;
use super::thresholds::THRESHOLDS;

/// What breaks.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotorFaultKind {
    /// A part of the propeller is gone: `lost` of its thrust and of its drag. The motor turns faster under less load.
    BrokenPropeller,
    /// The ESC has lost the motor's angle: it drives it no more, and the rotor runs out.
    Desync,
    /// The ESC goes on with the command that it had, whatever comes, and without its own timeout.
    Deaf,
    /// The ESC turns the rotor at `command`, whatever it is sent.
    TurnsByItself,
}

/// One `[[emulator.fault]]` table: what breaks on a rotor.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RotorFault {
    /// Its number, from 1.
    pub rotor: usize,
    /// [s] since the start of the emulator.
    pub at_s: f64,
    /// What breaks.
    pub kind: RotorFaultKind,
    /// [-] share of the thrust that a broken propeller lacks.
    #[serde(default = "lost")]
    pub lost: f64,
    /// [-] what an ESC that turns by itself turns at.
    #[serde(default = "command")]
    pub command: f64,
}

fn lost() -> f64 {
    THRESHOLDS.usually_lost
}

fn command() -> f64 {
    THRESHOLDS.own_command
}

/// A fault as built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BuiltFault {
    /// From 0.
    pub rotor: usize,
    /// [ns] since the start.
    pub at_ns: u64,
    pub kind: RotorFaultKind,
    lost: f64,
    /// [-]
    pub command: f64,
}

/// What is broken of a rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Damage {
    /// [-] what is left of thrust and drag of the propeller.
    pub propeller: f64,
    /// Whether the ESC drives it.
    pub is_driven: bool,
}

impl Default for Damage {
    fn default() -> Self {
        Self { propeller: 1.0, is_driven: true }
    }
}

impl RotorFault {
    pub(super) fn build(&self) -> Result<BuiltFault, EmulateError> {
        let spans = [
            ("fault.rotor", self.rotor as f64, 1.0, ROTORS as f64),
            ("fault.at_s", self.at_s, 0.0, 1e6),
            ("fault.lost", self.lost, 0.0, THRESHOLDS.most_lost),
            ("fault.command", self.command, 0.0, 1.0),
        ];
        match spans.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value)) {
            Some((name, value, low, high)) => Err(EmulateError::Range { name, value, low, high }),
            None => Ok(BuiltFault {
                rotor: self.rotor - 1,
                at_ns: clock::span_ns(self.at_s),
                kind: self.kind,
                lost: self.lost,
                command: self.command,
            }),
        }
    }
}

impl BuiltFault {
    /// What it breaks of its rotor, beside what is broken already.
    pub fn damage(&self, damage: &mut Damage) {
        match self.kind {
            RotorFaultKind::BrokenPropeller => damage.propeller *= 1.0 - self.lost,
            RotorFaultKind::Desync => damage.is_driven = false,
            RotorFaultKind::Deaf | RotorFaultKind::TurnsByItself => {}
        }
    }
}

impl Damage {
    /// [rad/s] the steady rate of a rotor that would have `steady` whole. The propeller's drag, which goes with the square of the
    /// rate, slows the motor by b ω² below the rate that it has without load: ω + k b ω² = z + b z², with k of the drag left.
    pub fn steady_rate(&self, steady: f64, hover: f64) -> f64 {
        if !self.is_driven {
            return 0.0;
        }
        if self.propeller == 1.0 {
            return steady;
        }
        let slip = (1.0 / THRESHOLDS.loaded_share - 1.0) / hover;
        let left = self.propeller * slip;
        let unloaded = steady + slip * steady * steady;
        ((1.0 + 4.0 * left * unloaded).sqrt() - 1.0) / (2.0 * left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn less_propeller_is_less_load() {
        let broken = Damage { propeller: 0.7, is_driven: true };
        // By hand: at hover 0.3111 x^2 + x - 1 = 0 of the unloaded rate, x = 0.8006 of it, of 0.75: 6.75 % more.
        assert!((broken.steady_rate(600.0, 600.0) / 600.0 - 1.0675).abs() < 1e-4);
        assert!(broken.steady_rate(60.0, 600.0) < 1.02 * 60.0, "a slow one has little drag to lose");
        assert_eq!(Damage::default().steady_rate(600.0, 600.0), 600.0);
        assert_eq!(Damage { is_driven: false, ..broken }.steady_rate(600.0, 600.0), 0.0);
    }

    #[test]
    fn a_fault_that_cannot_be_is_refused_by_its_key() {
        let fault = |text: &str| {
            let fault: RotorFault = toml::from_str(&format!("kind = \"desync\"\n{text}")).expect("a fault");
            fault.build().map_or_else(|error| error.to_string(), |_| "built".to_owned())
        };
        assert_eq!(fault("rotor = 2\nat_s = 1.0"), "built");
        for (text, key) in [
            ("rotor = 0\nat_s = 1.0", "fault.rotor"),
            ("rotor = 3\nat_s = 1.0", "fault.rotor"),
            ("rotor = 1\nat_s = -1.0", "fault.at_s"),
            ("rotor = 1\nat_s = nan", "fault.at_s"),
            ("rotor = 1\nat_s = 1.0\nlost = 1.0", "fault.lost"),
            ("rotor = 1\nat_s = 1.0\ncommand = 2.0", "fault.command"),
        ] {
            assert!(fault(text).contains(key), "{text}: {}", fault(text));
        }
    }
}
