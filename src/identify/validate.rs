//! The identified rotor on another log: free run from its commands, percentage error as in [LPC16] Fig. 3.

use super::thresholds::THRESHOLDS;
use serde::Serialize;

use super::IdentifiedActuator;
use crate::estimation::moments::mean_of;
use crate::estimation::quantile::quantile;
use crate::screening::rotor_data::RotorLog;

/// How the identified rotor does on a log it was not fitted to.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct Validation {
    /// File and rotor.
    pub source: String,
    /// [rad/s] rms error of the free run.
    pub rms: f64,
    /// [%] rms of the error as a share of the measured rate.
    pub rms_percent: f64,
    /// [%] largest error as a share of the measured rate, over 99 % of the samples.
    pub worst_percent: f64,
    /// [%] 100 (1 - |error| / |measured - mean|), as `compare` in MATLAB defines it.
    pub fit_percent: f64,
    /// Samples compared.
    pub samples: usize,
    /// [s] [rad/s] [rad/s]: time, measured, modelled; for plots.
    #[serde(skip)]
    pub traces: Vec<(f64, f64, f64)>,
}

impl Validation {
    /// Whether it is off by far more than noise, and than what matters of a rate: where the commands of a log hardly move its rotor, noise
    /// and a slow drift are all that there is to explain.
    pub(crate) fn is_far_off(&self) -> bool {
        let steps = self.traces.windows(2).map(|pair| (pair[1].1 - pair[0].1).powi(2));
        let noise = (0.5 * mean_of(steps)).sqrt();
        let usual = mean_of(self.traces.iter().map(|trace| trace.1.abs()));
        self.rms > THRESHOLDS.far_off_noise * noise && self.rms > THRESHOLDS.far_off_share * usual
    }
}

/// Free run over one rotor's log; each stretch starts from the rate that fits it best, for the first one measured is noisy.
pub(crate) fn validate(rotor: &RotorLog, actuator: &IdentifiedActuator) -> Option<Validation> {
    let mut traces = Vec::new();
    if rotor.rows_are_levels() {
        let volts = |row: usize| rotor.voltage.as_ref().map(|voltage| voltage[row]);
        let steady = |row: usize| actuator.steady_rate(rotor.command[row], volts(row));
        traces.extend(rotor.scored().map(|row| (rotor.time[row], rotor.rate[row], steady(row))));
    }
    let runs = if rotor.rows_are_levels() { &[][..] } else { &rotor.stretches };
    for stretch in runs {
        let Some(first) = stretch.clone().find(|&row| rotor.rate[row].is_finite()) else { continue };
        let rows = first..stretch.end;
        let voltage = rotor.voltage.as_ref().map(|voltage| &voltage[rows.clone()]);
        let forced =
            actuator.run_from(Some(0.0), &rotor.time[rows.clone()], &rotor.command[rows.clone()], voltage);
        // Before the delay has passed, commands act that the stretch does not hold.
        let heard = rotor.time[first] + actuator.delay;
        let left = |row: usize| (-actuator.pole * (rotor.time[row] - rotor.time[first])).exp();
        let scored = |row: &usize| rotor.rate[*row].is_finite() && rotor.time[*row] >= heard;
        let each: Vec<(usize, f64)> = rows.zip(forced.rate).filter(|(row, _)| scored(row)).collect();
        let squares: f64 = each.iter().map(|(row, _)| left(*row).powi(2)).sum();
        let products: f64 = each.iter().map(|(row, forced)| left(*row) * (rotor.rate[*row] - forced)).sum();
        let start = if squares > 0.0 { products / squares } else { 0.0 };
        traces.extend(
            each.iter().map(|&(row, forced)| (rotor.time[row], rotor.rate[row], forced + start * left(row))),
        );
    }
    let fewest = if rotor.rows_are_levels() { THRESHOLDS.fewest_points } else { THRESHOLDS.fewest_validated };
    if traces.len() < fewest {
        return None;
    }
    let samples = traces.len();
    let count = samples as f64;
    let mean = mean_of(traces.iter().map(|trace| trace.1));
    let squares: f64 = traces.iter().map(|(_, measured, model)| (measured - model).powi(2)).sum();
    let around: f64 = traces.iter().map(|trace| (trace.1 - mean).powi(2)).sum();
    let percent = || traces.iter().map(|(_, measured, model)| 100.0 * ((model - measured) / measured).abs());
    Some(Validation {
        source: rotor.source(),
        rms: (squares / count).sqrt(),
        rms_percent: (percent().map(|error| error * error).sum::<f64>() / count).sqrt(),
        worst_percent: quantile(percent(), THRESHOLDS.worst_share).unwrap_or(f64::NAN),
        fit_percent: 100.0 * (1.0 - (squares / around.max(f64::MIN_POSITIVE)).sqrt()),
        samples,
        traces,
    })
}
