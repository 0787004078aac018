//! A law of your own beside the catalogue: it competes with every known effect, and is found.
//!
//!     cargo run --release --example own_effect

use std::error::Error;

use rotorbench::bench::BenchConfig;
use rotorbench::cancel::Cancel;
use rotorbench::diagnose::{DiagnoseConfig, Diagnosis};
use rotorbench::effect::Site;
use rotorbench::emulate::HiddenConfig;
use rotorbench::model::{Model, UserEffect, UserParameter};
use rotorbench::runtime::ExperimentPlan;
use rotorbench::session::{self, Job};

/// What the law adds to the torque on the body [N m]: a spring that gets stiffer as it bends.
const LAW: &str = "-k*body_angle*abs(body_angle)";

fn main() -> Result<(), Box<dyn Error>> {
    print(&diagnosed()?);
    Ok(())
}

/// Prints the result.
pub fn print(found: &Diagnosis) {
    println!("{:?}: {}", found.verdict, found.effects.join(", "));
    for (name, parameter) in &found.parameters {
        println!("  {name} = {:.3} {}", parameter.value, parameter.unit);
    }
}

/// A model that knows the law, asked about a bench that has it.
pub fn diagnosed() -> Result<Diagnosis, Box<dyn Error>> {
    let stiffness =
        UserParameter { name: "k".into(), unit: "N m/rad²".into(), start: 0.1, lower: 0.0, upper: 50.0 };
    let mut model = Model::paper();
    model.user_effects.push(UserEffect {
        id: "progressive_spring".into(),
        site: Site::Torque,
        expression: LAW.into(),
        parameters: vec![stiffness],
        meaning: "A spring that gets stiffer as it bends.".into(),
    });

    // The bench has the same law, with k = 6, and nobody tells the model how strong it is.
    let mut bench = BenchConfig::default();
    let hidden = HiddenConfig::parse("spring:k=6")?;
    let (site, expression) = (Some(Site::Torque), Some(LAW.to_owned()));
    bench.emulator.hidden.push(HiddenConfig { site, expression, ..hidden });
    let (cancel, plan) = (Cancel::default(), ExperimentPlan::closed_loop_prbs(0.03, 20.0));
    let job = Job::unwatched(&cancel);
    let log = [session::run_emulated(&bench, &plan, "run", &job)?];
    // Without validation logs every third stretch of the log is held out.
    Ok(session::diagnose(&model, &log, &[], &DiagnoseConfig::default(), &job)?)
}
