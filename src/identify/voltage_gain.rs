//! k_V from constant commands, [LPC16] Eqs. (4)-(6).
//!
//! **Deviation:** for Eq. (6) the print subtracts the first sample, Δω(k) = k_V Δv(k), and fits by least squares. Two
//! measurement errors then bias k_V towards zero: the noise of that one first sample, which every row shares,
//! and the noise of the voltage, which is as large as its fall over a short experiment. Here the mean is
//! subtracted, and the voltage is replaced by its smooth course over time (a cubic, as instruments). The
//! print's own number is given beside it.
//!
//! **Deviation:** Eq. (3) prints 1000 samples, Eq. (6) 3000; here a level has as many as the log holds.

use super::thresholds::THRESHOLDS;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::{Estimate, Weighted};
use crate::estimation::least_squares;
use crate::estimation::moments::mean_of;
use crate::screening::excitation::SteadyCommand;
use crate::screening::rotor_data::RotorLog;

/// k_V of one constant command.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct LevelGain {
    /// File and rotor.
    pub source: String,
    /// [-] the command.
    pub command: f64,
    /// Samples used.
    pub samples: usize,
    /// [V] how far the smooth course of the voltage moved.
    pub voltage_change: f64,
    /// [rad/(s V)] free of the noise of the voltage.
    pub gain: Estimate,
    /// [rad/(s V)] by least squares exactly as Eq. (6) is printed.
    pub as_printed: f64,
}

/// k_V from all constant commands.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct BatteryGain {
    /// [rad/(s V)] weighted mean over the levels.
    pub gain: Estimate,
    /// [rad/(s V)] standard deviation over the levels.
    pub spread: f64,
    /// [rad/(s V)] plain mean of the print's estimates.
    pub as_printed: f64,
    /// One entry per level.
    pub levels: Vec<LevelGain>,
    /// Levels at which the voltage hardly moved.
    pub left_out: usize,
}

/// k_V from every stretch of constant command; `None` when none of them shows it.
pub(crate) fn identify(rotors: &[RotorLog]) -> (Option<BatteryGain>, usize) {
    let mut levels = Vec::new();
    let mut left_out = 0;
    for rotor in rotors {
        for (kind, rows) in rotor.steady() {
            if kind == SteadyCommand::Constant {
                match level_gain(rotor, rows) {
                    Some(level) => levels.push(level),
                    None => left_out += 1,
                }
            }
        }
    }
    if levels.is_empty() {
        return (None, left_out);
    }
    let gains: Vec<Estimate> = levels.iter().map(|level| level.gain).collect();
    let Weighted { estimate: gain, spread } = Weighted::mean(&gains);
    let as_printed = mean_of(levels.iter().map(|level| level.as_printed));
    (Some(BatteryGain { gain, spread, as_printed, levels, left_out }), left_out)
}

fn level_gain(rotor: &RotorLog, rows: std::ops::Range<usize>) -> Option<LevelGain> {
    let voltage = rotor.voltage.as_deref()?;
    let command = rotor.command[rows.start];
    let rows: Vec<usize> =
        rows.filter(|&row| rotor.rate[row].is_finite() && voltage[row].is_finite()).collect();
    if rows.len() < THRESHOLDS.fewest_level_rows {
        return None;
    }
    let time: Vec<f64> = rows.iter().map(|&row| rotor.time[row]).collect();
    let instruments = least_squares::smooth_course(&time, 4);
    let course = least_squares::least_squares(
        &instruments,
        &DVector::from_iterator(rows.len(), rows.iter().map(|&row| voltage[row])),
    )?;
    let smooth = &instruments * &course.coefficients;
    let explained = smooth.add_scalar(-smooth.mean()).norm_squared();
    let left = course.residuals.norm_squared().max(f64::MIN_POSITIVE);
    // A voltage without any noise is as good as it gets.
    if (explained / 3.0) / (left / (rows.len() - 4) as f64) < THRESHOLDS.weakest_first_stage
        || explained < 1e-12
    {
        return None;
    }
    // Eq. (5) with z = g - k_V (v_bmax - v): the rate rises with the voltage.
    let design =
        DMatrix::from_fn(rows.len(), 2, |at, column| if column == 0 { 1.0 } else { voltage[rows[at]] });
    let rate = DVector::from_iterator(rows.len(), rows.iter().map(|&row| rotor.rate[row]));
    let fit = least_squares::instrumental(design.as_view(), instruments.as_view(), &rate)?;
    Some(LevelGain {
        source: rotor.source(),
        command,
        samples: rows.len(),
        voltage_change: smooth.max() - smooth.min(),
        gain: Estimate { value: fit.coefficients[1], standard_error: fit.standard_error(1) },
        as_printed: as_printed(&rows, &rotor.rate, voltage),
    })
}

/// [rad/(s V)] least squares of [LPC16] Eq. (6), word for word.
fn as_printed(rows: &[usize], rate: &[f64], voltage: &[f64]) -> f64 {
    let first = rows[0];
    let (mut products, mut squares) = (0.0, 0.0);
    for &row in rows {
        let (rate_change, voltage_change) = (rate[row] - rate[first], voltage[row] - voltage[first]);
        products += rate_change * voltage_change;
        squares += voltage_change * voltage_change;
    }
    products / squares
}
