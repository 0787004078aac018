//! `rotorbench demo`: the whole story with no hardware, in under a minute.

use std::fs;
use std::path::{Path, PathBuf};

use super::output::Force;
use super::thresholds::THRESHOLDS;
use super::usage_error::UsageError;
use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::control::MoveConfig;
use crate::effect::{Law, Site, Term, find};
use crate::emulate::{HiddenConfig, Impulse};
use crate::report::{self, Page, Plot, run_summary};
use crate::rt::{Shutdown, cancel_on_signals};
use crate::session::Job;
use crate::shm::PassingBench;

mod bench_run;
mod lesson;

use bench_run::{Attempts, DemoRun, degraded, guard_lines, run_whole};

/// Arguments of `demo`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for everything it writes
    #[arg(long, value_name = "DIR", default_value = "rotorbench-demo")]
    out: PathBuf,
    /// Seed of the sensors' noise and of the effect that the emulator hides
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    force: Force,
    /// Hide this effect (`id` or `id:parameter=value,...`) and not a drawn one; may be given several times
    #[arg(long, value_name = "EFFECT")]
    hide: Vec<String>,
}

/// What an earlier story left and this one may not write: with it, the folder would tell two.
const LATE: [&str; 5] =
    ["index.html", "extended.toml", "loop-extended.mcap", "loop-extended.csv", "loop-extended.toml"];

/// What every story writes.
const ALWAYS: [&str; 5] = ["loop.mcap", "loop.csv", "emulator.toml", "angle.svg", "disturbance.svg"];

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let out = &arguments.out;
    let (mut bench, emulator) = benches(arguments)?;
    arguments.force.check(&ALWAYS.iter().chain(&LATE).map(|name| out.join(name)).collect::<Vec<_>>())?;
    fs::create_dir_all(out).map_err(UsageError::at(out))?;
    for path in LATE.map(|name| out.join(name)).iter().filter(|path| path.exists()) {
        fs::remove_file(path).map_err(UsageError::at(path))?;
    }
    let hidden: Vec<String> = emulator.emulator.hidden.iter().map(ToString::to_string).collect();
    let user = Shutdown::listen()?;
    // First, so that it goes last: nothing of the demo stays in shared memory.
    let _passing = PassingBench::open(&bench.name, &bench.shared_memory)?;
    let first = match run_whole(&bench, &emulator, out, ("loop", 0.0), &user)? {
        Attempts::Whole(run) => run,
        Attempts::HeldUp => return Ok(held_up(None)),
        Attempts::Interrupted => return Ok(interrupted()),
    };
    println!("{}", run_summary::angle(&first.summary.angle));
    print!("{}", run_summary::timing(&first.summary.timing));
    let mut page = first_page(&first, (&bench, &emulator), out)?;
    let cancel = cancel_on_signals()?;
    let learned = lesson::learn(&first.log, &Job::unwatched(&cancel));
    if cancel.is_requested() {
        return Ok(interrupted());
    }
    let lesson = learned?;
    println!("{}", report::demo::lesson_text(&lesson.diagnosis, &hidden.join(", ")));
    report::demo::lesson(&mut page, &lesson.diagnosis, &hidden.join(", "));
    let index = out.join("index.html");
    if let Some(extension) = &lesson.extension {
        let model = out.join("extended.toml");
        extension.model.save(&model)?;
        bench.model = model.display().to_string();
        println!("{}", report::demo::AGAIN);
        match run_whole(&bench, &emulator, out, ("loop-extended", first.hold_s), &user)? {
            Attempts::Whole(again) => better_page(&mut page, &first, &again, &emulator),
            Attempts::HeldUp => {
                report::demo::nothing_to_compare(&mut page);
                page.save(&index)?;
                return Ok(held_up(Some(&index)));
            }
            Attempts::Interrupted => return Ok(interrupted()),
        }
    }
    page.save(&index)?;
    println!("recording: {}   report: {}", out.join("loop.mcap").display(), index.display());
    println!("{}", report::workbench::POINTER);
    Ok(Outcome::Done)
}

/// Half a story is none.
fn interrupted() -> Outcome {
    println!("{}", report::demo::INTERRUPTED);
    Outcome::FoundWanting
}

/// No run came to its end, so nothing can be compared; the report, if there is one, ends before it.
fn held_up(page: Option<&Path>) -> Outcome {
    println!("{}", report::demo::held_up(page));
    Outcome::FoundWanting
}

/// The bench as its controller knows it, and as it really is. Only the emulator's process knows the second.
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
    // Torques that follow the body's motion without a jump: a short run shows no other plainly.
    let shows_in_a_run = |id: &str| {
        find(id).is_some_and(|card| {
            let follows = matches!(card.law, Law::Static(_)) && card.acts_as != Some(Term::Constant);
            card.site == Site::Torque && follows
        })
    };
    if arguments.hide.is_empty() {
        emulator.emulator.hidden.extend(HiddenConfig::draw(seed, shows_in_a_run));
    }
    for text in &arguments.hide {
        emulator.emulator.hidden.push(HiddenConfig::parse(text)?.completed());
    }
    // Before anything runs or is taken away.
    emulator.emulator.build()?;
    Ok((bench, emulator))
}

/// The pictures of a run, beside each other on the page and as files.
fn pictures(run: &DemoRun, emulator: &BenchConfig) -> (Plot, Plot) {
    report::demo::pictures(&run.steps, &emulator.emulator.impulse)
}

fn first_page(
    run: &DemoRun,
    (bench, emulator): (&BenchConfig, &BenchConfig),
    out: &Path,
) -> Result<Page, CliError> {
    let (angle, torque) = pictures(run, emulator);
    angle.save_svg(&out.join("angle.svg"))?;
    torque.save_svg(&out.join("disturbance.svg"))?;
    Ok(report::demo::first_page(&run.summary, (angle, torque), guard_lines(run, bench)))
}

/// The same run, with what was learned in the controller.
fn better_page(page: &mut Page, before: &DemoRun, after: &DemoRun, emulator: &BenchConfig) {
    let errors = [before, after].map(lesson::tracking_error);
    let degraded = degraded(before).max(degraded(after));
    let degraded = (degraded > THRESHOLDS.degraded_share).then_some(degraded);
    report::demo::better_text(errors, degraded).iter().for_each(|line| println!("{line}"));
    report::demo::better(page, errors, degraded, pictures(after, emulator));
}
