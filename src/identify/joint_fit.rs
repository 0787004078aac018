//! Joint estimation of the rotor: pole, polynomial and battery gain from one record with exciting commands.
//!
//! The paper goes step by step; where a log holds what all steps need, this is the efficient way, and it is the
//! only way where constant commands and ramps are missing.

use super::thresholds::THRESHOLDS;
use serde::Serialize;

use super::Estimate;
use super::dead_time::{self, Delay, DelayedFit};
use super::lag_order::{self, LagAlternative};
use super::possible_gain;
use super::regressors::{NO_DELAY, record_of};
use super::static_curve::DegreeScore;
use super::voltage_instruments::{self, RotorResponse};
use crate::estimation::unknown_instants;
use crate::estimation::variable_projection::{self, LagFit, Record};
use crate::screening::Finding;
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::threads::spread;

/// The joint fit.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Serialize)]
pub struct JointFit {
    /// `c_gj` of u^j, from j = 1.
    pub coefficients: Vec<Estimate>,
    /// [rad/(s V)] k_V; `None` when there is no voltage, or it does not show.
    pub voltage_gain: Option<Estimate>,
    /// [rad/s]
    pub pole: Estimate,
    /// [rad/s] rms of the residual.
    pub residual_rms: f64,
    /// Lag-one correlation of the residual: near zero when nothing is missing.
    pub residual_correlation: f64,
    /// Samples used.
    pub samples: usize,
    /// Degrees side by side, where they could be compared.
    pub degrees: Vec<DegreeScore>,
    /// A delay and a second pole, tried.
    pub alternatives: Vec<LagAlternative>,
    /// The delay, where the data show one; everything else then was fitted beside it.
    pub delay: Option<Delay>,
    /// [rad/s] the curve without the delay, where there is one; and k_V [rad/(s V)].
    #[serde(skip)]
    pub(crate) without_delay: Option<(Vec<f64>, Option<f64>)>,
}

impl JointFit {
    /// How the rotor follows its command, where that is delayed.
    fn response(&self, full_voltage: f64) -> Option<RotorResponse> {
        let delay = self.delay.as_ref()?.delay.value;
        let curve = [0, 1].map(|at| self.coefficients.get(at).map_or(0.0, |it| it.value));
        let voltage_gain = self.voltage_gain.map_or(0.0, |it| it.value);
        Some(RotorResponse { pole: self.pole.value, delay, curve, voltage_gain, full_voltage })
    }
}

/// What is fitted.
#[derive(Debug, Clone, Copy)]
struct Problem<'a> {
    rotors: &'a [RotorLog],
    full_voltage: f64,
    degree: usize,
    battery: bool,
}

/// A lag alone, its alternatives, and the lag behind a delay where that shows.
#[derive(Debug, Clone)]
struct Candidates {
    lag: LagFit,
    /// Powers of the command in it; k_V comes behind them.
    lag_degree: usize,
    alternatives: Vec<LagAlternative>,
    delayed: Option<DelayedFit>,
}

/// Inputs u, u², ..., and -(v_bmax - v_b) last where the battery takes part.
fn columns<const M: usize>(degree: usize, u: f64, drop: f64) -> [f64; M] {
    let mut power = 1.0;
    std::array::from_fn(|column| {
        if column < degree {
            power *= u;
            power
        } else {
            -drop
        }
    })
}

/// Calls a method that is generic over the number of columns with the number this problem has.
macro_rules! sized {
    ($problem:expr, $method:ident ( $($argument:expr),* )) => {
        match $problem.degree + usize::from($problem.battery) {
            1 => $problem.$method::<1>($($argument),*),
            2 => $problem.$method::<2>($($argument),*),
            3 => $problem.$method::<3>($($argument),*),
            4 => $problem.$method::<4>($($argument),*),
            _ => $problem.$method::<5>($($argument),*),
        }
    };
}

