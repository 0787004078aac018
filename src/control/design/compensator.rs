//! The controllers as linear systems: gyro sample in, commanded torque out.

use nalgebra::RowSVector;

use super::linear::SisoSystem;
use super::plant::slopes;
use crate::control::{Compensation, EmcGains, PidConfig, PlantParameters};

/// A controller whose loop is to be looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Compensator {
    /// Embedded Model Control with these gains.
    Emc(EmcGains),
    /// PID with these gains.
    Pid(PidConfig),
}

impl Compensator {
    /// From the body rate [rad/s] to the torque [N m], in one period; `known` is what the controller cancels,
    /// taken by its slope at rest at `angle` [rad].
    #[must_use]
    pub fn sampled(
        &self,
        plant: &PlantParameters,
        known: &Compensation,
        angle: f64,
        period_s: f64,
    ) -> SisoSystem {
        let (stiffness, damping) = slopes(known, angle);
        match self {
            Self::Emc(gains) => emc(gains, plant.inertia, stiffness, damping, period_s),
            Self::Pid(gains) => pid(gains, stiffness, damping, period_s),
        }
    }
}

/// [LPC16] Eqs. (25), (28) on x̂ = [x_c1, x_c2, x_c3, x_d1, x_d2], with the known torques in model and law.
fn emc(gains: &EmcGains, inertia: f64, stiffness: f64, damping: f64, t_c: f64) -> SisoSystem {
    type Row = RowSVector<f64, 5>;
    let EmcGains { beta, l, k } = *gains;
    let unit = |index: usize| Row::from_fn(|_, column| if column == index { 1.0 } else { 0.0 });
    let [x_1, x_2, x_3, x_d1, x_d2] = [0, 1, 2, 3, 4].map(unit);
    let h = -(x_1 * (stiffness * t_c * t_c / inertia) + x_2 * (damping * t_c / inertia));
    let ahead = x_2 * (stiffness * t_c * t_c / inertia) + (x_3 + x_d1 + h) * (damping * t_c / inertia);
    let (d_1, d_2) = (x_d1 + h, x_d2 - ahead);
    let u = -(x_1 * k[0] + x_2 * k[1] + (x_3 + d_1) * k[2]) - d_1 - d_2 / beta;
    let rows = [
        x_1 + x_2,
        x_2 * (1.0 - l[1]) + x_3 + d_1,
        x_3 * (1.0 - beta) - x_2 * (beta * l[0]) + u * beta,
        x_d1 + x_d2 - x_2 * l[2],
        x_d2 - x_2 * l[3],
    ];
    let mut system = SisoSystem::zeros(5);
    for (index, row) in rows.iter().enumerate() {
        system.a.row_mut(index).copy_from(row);
    }
    for (entry, gain) in system.b.iter_mut().zip([0.0, l[1], beta * l[0], l[2], l[3]]) {
        *entry = gain * t_c;
    }
    system.c.copy_from(&(u * (inertia / (t_c * t_c))).transpose());
    system
}

/// [LPC16] Eq. (30) on [angle, x_I].
fn pid(gains: &PidConfig, stiffness: f64, damping: f64, t_c: f64) -> SisoSystem {
    let mut system = SisoSystem::zeros(2);
    system.a.copy_from_slice(&[1.0, -1.0, 0.0, 1.0]);
    system.b[0] = t_c;
    system.c.copy_from_slice(&[-gains.k_p + stiffness, gains.k_i * t_c]);
    system.d = -gains.k_d + damping;
    system
}
