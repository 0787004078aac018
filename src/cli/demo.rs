//! `rotorbench demo`: the whole story with no hardware, in under a minute.

use std::fs;
use std::path::{Path, PathBuf};

use super::thresholds::THRESHOLDS;
use super::{CliError, CliResult, Outcome, timing};
use crate::bench::BenchConfig;
use crate::clock;
use crate::control::MoveConfig;
use crate::effect::{Law, Site, Term, find};
use crate::emulate::{HiddenConfig, Impulse};
use crate::report::{Axis, Bars, Mark, Page, Plot, Series, Table, Tone};
use crate::rt::{Shutdown, cancel_on_signals};
use crate::session::Job;
use crate::shm::PassingBench;
use crate::signal::ControlStep;

mod flight;
mod story;

use flight::{Flight, Flown, degraded, fly_whole, guard_lines};

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

/// What the report says where the second flight should be.
const HELD_UP: &str = "Each flight with the extended model in the controller was ended by the guard before its time, because \
                       this machine stood still for longer than the guard waits: there is nothing to compare.";

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let out = &arguments.out;
    let (mut bench, emulator) = benches(arguments)?;
    fs::create_dir_all(out).map_err(|error| at(out, &error))?;
    for path in LATE.map(|name| out.join(name)).iter().filter(|path| path.exists()) {
        fs::remove_file(path).map_err(|error| at(path, &error))?;
    }
    let hidden: Vec<String> = emulator.emulator.hidden.iter().map(ToString::to_string).collect();
    let user = Shutdown::listen()?;
    // First, so that it goes last: nothing of the demo stays in shared memory.
    let _passing = PassingBench::open(&bench.name, &bench.shared_memory)?;
    let flown = match fly_whole(&bench, &emulator, out, ("loop", 0.0), &user)? {
        Flight::Whole(flown) => flown,
        Flight::HeldUp => return Ok(held_up("There is no report")),
        Flight::Interrupted => return Ok(interrupted()),
    };
    println!("{}", timing::angle(&flown.summary.angle));
    print!("{}", timing::table(&flown.summary.timing));
    let mut page = first_page(&flown, (&bench, &emulator), out)?;
    let cancel = cancel_on_signals()?;
    let learned = story::learn(&flown.log, &Job::unwatched(&cancel));
    if cancel.is_requested() {
        return Ok(interrupted());
    }
    let lesson = learned?;
    println!("{}", story::text(&lesson, &hidden.join(", ")));
    story::tell(&mut page, &lesson, &hidden.join(", "));
    let report = out.join("index.html");
    if let Some(extension) = &lesson.extension {
        let model = out.join("extended.toml");
        extension.model.save(&model)?;
        bench.model = model.display().to_string();
        println!("the same flight, with it in the controller:");
        match fly_whole(&bench, &emulator, out, ("loop-extended", flown.hold_s), &user)? {
            Flight::Whole(again) => better_page(&mut page, &flown, &again, &emulator),
            Flight::HeldUp => {
                page.heading("The controller with it").paragraph(HELD_UP);
                page.save(&report)?;
                return Ok(held_up(&format!("{} ends before it", report.display())));
            }
            Flight::Interrupted => return Ok(interrupted()),
        }
    }
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
fn held_up(report: &str) -> Outcome {
    println!(
        "no flight came to its end: something holds this machine up for longer than the guard waits (`rotorbench jitter` \
         measures it). {report}; try again when the machine has less to do."
    );
    Outcome::FoundWanting
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
    // Torques that follow the body's motion without a jump: a short flight shows no other plainly.
    let shows_in_flight = |id: &str| {
        find(id).is_some_and(|card| {
            let follows = matches!(card.law, Law::Static(_)) && card.acts_as != Some(Term::Constant);
            card.site == Site::Torque && follows
        })
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

fn first_page(
    flown: &Flown,
    (bench, emulator): (&BenchConfig, &BenchConfig),
    out: &Path,
) -> Result<Page, CliError> {
    let (angle, torque) = pictures(&flown.steps, emulator);
    angle.save_svg(&out.join("angle.svg"))?;
    torque.save_svg(&out.join("disturbance.svg"))?;
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
    Ok(page)
}

/// The same flight, with what was learned in the controller.
fn better_page(page: &mut Page, before: &Flown, after: &Flown, emulator: &BenchConfig) {
    let (from, to) = (story::tracking_error(before), story::tracking_error(after));
    println!("tracking error with it in the controller: {from:.4} -> {to:.4} rad rms");
    let late = degraded(before).max(degraded(after));
    if late > THRESHOLDS.degraded_share {
        let late = format!(
            "This machine was late: for {:.0} % of a flight the guard was degraded and held commands, which is in these \
             errors, too.",
            100.0 * late
        );
        println!("{late}");
        page.paragraph(late);
    }
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
