//! `rotorbench monitor`: a live view of a running bench. It only listens.

use std::io::{IsTerminal, Write, stdout};
use std::time::Duration;

use crossterm::event::{self, Event, KeyCode, KeyModifiers};

use super::operate::BenchArguments;
use super::{CliError, CliResult, Outcome};
use crate::clock;
use crate::report;
use crate::rt::Shutdown;
use crate::runtime::monitor::{LOOK_PERIOD_MS, View};
use crate::signal::Channel;

/// Arguments of `monitor`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    pub(super) bench: BenchArguments,
    /// Print one line of JSON each second instead of the live view
    #[arg(long)]
    json: bool,
}

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
        terminal.draw(|frame| report::monitor::draw(view, clock::monotonic_ns(), frame))?;
        if event::poll(Duration::from_millis(LOOK_PERIOD_MS))?
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
            std::thread::sleep(Duration::from_millis(LOOK_PERIOD_MS));
            view.listen();
        }
        // Who reads may leave first.
        if writeln!(stdout(), "{}", json(view)).is_err() {
            break;
        }
    }
    Ok(Outcome::Done)
}

/// All of it, as a line of JSON.
fn json(view: &View) -> serde_json::Value {
    let (sensors, command, applied) = &view.newest;
    let now_ns = clock::monotonic_ns();
    let processes: Vec<serde_json::Value> = view
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
    let bus = (view.bus.sequence > 0).then(|| {
        serde_json::json!({
            "received": view.bus.received, "lost": view.bus.lost, "sent": view.bus.sent,
            "echoed": view.bus.echoed, "echo_age_ms": clock::span_s(view.bus.echo_age_ns) * 1e3,
            "not_sent": view.bus.not_sent, "error_frames": view.bus.error_frames,
            "unknown_id": view.bus.unknown_id, "foreign_command": view.bus.foreign_command,
            "wrong_length": view.bus.wrong_length, "counter": view.bus.counter,
            "not_a_number": view.bus.not_a_number, "out_of_range": view.bus.out_of_range,
        })
    });
    // What a sensor has given, under the name of its column in a log.
    let given = Channel::ALL.into_iter().filter(|channel| channel.of(sensors).stamp_ns != 0);
    let measured: serde_json::Map<String, serde_json::Value> =
        given.map(|channel| (channel.column().to_owned(), channel.of(sensors).value.into())).collect();
    serde_json::json!({
        "bench": view.bench, "state": view.state().to_string(), "rotor": applied.rotor,
        "body_rate_rad_s": sensors.body_rate.value, "body_angle_rad": command.estimate.body_angle,
        "disturbance_torque_nm": command.estimate.disturbance_torque,
        "battery_voltage_v": sensors.battery_voltage.value, "processes": processes,
        "measured": measured, "last_event": view.said.front().map(report::guard::event), "bus": bus,
    })
}
