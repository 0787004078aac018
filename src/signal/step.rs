//! One step of controller or guard with everything that went into it: for the recorder, and between two processes in lockstep.

use iceoryx2::prelude::ZeroCopySend;

use super::{Applied, Command, Request, Sensors};

/// from what was applied.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::ControlStep")]
pub struct ControlStep {
    /// The sensors it was given.
    pub sensors: Sensors,
    /// What the guard had let through, as fed back to it.
    pub applied: Applied,
    /// What it answered, stamped as published.
    pub command: Command,
}

/// One period of the guard: everything it consumed, and what it let through.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::GuardStep")]
pub struct GuardStep {
    /// [ns] the time it was given.
    pub now_ns: u64,
    /// Bits of [`GuardStepInputs`]: which of `newest` and `request` it was given.
    pub inputs: u32,
    /// Code of the cause it was tripped for from outside before this step, see `guard::Guard::trip`; 0 = it was not.
    pub trip_cause: u32,
    /// [ns] the time it was tripped with; 0 = it was not.
    pub trip_ns: u64,
    /// The sensors it was given.
    pub sensors: Sensors,
    /// The newest command it was given.
    pub newest: Command,
    /// The operator's act it was given.
    pub request: Request,
    /// What it let through.
    pub applied: Applied,
}

/// Bits of [`GuardStep::inputs`].
pub struct GuardStepInputs;

impl GuardStepInputs {
    /// `newest` was given.
    pub const COMMAND: u32 = 1;
    /// `request` was given.
    pub const REQUEST: u32 = 1 << 1;
}

impl GuardStep {
    /// The record of `Guard::step(now_ns, sensors, newest, request) -> applied`.
    #[must_use]
    pub fn new(
        now_ns: u64,
        sensors: &Sensors,
        newest: Option<&Command>,
        request: Option<&Request>,
        applied: &Applied,
    ) -> Self {
        let given = |present: bool, bit: u32| if present { bit } else { 0 };
        Self {
            now_ns,
            inputs: given(newest.is_some(), GuardStepInputs::COMMAND)
                | given(request.is_some(), GuardStepInputs::REQUEST),
            trip_cause: 0,
            trip_ns: 0,
            sensors: *sensors,
            newest: newest.copied().unwrap_or_default(),
            request: request.copied().unwrap_or_default(),
            applied: *applied,
        }
    }

    /// The same, after a trip from outside, given as time and code of the cause.
    #[must_use]
    pub fn tripped(self, trip: Option<(u64, u32)>) -> Self {
        let (trip_ns, trip_cause) = trip.unwrap_or_default();
        Self { trip_ns, trip_cause, ..self }
    }

    /// Time and code of the cause of the trip from outside before this step, if there was one.
    #[must_use]
    pub fn trip(&self) -> Option<(u64, u32)> {
        (self.trip_cause != 0).then_some((self.trip_ns, self.trip_cause))
    }

    /// The newest command, if one was given.
    #[must_use]
    pub fn newest(&self) -> Option<&Command> {
        (self.inputs & GuardStepInputs::COMMAND != 0).then_some(&self.newest)
    }

    /// The operator's act, if one was given.
    #[must_use]
    pub fn request(&self) -> Option<&Request> {
        (self.inputs & GuardStepInputs::REQUEST != 0).then_some(&self.request)
    }
}

/// One step of a bench on virtual time, from the emulator to the controller of another process.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::LockstepStep")]
pub struct LockstepStep {
    /// [ns] CLOCK_MONOTONIC when this run began: distinguishes one run of the emulator from the next.
    pub run: u64,
    /// Number of the step in its run, from 1; 0 = the run has ended.
    pub number: u64,
    /// [ns] virtual time.
    pub now_ns: u64,
    /// What was measured.
    pub sensors: Sensors,
    /// What the guard let through last.
    pub applied: Applied,
}

/// The controller's answer to a [`LockstepStep`].
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::LockstepAnswer")]
pub struct LockstepAnswer {
    /// [`LockstepStep::run`] it answers.
    pub run: u64,
    /// [`LockstepStep::number`] it answers.
    pub number: u64,
    /// What the controller wants.
    pub command: Command,
}
