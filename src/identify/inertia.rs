//! The body from an attitude log: d/J, and J where the arm is known, from `ω̇_b = (d/J)(f_1 - f_2)`,
//! [LPC16] Eq. (1) with the sign of its Eq. (12); or 1/J from a logged torque.
//!
//! The rate is compared over short windows, each with a free start, so that nothing has to be differentiated
//! and a drift of the gyro does not add up. A constant torque is fitted beside. Where the actuator is known the
//! measured rotor rates are replaced, as instruments, by those it predicts from the commands: the noise of the
//! rates would otherwise make the body look heavier.

use super::thresholds::THRESHOLDS;

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::omitted_torque::{self, OmittedTorque};
use super::significance;
use super::{Estimate, IdentifiedActuator};
use crate::estimation::autocorrelation::lag_one_correlation;
use crate::estimation::integral::{integral_of_held, interpolated, running, trapezoidal};
use crate::estimation::least_squares;
use crate::estimation::moments::mean_of;
use crate::estimation::windows;
use crate::log::Dataset;
use crate::model::RotorTrace;
use crate::screening::attitude::Mistaken;
use crate::screening::{DrivenBy, Finding, ScreenedBody, ScreenedLog};
use crate::signal::columns;
use crate::threads::spread;

/// What the attitude log says about the body.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct IdentifiedBody {
    /// File it comes from.
    pub source: String,
    /// [1/(kg m)] d/J; for a logged torque, with the arm given, d times 1/J.
    pub arm_over_inertia: Estimate,
    /// [kg m²] J, with the arm as given.
    pub inertia: Estimate,
    /// [m] arm d it holds for.
    pub arm: f64,
    /// [rad/s²] constant angular acceleration fitted beside: a torque bias over J.
    pub bias: Estimate,
    /// [rad/s] rms of the residual over windows of half a second.
    pub residual_rms: f64,
    /// [rad/s] rms of the body rate over the same windows, each about its mean.
    pub motion_rms: f64,
    /// Lag-one correlation of the residual: near zero when nothing is missing.
    pub residual_correlation: f64,
    /// A torque of the body's own that is missing; J's error allows for it.
    pub omitted_torque: Option<OmittedTorque>,
    /// Samples used.
    pub samples: usize,
    /// Where the torque came from, in words.
    pub driven_by: &'static str,
    /// [s] [rad/s] [rad/s]: time, measured rate, and the fit's, each window from its own mean; for plots.
    #[serde(skip)]
    pub traces: Vec<(f64, f64, f64)>,
}

/// The angular impulse per lever arm and mass moment: integral of (f_1 - f_2) over time, measured and predicted.
struct Drive {
    measured: Vec<f64>,
    predicted: Option<Vec<f64>>,
    driven_by: &'static str,
    /// d in front of it: the arm, or 1 for a logged torque.
    lever: f64,
}

/// What the fit is made of: a row for each sample of the windows, each column less its mean over the window.
struct Regression {
    /// The impulse per lever arm, and time; behind them the integrals of rate and angle.
    design: DMatrix<f64>,
    /// The same with the predicted impulse.
    instruments: DMatrix<f64>,
    /// [rad/s] the body's rate.
    y: DVector<f64>,
}

impl Regression {
    fn of(log: &Dataset, rate: &[f64], drive: &Drive, windows: &[Vec<usize>]) -> Self {
        let rows = windows.iter().map(Vec::len).sum();
        let integrals = integrals(log, rate);
        let mut design = DMatrix::zeros(rows, 4);
        let mut instruments = DMatrix::zeros(rows, 4);
        let mut y = DVector::zeros(rows);
        let predicted = drive.predicted.as_deref().unwrap_or(&drive.measured);
        let mut at = 0;
        for window in windows {
            let mean = |values: &[f64]| mean_of(window.iter().map(|&row| values[row]));
            let means = [mean(&drive.measured), mean(predicted), mean(log.time()), mean(rate)];
            let own_means = integrals.each_ref().map(|all| mean(all));
            for &row in window {
                design[(at, 0)] = drive.measured[row] - means[0];
                instruments[(at, 0)] = predicted[row] - means[1];
                design[(at, 1)] = log.time()[row] - means[2];
                instruments[(at, 1)] = design[(at, 1)];
                y[at] = rate[row] - means[3];
                for (column, (all, mean)) in integrals.iter().zip(own_means).enumerate() {
                    design[(at, 2 + column)] = all[row] - mean;
                    instruments[(at, 2 + column)] = all[row] - mean;
                }
                at += 1;
            }
        }
        Self { design, instruments, y }
    }
}

