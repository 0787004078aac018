//! Design of the discrete loop: eigenvalues, frequency response, margins, tuning.
//!
//! The plant is discretized exactly, with its actuator pole and with a transport delay of any fraction of a
//! period; the controllers are the linear form of what [`super::Emc`] and [`super::Pid`] compute.

mod compensator;
mod frequency;
mod linear;
mod plant;
mod tune;

pub use compensator::Compensator;
pub use frequency::{LoopResponse, Margins};
pub use linear::SisoSystem;
pub use plant::LoopPlant;
pub use tune::{Advice, Improvement, advise, pid_by_margins};

use nalgebra::{Complex, DMatrix};

use super::gains::require_stable;
use super::{Compensation, ControlError, PlantParameters, check_period};

/// A stable closed loop, opened at the plant's input for its margins.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteLoop {
    plant: SisoSystem,
    compensator: SisoSystem,
    period_s: f64,
    eigenvalues: Vec<Complex<f64>>,
}

impl DiscreteLoop {
    /// Closes the loop at rest at `angle` [rad]; `known` is what the controller cancels.
    ///
    /// # Errors
    /// [`ControlError::Unstable`] names the eigenvalue that is outside.
    pub fn build(
        plant: &PlantParameters,
        loop_plant: &LoopPlant,
        compensator: &Compensator,
        known: &Compensation,
        angle: f64,
        period_s: f64,
    ) -> Result<Self, ControlError> {
        check_period(period_s)?;
        let compensator = compensator.sampled(plant, known, angle, period_s);
        let sampled = loop_plant.sampled(period_s)?;
        let mut eigenvalues = closed(&sampled, &compensator).complex_eigenvalues().as_slice().to_vec();
        if loop_plant.stiffness != 0.0 {
            drop_angle_offset(&mut eigenvalues);
        }
        eigenvalues.sort_by(|a, b| b.norm().total_cmp(&a.norm()).then(b.im.total_cmp(&a.im)));
        require_stable("closed loop", eigenvalues.iter().copied())?;
        Ok(Self { plant: sampled, compensator, period_s, eigenvalues })
    }

    /// Eigenvalues of the closed loop, largest modulus first.
    #[must_use]
    pub fn eigenvalues(&self) -> &[Complex<f64>] {
        &self.eigenvalues
    }
}

/// Plant and controller in one matrix.
fn closed(plant: &SisoSystem, controller: &SisoSystem) -> DMatrix<f64> {
    let (n, m) = (plant.b.len(), controller.b.len());
    let mut a = DMatrix::zeros(n + m, n + m);
    a.view_mut((0, 0), (n, n)).copy_from(&(&plant.a + &plant.b * plant.c.transpose() * controller.d));
    a.view_mut((0, n), (n, m)).copy_from(&(&plant.b * controller.c.transpose()));
    a.view_mut((n, 0), (m, n)).copy_from(&(&controller.b * plant.c.transpose()));
    a.view_mut((n, n), (m, m)).copy_from(&controller.a);
    a
}

/// The angle is not observable from the gyro: where the true angle is a state, its difference from the
/// integrated one stays what it is, an eigenvalue of exactly 1 that no controller can move and no motion shows.
fn drop_angle_offset(eigenvalues: &mut Vec<Complex<f64>>) {
    let nearest = eigenvalues
        .iter()
        .enumerate()
        .min_by(|(_, a), (_, b)| (*a - 1.0).norm().total_cmp(&(*b - 1.0).norm()));
    // Its own rounding: the eigenvalue is simple, the matrix has entries up to some hundred.
    if let Some((index, _)) = nearest.filter(|(_, value)| (*value - 1.0).norm() < 1e-6) {
        eigenvalues.swap_remove(index);
    }
}
