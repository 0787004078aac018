//! Everything of the rotor at once: pole, polynomial and battery gain from one record with lively commands.
//!
//! The paper goes step by step; where a log holds what all steps need, this is the efficient way, and it is the
//! only way where constant commands and ramps are missing.

use serde::Serialize;

use super::Estimate;
use super::late::{self, Delay, LateFit};
use super::pole::{self, LagFit, Record};
use super::record_of::record_of;
use super::rivals::{self, Rival};
use super::rotor_log::RotorLog;
use super::static_curve::{DegreeScore, HIGHEST_DEGREE};
use super::voltage::{self, Follows};

/// Rows of each log that decide on the degree: four minutes at 50 Hz.
const DEGREE_ROWS: usize = 12_000;

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
    pub(super) without_delay: Option<(Vec<f64>, Option<f64>)>,
}

impl JointFit {
    /// How the rotor follows its command, where that is late.
    fn follows(&self) -> Option<Follows> {
        let delay = self.delay.as_ref()?.delay.value;
        let curve = [0, 1].map(|at| self.coefficients.get(at).map_or(0.0, |it| it.value));
        Some(Follows { pole: self.pole.value, delay, curve })
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
struct Tried {
    lag: LagFit,
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

    fn fit<const M: usize>(&self) -> Option<LagFit> {
        pole::fit(&self.record::<M>(self.rotors, 0.0))
    }

    fn rivals<const M: usize>(&self, fit: &LagFit) -> Vec<Rival> {
        rivals::both::<M>(fit, self.rotors, |rotors, delay| self.record(rotors, delay))
    }

    /// Squared error of each block when it was held out.
    fn held_out<const M: usize>(&self) -> Option<Vec<f64>> {
        let full = self.record::<M>(self.rotors, 0.0);
        late::held_out(&full, pole::fit(&full)?.pole)
    }

    fn with_rivals<const M: usize>(&self, delays: bool) -> Option<Tried> {
        let lag = self.fit::<M>()?;
        let rivals = self.rivals::<M>(&lag);
        let late = if delays { self.late::<M>(&lag, &rivals) } else { None };
        Some(Tried { lag, rivals, late })
    }

    fn late<const M: usize>(&self, fit: &LagFit, rivals: &[Rival]) -> Option<LateFit> {
        let interval = self.rotors.first().map_or(0.0, |rotor| rotor.interval);
        late::identify::<M>(fit, rivals, interval, |delay| self.record(self.rotors, delay))
    }
}

/// Fits all rotors' records together. Without `degree` cross-validation chooses it; with `delays` a delay that the data
/// settle is fitted beside.
pub(super) fn identify(
    rotors: &[RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    degree: Option<usize>,
    warnings: &mut Vec<String>,
) -> Option<JointFit> {
    let smooth = battery.then(|| rough(rotors, full_voltage)).flatten().map(|follows| quiet(rotors, follows));
    let found = at_once(smooth.as_deref().unwrap_or(rotors), full_voltage, (battery, delays), degree)?;
    // What the commands draw comes as late as the rotor does.
    let found = match (&smooth, found.follows()) {
        (Some(_), Some(late)) => at_once(&quiet(rotors, late), full_voltage, (battery, delays), degree)?,
        _ => found,
    };
    if battery && found.voltage_gain.is_none() {
        warnings.push(
            "the battery's effect does not show beside the command in these logs: k_V is left out of the joint \
             fit; record a longer discharge, or constant commands"
                .to_owned(),
        );
    }
    Some(found)
}

/// A lag fitted to the voltage as it was read.
pub(super) fn rough(rotors: &[RotorLog], full_voltage: f64) -> Option<Follows> {
    let problem = |degree| Problem { rotors, full_voltage, degree, battery: true };
    let (fit, degree) =
        [2, 1].into_iter().find_map(|degree| Some((sized!(problem(degree), fit())?, degree)))?;
    let quadratic = if degree == 2 { fit.coefficients[1] } else { 0.0 };
    Some(Follows { pole: fit.pole, delay: 0.0, curve: [fit.coefficients[0], quadratic] })
}

/// The logs with the noise of their voltage taken away.
pub(super) fn quiet(rotors: &[RotorLog], follows: Follows) -> Vec<RotorLog> {
    rotors.iter().map(|rotor| voltage::without_noise(rotor, follows)).collect()
}

fn at_once(
    rotors: &[RotorLog],
    full_voltage: f64,
    (battery, delays): (bool, bool),
    asked: Option<usize>,
) -> Option<JointFit> {
    let (degrees, preferred) = compare_degrees(rotors, full_voltage, battery);
    // Where no comparison succeeds, the curve of one coefficient is the last thing to try.
    let degree = asked.or(preferred).unwrap_or(1);
    let problem = Problem { rotors, full_voltage, degree, battery };
    let found = sized!(problem, with_rivals(delays));
    // Judged beside the delay: what a lag alone leaves over would hide a battery.
    let shows = |found: &Tried| {
        let fit = found.late.as_ref().map_or(&found.lag, |late| &late.fit);
        // A battery that gives way never makes a rotor faster.
        fit.coefficients[degree] >= 3.0 * fit.error(degree)
    };
    if battery && !found.as_ref().is_some_and(shows) {
        // The curve's degree, too, was chosen beside a battery that does not show.
        return at_once(rotors, full_voltage, (false, delays), asked);
    }
    let Tried { lag, rivals, late } = found?;
    let without_delay = late
        .as_ref()
        .map(|_| (lag.coefficients[..degree].to_vec(), problem.battery.then(|| lag.coefficients[degree])));
    let (fit, delay) = match late {
        Some(LateFit { fit, told }) => (fit, Some(told)),
        None => (lag, None),
    };
    let estimate =
        |index: usize| Estimate { value: fit.coefficients[index], standard_error: fit.error(index) };
    Some(JointFit {
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
    })
}

/// Degrees side by side, and the lowest whose held-out error is not significantly above the best.
fn compare_degrees(
    rotors: &[RotorLog],
    full_voltage: f64,
    battery: bool,
) -> (Vec<DegreeScore>, Option<usize>) {
    let mut scores = Vec::new();
    let mut blocks: Vec<Vec<f64>> = Vec::new();
    let heads: Vec<RotorLog> = rotors.iter().map(|rotor| rotor.head(DEGREE_ROWS)).collect();
    let rotors = heads.as_slice();
    for degree in 1..=HIGHEST_DEGREE {
        let problem = Problem { rotors, full_voltage, degree, battery };
        let (Some(fit), Some(squares)) = (sized!(problem, fit()), sized!(problem, held_out())) else {
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
