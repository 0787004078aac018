//! What is wanted, by a controller or by an operator, and what the guard let through.

use iceoryx2::prelude::ZeroCopySend;

use super::ROTORS;

/// What the controller wants, before the guard.
///
/// In a controller: `examples/own_controller.rs`.
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
    /// Controller's view of its state, for recording and for the report; see [`StateEstimate`].
    pub estimate: StateEstimate,
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
pub struct StateEstimate {
    /// [rad] reference angle of this step.
    pub reference_angle: f64,
    /// [rad] estimated (integrated) angle.
    pub body_angle: f64,
    /// [rad/s] estimated body rate.
    pub body_rate: f64,
    /// [rad/s²] estimated angular acceleration from the actuators.
    pub actuator_acceleration: f64,
    /// [N m] estimated disturbance torque on the body; a PID's is what its integral holds against, so with the other
    /// sign than the integral's part of the command.
    pub disturbance_torque: f64,
    /// [rad/s] model error e_m: estimated minus measured body rate.
    pub model_error: f64,
}

/// What the guard really let through: what the rotors got.
///
/// In a controller: `examples/own_controller.rs`.
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
///
/// In a controller: `examples/own_controller.rs`.
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
