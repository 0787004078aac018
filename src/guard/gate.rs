//! The gate for commands: freshness, not liveness.

use super::Cause;
use crate::signal::{Command, ROTORS};

/// What came to the gate in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Passage {
    /// Nothing that has not been here before.
    Nothing,
    /// A fresh command went through.
    Fresh,
    /// A command was refused, with the offending value.
    Refused(Cause, f64),
}

/// What the gate goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GateRules {
    pub(super) period_ns: u64,
    pub(super) time_to_live_ns: u64,
    /// Whether a controller may restart with a lower sequence: not while the rotors follow it.
    pub(super) may_restart: bool,
}

/// The last command that went through, and when.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct CommandGate {
    /// [-] its rotor commands.
    pub(super) rotor: [f64; ROTORS],
    pub(super) sequence: u64,
    pub(super) stamp_ns: u64,
    /// [ns] when it went through; 0 = none ever did.
    pub(super) passed_ns: u64,
    /// [ns] since when there are sensors that no command has answered, nor any newer ones; 0 = there are none.
    unanswered_since_ns: u64,
    /// Why the newest refused command was refused; `None` after a fresh one.
    pub(super) complaint: Option<Cause>,
    sensors_sequence: u64,
    refused: (u64, u64),
    /// Sensors' sequence seen at `mark_ns`, and the one before: at least a time-to-live old.
    mark: u64,
    mark_ns: u64,
    floor: u64,
}

impl CommandGate {
    /// Examines the newest command there is.
    pub(super) fn examine(
        &mut self,
        rules: &GateRules,
        now_ns: u64,
        sensors_sequence: u64,
        newest: Option<&Command>,
    ) -> Passage {
        if now_ns.saturating_sub(self.mark_ns) >= rules.time_to_live_ns {
            (self.floor, self.mark, self.mark_ns) = (self.mark, sensors_sequence, now_ns);
        }
        if sensors_sequence <= self.sensors_sequence {
            self.unanswered_since_ns = 0;
        } else if self.unanswered_since_ns == 0 {
            self.unanswered_since_ns = now_ns;
        }
        let Some(command) = newest else { return Passage::Nothing };
        let identity = (command.sequence, command.stamp_ns);
        if identity == (self.sequence, self.stamp_ns) || identity == self.refused {
            return Passage::Nothing;
        }
        match self.objection(rules, now_ns, sensors_sequence, command) {
            Some((cause, value)) => {
                self.refused = identity;
                self.complaint = Some(cause);
                Passage::Refused(cause, value)
            }
            None => {
                self.pass(now_ns, command);
                Passage::Fresh
            }
        }
    }

    /// [ns] for which newer sensors have waited for a command that answers them.
    pub(super) fn unanswered_ns(&self, now_ns: u64) -> u64 {
        if self.unanswered_since_ns == 0 { 0 } else { now_ns.saturating_sub(self.unanswered_since_ns) }
    }

    fn objection(
        &self,
        rules: &GateRules,
        now_ns: u64,
        sensors_sequence: u64,
        command: &Command,
    ) -> Option<(Cause, f64)> {
        if let Some(value) = command.rotor.iter().find(|value| !value.is_finite()) {
            return Some((Cause::CommandNotANumber, *value));
        }
        // One period of grace: the guard may have read its clock before the command was stamped.
        if command.stamp_ns > now_ns.saturating_add(rules.period_ns) {
            return Some((Cause::CommandFromFuture, (command.stamp_ns - now_ns) as f64 * 1e-9));
        }
        let age_ns = now_ns.saturating_sub(command.stamp_ns);
        if age_ns > rules.time_to_live_ns {
            return Some((Cause::CommandExpired, age_ns as f64 * 1e-9));
        }
        let later = command.stamp_ns > self.stamp_ns;
        let restarted = rules.may_restart && later && command.sequence < self.sequence;
        if !later || (command.sequence <= self.sequence && !restarted) {
            return Some((Cause::CommandRepeated, command.sequence as f64));
        }
        let answers = command.sensors_sequence;
        if answers > sensors_sequence {
            return Some((Cause::CommandAheadOfSensors, answers as f64));
        }
        if answers < self.floor || (answers < self.sensors_sequence && !restarted) {
            return Some((Cause::CommandAnswersOldSensors, answers as f64));
        }
        None
    }

    fn pass(&mut self, now_ns: u64, command: &Command) {
        if command.sensors_sequence != self.sensors_sequence {
            self.unanswered_since_ns = 0;
        }
        self.rotor = command.rotor;
        self.sequence = command.sequence;
        self.stamp_ns = command.stamp_ns;
        self.sensors_sequence = command.sensors_sequence;
        self.passed_ns = now_ns;
        self.complaint = None;
    }
}
