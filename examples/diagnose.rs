//! Finds the effect that a model lacks, adds it, and shows the error fall.
//!
//!     cargo run --release --example diagnose

use std::error::Error;

use rotorbench::bench::BenchConfig;
use rotorbench::cancel::Cancel;
use rotorbench::diagnose::{DiagnoseConfig, Diagnosis};
use rotorbench::emulate::HiddenConfig;
use rotorbench::model::Model;
use rotorbench::report::measure::measure;
use rotorbench::runtime::ExperimentPlan;
use rotorbench::screening::ScreenedLog;
use rotorbench::session::{self, Extended, Job};

fn main() -> Result<(), Box<dyn Error>> {
    let (found, extended) = diagnosed()?;
    print(&found, &extended)
}

/// Prints the result.
pub fn print(found: &Diagnosis, extended: &Extended) -> Result<(), Box<dyn Error>> {
    println!("{:?}: {}", found.verdict, found.effects.join(", "));
    for (name, parameter) in &found.parameters {
        println!("  {name} = {:.4} {}", parameter.value, parameter.unit);
    }
    let error = &extended.extension.error;
    println!("{}", measure(&error.measure));
    println!("  as it was {:.4}, refitted {:.4}", error.base.validate, error.refitted.validate);
    println!("  extended  {:.4}, noise {:.4}", error.extended.validate, error.noise_floor);
    println!("\n{}", extended.extension.model.emit()?);
    Ok(())
}

/// What the paper's model lacks on a bench with a pendulum, and the model with it.
pub fn diagnosed() -> Result<(Diagnosis, Extended), Box<dyn Error>> {
    let cancel = Cancel::default();
    // `Job::new` takes a function that hears of progress; `cancel.request()`, from any thread, ends the work.
    let job = Job::unwatched(&cancel);
    let (train, validate) = (bench_log(1, &job)?, bench_log(2, &job)?);
    let (model, config) = (Model::paper(), DiagnoseConfig::default());
    let found = session::diagnose(&model, &train, &validate, &config, &job)?;
    let extended = session::extend(&model, &found.effects, (&train, &validate), &config, &job)?;
    Ok((found, extended))
}

/// Your own logs: `session::open_all(&paths, &OpenConfig::default(), &job)`.
fn bench_log(seed: u64, job: &Job) -> Result<[ScreenedLog; 1], Box<dyn Error>> {
    let mut bench = BenchConfig::default();
    bench.emulator.seed = seed;
    bench.emulator.hidden.push(HiddenConfig::parse("gravity_pendulum:moment=0.4")?);
    Ok([session::run_emulated(&bench, &ExperimentPlan::closed_loop_prbs(0.03, 20.0), "run", job)?])
}
