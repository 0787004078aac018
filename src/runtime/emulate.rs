//! `emulate`: the emulated bench as a process, in the place of bridge and hardware or on the other side of a bus.

use super::ProcessError;
use crate::bench::{BenchConfig, Trigger};
use crate::bus_guard::Gate;
use crate::can::{Port, Roles};
use crate::clock;
use crate::emulate::{self, BodySummary, BusDoor, BusSummary, DoorOptions, Emulator};
use crate::guard::{Cause, State};
use crate::rt::{Clerk, Granted, Shutdown, Summary};
use crate::shm::{Bench, Role};

/// Log lines of the cycle that may wait for the thread that writes them.
const LOG_LINES: usize = 64;

/// What an emulator behind shared memory ends with.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GateSummary {
    /// Body and battery.
    pub body: BodySummary,
    /// State of the guard at the end.
    pub state: String,
    /// Cause of its last transition.
    pub cause: String,
    /// Timing of the gate's cycle.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

/// The bench's emulator. Where the IMU frame is the trigger, the IMU runs at the control period.
///
/// # Errors
/// [`crate::emulate::EmulateError`] naming the key that cannot be.
pub fn emulator(config: &BenchConfig) -> Result<Emulator, ProcessError> {
    let mut settings = config.emulator.clone();
    if config.trigger == Trigger::Imu {
        settings.sensors.body_rate.rate_hz = 1.0 / config.period_s;
    }
    Ok(settings.build()?)
}

/// Runs the emulated bench behind the guard and shared memory until `shutdown`, for `seconds` at most; the last it
/// does is the ramp to zero.
///
/// # Errors
/// A second bridge or emulator on the same bench; settings that cannot be.
pub fn behind_gate(
    config: &BenchConfig,
    arm: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<GateSummary, ProcessError> {
    config.check()?;
    let emulator = emulator(config)?;
    let guard = config.guard.build(config.period_s)?;
    let bench = Bench::join(&config.name, &config.shared_memory, Role::Emulate)?;
    let mut gate = Gate::open(&bench, guard, clock::span_ns(config.period_s))?;
    if arm {
        gate.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    gate.start_at(clock::monotonic_ns());
    tracing::info!(bench = config.name, "emulate: {granted}");
    let options = options(config, seconds);
    let body = emulate::run_behind_gate(&emulator, &mut gate, options, shutdown);
    shutdown.request();
    tracing::info!("emulate ends: {}", shutdown.reason());
    let applied = gate.applied();
    Ok(GateSummary {
        body,
        state: State::from_code(applied.state).unwrap_or_default().to_string(),
        cause: Cause::from_code(applied.cause).unwrap_or_default().to_string(),
        timing: gate.cycle().statistics().summary(),
        granted,
    })
}

/// Plays the ESCs and the IMU on the bench's CAN bus until `shutdown`, for `seconds` at most.
///
/// # Errors
/// A bus that cannot be opened; roles or settings that cannot be.
pub fn on_bus(
    config: &BenchConfig,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<BusSummary, ProcessError> {
    config.check()?;
    let emulator = emulator(config)?;
    let roles = Roles::build(&config.bus, config.period_s)?;
    let clerk = Clerk::start(LOG_LINES)?;
    let mut door = BusDoor::new(roles, Port::open(&config.bus.interface, config.bus.fd)?);
    let granted = config.real_time.apply()?;
    tracing::info!(interface = config.bus.interface, "emulate: {granted}");
    let summary = door.run(&emulator, options(config, seconds), shutdown, &clerk.queue());
    shutdown.request();
    tracing::info!("emulate ends: {}", shutdown.reason());
    Ok(summary)
}

fn options(config: &BenchConfig, seconds: Option<f64>) -> DoorOptions {
    DoorOptions {
        duration_s: seconds.unwrap_or(f64::INFINITY),
        wakes_control: config.trigger == Trigger::Imu,
    }
}
