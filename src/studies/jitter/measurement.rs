//! The stages: what runs in the cycle, from nothing to the whole loop. The real bodies of `control` and `run`, driven
//! by the emulator where they need sensors.

use std::fmt;
use std::thread;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::JitterConfig;
use crate::bench::BenchConfig;
use crate::can::{BusPort, is_virtual};
use crate::clock;
use crate::rt::{self, Cycle, Granted, LogQueue, LogWriter, RealTimeConfig, Shutdown, Statistics, Usage};
use crate::runtime::control::ControlProcess;
use crate::runtime::run::RunLoop;
use crate::runtime::{ProcessError, controller_plant, emulate};
use crate::shm::{BenchMember, BenchPlace, ProcessRole, SENSORS};
use crate::signal::{Applied, Sample, Sensors};
use crate::studies::thresholds::THRESHOLDS;

/// What runs in the cycle.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Nothing: the cycle and its statistics, which is what cyclictest measures.
    Bare,
    /// The controller's step on made-up sensors.
    Controller,
    /// `control` as it is, its sensors from an emulator on another thread through shared memory.
    SharedMemory,
    /// `run` as it is: bus, guard, controller and shared memory.
    Bus,
}

impl Stage {
    /// All of them, each holding what the one before holds.
    pub const ALL: [Self; 4] = [Self::Bare, Self::Controller, Self::SharedMemory, Self::Bus];

    /// As a tag in a file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bare => "bare",
            Self::Controller => "controller",
            Self::SharedMemory => "shared_memory",
            Self::Bus => "bus",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Bare => "bare cycle",
            Self::Controller => "with the controller",
            Self::SharedMemory => "with shared memory",
            Self::Bus => "with a bus",
        })
    }
}

/// What a stage showed in one round.
pub(crate) struct StageTimes {
    pub statistics: Statistics,
    pub usage: Usage,
    pub granted: Granted,
}

/// What the system grants a cycle's thread.
pub(crate) fn granted(settings: &RealTimeConfig) -> Result<Granted, ProcessError> {
    on_own_thread(|| Ok(settings.apply()?))
}

/// Measures `slots` slots of `stage` on a thread of its own.
pub(crate) fn measure(
    stage: Stage,
    config: &JitterConfig,
    slots: u64,
    shutdown: &Shutdown,
) -> Result<StageTimes, ProcessError> {
    let bench = &config.bench;
    match stage {
        Stage::Bare => on_own_thread(|| bare(bench, slots, shutdown)),
        Stage::Controller => on_own_thread(|| controller(bench, slots, shutdown)),
        Stage::SharedMemory => {
            // A bench of its own: this must not touch one that runs.
            let bench = BenchConfig { name: format!("jitter-{}", std::process::id()), ..bench.clone() };
            let result = beside(
                |peer| emulate::behind_guard(&peer_of(&bench), true, None, peer).map(|_| ()),
                |peer| on_own_thread(|| shared_memory(&bench, slots, shutdown, peer)),
            );
            if let Ok(place) = BenchPlace::open(&bench.name, &bench.shared_memory) {
                // What stays is in memory only, and `doctor --fix` finds it.
                let _ = place.remove();
            }
            result
        }
        Stage::Bus => {
            // Whether there is a bus at all, before anything of the bench is touched.
            drop(BusPort::open(&bench.bus.interface, bench.bus.fd)?);
            if !is_virtual(&bench.bus.interface) {
                if !config.is_interface_named {
                    return Err(ProcessError::JitterOnHardware { interface: bench.bus.interface.clone() });
                }
                return on_own_thread(|| bus(bench, slots, shutdown, false));
            }
            beside(
                |peer| emulate::on_bus(&peer_of(bench), false, None, peer).map(|_| ()),
                |_| on_own_thread(|| bus(bench, slots, shutdown, true)),
            )
        }
    }
}

/// The other side is no part of what is measured: it may have any processor, and gives way to the cycle.
fn peer_of(bench: &BenchConfig) -> BenchConfig {
    let RealTimeConfig { priority, .. } = bench.real_time;
    let real_time = RealTimeConfig {
        priority: priority.saturating_sub(1),
        processor: None,
        required: false,
        ..bench.real_time.clone()
    };
    BenchConfig { real_time, ..bench.clone() }
}

/// Runs `measured` while `peer` runs; the peer is ended afterwards. What is wrong with the peer comes first:
/// it is why the rest could not be.
fn beside<T: Send>(
    peer: impl FnOnce(&Shutdown) -> Result<(), ProcessError> + Send,
    measured: impl FnOnce(&Shutdown) -> Result<T, ProcessError> + Send,
) -> Result<T, ProcessError> {
    let end = Shutdown::default();
    thread::scope(|scope| {
        let other = thread::Builder::new().name("peer".to_owned()).spawn_scoped(scope, || {
            let result = without_log(|| peer(&end));
            end.request();
            result
        })?;
        let result = measured(&end);
        end.request();
        other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        result
    })
}

/// Without log records: that a loop begins and ends, some times a second, is no news here. Errors come back as values.
fn without_log<T>(act: impl FnOnce() -> T) -> T {
    tracing::subscriber::with_default(tracing::subscriber::NoSubscriber::default(), act)
}

