//! The house's nouns: what a sensor said, what a controller wants, what the guard let through.
//!
//! All are plain `repr(C)` values without pointers, so that the same bytes cross shared memory, the
//! recording and a function call.

use iceoryx2::prelude::ZeroCopySend;

/// Number of rotors on the bench; rotor 1 has index 0. See the drawing in the crate's page.
pub const ROTORS: usize = 2;

/// One measured quantity, with its age and its health.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Sample")]
pub struct Sample {
    /// Value in the SI unit of the field that holds it; the last good one while `health` says it is bad.
    pub value: f64,
    /// [ns] CLOCK_MONOTONIC when the value reached this machine; 0 = never.
    pub stamp_ns: u64,
    /// Number of values received so far, wrapping: tells a stream that stopped from one that goes on.
    pub count: u32,
    /// Bits of [`Health`]; 0 = good.
    pub health: u32,
}

/// Bits of [`Sample::health`]. Bad values are flagged and recorded, never silently replaced.
pub struct Health;

impl Health {
    /// No value has ever arrived.
    pub const NEVER: u32 = 1;
    /// The last value is older than the signal's staleness limit.
    pub const STALE: u32 = 1 << 1;
    /// The last value received is outside the signal's configured range.
    pub const OUT_OF_RANGE: u32 = 1 << 2;
    /// The last value received is not a finite number.
    pub const NOT_A_NUMBER: u32 = 1 << 3;
    /// Frames go on, but the value (or the sender's counter) has not changed for too long.
    pub const FROZEN: u32 = 1 << 4;
    /// The sender's counter jumped, went back or repeated.
    pub const COUNTER: u32 = 1 << 5;
}

impl Sample {
    /// A good sample of `value` at `stamp_ns`.
    #[must_use]
    pub fn good(value: f64, stamp_ns: u64, count: u32) -> Self {
        Self { value, stamp_ns, count, health: 0 }
    }

    /// A channel that never received anything.
    #[must_use]
    pub fn never() -> Self {
        Self { value: 0.0, stamp_ns: 0, count: 0, health: Health::NEVER }
    }

    /// Whether a controller may use the value.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.health == 0
    }
}

/// Everything measured, as the bridge or the emulator publishes it: the newest value of each channel.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("rotorbench::Sensors")]
pub struct Sensors {
    /// Counts publications from 1; 0 = nothing published yet.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC at publication.
    pub stamp_ns: u64,
    /// [rad/s] gyroscope, about the bench's axis.
    pub body_rate: Sample,
    /// [rad] encoder or potentiometer at the pivot, where the bench has one; recorded, not used by EMC.
    pub body_angle: Sample,
    /// [m/s²] accelerometer x, y, z.
    pub acceleration: [Sample; 3],
    /// [V] battery.
    pub battery_voltage: Sample,
    /// [rad/s] rotor speeds (mechanical).
    pub propeller_rate: [Sample; ROTORS],
    /// [A] motor or ESC input currents.
    pub current: [Sample; ROTORS],
    /// [N] load cells, where the bench has them.
    pub thrust: [Sample; ROTORS],
}

impl Default for Sensors {
    fn default() -> Self {
        let never = Sample::never();
        Self {
            sequence: 0,
            stamp_ns: 0,
            body_rate: never,
            body_angle: never,
            acceleration: [never; 3],
            battery_voltage: never,
            propeller_rate: [never; ROTORS],
            current: [never; ROTORS],
            thrust: [never; ROTORS],
        }
    }
}

/// What the controller wants, before the guard.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Command")]
pub struct Command {
    /// Counts steps of the controller from 1; the guard refuses a repeated or older one.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC when it was published (0 in a bare step; the process stamps it).
    pub stamp_ns: u64,
    /// [`Sensors::sequence`] it answers: freshness, not liveness.
    pub sensors_sequence: u64,
    /// [-] rotor commands u_1, u_2 in 0..1.
    pub rotor: [f64; ROTORS],
    /// [N m] u_p, the torque it asks for. [LPC16] Eq. (19).
    pub torque: f64,
    /// Bits of [`CommandFlags`].
    pub flags: u32,
    /// Which controller: 1 EMC, 2 PID, 3 open-loop experiment.
    pub controller: u32,
    /// Controller's view of its state, for recording and for the report; see [`Estimate`].
    pub estimate: Estimate,
}

/// Bits of [`Command::flags`].
pub struct CommandFlags;

impl CommandFlags {
    /// A rotor command was clipped at 0..1 by the allocation.
    pub const SATURATED: u32 = 1;
    /// A sensor it needs was not good in this step; the prediction was used instead.
    pub const SENSOR_MISSING: u32 = 1 << 1;
    /// The battery voltage was not good; the last good (or full) one was used.
    pub const VOLTAGE_ASSUMED: u32 = 1 << 2;

    /// The bits for what happened in a step.
    #[must_use]
    pub fn of(saturated: bool, sensor_missing: bool, voltage_assumed: bool) -> u32 {
        (if saturated { Self::SATURATED } else { 0 })
            | (if sensor_missing { Self::SENSOR_MISSING } else { 0 })
            | (if voltage_assumed { Self::VOLTAGE_ASSUMED } else { 0 })
    }
}

