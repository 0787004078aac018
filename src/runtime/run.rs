//! `run`: bridge and control in one process. With `trigger = "imu"` the way from frame to frame is on one thread
//! without a wake-up in between; shared memory is written beside it, after the frames are out.

use super::ProcessError;
use super::bus_io::{BusIo, BusIoSummary, Look, check_arming, ramp_down};
use super::command_source::CommandSource;
use super::control::end_after;
use super::control_output::{AngleError, ControlOutput};
use super::imu_trigger::ImuTrigger;
use crate::bench::{BenchConfig, StepTrigger};
use crate::bus_guard::BusGuard;
use crate::clock;
use crate::guard::{Cause, State};
use crate::rt::{self, Granted, LogQueue, LogWriter, Shutdown, Summary, Wake};
use crate::shm::{BenchMember, GUARD_EVENTS, ProcessRole, Subscriber};
use crate::signal::GuardEvent;

const LOG_LINES: usize = 256;

/// The run process before its thread is made real-time.
#[derive(Debug)]
pub struct RunLoop {
    trigger: StepTrigger,
    guard: BusGuard,
    output: ControlOutput,
    imu_trigger: ImuTrigger,
    bus_io: BusIo,
    hold_periods: u32,
    /// [ns] when a command was out, this turn; the wait that follows spares the clock where nobody minds when it ends.
    out_ns: Option<u64>,
    events: Subscriber<GuardEvent>,
    // Last: everything above lives on it.
    _bench: BenchMember,
}

/// One line of the summary: what the guard decided.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EventLine {
    /// [s] since the run began.
    pub time_s: f64,
    /// State before.
    pub from: String,
    /// State after.
    pub to: String,
    /// Why.
    pub cause: String,
    /// The same as a name for scripts.
    pub code: &'static str,
}

impl EventLine {
    /// The line of `event`, in a run that began at `start_ns`.
    #[must_use]
    pub fn new(event: &GuardEvent, start_ns: u64) -> Self {
        let state = |code| State::from_code(code).unwrap_or_default().to_string();
        let cause = Cause::from_code(event.cause).unwrap_or_default();
        Self {
            time_s: clock::span_s(event.stamp_ns.saturating_sub(start_ns)),
            from: state(event.from),
            to: state(event.to),
            cause: cause.to_string(),
            code: cause.name(),
        }
    }
}

/// What a run ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RunSummary {
    /// How well the angle was held.
    pub angle: AngleError,
    /// State of the guard at the end.
    pub state: String,
    /// What the guard decided and refused, in order; refusals of one kind in a row count once.
    pub guard_events: Vec<EventLine>,
    /// How many more it decided before these, which the ring of the last 1,024 no longer holds.
    pub guard_events_lost: u64,
    /// The bus.
    pub bus: BusIoSummary,
    /// Timing of the cycle, frame to frame.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

