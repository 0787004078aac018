//! The reference generator: a hold, steps and smooth slews of the angle.

use serde::{Deserialize, Serialize};

use super::error::{ControlError, require_finite};
use crate::signal::{Applied, Reference};

/// The `[controller.reference]` table. Without moves the angle is held at `angle_rad`, as in [LPC16] section V.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReferenceConfig {
    /// [rad] angle held from the start; the body's angle when the bench is armed is taken to be this one.
    pub angle_rad: f64,
    /// What comes then, in the order of time.
    pub moves: Vec<MoveConfig>,
}

/// One change of the angle.
///
/// ```
/// use rotorbench::control::{MoveConfig, ReferenceConfig};
///
/// // Five seconds at 0, then to 0.3 rad within 1.5 s.
/// let slew = MoveConfig { at_s: 5.0, angle_rad: 0.3, duration_s: 1.5 };
/// let reference = ReferenceConfig { angle_rad: 0.0, moves: vec![slew] };
/// assert!(reference.build(0.02).is_ok());
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MoveConfig {
    /// [s] when it begins, after the guard first let a command through.
    pub at_s: f64,
    /// [rad] where it ends.
    pub angle_rad: f64,
    /// [s] how long it takes: 0 (the default) = a step, else a slew that is smooth up to the jerk.
    #[serde(default)]
    pub duration_s: f64,
}

/// A built reference: angle, rate, acceleration and jerk of every period.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceGenerator {
    start: f64,
    moves: Vec<MoveConfig>,
    period_s: f64,
}

/// How far the reference has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReferenceState {
    /// Periods since the guard first let a command through.
    periods: u64,
}

impl ReferenceConfig {
    /// Checks the moves.
    ///
    /// # Errors
    /// [`ControlError::Move`] names the move that is not a number, in the past, or begins before the one
    /// before it has ended.
    pub fn build(&self, period_s: f64) -> Result<ReferenceGenerator, ControlError> {
        super::check_period(period_s)?;
        require_finite("reference.angle_rad", self.angle_rad)?;
        let mut free_from = 0.0;
        for (index, step) in self.moves.iter().enumerate() {
            let numbers = [step.at_s, step.angle_rad, step.duration_s].iter().all(|value| value.is_finite());
            if !numbers || step.duration_s < 0.0 || step.at_s < free_from {
                return Err(ControlError::Move { index, at_s: step.at_s, free_from_s: free_from });
            }
            free_from = step.at_s + step.duration_s;
        }
        Ok(ReferenceGenerator { start: self.angle_rad, moves: self.moves.clone(), period_s })
    }
}

impl ReferenceGenerator {
    /// The state at the beginning.
    #[must_use]
    pub fn start(&self) -> ReferenceState {
        ReferenceState::default()
    }

    /// The reference of this period, then one period further. Its time runs only while the guard lets
    /// commands through, and starts again when it stops doing so.
    pub fn next(&self, state: &mut ReferenceState, applied: &Applied) -> Reference {
        if applied.command_sequence == 0 {
            state.periods = 0;
            return self.at(0);
        }
        state.periods += 1;
        self.at(state.periods)
    }

    /// The reference `periods` after the start. Rate, acceleration and jerk are forward differences, so that
    /// the embedded model (Euler forward, [LPC16] Eq. (22)) follows the slew exactly.
    #[must_use]
    pub fn at(&self, periods: u64) -> Reference {
        let time = |ahead: u64| (periods.saturating_add(ahead)) as f64 * self.period_s;
        let angle = [0, 1, 2, 3].map(|ahead| self.angle(time(ahead), time(0)));
        let rate = [0, 1, 2].map(|i| (angle[i + 1] - angle[i]) / self.period_s);
        let acceleration = [0, 1].map(|i| (rate[i + 1] - rate[i]) / self.period_s);
        Reference {
            angle: angle[0],
            rate: rate[0],
            acceleration: acceleration[0],
            jerk: (acceleration[1] - acceleration[0]) / self.period_s,
        }
    }

    /// [rad] angle at `time`, as foreseen at the time `now`: a step to come is no reason to move yet.
    fn angle(&self, time: f64, now: f64) -> f64 {
        let mut angle = self.start;
        for step in &self.moves {
            let begun_at = if step.duration_s > 0.0 { time } else { now };
            // Half a nanosecond: the grid's rounding must not shift a move by a period.
            if begun_at + 0.5e-9 < step.at_s {
                break;
            }
            let share = if step.duration_s > 0.0 { (time - step.at_s) / step.duration_s } else { 1.0 };
            angle += (step.angle_rad - angle) * smooth_step(share.clamp(0.0, 1.0));
        }
        angle
    }
}

/// 0..1 with rate, acceleration and jerk zero at both ends: 35 s⁴ - 84 s⁵ + 70 s⁶ - 20 s⁷.
fn smooth_step(s: f64) -> f64 {
    s * s * s * s * (35.0 + s * (-84.0 + s * (70.0 - 20.0 * s)))
}
