//! Benches whose commands step on another clock than the rows of their log, as most stands log them: a row shows the command that is in
//! force, and not since when. The plant goes in ticks of a quarter of a millisecond; steps and rows fall on ticks of their own.

use std::path::Path;
use std::{fs, io};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use serde_json::{Value, json};

use crate::experiment::digits;
use crate::motion::Motion;
use crate::plant::{Base, Hidden};

/// [s]
const TICK: f64 = 2.5e-4;

/// A bench, and how it is logged.
struct Bench {
    base: Base,
    hidden: Hidden,
    /// [Hz] of the rows.
    rate: f64,
    /// [rad/s]
    noise: f64,
    /// [s] shortest and longest hold of a command.
    holds: (f64, f64),
    /// Two levels, or any.
    is_binary: bool,
}

/// A made case.
pub struct Case {
    train: String,
    validate: String,
    model: String,
    pub truth: Value,
}

/// What is hidden, in turns: nothing in every second case.
const HIDDEN: [&str; 8] = [
    "none",
    "transport_delay",
    "none",
    "asymmetric_pole",
    "none",
    "telemetry_lag",
    "none",
    "second_order_lag",
];

impl Case {
    pub fn draw(number: u64, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut log_uniform = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let (rate, pole, noise) = (log_uniform(20.0, 400.0), log_uniform(5.0, 60.0), log_uniform(0.3, 6.0));
        let shortest = (log_uniform(1.5, 6.0) / pole).max(6.0 / rate);
        let effect = HIDDEN[number as usize % HIDDEN.len()];
        let mut hidden = Hidden::nothing();
        let mut parameters = json!({});
        let row = 1.0 / rate;
        match effect {
            "transport_delay" => {
                hidden.transport_delay = rng.random_range(1.2..3.0) * row.max(0.15 / pole);
                parameters = json!({"delay": hidden.transport_delay});
            }
            "asymmetric_pole" => {
                let ratio: f64 = rng.random_range(1.15..1.5);
                hidden.asymmetric_pole = if rng.random_bool(0.5) { ratio } else { 1.0 / ratio };
                parameters = json!({"ratio": hidden.asymmetric_pole});
            }
            "telemetry_lag" => {
                hidden.telemetry_lag = rng.random_range(2.0..5.0) * pole;
                parameters = json!({"pole": hidden.telemetry_lag});
            }
            "second_order_lag" => {
                hidden.second_order_lag = rng.random_range(2.0..5.0) * pole;
                parameters = json!({"pole": hidden.second_order_lag});
            }
            _ => {}
        }
        let bench = Bench {
            base: Base { pole, ..Base::PAPER },
            hidden,
            rate,
            noise,
            holds: (shortest, shortest * rng.random_range(1.2..4.0)),
            is_binary: rng.random_bool(0.3),
        };
        let seconds = if rate > 150.0 { 30.0 } else { 60.0 };
        let (train, validate) = (bench.log(&mut rng, seconds), bench.log(&mut rng, 0.7 * seconds));
        let truth = json!({
            "bench": "actuator", "effect": effect, "parameters": parameters, "seed": seed,
            "base_changed_as_well": {}, "rate_hz": rate, "pole_1_s": pole,
            "noise": {"propeller_rate_rad_s": noise}, "holds_s": [bench.holds.0, bench.holds.1],
            "binary": bench.is_binary,
        });
        Self { train, validate, model: bench.base.model("stand"), truth }
    }

    pub fn write(&self, folder: &Path) -> io::Result<()> {
        fs::create_dir_all(folder)?;
        fs::write(folder.join("model.toml"), &self.model)?;
        fs::write(folder.join("train.csv"), &self.train)?;
        fs::write(folder.join("validate.csv"), &self.validate)
    }
}

impl Bench {
    /// One log of it.
    fn log(&self, rng: &mut ChaCha8Rng, seconds: f64) -> String {
        let mut out = String::from("time_s,command_1,battery_voltage_v,propeller_rate_1_rad_s\n");
        let full = 12.4;
        let level = |rng: &mut ChaCha8Rng| match self.is_binary {
            true if rng.random_bool(0.5) => 0.38,
            true => 0.54,
            false => rng.random_range(0.26..0.68),
        };
        let mut command = level(rng);
        let mut motion = Motion::start(&self.base, &self.hidden, false, TICK, TICK, ([command; 2], full));
        let mut next_step = rng.random_range(self.holds.0..self.holds.1);
        // The logger began whenever it did.
        let mut next_row = rng.random_range(0.0..1.0) / self.rate;
        for tick in 0..(seconds / TICK) as usize {
            let time = TICK * tick as f64;
            if time >= next_step {
                command = level(rng);
                next_step += rng.random_range(self.holds.0..self.holds.1);
            }
            let voltage = full - 0.008 * time;
            if time >= next_row {
                next_row += 1.0 / self.rate;
                let [off, read]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(rng));
                let battery = ((voltage + 0.004 * off) * 100.0).round() / 100.0;
                let cells = [time, command, battery, motion.row().rate[0] + self.noise * read];
                out.push_str(&cells.map(digits).join(","));
                out.push('\n');
            }
            motion.advance([command; 2], [voltage, voltage - 0.008 * TICK]);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(log: &str) -> Vec<[f64; 4]> {
        let row = |line: &str| {
            let mut cells = line.split(',').map(|cell| cell.parse().unwrap());
            std::array::from_fn(|_| cells.next().unwrap())
        };
        log.lines().skip(1).map(row).collect()
    }

    /// The row that shows a step shows its answer, too: by another part of a row's way each time, evenly from none to all of it.
    #[test]
    fn steps_come_anywhere_between_rows() {
        let bench = Bench {
            base: Base { pole: 10.0, ..Base::PAPER },
            hidden: Hidden::nothing(),
            rate: 50.0,
            noise: 0.0,
            holds: (0.8, 1.2),
            is_binary: true,
        };
        let rows = cells(&bench.log(&mut ChaCha8Rng::seed_from_u64(3), 200.0));
        let steps = (1..rows.len()).filter(|row| rows[*row][1] != rows[row - 1][1]);
        let ahead: Vec<f64> = steps
            .filter(|row| row + 20 < rows.len())
            .map(|row| {
                // A lag: 1 - exp(-p s) of the way to where it is 0.4 s later.
                let (before, end) = (rows[row - 1][3], rows[row + 20][3]);
                let gone = (rows[row][3] - before) / (end - before) * (1.0 - (-0.4_f64 * 10.0).exp());
                -(1.0 - gone).ln() / 10.0 / 0.02
            })
            .collect();
        let mean = ahead.iter().sum::<f64>() / ahead.len() as f64;
        let variance = ahead.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / ahead.len() as f64;
        // Some 100 steps: the mean is known to 0.03, the variance of 1/12 to a tenth; the battery moves the rates by 0.01 of a step.
        assert!(ahead.len() > 80 && (mean - 0.5).abs() < 0.12, "{} {mean}", ahead.len());
        assert!((variance * 12.0 - 1.0).abs() < 0.35, "{variance}");
        assert!(ahead.iter().all(|it| (-0.05..1.05).contains(it)), "{ahead:?}");
    }
}
