//! The state table as data: states, triggers, causes.

use std::fmt;

/// State of the guard; the number is [`crate::signal::Applied::state`].
#[repr(u32)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum State {
    /// Nothing leaves but zero.
    #[default]
    Disarmed = 0,
    /// The operator has asked to arm; every check must be good for a while. Nothing leaves but zero.
    PreArm = 1,
    /// Fresh commands leave, within the limits.
    Armed = 2,
    /// As armed, but something is missing: the last command is held, for N periods at most.
    Degraded = 3,
    /// Ramped to zero, or on the way. Only the operator leads out, by `disarm` or `stop`.
    FailsafeLatched = 4,
    /// Zero at once, by the operator's `stop`. Only `disarm` leads out.
    EmergencyStop = 5,
}

impl State {
    /// All states, in the order of their codes.
    pub const ALL: [Self; 6] = [
        Self::Disarmed,
        Self::PreArm,
        Self::Armed,
        Self::Degraded,
        Self::FailsafeLatched,
        Self::EmergencyStop,
    ];

    /// The state with this code.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|state| *state as u32 == code)
    }

    /// Whether commands leave in this state.
    #[must_use]
    pub fn is_active(self) -> bool {
        matches!(self, Self::Armed | Self::Degraded)
    }

    /// Where `trigger` leads from here; `None` = nowhere.
    #[must_use]
    pub fn next(self, trigger: Trigger) -> Option<Self> {
        TRANSITIONS.iter().find(|(from, by, _)| *from == self && *by == trigger).map(|(_, _, to)| *to)
    }
}

impl fmt::Display for State {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Disarmed => "disarmed",
            Self::PreArm => "pre-arm checks",
            Self::Armed => "armed",
            Self::Degraded => "degraded",
            Self::FailsafeLatched => "failsafe latched",
            Self::EmergencyStop => "emergency stop",
        })
    }
}

/// What can move the guard from state to state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trigger {
    /// The operator's `arm`.
    Arm,
    /// The operator's `disarm`.
    Disarm,
    /// The operator's `stop`.
    Stop,
    /// Every pre-arm check was good for long enough.
    ChecksPassed,
    /// They were not, in the time allowed.
    ChecksFailed,
    /// A period without a fresh command, or with a bad value of a required signal.
    Miss,
    /// Clean for N periods.
    Recover,
    /// The ladder's end: hold is over, or there is no point in holding.
    Trip,
}

impl Trigger {
    /// All triggers.
    pub const ALL: [Self; 8] = [
        Self::Arm,
        Self::Disarm,
        Self::Stop,
        Self::ChecksPassed,
        Self::ChecksFailed,
        Self::Miss,
        Self::Recover,
        Self::Trip,
    ];
}

/// Every transition there is. What is not in this table does not happen; in particular nothing but `Arm`
/// leads out of `Disarmed` towards the rotors, and nothing but `Disarm` leads back to `Disarmed` from a latch.
#[rustfmt::skip]
pub const TRANSITIONS: &[(State, Trigger, State)] = &[
    (State::Disarmed,        Trigger::Arm,          State::PreArm),
    (State::Disarmed,        Trigger::Stop,         State::EmergencyStop),
    (State::Disarmed,        Trigger::Trip,         State::FailsafeLatched),
    (State::PreArm,          Trigger::ChecksPassed, State::Armed),
    (State::PreArm,          Trigger::ChecksFailed, State::Disarmed),
    (State::PreArm,          Trigger::Disarm,       State::Disarmed),
    (State::PreArm,          Trigger::Stop,         State::EmergencyStop),
    (State::PreArm,          Trigger::Trip,         State::FailsafeLatched),
    (State::Armed,           Trigger::Miss,         State::Degraded),
    (State::Armed,           Trigger::Disarm,       State::Disarmed),
    (State::Armed,           Trigger::Stop,         State::EmergencyStop),
    (State::Armed,           Trigger::Trip,         State::FailsafeLatched),
    (State::Degraded,        Trigger::Recover,      State::Armed),
    (State::Degraded,        Trigger::Disarm,       State::Disarmed),
    (State::Degraded,        Trigger::Stop,         State::EmergencyStop),
    (State::Degraded,        Trigger::Trip,         State::FailsafeLatched),
    (State::FailsafeLatched, Trigger::Disarm,       State::Disarmed),
    (State::FailsafeLatched, Trigger::Stop,         State::EmergencyStop),
    (State::EmergencyStop,   Trigger::Disarm,       State::Disarmed),
];