impl Problem<'_> {
    fn record<const M: usize>(&self, rotors: &[RotorLog], delay: f64) -> Record<M> {
        record_of(rotors, self.full_voltage, delay, |u, drop| columns(self.degree, u, drop))
    }

    fn fit<const M: usize>(&self, delay: f64) -> Option<LagFit> {
        variable_projection::fit(&self.record::<M>(self.rotors, delay))
    }

    fn alternatives<const M: usize>(&self, fit: &LagFit) -> Vec<LagAlternative> {
        lag_order::both::<M>(fit, self.rotors, |rotors, delay| self.record(rotors, delay))
    }

    /// Squared error of each block when it was held out.
    fn held_out<const M: usize>(&self, delay: f64) -> Option<Vec<f64>> {
        let full = self.record::<M>(self.rotors, delay);
        dead_time::held_out(&full, variable_projection::fit(&full)?.pole)
    }

    fn with_alternatives<const M: usize>(&self, delays: bool) -> Option<Candidates> {
        let mut lag = self.fit::<M>(0.0)?;
        let alternatives = self.alternatives::<M>(&lag);
        let mut delayed = if delays { self.delayed::<M>(&lag, &alternatives) } else { None };
        self.allow_for_instants::<M>(&mut lag, NO_DELAY);
        if let Some(delayed) = &mut delayed {
            self.allow_for_instants::<M>(&mut delayed.fit, delayed.delay.delay.value);
        }
        if self.battery {
            let fits = std::iter::once(&mut lag).chain(delayed.as_mut().map(|delayed| &mut delayed.fit));
            fits.for_each(|fit| allow_for_reading_noise(fit, self.rotors, self.degree));
        }
        Some(Candidates { lag, lag_degree: self.degree, alternatives, delayed })
    }

    /// The delay that was found `first`, and all the rest again beside it.
    fn behind<const M: usize>(&self, first: &Candidates) -> Option<Candidates> {
        let mut delayed = self.delayed::<M>(&first.lag, &first.alternatives)?;
        self.allow_for_instants::<M>(&mut delayed.fit, delayed.delay.delay.value);
        if self.battery {
            allow_for_reading_noise(&mut delayed.fit, self.rotors, self.degree);
        }
        Some(Candidates { delayed: Some(delayed), ..first.clone() })
    }

    /// Commands that step between rows were put where the same rates say.
    fn allow_for_instants<const M: usize>(&self, fit: &mut LagFit, delay: f64) {
        if let Some(deviation) = lag_order::step_deviation(self.rotors) {
            unknown_instants::widen(fit, &self.record::<M>(self.rotors, delay), deviation);
        }
    }

    fn delayed<const M: usize>(&self, fit: &LagFit, alternatives: &[LagAlternative]) -> Option<DelayedFit> {
        let interval = self.rotors.first().map_or(0.0, |rotor| rotor.interval);
        let unknown = lag_order::delay_unknown(self.rotors);
        dead_time::identify::<M>(fit, alternatives, (interval, unknown), |delay| {
            self.record(self.rotors, delay)
        })
    }
}

