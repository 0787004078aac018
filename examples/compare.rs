//! Compares a model with a log: where is it wrong, and how much of that is noise?
//!
//!     cargo run --example compare

use std::error::Error;

use rotorbench::bench::BenchConfig;
use rotorbench::cancel::Cancel;
use rotorbench::compare::{CompareConfig, Comparison};
use rotorbench::emulate::HiddenConfig;
use rotorbench::model::Model;
use rotorbench::runtime::ExperimentPlan;
use rotorbench::session::{self, Job};

/// Prints the result.
pub fn main() -> Result<(), Box<dyn Error>> {
    for block in comparison()?.blocks {
        let error = &block.error;
        let verdict = if error.is_noise() { "noise alone" } else { "the model fails here" };
        println!(
            "{:<12} {:>8.4} {} rms, {:>7.4} of it noise: {verdict}",
            block.name, error.rms, block.unit, error.noise_floor
        );
    }
    Ok(())
}

/// The paper's model, compared with a run of a bench that has a pendulum which the model does not know.
pub fn comparison() -> Result<Comparison, Box<dyn Error>> {
    let cancel = Cancel::default();
    let job = Job::unwatched(&cancel);
    let mut bench = BenchConfig::default();
    bench.emulator.hidden.push(HiddenConfig::parse("gravity_pendulum:moment=0.4")?);
    // Your own log: `session::open_all(&[path], &OpenConfig::default(), &job)?`.
    let logs = [session::run_emulated(&bench, &ExperimentPlan::closed_loop_prbs(0.03, 20.0), "run", &job)?];
    // One answer for each log and each model.
    let compared = session::compare(&[Model::paper()], &logs, &CompareConfig::default(), &job)?;
    compared.into_iter().flatten().next().ok_or_else(|| "nothing was compared".into())
}
