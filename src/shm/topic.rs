//! The topics of a bench: what is published, by whom, and how much of it a slow reader can catch up on.

use std::borrow::Cow;
use std::marker::PhantomData;

use iceoryx2::prelude::ZeroCopySend;

use crate::signal::{
    Applied, BusStatus, Command, ControlStep, CycleSample, GuardEvent, GuardStep, Heartbeat, LockstepAnswer,
    LockstepStep, Request, Sensors,
};

/// A value that may cross shared memory.
pub trait Shareable: ZeroCopySend + Copy + Default + Send + std::fmt::Debug + 'static {}
impl<T: ZeroCopySend + Copy + Default + Send + std::fmt::Debug + 'static> Shareable for T {}

/// A process's part on the bench. The numbers are those of [`Heartbeat::role`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum ProcessRole {
    /// Owns the CAN bus and the guard.
    Bridge = 1,
    /// Runs the controller.
    Control = 2,
    /// Stands in for bridge and hardware.
    Emulate = 3,
    /// Bridge and control in one process.
    Run = 4,
    /// Writes a recording.
    Record = 5,
    /// Shows the bench to a person.
    Monitor = 6,
    /// Carries an operator's act: arm, disarm, stop.
    Operator = 7,
}

impl ProcessRole {
    /// All roles.
    pub const ALL: [Self; 7] =
        [Self::Bridge, Self::Control, Self::Emulate, Self::Run, Self::Record, Self::Monitor, Self::Operator];

    /// The role's command.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bridge => "bridge",
            Self::Control => "control",
            Self::Emulate => "emulate",
            Self::Run => "run",
            Self::Record => "record",
            Self::Monitor => "monitor",
            Self::Operator => "operator",
        }
    }

    /// Where this role says that it is alive.
    #[must_use]
    pub fn heartbeat(self) -> Topic<Heartbeat> {
        Topic { name: Cow::Owned(format!("heartbeat-{}", self.name())), depth: 8, payload: PhantomData }
    }

    /// Where this role publishes what its cycle did.
    #[must_use]
    pub fn cycle(self) -> Topic<CycleSample> {
        Topic { name: Cow::Owned(format!("cycle-{}", self.name())), depth: 1024, payload: PhantomData }
    }
}

/// A named stream of values of one type.
#[derive(Debug, Clone)]
pub struct Topic<T> {
    name: Cow<'static, str>,
    depth: u32,
    payload: PhantomData<fn() -> T>,
}

/// What the bench measured; by bridge, run or emulator.
pub const SENSORS: Topic<Sensors> = Topic::fixed("sensors", 1024);
/// What the controller wants; by control or run.
pub const COMMAND: Topic<Command> = Topic::fixed("command", 1024);
/// What the guard let through; by bridge, run or emulator.
pub const APPLIED: Topic<Applied> = Topic::fixed("applied", 1024);
/// What the bus does; by bridge or run, once a period.
pub const BUS: Topic<BusStatus> = Topic::fixed("bus", 8);
/// What the guard decided and refused; by bridge, run or emulator.
pub const GUARD_EVENTS: Topic<GuardEvent> = Topic::fixed("guard-events", 1024);
/// What each controller step consumed and answered, for the recorder; by control or run.
pub const CONTROL_STEPS: Topic<ControlStep> = Topic::fixed("control-steps", 1024);
/// What each period of the guard consumed and let through, for the recorder; by bridge, run or emulator.
pub const GUARD_STEPS: Topic<GuardStep> = Topic::fixed("guard-steps", 1024);
/// An operator's `arm` and `disarm`; by one short-lived process at a time.
pub const REQUEST: Topic<Request> = Topic::fixed("request", 8);
/// An operator's `stop`. Places of its own, and more than one: neither an `arm` that waits for its checks nor a `stop`
/// that hangs or was suspended is in the way of the next `stop`.
pub const STOPS: [Topic<Request>; 3] =
    [Topic::fixed("stop-1", 8), Topic::fixed("stop-2", 8), Topic::fixed("stop-3", 8)];
/// Numbered steps of a bench on virtual time; by the emulator in lockstep.
pub const LOCKSTEP_STEPS: Topic<LockstepStep> = Topic::fixed("lockstep-steps", 8);
/// Their answers; by control in lockstep.
pub const LOCKSTEP_ANSWERS: Topic<LockstepAnswer> = Topic::fixed("lockstep-answers", 8);

impl<T: Shareable> Topic<T> {
    const fn fixed(name: &'static str, depth: u32) -> Self {
        Self { name: Cow::Borrowed(name), depth, payload: PhantomData }
    }

    /// Name of the topic.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of values a reader may be behind without losing one.
    #[must_use]
    pub fn depth(&self) -> u32 {
        self.depth
    }
}
