//! `rotorbench demo`: the whole story with no hardware, in under a minute.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Program, Stdio};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use super::{CliError, CliResult, Outcome, timing};
use crate::bench::BenchConfig;
use crate::clock;
use crate::control::MoveConfig;
use crate::emulate::{HiddenConfig, Impulse};
use crate::file::write_atomically;
use crate::guard::{Cause, State};
use crate::process::control::{self, ControlSummary};
use crate::process::operator;
use crate::process::plant;
use crate::process::record::Background;
use crate::record::{Dataset, Record, Recording, export, log};
use crate::report::{Axis, Bars, Mark, Page, Plot, Series, Table, Tone};
use crate::rt::Shutdown;
use crate::shm::{APPLIED, Bench, CONTROL_STEPS, PassingBench, Role};
use crate::signal::{ControlStep, GuardEvent};

mod story;

/// Arguments of `demo`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for everything it writes
    #[arg(long, value_name = "DIR", default_value = "rotorbench-demo")]
    out: PathBuf,
    /// Seed of the sensors' noise and of the effect that the emulator hides
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Hide this effect (`id` or `id:parameter=value,...`) and not a drawn one; may be given several times
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
}

/// What an earlier story left and this one may not write: with it, the folder would tell two.
const LATE: [&str; 5] =
    ["index.html", "extended.toml", "loop-extended.mcap", "loop-extended.csv", "loop-extended.toml"];

/// Flights that are tried until one comes to its end.
const FLIGHTS: u32 = 3;
/// [s] that the bench flies, each time.
const FLIGHT_S: f64 = 19.0;
/// [s] that the emulator outlives the flight: the guard must be seen to stop the rotors.
const AFTER_S: f64 = 1.0;

/// One flight.
struct Flown {
    summary: ControlSummary,
    steps: Vec<ControlStep>,
    events: Vec<GuardEvent>,
    log: Dataset,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let out = &arguments.out;
    let (mut bench, emulator) = benches(arguments)?;
    fs::create_dir_all(out).map_err(|error| at(out, &error))?;
    for path in LATE.map(|name| out.join(name)).iter().filter(|path| path.exists()) {
        fs::remove_file(path).map_err(|error| at(path, &error))?;
    }
    let hidden: Vec<String> = emulator.emulator.hidden.iter().map(ToString::to_string).collect();
    let shutdown = Shutdown::listen()?;
    // First, so that it goes last: nothing of the demo stays in shared memory.
    let _passing = PassingBench::open(&bench.name, &bench.shared_memory)?;
    let flown = match fly_whole(&bench, &emulator, out, "loop", &shutdown) {
        _ if shutdown.is_interrupted() => return Ok(interrupted()),
        flown => flown?,
    };
    let Some(flown) = flown else { return Ok(held_up()) };
    println!("{}", timing::angle(&flown.summary.angle));
    print!("{}", timing::table(&flown.summary.timing));
    let (angle, torque) = pictures(&flown.steps, &emulator);
    angle.save_svg(&out.join("angle.svg"))?;
    torque.save_svg(&out.join("disturbance.svg"))?;
    let mut page = first_page(&flown, &bench, (angle, torque));
    let lesson = story::learn(&flown.log)?;
    println!("{}", story::text(&lesson, &hidden.join(", ")));
    story::tell(&mut page, &lesson, &hidden.join(", "));
    if let Some(extension) = &lesson.extension {
        let model = out.join("extended.toml");
        extension.model.save(&model)?;
        bench.model = model.display().to_string();
        let shutdown = Shutdown::listen()?;
        println!("the same flight, with it in the controller:");
        let again = match fly_whole(&bench, &emulator, out, "loop-extended", &shutdown) {
            _ if shutdown.is_interrupted() => return Ok(interrupted()),
            again => again?,
        };
        let Some(again) = again else { return Ok(held_up()) };
        better_page(&mut page, &flown, &again, &emulator);
    }
    let report = out.join("index.html");
    page.save(&report)?;
    println!("recording: {}   report: {}", out.join("loop.mcap").display(), report.display());
    Ok(Outcome::Done)
}