/// Why a transition happened, or why something was refused; the number is [`crate::signal::Applied::cause`].
#[repr(u32)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Cause {
    /// Nothing has happened yet.
    #[default]
    None = 0,
    /// The operator armed.
    OperatorArm = 1,
    /// The operator disarmed.
    OperatorDisarm = 2,
    /// The operator stopped.
    OperatorStop = 3,
    /// Every pre-arm check was good.
    ChecksPassed = 4,
    /// Clean again.
    Recovered = 5,
    /// No new command.
    CommandMissing = 6,
    /// Older than its time-to-live.
    CommandExpired = 7,
    /// Sequence or stamp did not advance.
    CommandRepeated = 8,
    /// Not a finite number.
    CommandNotANumber = 9,
    /// Stamped later than now.
    CommandFromFuture = 10,
    /// Answers sensors of long ago: alive, but not fresh.
    CommandAnswersOldSensors = 11,
    /// Answers sensors that have not been yet.
    CommandAheadOfSensors = 12,
    /// A required signal never came.
    SignalNever = 13,
    /// A required signal stopped coming.
    SignalStale = 14,
    /// A required signal is outside its range.
    SignalOutOfRange = 15,
    /// A required signal is not a finite number.
    SignalNotANumber = 16,
    /// A required signal goes on coming, and its value never changes.
    SignalFrozen = 17,
    /// The sender's counter jumped, went back or repeated.
    SignalCounter = 18,
    /// Too many misses, though never too many in a row.
    TooManyMisses = 19,
    /// The controller swings from limit to limit.
    Oscillation = 20,
    /// The guard's own process stood still.
    GuardPaused = 21,
    /// The bus is off, stalled or gone.
    BusDead = 22,
    /// The process is ending: a signal, a panic, a closed terminal.
    Shutdown = 23,
    /// The request is too old, or older than this run of the guard.
    RequestStale = 24,
    /// The request's code is unknown.
    RequestUnknown = 25,
    /// The request leads nowhere from this state.
    RequestRefused = 26,
    /// Frames with the command's identifier that we did not send: another controller, or a forger.
    ForeignCommand = 27,
    /// A node whose values are used does not say how it is.
    NodeSilent = 28,
    /// A node whose values are used says that it is not well, or not at work.
    NodeUnhealthy = 29,
    /// Two nodes have one number.
    NodeIdTwice = 30,
    /// A rotor's speed is not what the model makes of its command.
    SpeedWrong = 31,
    /// A rotor turns though it was commanded to stand.
    TurnsUncommanded = 32,
}

impl Cause {
    /// Number of causes.
    pub const COUNT: usize = 33;

    /// Cause, its name for scripts and its label, in the order of the codes.
    #[rustfmt::skip]
    pub const ALL: [(Self, &'static str, &'static str); Self::COUNT] = [
        (Self::None, "none", "nothing happened yet"),
        (Self::OperatorArm, "operator_arm", "operator armed"),
        (Self::OperatorDisarm, "operator_disarm", "operator disarmed"),
        (Self::OperatorStop, "operator_stop", "operator stopped"),
        (Self::ChecksPassed, "checks_passed", "pre-arm checks passed"),
        (Self::Recovered, "recovered", "clean again"),
        (Self::CommandMissing, "command_missing", "no fresh command"),
        (Self::CommandExpired, "command_expired", "command older than its time-to-live"),
        (Self::CommandRepeated, "command_repeated", "command repeated or out of order"),
        (Self::CommandNotANumber, "command_not_a_number", "command is not a number"),
        (Self::CommandFromFuture, "command_from_future", "command stamped in the future"),
        (Self::CommandAnswersOldSensors, "command_answers_old_sensors", "command answers old sensor values"),
        (Self::CommandAheadOfSensors, "command_ahead_of_sensors", "command answers sensor values that do not exist"),
        (Self::SignalNever, "signal_never", "required signal never received"),
        (Self::SignalStale, "signal_stale", "required signal is stale"),
        (Self::SignalOutOfRange, "signal_out_of_range", "required signal is out of range"),
        (Self::SignalNotANumber, "signal_not_a_number", "required signal is not a number"),
        (Self::SignalFrozen, "signal_frozen", "required signal is frozen"),
        (Self::SignalCounter, "signal_counter", "required signal's frame counter is wrong"),
        (Self::TooManyMisses, "too_many_misses", "too many misses"),
        (Self::Oscillation, "oscillation", "controller swings from limit to limit"),
        (Self::GuardPaused, "guard_paused", "the guard's process stood still"),
        (Self::BusDead, "bus_dead", "the bus is dead"),
        (Self::Shutdown, "shutdown", "the process is ending"),
        (Self::RequestStale, "request_stale", "request is too old"),
        (Self::RequestUnknown, "request_unknown", "request is unknown"),
        (Self::RequestRefused, "request_refused", "request is not possible in this state"),
        (Self::ForeignCommand, "foreign_command", "another sender commands the rotors"),
        (Self::NodeSilent, "node_silent", "a node of the bus is silent"),
        (Self::NodeUnhealthy, "node_unhealthy", "a node of the bus is not well"),
        (Self::NodeIdTwice, "node_id_twice", "two nodes of the bus have one number"),
        (Self::SpeedWrong, "speed_wrong", "a rotor's speed does not answer its command"),
        (Self::TurnsUncommanded, "turns_uncommanded", "a rotor turns without a command"),
    ];

    /// The cause with this code.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().map(|(cause, ..)| cause).find(|cause| *cause as u32 == code)
    }

    /// Its name in snake case: stable, for scripts.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(cause, ..)| *cause == self).map_or("", |(_, name, _)| name)
    }
}

impl fmt::Display for Cause {
    /// Its label.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(
            Self::ALL.into_iter().find(|(cause, ..)| cause == self).map_or("", |(.., label)| label),
        )
    }
}

/// What an operator can ask for; the number is [`crate::signal::Request::act`].
#[repr(u32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OperatorAct {
    /// Begin the pre-arm checks, and arm when they pass.
    Arm = 1,
    /// Zero, and acknowledge a latch.
    Disarm = 2,
    /// Zero at once, latched.
    Stop = 3,
}

impl OperatorAct {
    /// The act with this code.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        [Self::Arm, Self::Disarm, Self::Stop].into_iter().find(|act| *act as u32 == code)
    }

    /// The trigger and the cause it stands for.
    pub(super) fn meaning(self) -> (Trigger, Cause) {
        match self {
            Self::Arm => (Trigger::Arm, Cause::OperatorArm),
            Self::Disarm => (Trigger::Disarm, Cause::OperatorDisarm),
            Self::Stop => (Trigger::Stop, Cause::OperatorStop),
        }
    }
}
