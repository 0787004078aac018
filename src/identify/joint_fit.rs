//! Everything of the rotor at once: pole, polynomial and battery gain from one record with lively commands.
//!
//! The paper goes step by step; where a log holds what all steps need, this is the efficient way, and it is the
//! only way where constant commands and ramps are missing.

use serde::Serialize;

use super::Estimate;
use super::dead_time::{self, Delay, LateFit};
use super::lag_order::{self, Rival};
use super::pole::{self, LagFit, Record};
use super::regressors::record_of;
use super::static_curve::DegreeScore;
use super::steady_rows::HIGHEST_DEGREE;
use super::voltage_instruments::{self, Follows};
use crate::screening::Finding;
use crate::screening::rotor_data::RotorLog;

/// Rows of each log that decide on the degree: four minutes at 50 Hz.
const DEGREE_ROWS: usize = 12_000;
/// Fits more, each with the battery foretold from the numbers of the one before.
const PASSES: usize = 2;

/// The joint fit.
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
    /// Degrees side by side, where they could be told apart.
    pub degrees: Vec<DegreeScore>,
    /// A delay and a second pole, tried.
    pub rivals: Vec<Rival>,
    /// The delay, where it was settled; everything else then was fitted beside it.
    pub delay: Option<Delay>,
    /// [rad/s] the curve without the delay, where there is one; and k_V [rad/(s V)].
    #[serde(skip)]
    pub(crate) without_delay: Option<(Vec<f64>, Option<f64>)>,
}

impl JointFit {
    /// How the rotor follows its command, where that is late.
    fn follows(&self, full_voltage: f64) -> Option<Follows> {
        let delay = self.delay.as_ref()?.delay.value;
        let curve = [0, 1].map(|at| self.coefficients.get(at).map_or(0.0, |it| it.value));
        let voltage_gain = self.voltage_gain.map_or(0.0, |it| it.value);
        Some(Follows { pole: self.pole.value, delay, curve, voltage_gain, full_voltage })
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

/// A lag alone, its rivals, and the lag behind a delay where that is settled.
#[derive(Debug, Clone)]
struct Tried {
    lag: LagFit,
    /// Powers of the command in it; k_V comes behind them.
    lag_degree: usize,
    rivals: Vec<Rival>,
    late: Option<LateFit>,
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
        pole::fit(&self.record::<M>(self.rotors, delay))
    }

    fn rivals<const M: usize>(&self, fit: &LagFit) -> Vec<Rival> {
        lag_order::both::<M>(fit, self.rotors, |rotors, delay| self.record(rotors, delay))
    }

    /// Squared error of each block when it was held out.
    fn held_out<const M: usize>(&self, delay: f64) -> Option<Vec<f64>> {
        let full = self.record::<M>(self.rotors, delay);
        dead_time::held_out(&full, pole::fit(&full)?.pole)
    }

    fn with_rivals<const M: usize>(&self, delays: bool) -> Option<Tried> {
        let mut lag = self.fit::<M>(0.0)?;
        let rivals = self.rivals::<M>(&lag);
        let mut late = if delays { self.late::<M>(&lag, &rivals) } else { None };
        if self.battery {
            let fits = std::iter::once(&mut lag).chain(late.as_mut().map(|late| &mut late.fit));
            fits.for_each(|fit| allow_for_readings(fit, self.rotors, self.degree));
        }
        Some(Tried { lag, lag_degree: self.degree, rivals, late })
    }

    /// The delay that was found `first`, and all the rest again beside it.
    fn behind<const M: usize>(&self, first: &Tried) -> Option<Tried> {
        let mut late = self.late::<M>(&first.lag, &first.rivals)?;
        if self.battery {
            allow_for_readings(&mut late.fit, self.rotors, self.degree);
        }
        Some(Tried { late: Some(late), ..first.clone() })
    }

    fn late<const M: usize>(&self, fit: &LagFit, rivals: &[Rival]) -> Option<LateFit> {
        let interval = self.rotors.first().map_or(0.0, |rotor| rotor.interval);
        dead_time::identify::<M>(fit, rivals, interval, |delay| self.record(self.rotors, delay))
    }
}

/// Fits all rotors' records together. Without `degree` cross-validation chooses it; with `delays` a delay that the data
/// settle is fitted beside.
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
        let (problem, degrees, tried) = settle(rotors, full_voltage, (false, delays), degree)?;
        told(&problem, degrees, tried)
    };
    if battery && found.voltage_gain.is_none() {
        warnings.push(
            "the battery's effect does not show beside the command in these logs: k_V is left out of the joint \
             fit; record a longer discharge, or constant commands"
                .to_owned().into(),
        );
    }
    Some(found)
}

