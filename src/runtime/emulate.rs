//! `emulate`: the emulated bench as a process, in the place of bridge and hardware or on the other side of a bus.

use super::ProcessError;
use crate::bench::{BenchConfig, StepTrigger};
use crate::bus_guard::BusGuard;
use crate::can::{BusPort, protocol};
use crate::clock;
use crate::emulate::{self, BodyMotion, BusSummary, EmulatedBus, EmulationOptions, Emulator};
use crate::guard::{Cause, State};
use crate::rt::{Granted, LogWriter, Shutdown, Summary};
use crate::shm::{BenchMember, ProcessRole};

/// Log lines of the cycle that may wait for the thread that writes them.
const LOG_LINES: usize = 64;

/// What an emulator behind shared memory ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GuardedSummary {
    /// Body and battery.
    pub body: BodyMotion,
    /// State of the guard at the end.
    pub state: String,
    /// Cause of its last transition.
    pub cause: String,
    /// Timing of the guard's cycle.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

/// The bench's emulator. Where the IMU frame is the trigger, the IMU runs at the control period.
///
/// # Errors
/// [`crate::emulate::EmulateError`] naming the key that cannot be.
pub fn emulator(config: &BenchConfig) -> Result<Emulator, ProcessError> {
    let mut settings = config.emulator();
    if config.trigger == StepTrigger::Imu {
        settings.sensors.body_rate.rate_hz = 1.0 / config.period_s;
    }
    Ok(settings.build()?)
}

/// Runs the emulated bench behind the guard and shared memory until `shutdown`, for `seconds` at most; the last it
/// does is the ramp to zero.
///
/// # Errors
/// A second bridge or emulator on the same bench; settings that cannot be.
pub fn behind_guard(
    config: &BenchConfig,
    arm: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<GuardedSummary, ProcessError> {
    config.check()?;
    let emulator = emulator(config)?;
    let guard = super::guard::of_bench(config)?;
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Emulate)?;
    let mut guard = BusGuard::open(&bench, guard, clock::span_ns(config.period_s))?;
    if arm {
        guard.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    guard.start_at(clock::monotonic_ns());
    tracing::info!(bench = config.name, "emulate: {granted}");
    let options = options(config, seconds);
    let body = emulate::run_behind_guard(&emulator, &mut guard, options, shutdown);
    shutdown.request();
    tracing::info!("emulate ends: {}", shutdown.reason());
    let applied = guard.applied();
    Ok(GuardedSummary {
        body,
        state: State::from_code(applied.state).unwrap_or_default().to_string(),
        cause: Cause::from_code(applied.cause).unwrap_or_default().to_string(),
        timing: guard.cycle().statistics().summary(),
        granted,
    })
}

/// Plays the ESCs and the IMU on the bench's CAN bus until `shutdown`, for `seconds` at most; with `asks_for_ids` by nodes that an
/// allocator has to give their ids first.
///
/// # Errors
/// A bus that cannot be opened; roles or settings that cannot be.
pub fn on_bus(
    config: &BenchConfig,
    asks_for_ids: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<BusSummary, ProcessError> {
    config.check()?;
    let emulator = emulator(config)?;
    let spoken = protocol(&config.bus, config.period_s)?;
    let now_ns = clock::monotonic_ns();
    let end = if asks_for_ids {
        spoken.bench_end_without_ids(now_ns).ok_or(ProcessError::NoNodeIds)?
    } else {
        spoken.bench_end(now_ns)
    };
    let log_writer = LogWriter::start(LOG_LINES)?;
    let port = BusPort::open(&config.bus.interface, config.bus.fd)?;
    let mut emulated = EmulatedBus::new(end, port);
    let granted = config.real_time.apply()?;
    tracing::info!(interface = config.bus.interface, "emulate: {granted}");
    let summary = emulated.run(&emulator, options(config, seconds), shutdown, &log_writer.queue());
    shutdown.request();
    tracing::info!("emulate ends: {}", shutdown.reason());
    Ok(summary)
}

fn options(config: &BenchConfig, seconds: Option<f64>) -> EmulationOptions {
    EmulationOptions {
        duration_s: seconds.unwrap_or(f64::INFINITY),
        wakes_control: config.trigger == StepTrigger::Imu,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::ProtocolName;

    /// Whether an emulated ESC still obeys its last command after this long.
    fn obeys(config: &BenchConfig, after_s: f64) -> bool {
        let emulator = emulator(config).expect("a bench");
        let mut state = emulator.start(1);
        emulator.command(&mut state, [0.4; 2]);
        emulator.advance(&mut state, clock::span_ns(after_s));
        state.rotor_commands() == [0.4; 2]
    }

    #[test]
    fn escs_on_dronecan_stop_later_than_the_guard_asks_unless_the_file_says_when() {
        let mut config = BenchConfig::default();
        assert_eq!([0.09, 0.11].map(|at_s| obeys(&config, at_s)), [true, false]);
        config.bus.protocol = ProtocolName::Dronecan;
        assert_eq!([0.09, 0.11, 0.49, 0.51].map(|at_s| obeys(&config, at_s)), [true, true, true, false]);
        config.guard.hold_s = 2.0;
        assert!(!obeys(&config, 0.51), "whatever the guard holds: it is the ESC's own");
        config.emulator.esc_timeout_s = Some(0.2);
        assert_eq!([0.19, 0.21].map(|at_s| obeys(&config, at_s)), [true, false]);
    }
}
