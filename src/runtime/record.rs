//! `record`: listens to everything a bench publishes, and to its bus, and writes it down. It never speaks: whether it
//! runs, hangs or is killed makes no difference to the bench.
//!
//! The same listener records from inside a process (`--record FILE`): on a thread of its own, so that no loop has
//! anything to do with a file.

use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use super::ProcessError;
use super::control::{end_after, is_before};
use super::experiment_plan::ExperimentPlan;
use super::lockstep::Interference;
use crate::bench::BenchConfig;
use crate::can::{Bus, BusPort};
use crate::clock;
use crate::model::Model;
use crate::recording::{
    RawFrame, RecordError, RecordSender, RecordedItem, Recorder, RecorderOptions, RecorderSummary,
    RecordingMetadata,
};
use crate::rt::{self, Shutdown};
use crate::shm::{
    APPLIED, BenchMember, COMMAND, CONTROL_STEPS, GUARD_EVENTS, GUARD_STEPS, ProcessRole, Publisher, REQUEST,
    SENSORS, STOPS, Shareable, ShmError, Subscriber, Topic,
};
use crate::signal::{
    Applied, Command, ControlStep, CycleSample, GuardEvent, GuardStep, Heartbeat, Request, Sensors,
};

/// How often the topics are looked at. Their rings hold a second of a 1 kHz bench.
const POLL: Duration = Duration::from_millis(2);
/// Polls between two pulses.
const POLLS_A_PULSE: u64 = 50;
/// Processes whose pulse and cycle are recorded.
const ROLES: [ProcessRole; 4] =
    [ProcessRole::Bridge, ProcessRole::Control, ProcessRole::Emulate, ProcessRole::Run];

/// What a recording of this bench must hold to be run again.
///
/// # Errors
/// A model or DBC file that cannot be read.
pub fn metadata(
    config: &BenchConfig,
    process: &str,
    plan: Option<&ExperimentPlan>,
) -> Result<RecordingMetadata, ProcessError> {
    let text = |text: Result<String, toml::ser::Error>| {
        text.map_err(|error| {
            std::io::Error::other(format!("the bench file has no spelling in TOML: {error}"))
        })
    };
    Ok(RecordingMetadata {
        process: process.to_owned(),
        bench: text(toml::to_string(config))?,
        model: Model::load(Path::new(&config.model))?.emit()?,
        experiment: plan.map_or_else(|| Ok(String::new()), |it| text(toml::to_string(it)))?,
        seeds: [("emulator".to_owned(), config.emulator.seed)].into(),
        dbc_files: config.bus.files()?,
        interface: config.bus.interface.clone(),
        ..RecordingMetadata::default()
    })
}

/// A topic being copied.
struct Tap<T: Shareable> {
    subscriber: Subscriber<T>,
    lost: u64,
}

impl<T: Shareable + Into<RecordedItem>> Tap<T> {
    fn open(bench: &BenchMember, topic: &Topic<T>) -> Result<Self, ShmError> {
        Ok(Self { subscriber: bench.subscribe(topic)?, lost: 0 })
    }

    fn copy(&mut self, to: &mut RecordSender) {
        while let Some(value) = self.subscriber.next_in_order() {
            to.send(value);
        }
        to.count_lost(self.subscriber.lost() - self.lost);
        self.lost = self.subscriber.lost();
    }
}

/// Subscriptions to everything on a bench.
struct Listener {
    control_steps: Tap<ControlStep>,
    guard_steps: Tap<GuardStep>,
    sensors: Tap<Sensors>,
    commands: Tap<Command>,
    applied: Tap<Applied>,
    requests: Vec<Tap<Request>>,
    events: Tap<GuardEvent>,
    cycles: Vec<Tap<CycleSample>>,
    heartbeats: Vec<Tap<Heartbeat>>,
    port: Option<BusPort>,
    /// Frames the socket lost, as counted already.
    frames_lost: u64,
    // Last: everything above lives on it.
    bench: BenchMember,
}

impl Listener {
    fn open(config: &BenchConfig) -> Result<Self, ProcessError> {
        let bench = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Record)?;
        let port = BusPort::open(&config.bus.interface, config.bus.fd)
            .inspect_err(|error| tracing::info!("no raw frames in the recording: {error}"))
            .ok();
        Ok(Self {
            control_steps: Tap::open(&bench, &CONTROL_STEPS)?,
            guard_steps: Tap::open(&bench, &GUARD_STEPS)?,
            sensors: Tap::open(&bench, &SENSORS)?,
            commands: Tap::open(&bench, &COMMAND)?,
            applied: Tap::open(&bench, &APPLIED)?,
            requests: [REQUEST]
                .iter()
                .chain(&STOPS)
                .map(|topic| Tap::open(&bench, topic))
                .collect::<Result<_, _>>()?,
            events: Tap::open(&bench, &GUARD_EVENTS)?,
            cycles: ROLES.iter().map(|role| Tap::open(&bench, &role.cycle())).collect::<Result<_, _>>()?,
            heartbeats: ROLES
                .iter()
                .map(|role| Tap::open(&bench, &role.heartbeat()))
                .collect::<Result<_, _>>()?,
            port,
            frames_lost: 0,
            bench,
        })
    }

    fn copy(&mut self, to: &mut RecordSender) {
        if let Some(port) = &mut self.port {
            // A bus that is down or gone has no frames; the bridge says so, and it may come back.
            let _ = port.receive(|arrival| {
                to.send(RawFrame::arrived(&arrival));
            });
            let lost = port.counts().dropped;
            to.count_lost(lost.saturating_sub(self.frames_lost));
            self.frames_lost = lost;
        }
        self.sensors.copy(to);
        self.commands.copy(to);
        self.applied.copy(to);
        self.requests.iter_mut().for_each(|tap| tap.copy(to));
        self.control_steps.copy(to);
        self.guard_steps.copy(to);
        self.events.copy(to);
        self.cycles.iter_mut().for_each(|tap| tap.copy(to));
        self.heartbeats.iter_mut().for_each(|tap| tap.copy(to));
    }
}

