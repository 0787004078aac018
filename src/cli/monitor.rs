//! `rotorbench monitor`: a live view of a running bench. It only listens.

mod picture;

use std::collections::VecDeque;
use std::io::{IsTerminal, Write, stdout};
use std::time::Duration;

use crossterm::event::{self, Event, KeyCode, KeyModifiers};

use super::operate::BenchArguments;
use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::State;
use crate::report;
use crate::rt::Shutdown;
use crate::shm::{APPLIED, BUS, Bench, COMMAND, GUARD_EVENTS, Role, SENSORS, ShmError, Subscriber};
use crate::signal::{Applied, BusStatus, Channel, Command, CycleSample, GuardEvent, Heartbeat, Sensors};

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Print one line of JSON each second instead of the live view
    #[arg(long)]
    json: bool,
}

/// [ms] between two pictures.
const PICTURE_PERIOD_MS: u64 = 100;
/// Points of a strip: the last 30 s.
const STRIP: usize = 300;
const EVENTS: usize = 8;
const ROLES: [Role; 4] = [Role::Bridge, Role::Emulate, Role::Run, Role::Control];

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let config = arguments.bench.load()?;
    let mut view = View::join(&config)?;
    let shutdown = Shutdown::listen()?;
    if arguments.json {
        return print_lines(&mut view, &shutdown);
    }
    if !stdout().is_terminal() {
        return Err(CliError::new("monitor draws on a terminal; without one, use --json"));
    }
    let mut terminal = ratatui::try_init()?;
    let result = watch(&mut terminal, &mut view, &shutdown);
    ratatui::restore();
    result
}

fn watch(terminal: &mut ratatui::DefaultTerminal, view: &mut View, shutdown: &Shutdown) -> CliResult {
    while !shutdown.is_requested() {
        view.listen();
        terminal.draw(|frame| picture::draw(view, clock::monotonic_ns(), frame))?;
        if event::poll(Duration::from_millis(PICTURE_PERIOD_MS))?
            && let Event::Key(key) = event::read()?
        {
            let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            if control_c || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc) {
                break;
            }
        }
    }
    Ok(Outcome::Done)
}

fn print_lines(view: &mut View, shutdown: &Shutdown) -> CliResult {
    while !shutdown.is_requested() {
        for _ in 0..10 {
            std::thread::sleep(Duration::from_millis(PICTURE_PERIOD_MS));
            view.listen();
        }
        // Who reads may leave first.
        if writeln!(stdout(), "{}", view.json()).is_err() {
            break;
        }
    }
    Ok(Outcome::Done)
}

/// One process of the bench, as seen from outside.
struct Process {
    role: Role,
    heartbeats: Subscriber<Heartbeat>,
    cycles: Subscriber<CycleSample>,
    heartbeat: Heartbeat,
    /// [1/s]
    rate: f64,
    /// [µs] greatest release lateness and command-out time since the last second began.
    worst_us: (f64, f64),
    shown_us: (f64, f64),
    cycle: CycleSample,
    counted: (u64, u64),
}

/// Everything the monitor knows.
struct View {
    bench: String,
    sensors: Subscriber<Sensors>,
    commands: Subscriber<Command>,
    applied: Subscriber<Applied>,
    events: Subscriber<GuardEvent>,
    statuses: Subscriber<BusStatus>,
    processes: Vec<Process>,
    newest: (Sensors, Command, Applied),
    bus: BusStatus,
    said: VecDeque<GuardEvent>,
    strips: [VecDeque<f64>; 3],
    _member: Bench,
}

impl View {
    fn join(config: &BenchConfig) -> Result<Self, ShmError> {
        let member = Bench::join(&config.name, &config.shared_memory, Role::Monitor)?;
        let process = |role: Role| {
            Ok::<_, ShmError>(Process {
                role,
                heartbeats: member.subscribe(&role.heartbeat())?,
                cycles: member.subscribe(&role.cycle())?,
                heartbeat: Heartbeat::default(),
                rate: 0.0,
                worst_us: (0.0, 0.0),
                shown_us: (0.0, 0.0),
                cycle: CycleSample::default(),
                counted: (0, 0),
            })
        };
        Ok(Self {
            bench: config.name.clone(),
            sensors: member.subscribe(&SENSORS)?,
            commands: member.subscribe(&COMMAND)?,
            applied: member.subscribe(&APPLIED)?,
            events: member.subscribe(&GUARD_EVENTS)?,
            statuses: member.subscribe(&BUS)?,
            processes: ROLES.into_iter().map(process).collect::<Result<_, _>>()?,
            newest: Default::default(),
            bus: BusStatus::default(),
            said: VecDeque::new(),
            strips: Default::default(),
            _member: member,
        })
    }