/// Half a story is none.
fn interrupted() -> Outcome {
    println!("interrupted before the story's end: there is no report");
    Outcome::FoundWanting
}

/// No flight came to its end, so nothing can be compared.
fn held_up() -> Outcome {
    println!(
        "{FLIGHTS} flights were ended by the guard before their time: something holds this machine up for longer than the \
         guard waits (`rotorbench jitter` measures it). There is no report; try again when it has less to do."
    );
    Outcome::FoundWanting
}

/// [s] from the controller's first step.
fn after_s(event: &GuardEvent, flown: &Flown) -> f64 {
    let begun_ns = flown.steps.first().map_or(0, |step| step.command.stamp_ns);
    (i128::from(event.stamp_ns) - i128::from(begun_ns)) as f64 * 1e-9
}

/// Whether the guard closed before the controller had ended, for a reason that only a machine that stood still gives.
fn was_held_up(flown: &Flown, bench: &BenchConfig) -> bool {
    let late =
        [Cause::TooManyMisses, Cause::CommandMissing, Cause::CommandAnswersOldSensors, Cause::SignalStale];
    let is_open = |code| State::from_code(code).is_some_and(State::is_active);
    flown.events.iter().any(|event| {
        let closed = is_open(event.from) && !is_open(event.to);
        let by_time = Cause::from_code(event.cause).is_some_and(|cause| late.contains(&cause));
        closed && by_time && after_s(event, flown) < FLIGHT_S - bench.period_s
    })
}

/// A flight that the guard let come to its end; `None` when none of a few did. What the guard said is printed.
fn fly_whole(
    bench: &BenchConfig,
    emulator: &BenchConfig,
    out: &Path,
    name: &str,
    shutdown: &Shutdown,
) -> Result<Option<Flown>, CliError> {
    for flight in 1..=FLIGHTS {
        let flown = fly(bench, emulator, out, name, shutdown)?;
        guard_lines(&flown, bench).iter().for_each(|line| println!("{line}"));
        if shutdown.is_interrupted() || !was_held_up(&flown, bench) {
            return Ok(Some(flown));
        }
        println!("the machine was held up, and the guard ended flight {flight} of {FLIGHTS} early");
    }
    Ok(None)
}

/// What the guard said, and when after the first step of the controller [s].
fn guard_lines(flown: &Flown, bench: &BenchConfig) -> Vec<String> {
    let line = |event: &GuardEvent| {
        let after_s = after_s(event, flown);
        let ended = if after_s > FLIGHT_S - bench.period_s { " (the controller has ended)" } else { "" };
        format!("{after_s:6.2} s  guard: {}{ended}", operator::sentence(event))
    };
    flown.events.iter().map(line).collect()
}

fn at(path: &Path, error: &std::io::Error) -> CliError {
    CliError::new(format!("{}: {error}", path.display()))
}

/// The bench as its controller knows it, and as it really is. Only the emulator's process is told the second.
fn benches(arguments: &Arguments) -> Result<(BenchConfig, BenchConfig), CliError> {
    let seed = arguments.seed;
    let mut bench = BenchConfig { name: format!("demo-{}", std::process::id()), ..BenchConfig::default() };
    bench.period_s = 0.01;
    let angles = [0.3, -0.3, 0.2, -0.25, 0.3, 0.0];
    bench.controller.reference.moves = angles
        .iter()
        .enumerate()
        .map(|(index, angle_rad)| MoveConfig {
            at_s: 6.5 + 2.0 * index as f64,
            angle_rad: *angle_rad,
            duration_s: 1.0,
        })
        .collect();
    let mut emulator = bench.clone();
    emulator.emulator.seed = seed;
    // All at once, so that a row of the log holds one moment: skewed sensors would look like missing physics.
    emulator.emulator.sensors = emulator.emulator.sensors.at_rate(1000.0);
    emulator.emulator.impulse = vec![
        Impulse { at_s: 2.5, duration_s: 0.05, torque: 0.6 },
        Impulse { at_s: 4.5, duration_s: 0.05, torque: -0.6 },
    ];
    let shows_in_flight = |id: &str| {
        matches!(id, "gravity_pendulum" | "pivot_viscous_friction" | "quadratic_air_drag" | "cable_stiffness")
    };
    if arguments.hide.is_empty() {
        emulator.emulator.hidden.extend(HiddenConfig::draw(seed, shows_in_flight));
    }
    for text in &arguments.hide {
        emulator.emulator.hidden.push(HiddenConfig::parse(text)?);
    }
    // Before anything is flown or taken away.
    emulator.emulator.build()?;
    Ok((bench, emulator))
}

