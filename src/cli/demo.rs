//! `rotorbench demo`: the whole story with no hardware, in under a minute.

use std::fs;
use std::path::{Path, PathBuf};

use super::{CliError, CliResult, Outcome};
use crate::bench::BenchConfig;
use crate::control::PlantParameters;
use crate::emulate::Impulse;
use crate::process::lockstep::{Lockstep, Slot};
use crate::process::pilot::Pilot;
use crate::process::trace::Trace;
use crate::record::log;
use crate::report::{Axis, Page, Plot, Series, Table, Tone};

/// Arguments of `demo`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder for everything it writes
    #[arg(long, value_name = "DIR", default_value = "rotorbench-demo")]
    out: PathBuf,
    /// Seed of the emulator
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// [s] that the bench flies.
const FLIGHT_S: f64 = 30.0;

/// Runs the command.
pub fn run(arguments: &Arguments) -> CliResult {
    let out = &arguments.out;
    fs::create_dir_all(out).map_err(|error| CliError::new(format!("{}: {error}", out.display())))?;
    let bench = bench(arguments.seed);
    let slots = fly(&bench)?;
    save_log(&slots, &out.join("loop.csv"))?;
    let (angle, torque) = pictures(&slots);
    angle.save_svg(&out.join("angle.svg"))?;
    torque.save_svg(&out.join("disturbance.svg"))?;
    let table = summary(&slots);
    print!("{}", table.text());
    let report = out.join("index.html");
    let mut page = Page::new("rotorbench demo");
    page.heading("The loop holds the angle").table(table).plot(angle).plot(torque);
    page.save(&report)?;
    println!("report: {}", report.display());
    Ok(Outcome::Done)
}

/// The embedded default bench, struck by torque impulses.
fn bench(seed: u64) -> BenchConfig {
    let mut bench = BenchConfig::default();
    bench.emulator.seed = seed;
    bench.emulator.impulse = vec![
        Impulse { at_s: 5.0, duration_s: 0.05, torque: 0.6 },
        Impulse { at_s: 10.0, duration_s: 0.05, torque: -0.6 },
    ];
    bench.emulator.impulse_period_s = 10.0;
    bench
}

fn fly(bench: &BenchConfig) -> Result<Vec<Slot>, CliError> {
    let controller = bench.controller.build(&PlantParameters::paper(), bench.period_s)?;
    let reference = bench.controller.reference.build(bench.period_s)?;
    let pilot = Pilot::controller(controller, reference);
    Ok(Lockstep::new(bench.emulator.build()?, pilot, bench.period_s).run(FLIGHT_S, &mut ()))
}

fn save_log(slots: &[Slot], path: &Path) -> Result<(), CliError> {
    let mut trace = Trace::default();
    for slot in slots {
        trace.push(crate::clock::span_ns(slot.time), &slot.sensors, &slot.applied);
    }
    Ok(log::write(&trace.into_dataset("demo")?, path)?)
}

fn column(slots: &[Slot], of: impl Fn(&Slot) -> f64) -> Vec<f64> {
    slots.iter().map(of).collect()
}

/// The angle, and the disturbance with its estimate.
fn pictures(slots: &[Slot]) -> (Plot, Plot) {
    let time = column(slots, |slot| slot.time);
    let estimate = |of: fn(&crate::signal::Estimate) -> f64| {
        column(slots, |slot| slot.command.as_ref().map_or(f64::NAN, |command| of(&command.estimate)))
    };
    let seconds = || Axis::new("time", "s");
    let angle = Plot::new("Angle", seconds(), Axis::new("body angle", "rad"))
        .group("time")
        .series(
            Series::line("true", &time, &column(slots, |slot| slot.truth.body_angle)).tone(Tone::Measured),
        )
        .series(Series::line("estimated", &time, &estimate(|it| it.body_angle)).tone(Tone::Model));
    let torque = Plot::new("Disturbance", seconds(), Axis::new("torque", "N m"))
        .group("time")
        .series(
            Series::line("true", &time, &column(slots, |slot| slot.truth.disturbance_torque))
                .tone(Tone::Measured),
        )
        .series(Series::line("estimated", &time, &estimate(|it| it.disturbance_torque)).tone(Tone::Model));
    (angle, torque)
}

fn summary(slots: &[Slot]) -> Table {
    let angles = column(slots, |slot| slot.truth.body_angle);
    let square: f64 = angles.iter().map(|angle| angle * angle).sum();
    let peak = angles.iter().fold(0.0_f64, |peak, angle| peak.max(angle.abs()));
    Table::new(["", "value", "unit"])
        .row(["angle error, rms", &format!("{:.4}", (square / angles.len() as f64).sqrt()), "rad"])
        .row(["angle error, largest", &format!("{peak:.4}"), "rad"])
        .row(["flown", &format!("{FLIGHT_S}"), "s"])
}
