//! Runs the controller and the guard again on what a recording says they consumed, and compares bit for bit.

use std::collections::VecDeque;

use serde::Serialize;

use super::command_source::{CommandSource, CommandSourceState};
use crate::clock;
use crate::guard::{Cause, Guard, GuardState};
use crate::recording::{Difference, RecordError, RecordedItem, first_difference};
use crate::signal::{Applied, Command, ControlStep, GuardEvent, GuardStep};

/// The first place where a recording and its replay part.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FirstDifference {
    /// Sequence number of the command, the guard's period or the guard's event.
    pub sequence: u64,
    /// [s] since the first record.
    pub time_s: f64,
    /// The field and both its values.
    #[serde(flatten)]
    pub difference: Difference,
}

/// What replaying one of the two came to.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ReplayResult {
    /// Steps replayed and found equal, bit for bit.
    pub equal: u64,
    /// Steps that could not be replayed, because what came before them is not in the recording.
    pub unknown: u64,
    /// Starts met: times the process started anew.
    #[serde(rename = "lives")]
    pub starts: u64,
    /// The first difference; nothing is compared behind it.
    pub first_difference: Option<FirstDifference>,
}

impl ReplayResult {
    /// Whether everything recorded could be replayed and was equal.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.first_difference.is_none() && self.unknown == 0
    }
}

/// A replay under way.
#[derive(Debug)]
pub struct Replay<'a> {
    source: &'a CommandSource,
    guard: &'a Guard,
    /// State and number of the last step; `None` while it is not known.
    controlling: Option<(CommandSourceState, u64)>,
    guarding: Option<(GuardState, u64)>,
    /// Events of the replayed guard, and those of the recording, until they are compared.
    replayed: VecDeque<GuardEvent>,
    recorded: VecDeque<GuardEvent>,
    first_ns: Option<u64>,
    /// The controller's outcome.
    pub controller: ReplayResult,
    /// The guard's outcome.
    pub guard_result: ReplayResult,
    /// Events of the guard that were equal.
    pub equal_events: u64,
}

impl<'a> Replay<'a> {
    /// Begins, with the controller and guard that the recording names (or others, to see where they part).
    #[must_use]
    pub fn new(source: &'a CommandSource, guard: &'a Guard) -> Self {
        Self {
            source,
            guard,
            controlling: None,
            guarding: None,
            replayed: VecDeque::new(),
            recorded: VecDeque::new(),
            first_ns: None,
            controller: ReplayResult::default(),
            guard_result: ReplayResult::default(),
            equal_events: 0,
        }
    }

    /// Replays all of `records`.
    ///
    /// # Errors
    /// [`RecordError`] of the recording.
    pub fn run(
        &mut self,
        records: impl IntoIterator<Item = Result<RecordedItem, RecordError>>,
    ) -> Result<(), RecordError> {
        for record in records {
            match record? {
                RecordedItem::ControlStep(step) => self.control_step(&step),
                RecordedItem::GuardStep(step) => self.guard_step(&step),
                RecordedItem::GuardEvent(event) => self.event(event),
                _ => {}
            }
        }
        Ok(())
    }

    /// [s] since the first record.
    fn time_s(&mut self, stamp_ns: u64) -> f64 {
        clock::span_s(stamp_ns.saturating_sub(*self.first_ns.get_or_insert(stamp_ns)))
    }

    fn control_step(&mut self, step: &ControlStep) {
        let time_s = self.time_s(step.command.stamp_ns);
        if self.controller.first_difference.is_some() {
            return;
        }
        let sequence = step.command.sequence;
        if sequence == 1 {
            self.controlling = Some((self.source.start(), 0));
            self.controller.starts += 1;
        }
        let Some((state, last)) = self.controlling.as_mut().filter(|(_, last)| last + 1 == sequence) else {
            self.controlling = None;
            self.controller.unknown += 1;
            return;
        };
        *last = sequence;
        let command = self.source.step(state, &step.sensors, &step.applied);
        // The process stamps the command after the step.
        let command = Command { stamp_ns: step.command.stamp_ns, ..command };
        match first_difference(&step.command, &command) {
            None => self.controller.equal += 1,
            Some(difference) => {
                self.controller.first_difference = Some(FirstDifference { sequence, time_s, difference });
            }
        }
    }

    fn guard_step(&mut self, step: &GuardStep) {
        let time_s = self.time_s(step.now_ns);
        if self.guard_result.first_difference.is_some() {
            return;
        }
        let sequence = step.applied.sequence;
        if sequence == 1 {
            self.guarding = Some((GuardState::new(), 0));
            self.guard_result.starts += 1;
        }
        let Some((state, last)) = self.guarding.as_mut().filter(|(_, last)| last + 1 == sequence) else {
            self.guarding = None;
            self.guard_result.unknown += 1;
            return;
        };
        *last = sequence;
        if let Some((trip_ns, cause)) = step.trip() {
            self.guard.trip(state, trip_ns, Cause::from_code(cause).unwrap_or_default());
        }
        let applied: Applied =
            self.guard.step(state, step.now_ns, &step.sensors, step.newest(), step.request());
        self.replayed.extend(state.take_events());
        match first_difference(&step.applied, &applied) {
            None => self.guard_result.equal += 1,
            Some(difference) => {
                self.guard_result.first_difference = Some(FirstDifference { sequence, time_s, difference });
            }
        }
        self.compare_events();
    }

    fn event(&mut self, event: GuardEvent) {
        self.time_s(event.stamp_ns);
        self.recorded.push_back(event);
        self.compare_events();
    }

    /// Compares the events of both so far, in order.
    fn compare_events(&mut self) {
        while let (Some(recorded), Some(replayed)) = (self.recorded.front(), self.replayed.front()) {
            if self.guard_result.first_difference.is_some() {
                return;
            }
            let (sequence, stamp_ns) = (recorded.sequence, recorded.stamp_ns);
            match first_difference(recorded, replayed) {
                None => self.equal_events += 1,
                Some(difference) => {
                    let time_s = self.time_s(stamp_ns);
                    self.guard_result.first_difference =
                        Some(FirstDifference { sequence, time_s, difference });
                }
            }
            self.recorded.pop_front();
            self.replayed.pop_front();
        }
    }
}
