//! The plant as the sampled loop sees it: torque command in, gyro sample out, discretized exactly.

use nalgebra::{DMatrix, DVector};

use super::linear::SisoSystem;
use crate::control::error::{require, require_finite, require_positive};
use crate::control::{Compensation, ControlError, PlantParameters};

/// [rad], [rad/s] how far the known torques are moved to see their slope: small against every bench's motion.
const SLOPE_STEP: f64 = 1e-4;

/// The linear plant between the commanded torque and the gyro.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopPlant {
    /// [kg m²] J.
    pub inertia: f64,
    /// [rad/s] p, actuator pole.
    pub pole: f64,
    /// [rad/s] further first-order lags between command and torque.
    pub lags: Vec<f64>,
    /// [rad/s] first-order lag of the gyro; `None` = none.
    pub gyro_pole: Option<f64>,
    /// [s] transport delay from the command to the actuator, any fraction of a period.
    pub delay_s: f64,
    /// [N m/rad] restoring torque of the body (pendulum, cable).
    pub stiffness: f64,
    /// [N m s/rad] damping torque of the body.
    pub damping: f64,
}

impl LoopPlant {
    /// The paper's plant, without delay: J, one actuator pole, a free body. [LPC16] Eqs. (15), (17).
    ///
    /// **Deviation:** the left side of Eq. (15) lacks a dot: q̇_b = -p q_b + p b u_x with q_b = ω̇_b.
    #[must_use]
    pub fn new(plant: &PlantParameters) -> Self {
        Self {
            inertia: plant.inertia,
            pole: plant.pole,
            lags: Vec::new(),
            gyro_pole: None,
            delay_s: 0.0,
            stiffness: 0.0,
            damping: 0.0,
        }
    }

    /// Adds the slope of known torques at rest at `angle` [rad].
    #[must_use]
    pub fn with_torques(mut self, known: &Compensation, angle: f64) -> Self {
        let (stiffness, damping) = slopes(known, angle);
        self.stiffness += stiffness;
        self.damping += damping;
        self
    }

    /// Sampled with a zero-order hold at `period_s`, the delay included, without approximation.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] names what is no plant.
    pub fn sampled(&self, period_s: f64) -> Result<SisoSystem, ControlError> {
        self.validate()?;
        let (a, b, c) = self.continuous();
        let whole = (self.delay_s / period_s + 1e-9).floor();
        let fraction_s = (self.delay_s - whole * period_s).max(0.0);
        let whole = whole as usize;
        // The command of one period later takes over after `fraction_s`.
        let (after, gain_after) = hold(&a, &b, period_s - fraction_s);
        let (before, gain_before) = hold(&a, &b, fraction_s);
        let (phi, gain_before) = (&after * before, &after * gain_before);

        let (n, registers) = (b.len(), whole + 1);
        let mut sampled = SisoSystem::zeros(n + registers);
        sampled.a.view_mut((0, 0), (n, n)).copy_from(&phi);
        // Register i holds the command of i + 1 periods ago.
        sampled.a.view_mut((0, n + whole), (n, 1)).copy_from(&gain_before);
        if whole == 0 {
            sampled.b.rows_mut(0, n).copy_from(&gain_after);
        } else {
            let mut newest = sampled.a.view_mut((0, n + whole - 1), (n, 1));
            newest += &gain_after;
        }
        sampled.b[n] = 1.0;
        for register in 1..registers {
            sampled.a[(n + register, n + register - 1)] = 1.0;
        }
        sampled.c.rows_mut(0, n).copy_from(&c);
        Ok(sampled)
    }

    /// x' = A x + B u, y = C x on the states: torque of each lag in turn, [angle,] rate [, gyro].
    fn continuous(&self) -> (DMatrix<f64>, DVector<f64>, DVector<f64>) {
        let stiff = self.stiffness != 0.0;
        let lags: Vec<f64> = self.lags.iter().copied().chain([self.pole]).collect();
        let rate = lags.len() + usize::from(stiff);
        let n = rate + 1 + usize::from(self.gyro_pole.is_some());
        let (mut a, mut b, mut c) = (DMatrix::zeros(n, n), DVector::zeros(n), DVector::zeros(n));
        for (index, pole) in lags.iter().enumerate() {
            a[(index, index)] = -pole;
            match index.checked_sub(1) {
                Some(before) => a[(index, before)] = *pole,
                None => b[index] = *pole,
            }
        }
        a[(rate, lags.len() - 1)] = 1.0 / self.inertia;
        a[(rate, rate)] = -self.damping / self.inertia;
        if stiff {
            a[(rate - 1, rate)] = 1.0;
            a[(rate, rate - 1)] = -self.stiffness / self.inertia;
        }
        match self.gyro_pole {
            Some(pole) => {
                a[(rate + 1, rate)] = pole;
                a[(rate + 1, rate + 1)] = -pole;
                c[rate + 1] = 1.0;
            }
            None => c[rate] = 1.0,
        }
        (a, b, c)
    }

    fn validate(&self) -> Result<(), ControlError> {
        let lags = self.lags.iter().chain(&self.gyro_pole).map(|pole| ("lag", *pole));
        for (name, value) in [("inertia", self.inertia), ("pole", self.pole)].into_iter().chain(lags) {
            require_positive(name, value)?;
        }
        for (name, value) in [("stiffness", self.stiffness), ("damping", self.damping)] {
            require_finite(name, value)?;
        }
        require((0.0..=1.0).contains(&self.delay_s), "delay", self.delay_s, "must be from 0 to 1 s")
    }
}

/// [N m/rad], [N m s/rad] slopes of the known torques at rest at `angle` [rad], positive where they restore.
pub(super) fn slopes(known: &Compensation, angle: f64) -> (f64, f64) {
    let slope = |d_angle: f64, d_rate: f64| {
        -(known.torque(angle + d_angle, d_rate) - known.torque(angle - d_angle, -d_rate)) / (2.0 * SLOPE_STEP)
    };
    (slope(SLOPE_STEP, 0.0), slope(0.0, SLOPE_STEP))
}

/// e^(A t), and what a constant input of 1 adds in the time t.
fn hold(a: &DMatrix<f64>, b: &DVector<f64>, t: f64) -> (DMatrix<f64>, DVector<f64>) {
    let n = b.len();
    let mut block = DMatrix::zeros(n + 1, n + 1);
    block.view_mut((0, 0), (n, n)).copy_from(&(a * t));
    block.view_mut((0, n), (n, 1)).copy_from(&(b * t));
    let exponential = block.exp();
    (exponential.view((0, 0), (n, n)).into_owned(), exponential.view((0, n), (n, 1)).column(0).into_owned())
}
