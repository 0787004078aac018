//! `bridge`: owns the bus and the guard. Frames to sensors, commands through the guard to frames.

use super::ProcessError;
use super::bus_io::{BusIo, BusIoSummary, Look, check_arming, ramp_down};
use super::control::end_after;
use crate::bench::{BenchConfig, StepTrigger};
use crate::bus_guard::BusGuard;
use crate::can::{Bus, BusPort};
use crate::clock;
use crate::guard::{Cause, State};
use crate::rt::{self, Granted, LogQueue, LogWriter, Shutdown, Summary, Wake};
use crate::shm::{BenchMember, ProcessRole};

#[cfg(test)]
mod tests;

/// Log lines of the cycle that may wait for the thread that writes them.
const LOG_LINES: usize = 256;
/// What the wait says of the bus, and of the bell.
const SOCKET: u32 = 1;
const BELL: u32 = 2;

/// The bridge process before its thread is made real-time.
#[derive(Debug)]
pub struct BridgeLoop<B: Bus = BusPort> {
    guard: BusGuard,
    bus_io: BusIo<B>,
    /// Periods without an own frame on the bus after which the bus is dead.
    hold_periods: u32,
    /// Whether the controller waits for the gyro.
    wakes_control: bool,
    // Last: everything above lives on it.
    _bench: BenchMember,
}

/// What the bridge ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BridgeSummary {
    /// The bus.
    pub bus: BusIoSummary,
    /// State of the guard at the end.
    pub state: String,
    /// Cause of its last transition.
    pub cause: String,
    /// Timing of the cycle.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

impl BridgeLoop {
    /// Opens the bus and takes the bench's guard.
    ///
    /// # Errors
    /// A second bridge on the same bench; a bus, DBC file or role that cannot be.
    pub fn open(config: &BenchConfig, log: LogQueue, shutdown: &Shutdown) -> Result<Self, ProcessError> {
        config.check()?;
        let guard = super::guard::of_bench(config)?;
        let period_ns = clock::span_ns(config.period_s);
        let hold_periods = guard.hold_periods();
        let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Bridge)?;
        let guard = BusGuard::open(&bench, guard, period_ns)?;
        // After the guard: a second bridge that is refused must not say a word on the bus, not even a safe one.
        let bus_io = BusIo::open(config, &bench, log, shutdown)?;
        let wakes_control = config.trigger == StepTrigger::Imu;
        Ok(Self { guard, bus_io, hold_periods, wakes_control, _bench: bench })
    }

    /// Waits for the socket, the command or the timer, whichever comes first, and does what is to be done.
    pub fn turn(&mut self) {
        let descriptors = [self.bus_io.descriptor(), self.guard.bell().descriptor()];
        let (woken, woken_ns) = rt::wait_timed(descriptors, self.guard.deadline_ns());
        let ready = if let Wake::Ready(bits) = woken { bits } else { 0 };
        self.act(ready, woken_ns);
    }

    fn end(&mut self) {
        ramp_down(self, |it| &mut it.guard, Self::turn);
    }
}

impl<B: Bus> BridgeLoop<B> {
    /// What a turn does after its wait, which ended at `woken_ns` because of what is in `ready`: [`SOCKET`], [`BELL`].
    fn act(&mut self, ready: u32, woken_ns: u64) {
        let look = if ready == BELL && !self.bus_io.must_look() {
            // Only a command or a request came, and nothing stands between it and the rotors.
            Look { at_ns: woken_ns, ..Look::default() }
        } else {
            self.bus_io.receive(ready & SOCKET != 0, woken_ns)
        };
        self.answer(&look, ready);
    }

    /// What a turn does with what is on the bus and in shared memory.
    fn answer(&mut self, look: &Look, ready: u32) {
        let (sensors, is_news) = self.bus_io.present(look, &self.guard);
        if is_news {
            self.guard.publish_sensors(&sensors, look.gyro && self.wakes_control);
        }
        // Decoding and publishing took a while, and the machine may have been busy elsewhere: the newest command may be younger
        // than the look at the socket, or than the end of the wait. Judged by the older time it would come from the future.
        let is_old = self.guard.look(look.at_ns) && ready != BELL;
        let now_ns = if is_old { self.bus_io.now_ns() } else { look.at_ns };
        let now_ns = self.guard.time_to_judge(now_ns, || self.bus_io.now_ns());
        let period_ns = self.guard.cycle().period_ns();
        if let Some(cause) = self.bus_io.trouble(look, now_ns, self.hold_periods, period_ns) {
            self.guard.trip(now_ns, cause);
        }
        if let Some((release, applied)) = self.guard.step_if_due(now_ns, self.bus_io.sensors()) {
            let out_ns = self.bus_io.send(&applied);
            self.guard.finish(release, out_ns, self.bus_io.sensors());
            self.bus_io.publish(out_ns);
        }
        if ready & BELL != 0 {
            // After the command is out, which it would delay; what came meanwhile may have rung the bell that is quiet now.
            self.guard.bell().quiet();
            self.guard.look(now_ns);
        }
    }
}

/// Runs the bridge until `shutdown`, for `seconds` at most; the last frames are the safe command.
///
/// # Errors
/// [`ProcessError`] before the first cycle.
pub fn bridge(
    config: &BenchConfig,
    arm: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<BridgeSummary, ProcessError> {
    check_arming(config, arm)?;
    let log_writer = LogWriter::start(LOG_LINES)?;
    let mut bridge = BridgeLoop::open(config, log_writer.queue(), shutdown)?;
    if arm {
        bridge.guard.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    bridge.guard.start_at(clock::monotonic_ns());
    tracing::info!(bench = config.name, interface = config.bus.interface, "bridge: {granted}");
    let end_ns = end_after(seconds);
    while !shutdown.is_requested() && bridge.bus_io.looked_ns() < end_ns {
        bridge.turn();
    }
    shutdown.request();
    tracing::info!("bridge ends: {}", shutdown.reason());
    bridge.end();
    let applied = bridge.guard.applied();
    Ok(BridgeSummary {
        bus: bridge.bus_io.summary(),
        state: State::from_code(applied.state).unwrap_or_default().to_string(),
        cause: Cause::from_code(applied.cause).unwrap_or_default().to_string(),
        timing: bridge.guard.cycle().statistics().summary(),
        granted,
    })
}
