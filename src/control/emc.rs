//! Embedded Model Control. [LPC16] section IV.A.

use serde::Serialize;

use super::allocate::Allocator;
use super::compensation::Compensation;
use super::config::{ControllerConfig, EmcConfig};
use super::controller::{Controller, code};
use super::error::{ControlError, check_period, require, require_finite, require_not_negative};
use super::fresh_readings::{AngleCorrection, FreshReadings};
use super::gains::{
    complementary_eigenvalues, feedback_gains, feedback_matrix, observer_gains, predictor_matrix,
    require_stable,
};
use super::parameters::PlantParameters;
use crate::signal::{Applied, Command, CommandFlags, Reference, Sensors, StateEstimate};

/// The gains of a built EMC, all dimensionless.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EmcGains {
    /// β, discrete pole of the embedded actuator.
    pub beta: f64,
    /// l_0..l_3 of the noise estimator.
    pub l: [f64; 4],
    /// k_1..k_3 of the state feedback.
    pub k: [f64; 3],
}

impl EmcConfig {
    /// Gains for the actuator pole [rad/s] and the period [s].
    ///
    /// # Errors
    /// [`ControlError::Parameter`] for a number out of its range, [`ControlError::Unstable`] when predictor or
    /// feedback has an eigenvalue outside.
    pub fn gains(&self, pole: f64, period_s: f64) -> Result<EmcGains, ControlError> {
        check_period(period_s)?;
        let beta = self.beta.value(pole, period_s);
        let gamma_0 = self.gamma_0.unwrap_or(beta);
        for (name, value) in [("beta", beta), ("gamma_0", gamma_0)] {
            require(value > 0.0 && (..2.0).contains(&value), name, value, "must be above 0 and below 2")?;
        }
        require_not_negative("alpha", self.alpha)?;
        require_not_negative("alpha_c", self.alpha_c)?;
        let l = observer_gains(beta, complementary_eigenvalues(gamma_0, self.alpha));
        let k = match self.feedback_gain {
            Some(given) => given,
            None => feedback_gains(beta, complementary_eigenvalues(gamma_0, self.alpha_c)),
        };
        k.iter().try_for_each(|value| require_finite("feedback_gain", *value))?;
        let predictor = predictor_matrix(beta, l).complex_eigenvalues();
        require_stable("state predictor", predictor.iter().copied())?;
        let feedback = feedback_matrix(beta, k).complex_eigenvalues();
        require_stable("state feedback A_c - B_c K", feedback.iter().copied())?;
        Ok(EmcGains { beta, l, k })
    }
}

/// A built EMC.
///
/// Inside, everything has the unit of the angle, as in [LPC16]: rates times T_c, accelerations times T_c².
#[derive(Debug, Clone, PartialEq)]
pub struct Emc {
    gains: EmcGains,
    /// [s] T_c.
    period_s: f64,
    /// [N m] J / T_c²: torque of one unit of u*. [LPC16] Eq. (19).
    torque_unit: f64,
    /// [rad/s] 1 / (T_c² b): rotor difference of one unit of u*. [LPC16] Eq. (18).
    difference_unit: f64,
    // Reciprocals, made once: a division is what a step would spend most of its time on.
    per_difference_unit: f64,
    per_beta: f64,
    per_period: f64,
    allocator: Allocator,
    known: Option<Compensation>,
    angle: AngleCorrection,
    start_angle: f64,
    full_voltage: f64,
}

/// The embedded model's state x̂, and what is remembered of the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct EmcState {
    /// x̂_c1, x̂_c2, x̂_c3. [LPC16] Eq. (20).
    x_c: [f64; 3],
    /// x̂_d1, x̂_d2.
    x_d: [f64; 2],
    sequence: u64,
    readings: FreshReadings,
}

