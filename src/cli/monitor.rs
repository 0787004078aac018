//! `rotorbench monitor`: a live view of a running bench. It only listens.

mod line;

pub(super) use line::MonitorLine;

use std::io::{IsTerminal, Write, stdout};
use std::time::Duration;

use crossterm::event::{self, Event, KeyCode, KeyModifiers};

use super::operate::BenchArguments;
use super::usage_error::UsageError;
use super::{CliResult, Outcome};
use crate::clock;
use crate::report;
use crate::rt::Shutdown;
use crate::runtime::monitor::{LOOK_PERIOD_MS, View};

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
        return Err(UsageError::NoTerminal.into());
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
        if writeln!(stdout(), "{}", report::json::line(&MonitorLine::of(view))?).is_err() {
            break;
        }
    }
    Ok(Outcome::Done)
}
