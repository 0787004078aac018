//! What the error depends on: the channel whose value tells most about it.

use super::block_data::{BlockData, Runs};
use super::body_block::BodyRun;
use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use crate::estimation::dependence::explained;
use crate::estimation::moments::{mean, mean_square};
use crate::estimation::output_error::Fit;
use crate::estimation::scattered::one_in;
use crate::estimation::slope::slope;
use crate::log::signals::MOST_ROTORS;
use crate::signal::{Sensor, columns};

/// The error of one part of the model beside what it may depend on.
pub struct ResidualEvidence {
    /// `actuator_1`, `actuator_2`, ... or `body`.
    pub block: String,
    /// The error: residuals of a rotor, unexplained acceleration of each window of the body.
    pub error: Vec<f64>,
    /// Variance of the error that noise alone would have.
    pub noise: f64,
    /// Channels, by log name.
    pub channels: Vec<(String, Vec<f64>)>,
}

impl ResidualEvidence {
    /// The channel that explains most, and its share of what is above the noise.
    #[must_use]
    pub fn strongest(&self) -> (String, f64) {
        let room = (mean_square(&self.error) - self.noise).max(f64::MIN_POSITIVE);
        let share = |values: &Vec<f64>| (explained(&self.error, values) / room).clamp(0.0, 1.0);
        let all = self.channels.iter().map(|(name, values)| (name.clone(), share(values)));
        all.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((String::new(), 0.0))
    }
}

/// The evidence of a block under a fit.
#[must_use]
pub fn evidence(data: &BlockData, fit: &Fit) -> Vec<ResidualEvidence> {
    match &data.runs {
        Runs::Rotor(runs) => {
            let noise = data.white_noise(&fit.residuals, 0).powi(2);
            (0..MOST_ROTORS).filter_map(|rotor| rotor_evidence((data, noise), runs, fit, rotor)).collect()
        }
        Runs::Body(runs) => vec![body_evidence(data, runs, fit)],
    }
}

fn rotor_evidence(
    (data, noise): (&BlockData, f64),
    runs: &[RotorRun],
    fit: &Fit,
    rotor: usize,
) -> Option<ResidualEvidence> {
    const RATE: Sensor = Sensor::PropellerRate;
    let number = rotor + 1;
    let names = [
        columns::TIME.to_owned(),
        columns::command(number),
        columns::BATTERY_VOLTAGE.to_owned(),
        columns::propeller_rate(number),
        format!("{}_{number}_change{}", RATE.name(), RATE.suffix()),
        format!("{}_change", columns::command(number)),
    ];
    let mut channels: Vec<(String, Vec<f64>)> = names.into_iter().map(|name| (name, Vec::new())).collect();
    let residuals = fit.residuals.all();
    let of_rotor = || data.units().iter().zip(runs).filter(|(_, run)| run.rotor == rotor);
    let rows: usize = of_rotor().map(|(unit, _)| unit.len()).sum();
    let share = rows.div_ceil(THRESHOLDS.most_evidence_rows).max(1);
    let mut error = Vec::new();
    for (unit, run) in of_rotor() {
        let simulated = |row: usize| run.measured[row] - residuals[unit.start + row] * data.sigma[0];
        for row in one_in(share, run.time.len()) {
            let residual = residuals[unit.start + row];
            if residual == 0.0 || !run.measured[row].is_finite() {
                continue;
            }
            error.push(residual * data.sigma[0]);
            let back = row.saturating_sub(1);
            // The change of the simulated rate: the measured one would bring its noise along.
            let change = simulated(row) - simulated(back);
            let recent = run.command[row] - run.command[row.saturating_sub(3)];
            let voltage = run.voltage.as_ref().map_or(f64::NAN, |voltage| voltage[row]);
            let values = [run.time[row], run.command[row], voltage, simulated(row), change, recent];
            channels.iter_mut().zip(values).for_each(|((_, column), value)| column.push(value));
        }
    }
    (!error.is_empty()).then(|| ResidualEvidence {
        block: format!("actuator_{number}"),
        error,
        noise,
        channels,
    })
}

fn body_evidence(data: &BlockData, runs: &[BodyRun], fit: &Fit) -> ResidualEvidence {
    let names = [
        columns::TIME,
        columns::BODY_ANGLE,
        columns::BODY_RATE,
        "torque",
        "torque_change",
        columns::PROPELLER_RATES[0],
        columns::PROPELLER_RATES[1],
    ];
    let mut channels: Vec<(String, Vec<f64>)> =
        names.into_iter().map(|name| (name.to_owned(), Vec::new())).collect();
    let mut error = Vec::new();
    let mut spread = Vec::new();
    let all = fit.residuals.all();
    let windows = runs.iter().flat_map(|run| run.windows.iter().map(move |window| (run, window)));
    for (unit, (run, window)) in data.units().iter().zip(windows) {
        let time = &run.input.time[window.clone()];
        let residuals = &all[unit.start..unit.start + window.len()];
        if residuals.iter().all(|value| *value == 0.0) {
            continue;
        }
        let (slope, squares) = slope(time, residuals);
        error.push(slope * data.sigma[0]);
        spread.push(squares.recip());
        let over = |values: &[f64]| values.get(window.clone()).map_or(f64::NAN, mean);
        let ends = |values: &[f64]| {
            values
                .get(window.end - 1)
                .zip(values.get(window.start))
                .map_or(f64::NAN, |(end, start)| end - start)
        };
        let values = [
            mean(time),
            over(&run.path().angle),
            over(&run.path().rate),
            over(&run.input.torque),
            ends(&run.input.torque),
            over(&run.input.propeller_rate[0]),
            over(&run.input.propeller_rate[1]),
        ];
        channels.iter_mut().zip(values).for_each(|((_, column), value)| column.push(value));
    }
    channels.retain(|(_, values)| values.iter().any(|value| value.is_finite()));
    let floor = data.white_noise(&fit.residuals, 0);
    // The variance of a slope under white noise.
    let noise = floor * floor * mean(&spread);
    ResidualEvidence { block: "body".to_owned(), error, noise, channels }
}