/// Whether the log's body turned freely and its rate is one; what speaks against it is said.
fn can_show_inertia(screened: &ScreenedLog, warnings: &mut Vec<Finding>) -> bool {
    // That log is about a rotor.
    if let Some(found) = screened.body().map(ScreenedBody::findings).filter(|found| !found.is_empty()) {
        warnings.extend(found.iter().cloned());
        return false;
    }
    warnings.extend(screened.body().into_iter().flat_map(ScreenedBody::remarks).cloned());
    let (inertia, is_rate) = match screened.units() {
        None => return true,
        Some(Mistaken::Rate(_) | Mistaken::Time(_)) => ("not_identified", false),
        Some(Mistaken::Angle(_)) => ("holds", true),
        Some(Mistaken::Perhaps(_)) => ("too_small", true),
    };
    let found = screened.units().map(|it| it.finding().clone().with("inertia", inertia));
    warnings.extend(found);
    is_rate
}

/// Identifies the body from one log; `None` where the log holds no attitude or nothing that drives it.
pub(crate) fn identify(
    screened: &ScreenedLog,
    actuator: &IdentifiedActuator,
    arm: f64,
    warnings: &mut Vec<Finding>,
) -> Option<IdentifiedBody> {
    let log = screened.dataset();
    let rate = log.column(columns::BODY_RATE)?;
    if !can_show_inertia(screened, warnings) {
        return None;
    }
    let judged = screened.body()?;
    let drive = drive(log, judged, actuator, arm)?;
    let rate = &*judged.driven_rows(rate);
    // Cut where it is not known what the rotors did.
    let windows = windows::of_known(
        log.time(),
        |row| rate[row].is_finite(),
        judged.stretches(),
        THRESHOLDS.body_window,
        THRESHOLDS.fewest_window_samples,
    );
    if windows.iter().map(Vec::len).sum::<usize>()
        < THRESHOLDS.fewest_windows * THRESHOLDS.fewest_window_samples
    {
        warnings.push(Finding::new("too_few_body_samples", "inertia").of(log.source_name()));
        return None;
    }
    let (driven_by, lever) = (drive.driven_by, drive.lever);
    let regression = Regression::of(log, rate, &drive, &windows);
    drop(drive);
    fit(log, rate, regression, (driven_by, lever), &windows, arm, warnings)
}

