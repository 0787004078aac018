//! `rotorbench monitor`: a live view of a running bench. It only listens.

use std::collections::VecDeque;
use std::io::{IsTerminal, Write, stdout};
use std::time::Duration;

use crossterm::event::{self, Event, KeyCode, KeyModifiers};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph, Sparkline};

use super::operate::BenchArguments;
use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::State;
use crate::process::operator;
use crate::rt::Shutdown;
use crate::shm::{APPLIED, Bench, COMMAND, GUARD_EVENTS, Role, SENSORS, ShmError, Subscriber};
use crate::signal::{Applied, Command, CycleSample, GuardEvent, Heartbeat, Sensors};

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    bench: BenchArguments,
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
        terminal.draw(|frame| view.draw(frame))?;
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
    processes: Vec<Process>,
    newest: (Sensors, Command, Applied),
    said: VecDeque<(u64, String)>,
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
            processes: ROLES.into_iter().map(process).collect::<Result<_, _>>()?,
            newest: Default::default(),
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
        while let Some(event) = self.events.next_in_order() {
            self.said.push_front((event.stamp_ns, operator::sentence(&event)));
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
        serde_json::json!({
            "bench": self.bench, "state": guard_state(applied).to_string(), "rotor": applied.rotor,
            "body_rate_rad_s": sensors.body_rate.value, "body_angle_rad": command.estimate.body_angle,
            "disturbance_torque_nm": command.estimate.disturbance_torque,
            "battery_voltage_v": sensors.battery_voltage.value, "processes": processes,
            "last_event": self.said.front().map(|(_, sentence)| sentence),
        })
    }

    fn draw(&self, frame: &mut Frame) {
        let [head, processes, signals, strips, events] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(2 + ROLES.len() as u16),
            Constraint::Length(5),
            Constraint::Min(9),
            Constraint::Length(2 + EVENTS as u16),
        ])
        .areas(frame.area());
        frame.render_widget(self.head(), head);
        frame.render_widget(self.process_table(), processes);
        frame.render_widget(self.signal_table(), signals);
        self.draw_strips(frame, strips);
        let lines: Vec<Line> = self
            .said
            .iter()
            .map(|(stamp_ns, sentence)| Line::raw(format!("{:10.3} s  {sentence}", clock::span_s(*stamp_ns))))
            .collect();
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title("guard")), events);
    }

    fn head(&self) -> Line<'_> {
        let now_ns = clock::monotonic_ns();
        let applied = &self.newest.2;
        let is_running = now_ns.saturating_sub(applied.stamp_ns) < clock::NANOSECONDS_PER_SECOND;
        let (text, color) = match (is_running, guard_state(applied)) {
            (false, _) => ("NOT RUNNING".to_owned(), Color::DarkGray),
            (true, state @ State::Armed) => (state.to_string().to_uppercase(), Color::Green),
            (true, state @ (State::PreArm | State::Degraded)) => {
                (state.to_string().to_uppercase(), Color::Yellow)
            }
            (true, State::Disarmed) => ("DISARMED".to_owned(), Color::Blue),
            (true, state) => (state.to_string().to_uppercase(), Color::Red),
        };
        Line::from(vec![
            Span::raw(format!(" bench {}  ", self.bench)).bold(),
            Span::styled(
                format!(" {text} "),
                Style::new().bg(color).fg(Color::White).add_modifier(Modifier::BOLD),
            ),
            Span::raw("   q to leave; the bench goes on"),
        ])
    }

    fn process_table(&self) -> Paragraph<'_> {
        let now_ns = clock::monotonic_ns();
        let line = |process: &Process| {
            let name = process.role.name();
            if process.heartbeat.count == 0 {
                return Line::raw(format!("{name:8} -")).dim();
            }
            let text = format!(
                "{name:8} process {:7}  {:7.1} Hz  late {:8.1} µs  out {:8.1} µs  skipped {}  overruns {}",
                process.heartbeat.process_id,
                process.rate,
                process.shown_us.0,
                process.shown_us.1,
                process.cycle.skipped,
                process.cycle.overruns,
            );
            if process.is_alive(now_ns) {
                Line::raw(text)
            } else {
                Line::raw(format!("{text}  SILENT")).red()
            }
        };
        let lines: Vec<Line> = self.processes.iter().map(line).collect();
        Paragraph::new(lines).block(Block::bordered().title("processes (worst of each second)"))
    }

    fn signal_table(&self) -> Paragraph<'_> {
        let (sensors, command, applied) = &self.newest;
        let estimate = &command.estimate;
        let lines = vec![
            Line::raw(format!(
                "body rate {:+8.4} rad/s   angle {:+8.4} rad (wanted {:+.4})   disturbance {:+8.4} N m",
                sensors.body_rate.value,
                estimate.body_angle,
                estimate.reference_angle,
                estimate.disturbance_torque
            )),
            Line::raw(format!(
                "rotor 1 {:6.1} rad/s   rotor 2 {:6.1} rad/s   battery {:6.2} V",
                sensors.propeller_rate[0].value,
                sensors.propeller_rate[1].value,
                sensors.battery_voltage.value
            )),
            Line::raw(format!(
                "wanted {:.4} {:.4}   applied {:.4} {:.4}   misses {}",
                command.rotor[0], command.rotor[1], applied.rotor[0], applied.rotor[1], applied.misses
            )),
        ];
        Paragraph::new(lines).block(Block::bordered().title("signals"))
    }

    fn draw_strips(&self, frame: &mut Frame, area: Rect) {
        let areas = Layout::vertical([Constraint::Ratio(1, 3); 3]).split(area);
        let titles = ["angle [rad]", "rotor 1 [-]", "rotor 2 [-]"];
        for ((strip, title), area) in self.strips.iter().zip(titles).zip(areas.iter()) {
            let width = usize::from(area.width.saturating_sub(2));
            let shown: Vec<f64> = strip.iter().skip(strip.len().saturating_sub(width)).copied().collect();
            let low = shown.iter().copied().fold(f64::INFINITY, f64::min);
            let high = shown.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let span = (high - low).max(1e-6);
            let data: Vec<u64> =
                shown.iter().map(|value| ((value - low) / span * 1000.0) as u64 + 1).collect();
            let title =
                if shown.is_empty() { title.to_owned() } else { format!("{title}  {low:+.3} .. {high:+.3}") };
            frame.render_widget(
                Sparkline::default().block(Block::bordered().title(title)).data(data).max(1001),
                *area,
            );
        }
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