impl RunLoop {
    /// Opens the bus, takes the bench's guard and its controls.
    ///
    /// # Errors
    /// A second bridge or controller on the same bench; a bus, DBC file or role that cannot be.
    pub fn open(
        config: &BenchConfig,
        source: CommandSource,
        log: LogQueue,
        shutdown: &Shutdown,
    ) -> Result<Self, ProcessError> {
        config.check()?;
        let guard = super::guard::of_bench(config)?;
        let period_ns = clock::span_ns(config.period_s);
        let hold_periods = guard.hold_periods();
        let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Run)?;
        let output = ControlOutput::open(&bench, source)?;
        let guard = BusGuard::open(&bench, guard, period_ns)?;
        // After guard and controls: who is refused them must not say a word on the bus, not even a safe one.
        let bus_io = BusIo::open(config, &bench, log, shutdown)?;
        Ok(Self {
            trigger: config.trigger,
            output,
            imu_trigger: ImuTrigger::new(period_ns),
            guard,
            bus_io,
            hold_periods,
            out_ns: None,
            events: bench.subscribe(&GUARD_EVENTS)?,
            _bench: bench,
        })
    }

    /// Begins a period from now: for after the real-time set-up.
    pub fn start(&mut self) {
        self.guard.start_at(clock::monotonic_ns());
    }

    /// See [`BusGuard::arm_by_itself`]; for a virtual interface only.
    pub(crate) fn arm_by_itself(&mut self) {
        self.guard.arm_by_itself();
    }

    /// Waits for the socket, a request or the timer, and does what is to be done.
    pub fn turn(&mut self) {
        let (look, has_rung) = self.wait();
        self.answer(&look, has_rung);
    }

    /// What is on the bus, and whether an operator has rung.
    fn wait(&mut self) -> (Look, bool) {
        let deadline_ns = if self.guard.is_stop() { 0 } else { self.guard.cycle().due_ns() };
        let descriptors = [self.bus_io.descriptor(), self.guard.bell().descriptor()];
        let now_ns = self.out_ns.take().unwrap_or_else(clock::monotonic_ns);
        let (woken, woken_ns) = rt::wait_from(descriptors, deadline_ns, now_ns);
        let ready = if let Wake::Ready(bits) = woken { bits } else { 0 };
        let look = self.bus_io.receive(ready & 1 != 0, woken_ns);
        let has_rung = ready & 2 != 0;
        if has_rung {
            self.guard.bell().quiet();
        }
        (look, has_rung)
    }

    fn answer(&mut self, look: &Look, has_rung: bool) {
        let is_imu = self.trigger == StepTrigger::Imu;
        let now_ns = look.at_ns;
        let period_ns = self.guard.cycle().period_ns();
        if let Some(cause) = self.bus_io.trouble(look, now_ns, self.hold_periods, period_ns) {
            self.guard.trip(now_ns, cause);
        }
        // Who asks for something rings. The places where he may have asked are memory gone cold: looked at on the way of a
        // frame for one who rang only.
        let stop = if has_rung { self.guard.take_request(now_ns) } else { self.guard.is_stop() };
        let is_due = is_imu && look.gyro && self.imu_trigger.is_due(&self.bus_io.sensors().body_rate);
        let release = if is_due {
            Some(self.guard.cycle_mut().begin_at_arrival(now_ns, period_ns / 2))
        } else {
            self.guard.cycle_mut().begin(now_ns)
        };
        // With the IMU as trigger a slot without its frame steps the guard, which counts a miss, and nothing else.
        let steps = release.is_some() && (!is_imu || is_due) && self.bus_io.sensors().sequence > 0;
        let (sensors, is_news) = self.bus_io.present(look, &self.guard);
        let before = *self.guard.applied();
        let command = steps.then(|| self.output.step(now_ns, &sensors, &before));
        let out_ns = (release.is_some() || stop).then(|| {
            let applied = self.guard.step_with(now_ns, self.bus_io.sensors(), command.as_ref());
            let out_ns = self.bus_io.send(&applied);
            self.guard.publish_step();
            out_ns
        });
        if let Some((release, out_ns)) = release.zip(out_ns) {
            self.guard.finish(release, out_ns, &sensors);
            self.bus_io.publish(out_ns);
            self.out_ns = is_imu.then_some(out_ns);
        }
        if let Some(command) = command {
            self.output.publish(&sensors, &before, &command);
        }
        if is_news {
            self.guard.publish_sensors(&sensors, false);
        }
        if !has_rung {
            // One who died before he could ring. A stop ends the next wait at once.
            self.guard.take_request(now_ns);
        }
    }

    /// The slots and their timing.
    #[must_use]
    pub fn guard(&self) -> &BusGuard {
        &self.guard
    }

    /// The ramp to zero, which the next steps carry out.
    pub(crate) fn end(&mut self) {
        ramp_down(self, |it| &mut it.guard, Self::turn);
    }

    fn event_lines(&mut self, start_ns: u64) -> Vec<EventLine> {
        let events = std::iter::from_fn(|| self.events.next_in_order());
        events.map(|event| EventLine::new(&event, start_ns)).collect()
    }
}

/// Runs bridge and controller until `shutdown`, for `seconds` at most; the last frames are the safe command.
///
/// # Errors
/// [`ProcessError`] before the first cycle.
pub fn run(
    config: &BenchConfig,
    source: CommandSource,
    arm: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<RunSummary, ProcessError> {
    check_arming(config, arm)?;
    let log_writer = LogWriter::start(LOG_LINES)?;
    let mut run = RunLoop::open(config, source, log_writer.queue(), shutdown)?;
    if arm {
        run.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    run.start();
    tracing::info!(bench = config.name, interface = config.bus.interface, "run: {granted}");
    let (start_ns, end_ns) = (clock::monotonic_ns(), end_after(seconds));
    while !shutdown.is_requested() && run.bus_io.looked_ns() < end_ns && !run.output.is_finished() {
        run.turn();
    }
    shutdown.request();
    tracing::info!("run ends: {}", shutdown.reason());
    let state = State::from_code(run.guard.applied().state).unwrap_or_default().to_string();
    run.end();
    Ok(RunSummary {
        angle: run.output.angle(),
        state,
        guard_events: run.event_lines(start_ns),
        guard_events_lost: run.events.lost(),
        bus: run.bus_io.summary(),
        timing: run.guard.cycle().statistics().summary(),
        granted,
    })
}
