//! The identified rotor on another log: free run from its commands, percentage error as in [LPC16] Fig. 3.

use serde::Serialize;

use super::IdentifiedActuator;
use super::rotor_log::RotorLog;

/// How the identified rotor does on a log it was not fitted to.
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

/// Free run over one rotor's log; each stretch starts from its first measured rate.
pub(super) fn validate(rotor: &RotorLog, actuator: &IdentifiedActuator) -> Option<Validation> {
    let mut traces = Vec::new();
    for segment in &rotor.segments {
        let Some(first) = segment.clone().find(|&row| rotor.rate[row].is_finite()) else { continue };
        let rows = first..segment.end;
        let voltage = rotor.voltage.as_ref().map(|voltage| &voltage[rows.clone()]);
        let start = rotor.rate[first];
        let modelled =
            actuator.run_from(Some(start), &rotor.time[rows.clone()], &rotor.command[rows.clone()], voltage);
        let each = rows.zip(modelled.rates).filter(|(row, _)| rotor.rate[*row].is_finite());
        traces.extend(each.map(|(row, model)| (rotor.time[row], rotor.rate[row], model)));
    }
    let shown = with_holes(&traces, rotor.interval);
    if traces.len() < 10 {
        return None;
    }
    let samples = traces.len();
    let count = samples as f64;
    let mean = traces.iter().map(|trace| trace.1).sum::<f64>() / count;
    let squares: f64 = traces.iter().map(|(_, measured, model)| (measured - model).powi(2)).sum();
    let around: f64 = traces.iter().map(|trace| (trace.1 - mean).powi(2)).sum();
    let mut shares: Vec<f64> =
        traces.iter().map(|(_, measured, model)| 100.0 * ((model - measured) / measured).abs()).collect();
    shares.sort_by(f64::total_cmp);
    Some(Validation {
        source: rotor.source.clone(),
        rms: (squares / count).sqrt(),
        rms_percent: (shares.iter().map(|share| share * share).sum::<f64>() / count).sqrt(),
        worst_percent: shares.get((samples * 99) / 100).copied().unwrap_or(f64::NAN),
        fit_percent: 100.0 * (1.0 - (squares / around.max(f64::MIN_POSITIVE)).sqrt()),
        samples,
        traces: shown,
    })
}

/// The traces with a row that is not a number wherever rows are missing, so that no line is drawn over a hole.
fn with_holes(traces: &[(f64, f64, f64)], interval: f64) -> Vec<(f64, f64, f64)> {
    /// Intervals without a row that make a hole.
    const HOLE: f64 = 5.0;
    let mut shown = Vec::with_capacity(traces.len());
    let mut last = f64::INFINITY;
    for trace in traces {
        if trace.0 - last > HOLE * interval {
            shown.push((0.5 * (last + trace.0), f64::NAN, f64::NAN));
        }
        shown.push(*trace);
        last = trace.0;
    }
    shown
}