impl Emc {
    /// Builds from the whole controller configuration, since reference and angle settings belong to it.
    ///
    /// # Errors
    /// [`ControlError`] names the parameter or the eigenvalue.
    pub fn build(
        config: &ControllerConfig,
        plant: &PlantParameters,
        known: &Compensation,
        period_s: f64,
    ) -> Result<Self, ControlError> {
        let allocator = Allocator::build(plant, known)?;
        let gains = config.emc.gains(plant.pole, period_s)?;
        config.reference.build(period_s)?;
        let difference_unit = 1.0 / (period_s * period_s * plant.torque_gain());
        Ok(Self {
            gains,
            per_difference_unit: 1.0 / difference_unit,
            per_beta: 1.0 / gains.beta,
            per_period: 1.0 / period_s,
            period_s,
            torque_unit: plant.inertia / (period_s * period_s),
            difference_unit,
            allocator,
            known: known.acts_on_body().then_some(*known),
            angle: AngleCorrection::build(config.use_body_angle, period_s),
            start_angle: config.reference.angle_rad,
            full_voltage: plant.full_voltage,
        })
    }

    /// The gains in use.
    #[must_use]
    pub fn gains(&self) -> EmcGains {
        self.gains
    }

    /// Known acceleration h(θ, ω_b) in the model's unit, and its growth over the coming period.
    #[inline(always)]
    fn known_disturbance(&self, x_c: [f64; 3], x_d1: f64) -> (f64, f64) {
        self.known.as_ref().map_or((0.0, 0.0), |known| self.disturbance_of(known, x_c, x_d1))
    }

    // Apart, so that the sines of the few do not spill the registers of the many.
    #[inline(never)]
    fn disturbance_of(&self, known: &Compensation, x_c: [f64; 3], x_d1: f64) -> (f64, f64) {
        let scaled = |angle: f64, rate: f64| known.torque(angle, rate / self.period_s) / self.torque_unit;
        let h = scaled(x_c[0], x_c[1]);
        let ahead = scaled(x_c[0] + x_c[1], x_c[1] + x_c[2] + x_d1 + h);
        (h, ahead - h)
    }

    /// The prediction of this period's state, completed with the command that the rotors really got; or rest.
    // By value and in place: through memory each step would wait for its own stores.
    #[inline(always)]
    fn predicted(
        &self,
        state: &EmcState,
        sensors: &Sensors,
        y: Option<f64>,
        applied: &Applied,
        voltage: f64,
    ) -> ([f64; 3], [f64; 2]) {
        if applied.command_sequence == 0 {
            let angle = self.angle.measured(sensors).unwrap_or(self.start_angle);
            return ([angle, y.unwrap_or(0.0), 0.0], [0.0; 2]);
        }
        let [x_1, x_2, x_3] = state.x_c;
        let got = self.allocator.difference(applied.rotor, voltage) * self.per_difference_unit;
        let x_3 = if got.is_finite() { x_3 + self.gains.beta * got } else { x_3 };
        ([self.angle.correct(x_1, sensors), x_2, x_3], state.x_d)
    }
}

impl Emc {
    /// The control law: what is asked for in units of the model, from its states and the disturbance with what is known of it.
    #[inline]
    fn law(&self, reference: &Reference, [x_1, x_2, x_3]: [f64; 3], (d_1, d_2): (f64, f64)) -> f64 {
        let (t_c, k) = (self.period_s, self.gains.k);
        // [LPC16] Eq. (28) with M and Q of Eq. (29): e = x̲_c - x̂_c - Q x̂_d, u* = u̲ + K e - M x̂_d.
        // **Deviation:** the print of (28) has lost the underline of the reference x̲_c.
        let r = [reference.angle, t_c * reference.rate, t_c * t_c * reference.acceleration];
        let nominal = r[2] + t_c * t_c * t_c * reference.jerk * self.per_beta;
        let e = [r[0] - x_1, r[1] - x_2, r[2] - x_3 - d_1];
        nominal + (k[0] * e[0] + k[1] * e[1] + k[2] * e[2]) - (d_1 + d_2 * self.per_beta)
    }
}

impl Controller for Emc {
    type State = EmcState;