/// The emulator's process; ends with this one, however this one ends.
struct EmulatorProcess(Child);

impl EmulatorProcess {
    fn start(config: &BenchConfig, out: &Path) -> Result<Self, CliError> {
        let file = out.join("emulator.toml");
        write_atomically(&file, toml::to_string(config)?.as_bytes()).map_err(|error| at(&file, &error))?;
        let seconds = FLIGHT_S + AFTER_S;
        let program = std::env::current_exe()?;
        let child = Program::new(program)
            .args(["emulate", "--shm", "--arm", "--json", "--seconds", &seconds.to_string(), "--config"])
            .arg(&file)
            .env("ROTORBENCH_LOG", "warn")
            .stdout(Stdio::null())
            .spawn()?;
        Ok(Self(child))
    }

    /// Waits for its end; a failure is this command's failure.
    fn finish(mut self) -> Result<(), CliError> {
        let status = self.0.wait()?;
        if status.success() {
            Ok(())
        } else {
            Err(CliError::new(format!("the emulator's process: {status}")))
        }
    }
}

impl Drop for EmulatorProcess {
    fn drop(&mut self) {
        // Already waited for, unless this process is on its way out; then nothing must be left running.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The loop in real time: emulator in a process of its own, EMC here, shared memory between them.
fn fly(
    bench: &BenchConfig,
    emulator: &BenchConfig,
    out: &Path,
    name: &str,
    shutdown: &Shutdown,
) -> Result<Flown, CliError> {
    let pilot = plant::pilot(bench)?;
    let recording = out.join(name).with_extension("mcap");
    if recording.exists() {
        fs::remove_file(&recording).map_err(|error| at(&recording, &error))?;
    }
    let background = Background::start(bench, &recording, "demo", None)?;
    let process = EmulatorProcess::start(emulator, out)?;
    let ended = Shutdown::default();
    let summary = std::thread::scope(|scope| {
        scope.spawn(|| watch(bench, &ended));
        let summary = control::control(bench, pilot, Some(FLIGHT_S), shutdown);
        ended.request();
        summary
    })?;
    process.finish()?;
    background.finish()?;
    let log = export::dataset(&recording)?;
    log::write(&log, &out.join(name).with_extension("csv"))?;
    let (steps, events) = told(&recording)?;
    Ok(Flown { summary, steps, events, log })
}

/// The live line.
fn watch(bench: &BenchConfig, ended: &Shutdown) {
    let Ok(bench) = Bench::join(&bench.name, &bench.shared_memory, Role::Monitor) else { return };
    let (Ok(mut steps), Ok(mut applied)) = (bench.subscribe(&CONTROL_STEPS), bench.subscribe(&APPLIED))
    else {
        return;
    };
    let style = ProgressStyle::with_template("{bar:24} {msg}");
    let bar = ProgressBar::new((FLIGHT_S * 10.0) as u64)
        .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let start_ns = clock::monotonic_ns();
    while !ended.is_requested() {
        std::thread::sleep(Duration::from_millis(50));
        let flown_s = clock::span_s(clock::monotonic_ns().saturating_sub(start_ns));
        bar.set_position((flown_s * 10.0) as u64);
        if let (Some(ControlStep { command, .. }), Some(applied)) = (steps.newest(), applied.newest()) {
            let estimate = &command.estimate;
            bar.set_message(format!(
                "{flown_s:4.1} s  angle {:+.3} rad (wanted {:+.3})  disturbance {:+.3} N m  u {:.3} {:.3}",
                estimate.body_angle,
                estimate.reference_angle,
                estimate.disturbance_torque,
                applied.rotor[0],
                applied.rotor[1],
            ));
        }
    }
    bar.finish_and_clear();
}

/// The controller's steps and the guard's events, from the recording.
fn told(recording: &Path) -> Result<(Vec<ControlStep>, Vec<GuardEvent>), CliError> {
    let (mut steps, mut events) = (Vec::new(), Vec::new());
    for record in Recording::open(recording)? {
        match record? {
            Record::ControlStep(step) => steps.push(step),
            Record::GuardEvent(event) => events.push(event),
            _ => {}
        }
    }
    Ok((steps, events))
}

/// The angle, and the disturbance with its estimate.
fn pictures(steps: &[ControlStep], emulator: &BenchConfig) -> (Plot, Plot) {
    let begun_ns = steps.first().map_or(0, |step| step.command.stamp_ns);
    let seconds = |step: &ControlStep| clock::span_s(step.command.stamp_ns.saturating_sub(begun_ns));
    let column = |of: fn(&ControlStep) -> f64| -> Vec<f64> { steps.iter().map(of).collect() };
    let time: Vec<f64> = steps.iter().map(seconds).collect();
    let axis = || Axis::new("time", "s");
    let angle = Plot::new("Angle", axis(), Axis::new("body angle", "rad"))
        .group("time")
        .series(
            Series::line("measured", &time, &column(|step| step.sensors.body_angle.value))
                .tone(Tone::Measured),
        )
        .series(
            Series::line("estimated", &time, &column(|step| step.command.estimate.body_angle))
                .tone(Tone::Model),
        )
        .series(
            Series::line("reference", &time, &column(|step| step.command.estimate.reference_angle))
                .tone(Tone::Quiet)
                .dashed(),
        );
    let torque = Plot::new("Disturbance estimate", axis(), Axis::new("torque", "N m")).group("time").series(
        Series::line("estimated by EMC", &time, &column(|step| step.command.estimate.disturbance_torque))
            .tone(Tone::Model),
    );
    let strike =
        |plot: Plot, impulse: &Impulse| plot.span("impulse", impulse.at_s, impulse.at_s + impulse.duration_s);
    let impulses = &emulator.emulator.impulse;
    (impulses.iter().fold(angle, strike), impulses.iter().fold(torque, strike))
}

fn first_page(flown: &Flown, bench: &BenchConfig, (angle, torque): (Plot, Plot)) -> Page {
    let (angle_error, timing) = (&flown.summary.angle, &flown.summary.timing);
    let table = Table::new(["", "value", "unit"])
        .row(["angle error, rms", &format!("{:.4}", angle_error.rms), "rad"])
        .row(["angle error, greatest", &format!("{:.4}", angle_error.greatest), "rad"])
        .row(["periods flown", &angle_error.count.to_string(), ""])
        .row(["command out after due, p99", &format!("{:.0}", timing.response.p99_us), "µs"])
        .row(["slots skipped", &timing.skipped.to_string(), ""]);
    let mut page = Page::new("rotorbench demo");
    page.heading("The loop holds the angle")
        .paragraph(
            "An emulated bench in a process of its own, the controller in this one, shared memory between \
             them, the guard in front of the rotors. Somebody strikes the body twice; then the angle is moved.",
        )
        .table(table)
        .plot(angle)
        .plot(torque)
        .paragraph("What the guard said, seconds after the controller's first step:")
        .list(guard_lines(flown, bench));
    page
}

/// The same flight, with what was learned in the controller.
fn better_page(page: &mut Page, before: &Flown, after: &Flown, emulator: &BenchConfig) {
    let (from, to) = (story::tracking_error(before), story::tracking_error(after));
    println!("tracking error with it in the controller: {from:.4} -> {to:.4} rad rms");
    let (angle, torque) = pictures(&after.steps, emulator);
    page.heading("The controller with it")
        .paragraph("The same flight again, with the extended model in the controller, which now cancels what it knows.")
        .bars(
            Bars::new("Tracking error, rms, while the angle is moved", "rad")
                .bar("the paper's model", from, Mark::Bad)
                .bar("the extended model", to, Mark::Good),
        )
        .plot(angle)
        .plot(torque);
}