/// What the controller believes, in SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Estimate")]
pub struct Estimate {
    /// [rad] reference angle of this step.
    pub reference_angle: f64,
    /// [rad] estimated (integrated) angle.
    pub body_angle: f64,
    /// [rad/s] estimated body rate.
    pub body_rate: f64,
    /// [rad/s²] estimated angular acceleration from the actuators.
    pub actuator_acceleration: f64,
    /// [N m] estimated disturbance torque (EMC), or the integral's part of the command (PID).
    pub disturbance_torque: f64,
    /// [rad/s] model error e_m: estimated minus measured body rate.
    pub model_error: f64,
}

/// What the guard really let through: what the rotors got.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Applied")]
pub struct Applied {
    /// Counts the guard's periods from 1; 0 = nothing applied yet.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC when it left the guard.
    pub stamp_ns: u64,
    /// [`Command::sequence`] it came from; 0 = none (safe command).
    pub command_sequence: u64,
    /// [-] rotor commands sent, in 0..1.
    pub rotor: [f64; ROTORS],
    /// Guard state code, see `guard::State`.
    pub state: u32,
    /// Code of the cause of the last transition, see `guard::Cause`.
    pub cause: u32,
    /// Bits of [`AppliedFlags`].
    pub flags: u32,
    /// Consecutive periods without a fresh command.
    pub misses: u32,
}

/// Bits of [`Applied::flags`]: what the guard changed.
pub struct AppliedFlags;

impl AppliedFlags {
    /// Clipped at the absolute limit, or at the rising limit of the spin-up after arming.
    pub const LIMITED: u32 = 1;
    /// Clipped at the slew limit.
    pub const SLEWED: u32 = 1 << 1;
    /// No fresh command in this period: the last one is held.
    pub const HELD: u32 = 1 << 2;
    /// On the way to zero.
    pub const RAMPING: u32 = 1 << 3;
}

/// What the angle should do now.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Reference")]
pub struct Reference {
    /// [rad]
    pub angle: f64,
    /// [rad/s]
    pub rate: f64,
    /// [rad/s²]
    pub acceleration: f64,
    /// [rad/s³]
    pub jerk: f64,
}

/// An operator's act on a running bench.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Request")]
pub struct Request {
    /// Counts the sender's requests from 1.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC when it was made.
    pub stamp_ns: u64,
    /// 1 arm, 2 disarm, 3 emergency stop; see `guard::OperatorAct`.
    pub act: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// One transition of the guard, or one counted refusal.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::GuardEvent")]
pub struct GuardEvent {
    /// Counts the guard's events from 1.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC.
    pub stamp_ns: u64,
    /// Guard state before.
    pub from: u32,
    /// Guard state after (the same for a refusal without a transition).
    pub to: u32,
    /// Cause code, see `guard::Cause`.
    pub cause: u32,
    /// Which signal or rotor the cause speaks of; `u32::MAX` = none.
    pub subject: u32,
    /// The value that was refused or measured, in its unit.
    pub value: f64,
}

/// Identity and pulse of a process on the bench.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Heartbeat")]
pub struct Heartbeat {
    /// Counts cycles.
    pub count: u64,
    /// [ns] CLOCK_MONOTONIC of the last cycle.
    pub stamp_ns: u64,
    /// [ns] CLOCK_MONOTONIC when this life of the process began: a restart shows as a new one.
    pub born_ns: u64,
    /// 1 bridge, 2 control, 3 emulate, 4 run, 5 record, 6 monitor.
    pub role: u32,
    /// Operating-system process id.
    pub process_id: u32,
}

/// Statistics of one cycle, published each period for recorder and monitor.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::CycleSample")]
pub struct CycleSample {
    /// Grid slot number from 0; slots = run + skipped.
    pub slot: u64,
    /// [ns] when the slot should have begun.
    pub due_ns: u64,
    /// [ns] when it began: minus `due_ns` = release lateness.
    pub released_ns: u64,
    /// [ns] when its command was out: minus `due_ns` is what the deadline is on.
    pub finished_ns: u64,
    /// [ns] age of the newest gyro sample when the step used it.
    pub sensor_age_ns: u64,
    /// Slots skipped so far.
    pub skipped: u64,
    /// Overruns so far.
    pub overruns: u64,
    /// 1 bridge, 2 control, 3 emulate, 4 run.
    pub role: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// What the bus does, for whoever watches. All but the first three are totals of this life of the process.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend)]
#[type_name("rotorbench::BusStatus")]
pub struct BusStatus {
    /// Counts publications from 1.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC.
    pub stamp_ns: u64,
    /// [ns] since the first own frame that has not been seen on the bus yet; 0 = all were.
    pub echo_age_ns: u64,
    /// Frames of other senders received.
    pub received: u64,
    /// Frames lost because the process did not take them in time.
    pub lost: u64,
    /// Frames given to the interface.
    pub sent: u64,
    /// Own frames seen on the bus.
    pub echoed: u64,
    /// Frames that the interface did not take.
    pub not_sent: u64,
    /// Error frames.
    pub error_frames: u64,
    /// Frames with an identifier that no role names.
    pub unknown_id: u64,
    /// Frames with the identifier of our own command, from another sender.
    pub foreign_command: u64,
    /// Frames with the right identifier and the wrong number of bytes.
    pub wrong_length: u64,
    /// Frames whose counter does not go on.
    pub counter: u64,
    /// Values that are not a number.
    pub not_a_number: u64,
    /// Values outside the allowed range.
    pub out_of_range: u64,
}

/// One step of the controller: everything it consumed, and what it answered. The recorder's food: `replay` runs
/// the step again on it and expects the same bits. The reference is not among it: it follows from the bench file and
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
    /// [ns] CLOCK_MONOTONIC when this run began: tells one run of the emulator from the next.
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
