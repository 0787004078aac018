//! One rotor of one log by itself: its rates behind its commands, a first-order lag fitted to its excited part.

use super::thresholds::THRESHOLDS;
use std::ops::Range;

use nalgebra::DVector;

use super::Estimate;
use super::regressors::record_of;
use super::significance;
use crate::estimation::moments::deviation;
use crate::estimation::quantile::quantile;
use crate::estimation::variable_projection::{self, LagFit};
use crate::log::Cells;
use crate::screening::excitation::FEWEST_JUMPS;
use crate::screening::rotor_data::{Beside, RotorLog};

/// What the rates of a rotor do after its commands (or after another's).
pub(crate) struct SingleRotorFit {
    pub fit: LagFit,
    /// [rad/s] standard deviation of the rates.
    scatter: f64,
    /// [-] between which nine of ten commands lie.
    pub range: (f64, f64),
}

impl SingleRotorFit {
    /// Whether the pole is one, and most of the motion is explained.
    pub fn is_plain(&self) -> bool {
        let pole = Estimate { value: self.fit.pole, standard_error: self.fit.pole_error() };
        significance::is_significant(&pole) && self.fit.residual_rms < THRESHOLDS.follows_share * self.scatter
    }

    /// [rad/s] the steady rate at a command [-] and a voltage drop [V].
    pub fn at(&self, command: f64, drop: f64) -> Estimate {
        let mut place = vec![command, command * command];
        place.extend((self.fit.coefficients.len() > 2).then_some(-drop));
        place.push(0.0);
        let place = DVector::from(place);
        let rates = DVector::from_vec(self.fit.coefficients.clone()).push(0.0);
        let variance = (place.transpose() * &self.fit.covariance * &place)[(0, 0)];
        Estimate { value: rates.dot(&place), standard_error: variance.max(0.0).sqrt() }
    }
}

/// Whether a rotor's commands show how it follows: by jumps, or by many smaller moves that leave no doubt about it.
pub(crate) fn is_excited(rotor: &RotorLog, full_voltage: f64) -> bool {
    let is_plain = |own: SingleRotorFit| {
        own.is_plain() && own.fit.pole_error() <= THRESHOLDS.plain_pole_share * own.fit.pole
    };
    rotor.jumps().len() >= FEWEST_JUMPS
        || (rotor.quick_moves(THRESHOLDS.quick_move) >= THRESHOLDS.fewest_quick_moves
            && follows(&part_from(rotor, 0), full_voltage).is_some_and(is_plain))
}

/// The rotor from its first jump on, where it is excited.
pub(crate) fn excited_part(rotor: &RotorLog) -> Option<RotorLog> {
    let jumps = rotor.jumps();
    let first = *jumps.first().filter(|_| jumps.len() >= FEWEST_JUMPS)?;
    Some(part_from(rotor, first))
}

/// The rotor from row `first` on, as far as it is fitted alone.
fn part_from(rotor: &RotorLog, first: usize) -> RotorLog {
    let part = first..(first + THRESHOLDS.single_fit_rows).min(rotor.time.len());
    let inside = |stretch: &Range<usize>| stretch.start.max(part.start)..stretch.end.min(part.end);
    let stretches = rotor.stretches.iter().map(inside).filter(|it| it.len() > 1).collect();
    let head = |values: &Cells| values.part(0..part.end);
    let beside =
        |beside: &Beside| Beside { command: head(&beside.command), rate: beside.rate.as_ref().map(head) };
    RotorLog {
        file: rotor.file.clone(),
        time: head(&rotor.time),
        command: head(&rotor.command),
        command_from: rotor.command_from.as_ref().map(head),
        rate: head(&rotor.rate),
        voltage: rotor.voltage.as_ref().map(head),
        thrust: rotor.thrust.as_ref().map(head),
        beside: rotor.beside.as_ref().map(beside),
        stretches,
        ..*rotor
    }
}

/// The fit to an excited part.
pub(crate) fn follows(part: &RotorLog, full_voltage: f64) -> Option<SingleRotorFit> {
    let fit = lag(part, full_voltage, 0.0)?;
    let commands = |share: f64| quantile(part.scored().map(|row| part.command[row]), share);
    let edge = THRESHOLDS.command_range_edge;
    let range = (commands(edge)?, commands(1.0 - edge)?);
    Some(SingleRotorFit { fit, scatter: scatter(part), range })
}

/// A lag behind commands with a dead time of `delay` [s], with the battery where it was read.
pub(crate) fn lag(part: &RotorLog, full_voltage: f64, delay: f64) -> Option<LagFit> {
    let part = std::slice::from_ref(part);
    let beside =
        || variable_projection::fit(&record_of(part, full_voltage, delay, |u, drop| [u, u * u, -drop]));
    let alone = || variable_projection::fit(&record_of(part, full_voltage, delay, |u, _| [u, u * u]));
    part[0].voltage.is_some().then(beside).flatten().or_else(alone)
}

/// [rad/s] standard deviation of the rates.
pub(crate) fn scatter(part: &RotorLog) -> f64 {
    deviation(part.scored().map(|row| part.rate[row]))
}
