//! `control`: one controller on a fixed period, or on the arrival of the IMU frame, between shared memory and
//! shared memory.

use super::ProcessError;
use super::command_source::CommandSource;
use super::control_output::{AngleError, ControlOutput};
use super::imu_trigger::ImuTrigger;
use super::sensor_watch::SensorWatch;
use super::thresholds::THRESHOLDS;
use crate::bench::{BenchConfig, StepTrigger};
use crate::clock;
use crate::rt::{self, Cycle, Granted, LogQueue, LogWriter, Shutdown, Summary, Wake};
use crate::shm::{APPLIED, Bell, BenchMember, ProcessRole, Publisher, SENSORS, Subscriber, Waiter};
use crate::signal::{Applied, CycleSample, Heartbeat, Sensors};

const LOG_LINES: usize = 64;

/// The control process before its thread is made real-time.
#[derive(Debug)]
pub struct ControlProcess {
    trigger: StepTrigger,
    cycle: Cycle,
    output: ControlOutput,
    sensors: Subscriber<Sensors>,
    newest: Sensors,
    sensor_watch: SensorWatch,
    imu_trigger: ImuTrigger,
    applied: Subscriber<Applied>,
    passed: Applied,
    cycles: Publisher<CycleSample>,
    heartbeats: Publisher<Heartbeat>,
    heartbeat: Heartbeat,
    guard_bell: Bell,
    bell: Bell,
    /// `newest` came after the last look, and is to be looked at without waiting.
    is_news: bool,
    // Last: everything above lives on it.
    _bench: BenchMember,
}

/// What the control process ends with.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ControlSummary {
    /// How well the angle was held.
    pub angle: AngleError,
    /// Timing of the cycle.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

impl ControlProcess {
    /// Joins the bench and takes its controls.
    ///
    /// # Errors
    /// A second controller on the same bench; a bench that cannot be joined.
    pub fn open(config: &BenchConfig, source: CommandSource, log: LogQueue) -> Result<Self, ProcessError> {
        config.check()?;
        let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Control)?;
        let period_ns = clock::span_ns(config.period_s);
        let output = ControlOutput::open(&bench, source)?;
        let now_ns = clock::monotonic_ns();
        Ok(Self {
            trigger: config.trigger,
            cycle: Cycle::new(period_ns, now_ns.saturating_add(period_ns)),
            output,
            sensors: bench.subscribe(&SENSORS)?,
            newest: Sensors::default(),
            sensor_watch: SensorWatch::new(log, period_ns),
            imu_trigger: ImuTrigger::new(period_ns),
            applied: bench.subscribe(&APPLIED)?,
            passed: Applied::default(),
            cycles: bench.publish(&ProcessRole::Control.cycle())?,
            heartbeats: bench.publish(&ProcessRole::Control.heartbeat())?,
            heartbeat: Heartbeat {
                count: 0,
                stamp_ns: now_ns,
                born_ns: now_ns,
                role: ProcessRole::Control as u32,
                process_id: std::process::id(),
            },
            guard_bell: bench.bell(Waiter::Guard)?,
            bell: bench.bell(Waiter::Control)?,
            is_news: false,
            _bench: bench,
        })
    }

    /// Begins a period from now: for after the real-time set-up.
    pub(crate) fn start(&mut self) {
        self.cycle.start_at(clock::monotonic_ns().saturating_add(self.cycle.period_ns()));
    }

    /// Waits for the next slot and runs it. Returns whether a command went out.
    pub fn turn(&mut self) -> bool {
        let (is_imu, due_ns) = (self.trigger == StepTrigger::Imu, self.cycle.due_ns());
        let (woken, now_ns) = if is_imu && !std::mem::take(&mut self.is_news) {
            rt::wait_timed([self.bell.descriptor()], due_ns)
        } else {
            (if is_imu { Wake::Deadline } else { rt::wait([], due_ns) }, clock::monotonic_ns())
        };
        self.look();
        let stepped = self.run_slot(now_ns);
        // After the command is out.
        self.sensor_watch.look(now_ns, &self.newest);
        if matches!(woken, Wake::Ready(_)) {
            // After the command is out, which it would delay; what came meanwhile may have rung the bell that is quiet now.
            self.bell.quiet();
            self.is_news = self.look();
        }
        stepped
    }

    /// Takes the newest sensors, if there are newer ones.
    fn look(&mut self) -> bool {
        let newest = self.sensors.newest();
        self.newest = newest.unwrap_or(self.newest);
        newest.is_some()
    }

    /// Runs a slot at `now_ns`, if one has begun. Returns whether a command went out.
    fn run_slot(&mut self, now_ns: u64) -> bool {
        let is_imu = self.trigger == StepTrigger::Imu;
        let release = if is_imu && self.imu_trigger.is_due(&self.newest.body_rate) {
            self.cycle.begin_at_arrival(now_ns, self.cycle.period_ns() / 2)
        } else if is_imu {
            // A slot without an IMU frame of its own has nothing to run for: the guard sees that no command comes.
            if now_ns >= self.cycle.due_ns() {
                self.cycle.skip();
            }
            return false;
        } else if let Some(release) = self.cycle.begin(now_ns) {
            release
        } else {
            return false;
        };
        let has_sensors = self.newest.sequence > 0;
        if has_sensors {
            self.publish_command(now_ns);
        }
        let finished_ns = clock::monotonic_ns();
        let sample = self.cycle.finish(release, finished_ns, self.newest.body_rate.stamp_ns);
        self.cycles.send(&CycleSample { role: ProcessRole::Control as u32, ..sample });
        self.heartbeat.count += 1;
        self.heartbeat.stamp_ns = finished_ns;
        self.heartbeats.send(&self.heartbeat);
        has_sensors
    }

    fn publish_command(&mut self, now_ns: u64) {
        if let Some(applied) = self.applied.newest() {
            self.passed = applied;
        }
        let silent_ns = self.cycle.period_ns().saturating_mul(THRESHOLDS.silent_periods);
        if now_ns.saturating_sub(self.passed.stamp_ns) > silent_ns {
            self.passed = Applied::default();
        }
        let command = self.output.step(now_ns, &self.newest, &self.passed);
        self.output.command(&command);
        self.guard_bell.ring();
        self.output.record(&self.newest, &self.passed, &command);
    }

    /// The slots and their timing.
    #[must_use]
    pub fn cycle(&self) -> &Cycle {
        &self.cycle
    }

    /// How well the angle was held so far.
    #[must_use]
    pub fn angle(&self) -> AngleError {
        self.output.angle()
    }
}

