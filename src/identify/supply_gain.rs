//! k_V from levels that were recorded at several supplies, a log each.
//!
//! **Deviation:** Eq. (6) looks at one level at a time, while its voltage falls. On a bench supply it does not fall, and what is left of
//! it there is the supply's own answer to the load. But the same command settles at another rate in the next log, whose supply is set
//! to another voltage. So the mean rates of all levels are fitted at once, by powers of the command and the mean voltage.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::Estimate;
use super::steady_rows::{HIGHEST_DEGREE, settled_levels};
use super::thresholds::THRESHOLDS;
use crate::estimation::least_squares::{LinearFit, least_squares};
use crate::estimation::moments::{deviation, mean};
use crate::estimation::quantile::extremes;
use crate::estimation::robust_errors::stretched;
use crate::screening::battery_plateaus::step_of;
use crate::screening::rotor_data::RotorLog;

/// k_V from levels at several supplies.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct SupplyGain {
    /// [rad/(s V)]
    pub gain: Estimate,
    /// Levels used.
    pub levels: usize,
    /// Logs that they come from.
    pub logs: usize,
    /// [V] greatest less least voltage of a log, beside what goes with its commands.
    pub voltage_range: f64,
    /// [rad/s] rms of what is left of the levels' rates.
    pub residual_rms: f64,
    /// Powers of the command beside k_V.
    pub degree: usize,
}

/// A held command: means of what was measured once the rotor had settled.
struct Level<'a> {
    file: &'a str,
    /// [-]
    command: f64,
    /// [rad/s]
    rate: f64,
    /// [V]
    voltage: f64,
    /// [V] standard error of that.
    voltage_error: f64,
}

/// k_V from all held commands; `None` where all logs have one voltage, or the levels do not determine it.
pub(crate) fn identify(rotors: &[RotorLog], full_voltage: f64) -> Option<SupplyGain> {
    let levels: Vec<Level> = rotors.iter().flat_map(levels).collect();
    let degrees =
        (1..=HIGHEST_DEGREE).filter_map(|degree| Some((degree, fit(&levels, degree, full_voltage)?)));
    let left_out = |fit: &Fit| fit.linear.left_out(&fit.design);
    let (degree, fit) = degrees.min_by(|a, b| left_out(&a.1).total_cmp(&left_out(&b.1)))?;
    supply_gain(&levels, degree, &fit)
}

/// The levels of one rotor in one log: of each held command what comes when the rotor has settled, at the latest in its second half.
fn levels(rotor: &RotorLog) -> Vec<Level<'_>> {
    let Some(voltage) = rotor.voltage.as_deref() else { return Vec::new() };
    let step = step_of(voltage).unwrap_or(0.0);
    let mut levels = Vec::new();
    for settled in settled_levels(rotor) {
        let counts = |row: &usize| rotor.rate[*row].is_finite() && voltage[*row].is_finite();
        let rows: Vec<usize> = settled.clone().filter(counts).collect();
        if rows.is_empty() || (rows.len() < THRESHOLDS.fewest_of_level && !rotor.rows_are_levels()) {
            continue;
        }
        let of = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        let (rates, volts) = (of(&rotor.rate), of(voltage));
        let scatter = deviation(volts.iter().copied()) / (volts.len() as f64).sqrt();
        levels.push(Level {
            file: &rotor.file,
            command: rotor.command[settled.start],
            rate: mean(&rates),
            voltage: mean(&volts),
            voltage_error: scatter.hypot(step / 12f64.sqrt()),
        });
    }
    levels
}

/// Rates by powers of the command, and the voltage that lacks, last.
struct Fit {
    design: DMatrix<f64>,
    linear: LinearFit,
}

fn fit(levels: &[Level], degree: usize, full_voltage: f64) -> Option<Fit> {
    if levels.len() < degree + 1 + THRESHOLDS.spare_levels {
        return None;
    }
    let design = DMatrix::from_fn(levels.len(), degree + 1, |row, column| {
        let level = &levels[row];
        if column < degree { level.command.powi(column as i32 + 1) } else { level.voltage - full_voltage }
    });
    let rates = DVector::from_iterator(levels.len(), levels.iter().map(|level| level.rate));
    let linear = least_squares(&design, &rates)?;
    Some(Fit { design, linear })
}

/// Places of the levels, log by log.
fn by_log(levels: &[Level]) -> Vec<Vec<usize>> {
    let mut logs: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    levels.iter().enumerate().for_each(|(row, level)| logs.entry(level.file).or_default().push(row));
    logs.into_values().collect()
}