    fn listen(&mut self) {
        let now_ns = clock::monotonic_ns();
        let (sensors, command, applied) = &mut self.newest;
        *sensors = self.sensors.newest().unwrap_or(*sensors);
        *command = self.commands.newest().unwrap_or(*command);
        *applied = self.applied.newest().unwrap_or(*applied);
        self.bus = self.statuses.newest().unwrap_or(self.bus);
        while let Some(event) = self.events.next_in_order() {
            self.said.push_front(event);
            self.said.truncate(EVENTS);
        }
        self.processes.iter_mut().for_each(|process| process.listen(now_ns));
        let angle = if self.newest.0.body_angle.is_good() {
            self.newest.0.body_angle.value
        } else {
            self.newest.1.estimate.body_angle
        };
        let points = [angle, self.newest.2.rotor[0], self.newest.2.rotor[1]];
        for (strip, point) in self.strips.iter_mut().zip(points) {
            strip.push_back(point);
            if strip.len() > STRIP {
                strip.pop_front();
            }
        }
    }

    fn json(&self) -> serde_json::Value {
        let (sensors, command, applied) = &self.newest;
        let now_ns = clock::monotonic_ns();
        let processes: Vec<serde_json::Value> = self
            .processes
            .iter()
            .filter(|process| process.is_alive(now_ns))
            .map(|process| {
                serde_json::json!({
                    "role": process.role.name(), "process_id": process.heartbeat.process_id, "rate_hz": process.rate,
                    "lateness_us": process.shown_us.0, "response_us": process.shown_us.1,
                    "skipped": process.cycle.skipped, "overruns": process.cycle.overruns,
                })
            })
            .collect();
        let bus = (self.bus.sequence > 0).then(|| {
            serde_json::json!({
                "received": self.bus.received, "lost": self.bus.lost, "sent": self.bus.sent,
                "echoed": self.bus.echoed, "echo_age_ms": clock::span_s(self.bus.echo_age_ns) * 1e3,
                "not_sent": self.bus.not_sent, "error_frames": self.bus.error_frames,
                "unknown_id": self.bus.unknown_id, "foreign_command": self.bus.foreign_command,
                "wrong_length": self.bus.wrong_length, "counter": self.bus.counter,
                "not_a_number": self.bus.not_a_number, "out_of_range": self.bus.out_of_range,
            })
        });
        // What a sensor has given, under the name of its column in a log.
        let given = Channel::ALL.into_iter().filter(|channel| channel.of(sensors).stamp_ns != 0);
        let measured: serde_json::Map<String, serde_json::Value> =
            given.map(|channel| (channel.column().to_owned(), channel.of(sensors).value.into())).collect();
        serde_json::json!({
            "bench": self.bench, "state": guard_state(applied).to_string(), "rotor": applied.rotor,
            "body_rate_rad_s": sensors.body_rate.value, "body_angle_rad": command.estimate.body_angle,
            "disturbance_torque_nm": command.estimate.disturbance_torque,
            "battery_voltage_v": sensors.battery_voltage.value, "processes": processes,
            "measured": measured, "last_event": self.said.front().map(report::guard::event), "bus": bus,
        })
    }
}

impl Process {
    fn listen(&mut self, now_ns: u64) {
        if let Some(heartbeat) = self.heartbeats.newest() {
            self.heartbeat = heartbeat;
        }
        while let Some(cycle) = self.cycles.next_in_order() {
            let since_due = |end_ns: u64| end_ns.saturating_sub(cycle.due_ns) as f64 * 1e-3;
            self.worst_us.0 = self.worst_us.0.max(since_due(cycle.released_ns));
            self.worst_us.1 = self.worst_us.1.max(since_due(cycle.finished_ns));
            self.cycle = cycle;
        }
        let (count, since_ns) = self.counted;
        let elapsed_ns = now_ns.saturating_sub(since_ns);
        if since_ns == 0 {
            self.counted = (self.heartbeat.count, now_ns);
        } else if elapsed_ns >= clock::NANOSECONDS_PER_SECOND {
            self.rate = self.heartbeat.count.saturating_sub(count) as f64 / clock::span_s(elapsed_ns);
            self.shown_us = std::mem::take(&mut self.worst_us);
            self.counted = (self.heartbeat.count, now_ns);
        }
    }

    fn is_alive(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.heartbeat.stamp_ns) < 2 * clock::NANOSECONDS_PER_SECOND
    }
}

fn guard_state(applied: &Applied) -> State {
    State::from_code(applied.state).unwrap_or_default()
}