/// On a thread whose priority, processor and counters are its own.
fn on_own_thread<T: Send>(
    measured: impl FnOnce() -> Result<T, ProcessError> + Send,
) -> Result<T, ProcessError> {
    thread::scope(|scope| {
        let measured = || without_log(measured);
        let cycle = thread::Builder::new().name("cycle".to_owned()).spawn_scoped(scope, measured)?;
        cycle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// A cycle with its work.
trait Work {
    /// Waits for the next slot and runs it.
    fn turn(&mut self);
    fn cycle(&self) -> &Cycle;
}

/// Turns until `slots` have gone by, and says what the kernel counted meanwhile.
fn go_through(work: &mut impl Work, slots: u64, shutdown: &Shutdown, granted: Granted) -> StageTimes {
    let before = Usage::of_this_thread();
    while work.cycle().slots() < slots && !shutdown.is_requested() {
        work.turn();
    }
    let usage = Usage::of_this_thread().since(before);
    StageTimes { statistics: work.cycle().statistics().clone(), usage, granted }
}

/// The cycle, and what is done in a slot.
struct Alone<F> {
    cycle: Cycle,
    work: F,
}

impl<F: FnMut(u64)> Alone<F> {
    /// Slot 0 is due a period from now.
    fn new(config: &BenchConfig, work: F) -> Self {
        let period_ns = clock::span_ns(config.period_s);
        Self { cycle: Cycle::new(period_ns, clock::monotonic_ns().saturating_add(period_ns)), work }
    }
}

impl<F: FnMut(u64)> Work for Alone<F> {
    fn turn(&mut self) {
        let _ = rt::wait([], self.cycle.due_ns());
        let now_ns = clock::monotonic_ns();
        if let Some(release) = self.cycle.begin(now_ns) {
            (self.work)(now_ns);
            self.cycle.finish(release, clock::monotonic_ns(), 0);
        }
    }

    fn cycle(&self) -> &Cycle {
        &self.cycle
    }
}

impl Work for ControlProcess {
    fn turn(&mut self) {
        self.turn();
    }

    fn cycle(&self) -> &Cycle {
        self.cycle()
    }
}

impl Work for RunLoop {
    fn turn(&mut self) {
        self.turn();
    }

    fn cycle(&self) -> &Cycle {
        self.guard().cycle()
    }
}

fn bare(config: &BenchConfig, slots: u64, shutdown: &Shutdown) -> Result<StageTimes, ProcessError> {
    let granted = config.real_time.apply()?;
    Ok(go_through(&mut Alone::new(config, |_| {}), slots, shutdown, granted))
}

fn controller(config: &BenchConfig, slots: u64, shutdown: &Shutdown) -> Result<StageTimes, ProcessError> {
    let source = controller_plant::command_source(config)?;
    let (mut state, mut sensors, mut applied) = (source.start(), Sensors::default(), Applied::default());
    let step = |now_ns| {
        made_up(&mut sensors, now_ns);
        let command = source.step(&mut state, &sensors, &applied);
        // As if the guard had let it through.
        applied.command_sequence = command.sequence;
        applied.rotor = std::hint::black_box(command.rotor);
    };
    let granted = config.real_time.apply()?;
    Ok(go_through(&mut Alone::new(config, step), slots, shutdown, granted))
}

/// Sensors of a body that trembles.
fn made_up(sensors: &mut Sensors, now_ns: u64) {
    let count = sensors.body_rate.count.wrapping_add(1);
    let rate = if count.is_multiple_of(2) { 0.004 } else { -0.004 };
    sensors.sequence += 1;
    sensors.stamp_ns = now_ns;
    sensors.body_rate = Sample::good(rate, now_ns, count);
    sensors.battery_voltage = Sample::good(12.4, now_ns, count);
}

fn shared_memory(
    config: &BenchConfig,
    slots: u64,
    shutdown: &Shutdown,
    peer: &Shutdown,
) -> Result<StageTimes, ProcessError> {
    let source = controller_plant::command_source(config)?;
    await_sensors(config, peer)?;
    let mut control = ControlProcess::open(config, source, LogQueue::new(8))?;
    let granted = config.real_time.apply()?;
    control.start();
    Ok(go_through(&mut control, slots, shutdown, granted))
}

/// Waits for the peer's first sensors; `peer` ends before them when it cannot run.
fn await_sensors(config: &BenchConfig, peer: &Shutdown) -> Result<(), ProcessError> {
    let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Monitor)?;
    let mut sensors = bench.subscribe(&SENSORS)?;
    let start = Instant::now();
    while sensors.newest().is_none() {
        if peer.is_requested() || start.elapsed().as_secs_f64() > THRESHOLDS.peer_s {
            return Err(ProcessError::not_running(&config.name));
        }
        thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}

/// `arms` where the other side is the emulator; on a bus that may be real the guard stays closed and every command is
/// the safe one.
fn bus(
    config: &BenchConfig,
    slots: u64,
    shutdown: &Shutdown,
    arms: bool,
) -> Result<StageTimes, ProcessError> {
    let source = controller_plant::command_source(config)?;
    let log_writer = LogWriter::start(16)?;
    let mut run = RunLoop::open(config, source, log_writer.queue(), shutdown)?;
    if arms {
        run.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    run.start();
    let measured = go_through(&mut run, slots, shutdown, granted);
    // As every end of a bench: by the ramp.
    run.end();
    Ok(measured)
}