/// A delay is looked for beside the course of the voltage alone, and everything else then beside the delay: a battery that
/// gives way under the load says how fast a rotor turns that follows late, and stands in for it otherwise.
fn with_battery(
    rotors: &[RotorLog],
    full_voltage: f64,
    delays: bool,
    asked: Option<usize>,
) -> Option<JointFit> {
    let is_late = |(.., tried): &(Problem<'_>, Vec<DegreeScore>, Tried)| tried.late.is_some();
    let course: Vec<RotorLog> = rotors.iter().map(voltage_instruments::course).collect();
    let first = delays.then(|| settle(&course, full_voltage, (true, true), asked)).flatten();
    if let Some(first) = first.filter(is_late) {
        return Some(beside_delay(rotors, first, asked));
    }
    let smooth = foretold(rotors, &course, full_voltage);
    let found = settle(smooth.as_deref().unwrap_or(rotors), full_voltage, (true, delays), asked)?;
    if is_late(&found) {
        return Some(beside_delay(rotors, found, asked));
    }
    let (problem, degrees, tried) = found;
    Some(told(&problem, degrees, tried))
}

/// Everything again beside the delay that was found first: the curve's degree, what the commands draw from the battery, which
/// comes as late as the rotor does, and what that draws from the rotor.
fn beside_delay(
    rotors: &[RotorLog],
    (problem, degrees, first): (Problem<'_>, Vec<DegreeScore>, Tried),
    asked: Option<usize>,
) -> JointFit {
    let full_voltage = problem.full_voltage;
    let mut found = told(&problem, degrees, first.clone());
    for _ in 0..PASSES {
        let Some(follows) = found.follows(full_voltage) else { break };
        let smooth = quiet(rotors, follows);
        let again = [true, false].into_iter().find_map(|battery| {
            let (degrees, preferred) = compare_degrees(&smooth, full_voltage, battery, follows.delay);
            let degree = asked.or(preferred).unwrap_or(problem.degree);
            let problem = Problem { rotors: &smooth, full_voltage, degree, battery };
            let behind = sized!(problem, behind(&first))?;
            (!battery || shows(degree, &behind)).then(|| told(&problem, degrees, behind))
        });
        let Some(again) = again else { break };
        found = again;
    }
    found
}

/// The logs with the noise of their voltage taken away; `course` are those with its course over time alone. What the battery
/// gives way under the load makes a rotor faster, and bends its curve: a lag fitted beside the course alone has both in it,
/// and with them the voltage once more. So what is foretold by it is only good enough for the next lag.
pub(crate) fn foretold(rotors: &[RotorLog], course: &[RotorLog], full_voltage: f64) -> Option<Vec<RotorLog>> {
    let mut follows = rough(course, full_voltage)?;
    let mut smooth = quiet(rotors, follows);
    for _ in 0..PASSES {
        let Some(next) = follow(&smooth, full_voltage, true, 2).filter(|next| next.voltage_gain > 0.0) else {
            break;
        };
        follows = next;
        smooth = quiet(rotors, follows);
    }
    Some(smooth)
}

/// A lag fitted to `rotors` with the course of their voltage; without it, where k_V comes out negative.
fn rough(rotors: &[RotorLog], full_voltage: f64) -> Option<Follows> {
    [(true, 2), (true, 1), (false, 2), (false, 1)].into_iter().find_map(|(battery, degree)| {
        follow(rotors, full_voltage, battery, degree).filter(|follows| follows.voltage_gain > 0.0 || !battery)
    })
}

/// How `rotors` follow their commands by a lag that is fitted to them.
fn follow(rotors: &[RotorLog], full_voltage: f64, battery: bool, degree: usize) -> Option<Follows> {
    let problem = Problem { rotors, full_voltage, degree, battery };
    let fit = sized!(problem, fit(0.0))?;
    let quadratic = if degree == 2 { fit.coefficients[1] } else { 0.0 };
    let voltage_gain = if battery { fit.coefficients[degree] } else { 0.0 };
    let curve = [fit.coefficients[0], quadratic];
    Some(Follows { pole: fit.pole, delay: 0.0, curve, voltage_gain, full_voltage })
}

/// The logs with the noise of their voltage taken away.
fn quiet(rotors: &[RotorLog], follows: Follows) -> Vec<RotorLog> {
    rotors.iter().map(|rotor| voltage_instruments::without_noise(rotor, follows)).collect()
}

/// A foretold voltage has lost its noise, and yet was fitted to readings that have it: what is left in it weighs on the
/// numbers as that much noise of the rate would (the residual of two-stage least squares is taken with the reading, not
/// with what is foretold of it). `gain` is the place of k_V among the coefficients.
pub(crate) fn allow_for_readings(fit: &mut LagFit, rotors: &[RotorLog], gain: usize) {
    let rows = |rotor: &RotorLog| rotor.time.len() as f64;
    // Rotors of one log share the reading, and what its noise does to each does not average out.
    let shared = |rotor: &RotorLog| rotors.iter().filter(|it| it.file() == rotor.file()).count() as f64;
    let noise =
        |rotor: &RotorLog| rotor.foretold.map_or(0.0, |it| it.noise.powi(2) * rows(rotor) * shared(rotor));
    let total: f64 = rotors.iter().map(rows).sum();
    let variance = rotors.iter().map(noise).sum::<f64>() / total.max(1.0);
    fit.covariance += &fit.per_noise * (fit.coefficients[gain].powi(2) * variance);
}

/// Whether the battery shows beside `degree` powers of the command. Judged beside the delay: what a lag alone leaves over
/// would hide it. A battery that gives way never makes a rotor faster.
fn shows(degree: usize, found: &Tried) -> bool {
    let fit = found.late.as_ref().map_or(&found.lag, |late| &late.fit);
    fit.coefficients[degree] >= 3.0 * fit.error(degree)
}

/// What is fitted in the end, the degrees among which it was chosen, and the fit: with the battery where it shows.
fn settle<'a>(
    rotors: &'a [RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    asked: Option<usize>,
) -> Option<(Problem<'a>, Vec<DegreeScore>, Tried)> {
    let tried = |battery: bool| {
        // The curve's degree, too, is not to be chosen beside a battery that does not show.
        let (degrees, preferred) = compare_degrees(rotors, full_voltage, battery, 0.0);
        // Where no comparison succeeds, the curve of one coefficient is the last thing to try.
        let degree = asked.or(preferred).unwrap_or(1);
        let problem = Problem { rotors, full_voltage, degree, battery };
        Some((problem, degrees, sized!(problem, with_rivals(delays))?))
    };
    let with_battery = battery.then(|| tried(true)).flatten();
    with_battery.filter(|(problem, _, found)| shows(problem.degree, found)).or_else(|| tried(false))
}

fn told(problem: &Problem<'_>, degrees: Vec<DegreeScore>, found: Tried) -> JointFit {
    let degree = problem.degree;
    let Tried { lag, lag_degree, rivals, late } = found;
    let without_delay = late
        .as_ref()
        .map(|_| (lag.coefficients[..lag_degree].to_vec(), lag.coefficients.get(lag_degree).copied()));
    let (fit, delay) = match late {
        Some(LateFit { fit, told }) => (fit, Some(told)),
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
        rivals,
        delay,
        without_delay,
    }
}

/// Degrees side by side, commands acting `delay` [s] late, and the lowest whose held-out error is not significantly above the best.
fn compare_degrees(
    rotors: &[RotorLog],
    full_voltage: f64,
    battery: bool,
    delay: f64,
) -> (Vec<DegreeScore>, Option<usize>) {
    let mut scores = Vec::new();
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let heads: Vec<RotorLog> = rotors.iter().map(|rotor| rotor.head(DEGREE_ROWS)).collect();
    let rotors = heads.as_slice();
    for degree in 1..=HIGHEST_DEGREE {
        let problem = Problem { rotors, full_voltage, degree, battery };
        let (Some(fit), Some(squares)) = (sized!(problem, fit(delay)), sized!(problem, held_out(delay)))
        else {
            continue;
        };
        scores.push(DegreeScore {
            degree,
            train: fit.residual_rms,
            held_out: (squares.iter().sum::<f64>() / squares.len() as f64).sqrt(),
            coefficients: fit.coefficients[..degree].to_vec(),
        });
        blocks.push(squares);
    }
    let preferred = super::static_curve::simplest(&scores, &blocks);
    (scores, preferred)
}