/// Fits all rotors' records together. Without `degree` cross-validation chooses it; with `delays` a delay that the data
/// show is fitted beside.
pub(crate) fn identify(
    rotors: &[RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    degree: Option<usize>,
    warnings: &mut Vec<Finding>,
) -> Option<JointFit> {
    let found = if battery {
        with_battery(rotors, full_voltage, delays, degree)?
    } else {
        let (problem, degrees, tried) = select(rotors, full_voltage, (false, delays), degree)?;
        assembled(&problem, degrees, tried)
    };
    if battery && found.voltage_gain.is_none() {
        warnings.push(without_battery(rotors, full_voltage, delays, degree));
    }
    Some(found)
}

/// A delay is looked for beside the course of the voltage alone, and everything else then beside the delay: a battery that
/// gives way under the load says how fast a rotor turns with a dead time, and stands in for it otherwise.
fn with_battery(
    rotors: &[RotorLog],
    full_voltage: f64,
    delays: bool,
    asked: Option<usize>,
) -> Option<JointFit> {
    let is_delayed = |(.., tried): &(Problem<'_>, Vec<DegreeScore>, Candidates)| tried.delayed.is_some();
    let course: Vec<RotorLog> = spread(rotors, voltage_instruments::course);
    let first = delays.then(|| select(&course, full_voltage, (true, true), asked)).flatten();
    if let Some(first) = first.filter(is_delayed) {
        return Some(beside_delay(rotors, first, asked));
    }
    let smooth = with_instruments(rotors, &course, full_voltage);
    let found = select(smooth.as_deref().unwrap_or(rotors), full_voltage, (true, delays), asked)?;
    if is_delayed(&found) {
        return Some(beside_delay(rotors, found, asked));
    }
    let (problem, degrees, tried) = found;
    Some(assembled(&problem, degrees, tried))
}

/// Everything again beside the delay that was found first: the curve's degree, what the commands draw from the battery, which
/// has the dead time of the rotor, and what that draws from the rotor.
fn beside_delay(
    rotors: &[RotorLog],
    (problem, degrees, first): (Problem<'_>, Vec<DegreeScore>, Candidates),
    asked: Option<usize>,
) -> JointFit {
    let full_voltage = problem.full_voltage;
    let mut found = assembled(&problem, degrees, first.clone());
    for _ in 0..THRESHOLDS.instrument_refits {
        let Some(response) = found.response(full_voltage) else { break };
        let smooth = instrumented(rotors, response);
        let again = [true, false].into_iter().find_map(|battery| {
            let (degrees, preferred) = compare_degrees(&smooth, full_voltage, battery, response.delay);
            let degree = asked.or(preferred).unwrap_or(problem.degree);
            let problem = Problem { rotors: &smooth, full_voltage, degree, battery };
            let behind = sized!(problem, behind(&first))?;
            (!battery || shows(&problem, &behind)).then(|| assembled(&problem, degrees, behind))
        });
        let Some(again) = again else { break };
        found = again;
    }
    found
}

/// The logs with the noise of their voltage taken away; `course` are those with its course over time alone. What the battery
/// gives way under the load makes a rotor faster, and bends its curve: a lag fitted beside the course alone has both in it,
/// and with them the voltage once more. So instruments made by it are only good enough for the next lag.
pub(crate) fn with_instruments(
    rotors: &[RotorLog],
    course: &[RotorLog],
    full_voltage: f64,
) -> Option<Vec<RotorLog>> {
    let mut response = first_response(course, full_voltage)?;
    let mut smooth = instrumented(rotors, response);
    for _ in 0..THRESHOLDS.instrument_refits {
        let Some(next) = fit_response(&smooth, full_voltage, true, 2).filter(|next| next.voltage_gain > 0.0)
        else {
            break;
        };
        response = next;
        smooth = instrumented(rotors, response);
    }
    Some(smooth)
}

/// A lag fitted to `rotors` with the course of their voltage; without it, where k_V comes out negative.
fn first_response(rotors: &[RotorLog], full_voltage: f64) -> Option<RotorResponse> {
    [(true, 2), (true, 1), (false, 2), (false, 1)].into_iter().find_map(|(battery, degree)| {
        fit_response(rotors, full_voltage, battery, degree)
            .filter(|response| response.voltage_gain > 0.0 || !battery)
    })
}

/// How `rotors` follow their commands by a lag that is fitted to them.
fn fit_response(
    rotors: &[RotorLog],
    full_voltage: f64,
    battery: bool,
    degree: usize,
) -> Option<RotorResponse> {
    let problem = Problem { rotors, full_voltage, degree, battery };
    let fit = sized!(problem, fit(0.0))?;
    let quadratic = if degree == 2 { fit.coefficients[1] } else { 0.0 };
    let voltage_gain = if battery { fit.coefficients[degree] } else { 0.0 };
    let curve = [fit.coefficients[0], quadratic];
    Some(RotorResponse { pole: fit.pole, delay: 0.0, curve, voltage_gain, full_voltage })
}

/// The logs with the noise of their voltage taken away.
fn instrumented(rotors: &[RotorLog], response: RotorResponse) -> Vec<RotorLog> {
    spread(rotors, |rotor| voltage_instruments::without_noise(rotor, response))
}

/// An instrument has lost the noise of the reading, and yet was fitted to readings that have it: what is left in it weighs on the
/// numbers as that much noise of the rate would (the residual of two-stage least squares is taken with the reading, not
/// with the instrument). `gain` is the place of k_V among the coefficients.
pub(crate) fn allow_for_reading_noise(fit: &mut LagFit, rotors: &[RotorLog], gain: usize) {
    let rows = |rotor: &RotorLog| rotor.time.len() as f64;
    // Rotors of one log share the reading, and what its noise does to each does not average out.
    let shared = |rotor: &RotorLog| rotors.iter().filter(|it| it.file == rotor.file).count() as f64;
    let noise =
        |rotor: &RotorLog| rotor.instrument.map_or(0.0, |it| it.noise.powi(2) * rows(rotor) * shared(rotor));
    let total: f64 = rotors.iter().map(rows).sum();
    let variance = rotors.iter().map(noise).sum::<f64>() / total.max(1.0);
    fit.covariance += &fit.per_noise * (fit.coefficients[gain].powi(2) * variance);
}

/// Whether the battery shows beside the powers of the command. Judged beside the delay: what a lag alone leaves over
/// would hide it. A battery that gives way never makes a rotor faster.
fn shows(problem: &Problem<'_>, found: &Candidates) -> bool {
    let (gain, error) = voltage_gain(problem, found);
    gain >= THRESHOLDS.battery_shows_errors * error && impossible_gain(problem, found).is_none()
}

/// [rad/(s V)] k_V of a problem with the battery, and its standard error.
fn voltage_gain(problem: &Problem<'_>, found: &Candidates) -> (f64, f64) {
    let fit = found.delayed.as_ref().map_or(&found.lag, |delayed| &delayed.fit);
    (fit.coefficients[problem.degree], fit.error(problem.degree))
}

/// [rad/(s V)] a k_V that no motor has, and the most that one could have. Something else goes with the voltage (a motor that warms up),
/// and pole and curve would be bent to it.
fn impossible_gain(problem: &Problem<'_>, found: &Candidates) -> Option<(f64, f64)> {
    let fit = found.delayed.as_ref().map_or(&found.lag, |delayed| &delayed.fit);
    let measured = problem.rotors.iter().flat_map(|rotor| &rotor.rate).copied();
    let at_full: f64 = fit.coefficients[..problem.degree].iter().sum();
    let greatest = measured.filter(|rate| rate.is_finite()).fold(at_full, f64::max);
    let (gain, most) = (voltage_gain(problem, found).0, greatest / problem.full_voltage);
    possible_gain::is_too_great(gain, most).then_some((gain, most))
}

/// Why a fit goes without the battery.
fn without_battery(rotors: &[RotorLog], full_voltage: f64, delays: bool, asked: Option<usize>) -> Finding {
    let tried = tried(rotors, full_voltage, (true, delays), asked);
    match tried.and_then(|(problem, _, found)| impossible_gain(&problem, &found)) {
        Some((gain, most)) => possible_gain::refused(gain, most, true),
        None => Finding::new("battery_not_significant", "voltage_gain"),
    }
}

/// What is fitted in the end, the degrees among which it was chosen, and the fit: with the battery where it shows.
fn select<'a>(
    rotors: &'a [RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    asked: Option<usize>,
) -> Option<(Problem<'a>, Vec<DegreeScore>, Candidates)> {
    let with_battery = battery.then(|| tried(rotors, full_voltage, (true, delays), asked)).flatten();
    let shown = with_battery.filter(|(problem, _, found)| shows(problem, found));
    shown.or_else(|| tried(rotors, full_voltage, (false, delays), asked))
}

fn tried(
    rotors: &[RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    asked: Option<usize>,
) -> Option<(Problem<'_>, Vec<DegreeScore>, Candidates)> {
    // The curve's degree, too, is not to be chosen beside a battery that does not show.
    let (degrees, preferred) = compare_degrees(rotors, full_voltage, battery, 0.0);
    // Where no comparison succeeds, the curve of one coefficient is the last thing to try.
    let degree = asked.or(preferred).unwrap_or(1);
    let problem = Problem { rotors, full_voltage, degree, battery };
    Some((problem, degrees, sized!(problem, with_alternatives(delays))?))
}

fn assembled(problem: &Problem<'_>, degrees: Vec<DegreeScore>, found: Candidates) -> JointFit {
    let degree = problem.degree;
    let Candidates { lag, lag_degree, alternatives, delayed } = found;
    let without_delay = delayed
        .as_ref()
        .map(|_| (lag.coefficients[..lag_degree].to_vec(), lag.coefficients.get(lag_degree).copied()));
    let (fit, delay) = match delayed {
        Some(DelayedFit { fit, delay }) => (fit, Some(delay)),
        None => (lag, None),
    };
    let estimate =
        |index: usize| Estimate { value: fit.coefficients[index], standard_error: fit.error(index) };
    JointFit {
        coefficients: (0..degree).map(estimate).collect(),
        voltage_gain: problem.battery.then(|| estimate(degree)),
        pole: Estimate { value: fit.pole, standard_error: fit.pole_error() },
        residual_rms: fit.residual_rms,
        residual_correlation: fit.residual_correlation,
        samples: fit.samples,
        degrees,
        alternatives,
        delay,
        without_delay,
    }
}

/// Degrees side by side, commands acting `delay` [s] later, and the lowest whose held-out error is not significantly above the best.
fn compare_degrees(
    rotors: &[RotorLog],
    full_voltage: f64,
    battery: bool,
    delay: f64,
) -> (Vec<DegreeScore>, Option<usize>) {
    let heads: Vec<RotorLog> = rotors.iter().map(|rotor| rotor.head(THRESHOLDS.degree_rows)).collect();
    let rotors = heads.as_slice();
    let ranges = rotors.iter().map(|rotor| bounds(&rotor.command));
    let range =
        ranges.reduce(|(low, high), other| (low.min(other.0), high.max(other.1))).unwrap_or((0.0, 1.0));
    super::static_curve::degrees_beside(range, |degree| {
        let problem = Problem { rotors, full_voltage, degree, battery };
        let (fit, squares) = (sized!(problem, fit(delay))?, sized!(problem, held_out(delay))?);
        Some((fit.coefficients[..degree].to_vec(), fit.residual_rms, squares))
    })
}