/// k_V and its error, where the voltage goes its own way from log to log.
fn supply_gain(levels: &[Level], degree: usize, fit: &Fit) -> Option<SupplyGain> {
    let logs = by_log(levels);
    let voltage = fit.design.column(degree).into_owned();
    let powers = fit.design.columns(0, degree).into_owned();
    let without = |design: &DMatrix<f64>| least_squares(design, &voltage).map(|fit| fit.residuals);
    // What of the voltage does not go with the commands, wherever it lies.
    let own = without(&powers.clone().insert_column(degree, 1.0)).unwrap_or_else(|| voltage.clone());
    let of_log = |rows: &Vec<usize>| mean(&rows.iter().map(|row| own[*row]).collect::<Vec<f64>>());
    let (low, high) = extremes(logs.iter().map(of_log));
    let noise = levels.iter().map(|level| level.voltage_error.powi(2)).sum::<f64>() / levels.len() as f64;
    let is_seen = own.norm_squared() / levels.len() as f64 > THRESHOLDS.weakest_first_stage * noise;
    if logs.len() < 2 || high - low < THRESHOLDS.supplies_differ || !is_seen {
        return None;
    }
    // k_V comes from what the powers leave of the voltage. What else differs between the logs is in the residuals of all levels of
    // a log: their sums show it. Of few levels and few logs an error is itself uncertain.
    let alone = without(&powers).unwrap_or_else(|| voltage.clone());
    let score =
        |rows: &Vec<usize>| rows.iter().map(|row| alone[*row] * fit.linear.residuals[*row]).sum::<f64>();
    let others = logs.len() - 1;
    let scores = logs.iter().map(|rows| score(rows).powi(2)).sum::<f64>() * logs.len() as f64 / others as f64;
    let between = scores.sqrt() / alone.norm_squared() * stretched(others as f64);
    let white = fit.linear.standard_error(degree) * stretched((levels.len() - degree - 1) as f64);
    Some(SupplyGain {
        gain: Estimate { value: fit.linear.coefficients[degree], standard_error: white.max(between) },
        levels: levels.len(),
        logs: logs.len(),
        voltage_range: high - low,
        residual_rms: fit.linear.residual_rms,
        degree,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10 s at each of these commands, on a supply that is set to `volts`, and gives way by a tenth of a volt at full.
    fn log(name: &str, volts: f64, commands: &[f64], gain: f64) -> RotorLog {
        let rows = 500 * commands.len();
        let command: Vec<f64> = (0..rows).map(|row| commands[row / 500]).collect();
        let noise = |row: usize, by: f64| by * ((row as f64 * 12.9898).sin() * 43758.5453).fract();
        let voltage: Vec<f64> =
            (0..rows).map(|row| volts - 0.1 * command[row].powi(2) + noise(row, 0.01)).collect();
        let rate = |row: usize| {
            let u = command[row];
            (1124.5 + 447.1 * u) * u - gain * (12.6 - voltage[row]) + noise(row + rows, 3.0)
        };
        RotorLog {
            file: name.to_owned(),
            number: 1,
            time: (0..rows).map(|row| 0.02 * row as f64).collect(),
            rate: (0..rows).map(rate).collect(),
            command: command.into(),
            command_from: None,
            delay_unknown: 0.0,
            delay_found: 0.0,
            voltage: Some(voltage.into()),
            voltage_gap: None,
            thrust: None,
            stretches: std::iter::once(0..rows).collect(),
            interval: 0.02,
            instrument: None,
            beside: None,
        }
    }

    #[test]
    fn levels_at_several_supplies_tell_the_voltage_gain() {
        let commands = [[0.2, 0.35, 0.5, 0.65], [0.25, 0.4, 0.55, 0.6], [0.3, 0.45, 0.22, 0.5]];
        let logs = [("a", 10.0), ("b", 11.0), ("c", 12.2)];
        for gain in [50.0, 8.0] {
            let logs: Vec<RotorLog> = logs
                .iter()
                .zip(&commands)
                .map(|((name, volts), commands)| log(name, *volts, commands, gain))
                .collect();
            let found = identify(&logs, 12.6).expect("three supplies");
            assert!(found.gain.distance(gain) < 3.0 && found.gain.standard_error < 1.0, "{found:?}");
            assert_eq!((found.levels, found.logs), (12, 3));
            // 2.2 V less what the commands happen to go with.
            assert!((1.8..2.3).contains(&found.voltage_range), "{found:?}");
        }
        let same = [("a", 11.0), ("b", 11.05), ("c", 11.0)]
            .map(|(name, volts)| log(name, volts, &commands[0], 50.0));
        assert!(identify(&same, 12.6).is_none(), "one supply");
        let one = log("a", 11.0, &[0.2, 0.3, 0.4, 0.5, 0.6, 0.35, 0.25, 0.45], 50.0);
        assert!(identify(&[one], 12.6).is_none(), "one log");
    }

    /// What differs between logs beside the voltage widens the error: a battery that is no cause is not significant.
    #[test]
    fn what_else_differs_between_logs_is_in_the_error() {
        let commands = [0.2, 0.3, 0.4, 0.5, 0.6];
        let logs: Vec<RotorLog> = [(10.0, 1.0), (10.8, 1.03), (11.4, 0.98), (12.2, 1.01)]
            .iter()
            .enumerate()
            .map(|(at, (volts, scale))| {
                let mut log = log(&at.to_string(), *volts, &commands, 0.0);
                log.rate.iter_mut().for_each(|rate| *rate *= scale);
                log
            })
            .collect();
        let found = identify(&logs, 12.6).expect("four supplies");
        assert!(found.gain.standard_error > 0.4 * found.gain.value.abs(), "{found:?}");
    }
}