/// Fits the inertia over the windows; `None` where the torque hardly shows.
fn fit(
    log: &Dataset,
    rate: &[f64],
    regression: Regression,
    (driven_by, lever): (&'static str, f64),
    windows: &[Vec<usize>],
    arm: f64,
    warnings: &mut Vec<Finding>,
) -> Option<IdentifiedBody> {
    let Regression { design, instruments, y } = regression;
    let fit = least_squares::instrumental(design.columns(0, 2), instruments.columns(0, 2), &y)?;
    let slope = Estimate { value: fit.coefficients[0], standard_error: fit.standard_error(0) };
    if slope.value < THRESHOLDS.torque_shows_errors * slope.standard_error || slope.value <= 0.0 {
        let hardly = Finding::new("torque_hardly_shows", "inertia").of(log.source_name());
        warnings.push(significance::with_estimate(hardly, &slope));
        return None;
    }
    let inertia_of = |slope: Estimate| {
        let over = slope.scaled(arm / lever);
        Estimate { value: arm / over.value, standard_error: arm * over.standard_error / over.value.powi(2) }
    };
    let omitted_torque = omitted_torque::find((&design, &instruments, &y), &fit);
    drop((design, instruments));
    // What is missing may be another torque than the one that shows: J is known as well as the two values agree.
    let bent = omitted_torque.map_or(0.0, |(.., beside)| beside.value - slope.value);
    let slope = Estimate { standard_error: slope.standard_error.hypot(bent), ..slope };
    let omitted_torque = omitted_torque.map(|(goes_with, shows, beside)| OmittedTorque {
        goes_with,
        shows,
        inertia: inertia_of(beside),
    });
    let (arm_over_inertia, inertia) = (slope.scaled(arm / lever), inertia_of(slope));
    let each = windows.iter().flatten().zip(fit.residuals.iter());
    let traces = each.map(|(&row, residual)| (log.time()[row], rate[row], rate[row] - residual)).collect();
    Some(IdentifiedBody {
        source: log.source_name().to_owned(),
        arm_over_inertia,
        inertia,
        arm,
        bias: Estimate { value: fit.coefficients[1], standard_error: fit.standard_error(1) },
        residual_rms: fit.residual_rms,
        motion_rms: (y.norm_squared() / y.len() as f64).sqrt(),
        residual_correlation: lag_one_correlation(fit.residuals.as_slice()),
        omitted_torque,
        samples: y.len(),
        driven_by,
        traces,
    })
}

fn drive(log: &Dataset, judged: &ScreenedBody, actuator: &IdentifiedActuator, arm: f64) -> Option<Drive> {
    let driven_by = judged.driven_by().code();
    let commands = log.column(columns::COMMANDS[0]).zip(log.column(columns::COMMANDS[1]));
    let voltage = log.column(columns::BATTERY_VOLTAGE);
    let run = |command: &&[f64]| {
        let mut run = actuator.run_from(None, log.time(), command, voltage);
        // What else it holds is not asked for, and of a long log as much again.
        (run.measured, run.mean) = (Vec::new(), Vec::new());
        run
    };
    let runs = commands.map(|(first, second)| spread(&[first, second], run));
    let c = actuator.thrust_coefficient;
    let predicted =
        runs.as_ref().map(|runs| impulse(log, [0, 1].map(|rotor| &runs[rotor].rate[..]), Some(runs), c));
    if judged.driven_by() == DrivenBy::TorqueCommand {
        let measured = integral_of_held(log.time(), judged.torque());
        return Some(Drive { measured, predicted: None, driven_by, lever: 1.0 });
    }
    let measured = log.column(columns::PROPELLER_RATES[0]).zip(log.column(columns::PROPELLER_RATES[1]));
    if let Some((first, second)) = measured {
        let known = |rotor: usize, rates: &[f64]| match &runs {
            Some(runs) => filled_along(log, rates, &runs[rotor].rate),
            None => interpolated(log.time(), rates),
        };
        let measured = impulse(log, [&known(0, first), &known(1, second)], runs.as_deref(), c);
        return Some(Drive { measured, predicted, driven_by, lever: arm });
    }
    predicted.map(|measured| Drive { measured, predicted: None, driven_by, lever: arm })
}

/// [N s] running integral of f_1 - f_2 with f = c ω², by the trapezoidal rule; where the commands are known, with what the
/// rule misses of the exponentials between the samples, taken from the rotors' free run.
fn impulse(log: &Dataset, rates: [&[f64]; 2], runs: Option<&[RotorTrace]>, c: f64) -> Vec<f64> {
    let trapezium =
        |rates: &[f64], row: usize, h: f64| 0.5 * h * (rates[row].powi(2) + rates[row + 1].powi(2));
    running(log.time(), |row, h| {
        let of = |rotor: usize| {
            let square = |run: &RotorTrace| h * run.mean_square.as_ref().map_or(0.0, |all| all[row]);
            let missed = |run: &RotorTrace| square(run) - trapezium(&run.rate, row, h);
            trapezium(rates[rotor], row, h) + runs.map_or(0.0, |runs| missed(&runs[rotor]))
        };
        c * (of(0) - of(1))
    })
}

/// What was measured, and between measurements the free run of the rotor, moved by what it lacks to both sides.
fn filled_along(log: &Dataset, values: &[f64], run: &[f64]) -> Vec<f64> {
    let lacks: Vec<f64> = values.iter().zip(run).map(|(value, run)| value - run).collect();
    let moved = interpolated(log.time(), &lacks).into_iter().zip(run).map(|(lack, run)| run + lack);
    values.iter().zip(moved).map(|(value, moved)| if value.is_finite() { *value } else { moved }).collect()
}

/// [rad] [rad s] Running integrals of the body's rate and of its angle: of the measured one, or of the rate's own integral.
fn integrals(log: &Dataset, rate: &[f64]) -> [Vec<f64>; 2] {
    let time = log.time();
    let turned = trapezoidal(time, &interpolated(time, rate));
    let angle = log.column(columns::BODY_ANGLE).map(|angle| interpolated(time, angle));
    let swung = trapezoidal(time, angle.as_deref().filter(|angle| angle[0].is_finite()).unwrap_or(&turned));
    [turned, swung]
}