/// Runs the controller until `shutdown`, for `seconds` at most. The guard sees the commands stop, and stops the rotors.
///
/// # Errors
/// [`ProcessError`] before the first cycle.
pub fn control(
    config: &BenchConfig,
    source: CommandSource,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<ControlSummary, ProcessError> {
    let log_writer = LogWriter::start(LOG_LINES)?;
    let mut control = ControlProcess::open(config, source, log_writer.queue())?;
    let granted = config.real_time.beneath().apply()?;
    control.start();
    tracing::info!(bench = config.name, period_s = config.period_s, "control: {granted}");
    let end_ns = end_after(seconds);
    let waiting_ns = end_after(Some(THRESHOLDS.waiting_s));
    let mut is_new = true;
    while !shutdown.is_requested() && is_before(end_ns) && !control.output.is_finished() {
        control.turn();
        let has_sensors = control.newest.sequence > 0;
        if is_new && (has_sensors || !is_before(waiting_ns)) {
            is_new = false;
            if !has_sensors {
                tracing::info!("control waits for sensors: neither bridge nor emulate --shm has sent any");
            }
        }
    }
    shutdown.request();
    tracing::info!("control ends: {}", shutdown.reason());
    Ok(ControlSummary { angle: control.angle(), timing: control.cycle.statistics().summary(), granted })
}

/// [ns] CLOCK_MONOTONIC when a run of `seconds` that begins now ends.
pub(crate) fn end_after(seconds: Option<f64>) -> u64 {
    seconds.map_or(u64::MAX, |seconds| clock::monotonic_ns().saturating_add(clock::span_ns(seconds)))
}

/// Whether it is before `end_ns`, by [`end_after`]; without an end the clock is not asked.
pub(crate) fn is_before(end_ns: u64) -> bool {
    end_ns == u64::MAX || clock::monotonic_ns() < end_ns
}