    fn start(&self) -> EmcState {
        EmcState {
            x_c: [self.start_angle, 0.0, 0.0],
            x_d: [0.0; 2],
            sequence: 0,
            readings: FreshReadings::start(self.full_voltage),
        }
    }

    fn step(
        &self,
        state: &mut EmcState,
        sensors: &Sensors,
        reference: &Reference,
        applied: &Applied,
    ) -> Command {
        let (t_c, per_t) = (self.period_s, self.per_period);
        let EmcGains { beta, l, .. } = self.gains;
        let (voltage, voltage_assumed) = state.readings.voltage(sensors);
        let y = state.readings.body_rate(sensors).map(|rate| t_c * rate);
        let ([x_1, x_2, x_3], [x_d1, x_d2]) = self.predicted(state, sensors, y, applied, voltage);

        // Known physics is a disturbance that need not be estimated: it joins x_d in model and law.
        let (h, h_growth) = self.known_disturbance([x_1, x_2, x_3], x_d1);
        let (d_1, d_2) = (x_d1 + h, x_d2 + h_growth);

        let u = self.law(reference, [x_1, x_2, x_3], (d_1, d_2));
        let allocation = self.allocator.allocate(u * self.difference_unit, voltage);

        // [LPC16] Eq. (24); without a measurement the model predicts alone.
        let e_m = y.map_or(0.0, |y| x_2 - y);
        // [LPC16] Eq. (21) with the noise that L e_m stands for, which is Eq. (25); the command's part of x̂_c3 follows when
        // it is known what the guard let through.
        state.x_c = [x_1 + x_2, x_2 + x_3 + d_1 - l[1] * e_m, (1.0 - beta) * x_3 - beta * l[0] * e_m];
        state.x_d = [x_d1 + x_d2 - l[2] * e_m, x_d2 - l[3] * e_m];
        state.sequence += 1;

        Command {
            sequence: state.sequence,
            stamp_ns: 0,
            sensors_sequence: sensors.sequence,
            rotor: allocation.rotor,
            torque: u * self.torque_unit,
            flags: CommandFlags::of(allocation.saturated, y.is_none(), voltage_assumed),
            controller: code::EMC,
            estimate: StateEstimate {
                reference_angle: reference.angle,
                body_angle: x_1,
                body_rate: x_2 * per_t,
                actuator_acceleration: x_3 * per_t * per_t,
                disturbance_torque: x_d1 * self.torque_unit,
                model_error: e_m * per_t,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3, Matrix3x2, RowVector2, RowVector3, Vector3};

    use super::*;

    /// With everything else at rest the law answers -(M + K Q) x̂_d. M, read off the step with the Q of
    /// Eq. (29), is the print's, and both solve the equation that the print leaves to its source.
    #[test]
    fn eq_29_is_what_the_step_does_about_a_disturbance() {
        let (plant, period_s, beta) = (PlantParameters::paper(), 0.02, 0.276);
        let emc = Emc::build(&ControllerConfig::paper(), &plant, &Compensation::default(), period_s)
            .expect("the paper's controller");
        let answer = |x_d: [f64; 2]| {
            let mut state = EmcState { x_d, ..emc.start() };
            let hover = plant.command_for(plant.hover_rate);
            let applied = Applied { command_sequence: 1, rotor: [hover; 2], ..Applied::default() };
            let command = emc.step(&mut state, &Sensors::default(), &Reference::default(), &applied);
            command.torque / emc.torque_unit
        };
        let q = Matrix3x2::new(0.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let k = RowVector3::from(emc.gains.k);
        let m = -RowVector2::new(answer([1.0, 0.0]), answer([0.0, 1.0])) - k * q;
        // Rounding of numbers near 4.
        assert!((m - RowVector2::new(1.0, 1.0 / beta)).abs().max() < 1e-12, "{m}");
        let a_c = Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0 - beta);
        let a_d = Matrix2::new(1.0, 1.0, 0.0, 1.0);
        let h_c = Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0);
        let b_c = Vector3::new(0.0, 0.0, beta);
        assert!((a_c * q - q * a_d - h_c + b_c * m).abs().max() < 1e-12);
    }
}