/// Records a bench until `shutdown`, for `seconds` at most.
///
/// # Errors
/// [`ProcessError`] when the file is there already, the bench cannot be joined, or the disk fails.
pub fn record(
    config: &BenchConfig,
    path: &Path,
    seconds: Option<f64>,
    shutdown: &Shutdown,
    mut progress: impl FnMut(RecorderSummary),
) -> Result<RecorderSummary, ProcessError> {
    let metadata = metadata(config, "record", None)?;
    let mut listener = Listener::open(config)?;
    let mut pulse = Pulse::open(&listener.bench)?;
    let recorder = Recorder::start(path, &metadata, RecorderOptions::default())?;
    let mut sender = recorder.sender();
    let end_ns = end_after(seconds);
    while !shutdown.is_requested() && is_before(end_ns) {
        listener.copy(&mut sender);
        if pulse.beat() {
            progress(recorder.summary());
            if recorder.has_failed() {
                break;
            }
        }
        std::thread::sleep(POLL);
    }
    listener.copy(&mut sender);
    Ok(recorder.finish()?)
}

/// The recorder's own heartbeat.
struct Pulse {
    publisher: Publisher<Heartbeat>,
    heartbeat: Heartbeat,
    polls: u64,
}

impl Pulse {
    fn open(bench: &BenchMember) -> Result<Self, ShmError> {
        let heartbeat = Heartbeat {
            born_ns: clock::monotonic_ns(),
            role: ProcessRole::Record as u32,
            process_id: std::process::id(),
            ..Heartbeat::default()
        };
        Ok(Self { publisher: bench.publish(&ProcessRole::Record.heartbeat())?, heartbeat, polls: 0 })
    }

    /// Counts a poll; returns whether this one was a beat.
    fn beat(&mut self) -> bool {
        self.polls += 1;
        let beats = self.polls % POLLS_A_PULSE == 1;
        if beats {
            self.heartbeat.count += 1;
            self.heartbeat.stamp_ns = clock::monotonic_ns();
            self.publisher.send(&self.heartbeat);
        }
        beats
    }
}

/// A recording made from inside a process of the bench, on a thread of its own.
#[derive(Debug)]
pub struct Background {
    path: PathBuf,
    shutdown: Shutdown,
    thread: Option<JoinHandle<Result<RecorderSummary, RecordError>>>,
}

impl Background {
    /// Begins. Call it before the bench's own topics are published, so that nothing is missed, and before the process
    /// becomes real-time.
    ///
    /// # Errors
    /// [`ProcessError`] when the file is there already or the bench cannot be joined.
    pub fn start(
        config: &BenchConfig,
        path: &Path,
        process: &str,
        plan: Option<&ExperimentPlan>,
    ) -> Result<Self, ProcessError> {
        let metadata = metadata(config, process, plan)?;
        let recorder = Recorder::start(path, &metadata, RecorderOptions::default())?;
        let shutdown = Shutdown::default();
        let (ready, is_ready) = mpsc::channel();
        let (config, ended) = (config.clone(), shutdown.clone());
        let thread = std::thread::Builder::new().name("listener".to_owned()).spawn(move || {
            rt::end_alone();
            let mut sender = recorder.sender();
            let mut listener = match Listener::open(&config) {
                Ok(listener) => listener,
                Err(error) => {
                    let _ = ready.send(Err(error));
                    return recorder.finish();
                }
            };
            let _ = ready.send(Ok(()));
            while !ended.is_requested() {
                listener.copy(&mut sender);
                std::thread::sleep(POLL);
            }
            listener.copy(&mut sender);
            recorder.finish()
        })?;
        let background = Self { path: path.to_owned(), shutdown, thread: Some(thread) };
        is_ready
            .recv()
            .unwrap_or_else(|_| Err(std::io::Error::other("the recorder's thread died").into()))?;
        Ok(background)
    }

    /// Ends the recording and removes its file: for a run that was refused before it began. The file was made by this
    /// recording, never found.
    pub fn discard(mut self) {
        self.end();
        // Who cannot remove it leaves a recording of nothing.
        let _ = std::fs::remove_file(&self.path);
    }

    fn end(&mut self) {
        self.shutdown.request();
        if let Some(thread) = self.thread.take() {
            // The error was the disk's; whoever wanted to know has called `finish`.
            let _ = thread.join();
        }
    }

    /// Ends the recording: what was published until now is in it.
    ///
    /// # Errors
    /// [`ProcessError::Record`] when the disk failed.
    pub fn finish(mut self) -> Result<RecorderSummary, ProcessError> {
        self.shutdown.request();
        let ended = self.thread.take().map(JoinHandle::join);
        match ended {
            Some(Ok(summary)) => Ok(summary?),
            _ => Err(std::io::Error::other("the recorder's thread died").into()),
        }
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.end();
    }
}

/// A bench on virtual time records every step; it waits for the disk, as a real one never may.
impl Interference for RecordSender {
    fn control_step(&mut self, step: &ControlStep) {
        self.send_patiently(*step);
    }

    fn guard_step(&mut self, step: &GuardStep) {
        self.send_patiently(*step);
    }

    fn event(&mut self, event: &GuardEvent) {
        self.send_patiently(*event);
    }
}
