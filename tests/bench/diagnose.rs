//! `cargo bench --bench diagnose`: how long a diagnosis over the whole catalogue takes, and a free run of 120,000 samples.
//!
//! Logs come from the emulator, with an effect of the catalogue hidden in it, with nothing, and with a law that is in no
//! catalogue, which is the longest search. The yardsticks of the same run: a diagnosis against one free run of its own
//! log, the free run against the shortest loop there is for the same equation (a division, an exponential known before).
//! Peak memory is that of this process, logs included. `-- --quick` leaves the long log out.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use rotorbench::diagnose::{DiagnoseConfig, Verdict, diagnose};
use rotorbench::log::{Dataset, csv};
use rotorbench::model::{Model, RotorInput, RotorStart, RotorTrace};
use rotorbench::screening::ScreenedLog;

/// Runs of what takes milliseconds; the median counts.
const REPEATS: usize = 31;
/// A law that no catalogue has: a pivot with teeth, one that sticks the more the slower it turns, and a motor that likes some
/// speeds more than others.
const UNKNOWN: [(&str, &str, &str); 3] = [
    ("torque", "0.04 * sin(9 * body_angle_rad + 2) * (1 + 0.5 * cos(2 * body_rate_rad_s))", "pivot"),
    (
        "torque",
        "-0.05 * (1 + 2.5 * exp(-(body_rate_rad_s / 0.3)^2)) * tanh(body_rate_rad_s / 0.02)",
        "sticking",
    ),
    ("steady_rate", "12 * sin(0.06 * propeller_rate_rad_s)", "motor"),
];

/// A log of the emulator at 50 Hz.
struct Logs {
    folder: PathBuf,
}

impl Logs {
    fn make(&self, name: &str, arguments: &[&str], seconds: u32, seed: u32) -> Dataset {
        let path = self.folder.join(format!("{name}_{seed}.csv"));
        let (seconds, seed, output) = (seconds.to_string(), seed.to_string(), path.display().to_string());
        let common =
            ["--lockstep", "--duration", &seconds, "--seed", &seed, "--sequence", &seed, "-o", &output];
        let ran = Command::new(env!("CARGO_BIN_EXE_rotorbench"))
            .args(["experiment", "prbs"])
            .args(common)
            .args(arguments)
            .output()
            .expect("the program runs");
        assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
        csv::read(Path::new(&path)).expect("what was written can be read")
    }

    /// A plant with a law of no catalogue, as a model file.
    fn plant(&self, (site, expression, id): (&str, &str, &str)) -> String {
        let path = self.folder.join(format!("{id}.toml"));
        Model::paper().save(&path).expect("the folder can be written to");
        let paper = fs::read_to_string(&path).expect("what was written can be read");
        let law = format!(
            "[[user_effects]]\nid = \"{id}\"\nsite = \"{site}\"\nexpression = \"{expression}\"\n\
             [[effects]]\nid = \"{id}\"\nparameters = {{}}\n"
        );
        fs::write(&path, format!("{paper}\n{law}")).expect("the folder can be written to");
        path.display().to_string()
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// [s]
fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// [MB] the most memory that this process has had.
fn peak() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kilobytes| kilobytes / 1024.0)
}

