//! `cargo bench --bench identify -- --csv LOG.csv`: 2400 s of PRBS from the emulator, pole and polynomial fitted at
//! once on one core. Prints what came out and the median time as JSON; `tools/compare-scipy` sets scipy beside it.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use rotorbench::emulate::EmulatorConfig;
use rotorbench::estimation::variable_projection::{Record, fit};
use rotorbench::experiment::{ExperimentConfig, Rotors, Waveform};
use rotorbench::log::Dataset;
use rotorbench::runtime::lockstep::drive;

/// [s] T_s of the paper.
const PERIOD: f64 = 0.02;
/// [V] v_bmax of the paper.
const FULL_VOLTAGE: f64 = 12.6;
const REPEATS: usize = 51;

/// [ms] that this thread has had a processor, by the kernel's count: what a busy machine does not lengthen.
fn on_processor() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|word| word.parse::<f64>().ok()).map_or(f64::NAN, |ns| 1e-6 * ns)
}

fn log() -> Dataset {
    let mut config = EmulatorConfig { seed: 1, integration_step_s: 0.004, ..EmulatorConfig::default() };
    config.plant.clamped = true;
    config.sensors = config.sensors.at_rate(1.0 / PERIOD);
    let shape = Waveform::Prbs { amplitude: 0.08, bandwidth_hz: 0.0, duration_s: 2400.0, seed: 1 };
    let experiment = ExperimentConfig { shape, rotors: Rotors::One, around: 0.4633, lead_in_s: 4.0 };
    let experiment = experiment.build(PERIOD).expect("an experiment that can be");
    drive(&config.build().expect("a bench that can be"), &experiment)
        .into_dataset("PRBS")
        .expect("rising time")
}

fn main() {
    let log = log();
    let column = |name: &str| log.column(name).expect("the emulator measures it");
    let (u, v) = (column("command_1"), column("battery_voltage_v"));
    let rate = column("propeller_rate_1_rad_s");
    let arguments: Vec<String> = std::env::args().collect();
    if let Some(path) = arguments.iter().position(|word| word == "--csv").and_then(|at| arguments.get(at + 1))
    {
        let mut text = String::from("time_s,u,v,rate\n");
        for row in 0..log.len() {
            // Writing to a `String` cannot fail.
            let _ = writeln!(text, "{},{},{},{}", log.time()[row], u[row], v[row], rate[row]);
        }
        std::fs::write(path, text).expect("the folder can be written to");
    }
    let record = Record::<3> {
        time: log.time().to_vec(),
        output: rate.to_vec(),
        inputs: u.iter().zip(v).map(|(u, v)| [*u, u * u, v - FULL_VOLTAGE]).collect(),
        segments: std::iter::once(0..log.len()).collect(),
    };
    let before = on_processor();
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            black_box(fit(black_box(&record)));
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    let processor = (on_processor() - before) / REPEATS as f64;
    times.sort_by(f64::total_cmp);
    let found = fit(&record).expect("a PRBS determines it");
    println!(
        "{{\"samples\": {}, \"least_milliseconds\": {:.3}, \"milliseconds\": {:.3}, \
         \"processor_milliseconds\": {processor:.3}, \"values\": [{}, {}, {}, {}]}}",
        found.samples,
        times[0],
        times[REPEATS / 2],
        found.pole,
        found.coefficients[0],
        found.coefficients[1],
        found.coefficients[2]
    );
}