/// [s] a free run of rotor 1 under the paper's model, and the shortest loop for the same equation.
fn free_run(log: &Dataset) -> [f64; 2] {
    let column = |name: &str| log.column(name).expect("the emulator measures it");
    let (command, voltage) = (column("command_1"), column("battery_voltage_v"));
    let model = Model::paper();
    let equations = model.equations().expect("no effects");
    let input =
        RotorInput { time: log.time(), command, command_from: None, voltage: Some(voltage), side: 1.0 };
    let mut trace = RotorTrace::default();
    let ours = (0..REPEATS).map(|_| {
        seconds(|| equations.simulate_rotor(black_box(&input), &RotorStart::default(), black_box(&mut trace)))
    });
    let ours = median(ours.collect());
    let share = -(-model.actuator.pole * (log.time()[1] - log.time()[0])).exp_m1();
    let [_, c_g2, c_g1] = *model.actuator.steady_rate.as_slice() else { panic!("the paper's curve") };
    let bare = (0..REPEATS).map(|_| {
        seconds(|| {
            let mut rate = 0.0;
            let run = command.iter().zip(voltage).map(|(u, v)| {
                let steady =
                    u * (c_g2 + c_g1 * u) - model.actuator.voltage_gain * (model.actuator.full_voltage - v);
                rate += (steady - rate) * share;
                rate
            });
            black_box(run.collect::<Vec<f64>>());
        })
    });
    [ours, median(bare.collect())]
}

fn show(name: &str, train: &Dataset, validate: Option<&Dataset>) {
    let [once, _] = free_run(train);
    let mut answer = None;
    let time = seconds(|| {
        // The screening is a part of the work.
        let train = ScreenedLog::of(train);
        let validate: Vec<ScreenedLog> = validate.into_iter().map(ScreenedLog::of).collect();
        answer = Some(diagnose(&Model::paper(), &[train], &validate, &DiagnoseConfig::default(), &|_| ()));
    });
    let answer = answer.and_then(Result::ok).expect("logs of this bench");
    let verdict = match answer.verdict {
        Verdict::MissingEffect => answer.effects.join(" + "),
        verdict => format!("{verdict:?}").to_lowercase(),
    };
    println!("{name:<44} {:>7} {time:>8.2} {:>10.0} {:>8.0}   {verdict}", train.len(), time / once, peak());
}

fn main() {
    let folder = std::env::temp_dir().join(format!("rotorbench-bench-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder of our own");
    let logs = Logs { folder };
    println!("{:<44} {:>7} {:>8} {:>10} {:>8}   answer", "diagnose", "rows", "s", "free runs", "peak MB");
    let [pivot, sticking, motor] = UNKNOWN.map(|law| logs.plant(law));
    let attitude = ["--closed-loop", "--amplitude", "0.03"];
    let actuator = ["--rotors", "one"];
    let both = ["--hide", "gravity_pendulum:moment=0.3", "--hide", "pivot_viscous_friction:coefficient=0.05"];
    let cases: [(&str, &[&str], &[&str]); 8] = [
        ("attitude, nothing hidden", &attitude, &[]),
        ("attitude, gravity_pendulum", &attitude, &["--hide", "gravity_pendulum:moment=0.3"]),
        ("attitude, pendulum and friction", &attitude, &both),
        ("attitude, a law of no catalogue", &attitude, &["--model", &pivot]),
        ("attitude, another one, with friction", &attitude, &["--model", &sticking]),
        ("actuator, nothing hidden", &actuator, &[]),
        ("actuator, asymmetric_pole", &actuator, &["--hide", "asymmetric_pole:ratio=1.4"]),
        ("actuator, a law of no catalogue", &actuator, &["--model", &motor]),
    ];
    for (name, shape, hidden) in cases {
        let of = |seed| logs.make(&name.replace([' ', ','], "_"), &[shape, hidden].concat(), 120, seed);
        show(name, &of(1), Some(&of(2)));
    }
    if !std::env::args().any(|word| word == "--quick") {
        let long =
            logs.make("long", &[&actuator[..], &["--hide", "asymmetric_pole:ratio=1.4"]].concat(), 2400, 1);
        show("actuator, asymmetric_pole, thirds held out", &long, None);
        let [ours, bare] = free_run(&long);
        println!(
            "free run of {} samples: {:.2} ms, {:.2} times the bare loop's {:.2} ms",
            long.len(),
            1e3 * ours,
            ours / bare,
            1e3 * bare
        );
    }
    let _ = fs::remove_dir_all(&logs.folder);
}
