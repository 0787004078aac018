//! What a controller must know of the plant.

use super::error::{ControlError, require_not_negative, require_positive};

/// Plant parameters that gains and allocation are made of: [LPC16] Tables I and IV, or an identified model.
///
/// ```
/// use rotorbench::control::PlantParameters;
///
/// let plant = PlantParameters::paper();
/// let hover = plant.command_for(plant.hover_rate); // [-]
/// assert!((0.4..0.5).contains(&hover));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantParameters {
    /// [kg m²] J, inertia about the bench's axis.
    pub inertia: f64,
    /// [m] d, lever arm of each rotor.
    pub arm: f64,
    /// [rad/s] p, actuator pole.
    pub pole: f64,
    /// [N s/rad] c_p1, slope of the thrust curve at `hover_rate`. [LPC16] Eq. (13).
    pub thrust_slope: f64,
    /// [N s²/rad²] c, thrust is c ω².
    pub thrust_coefficient: f64,
    /// [rad/s] ω_0, rotor speed both rotors are commanded around.
    pub hover_rate: f64,
    /// [rad/s] c_g1, quadratic coefficient of the steady rate g(u). [LPC16] Eq. (7).
    pub steady_rate_quadratic: f64,
    /// [rad/s] c_g2, linear coefficient of g(u).
    pub steady_rate_linear: f64,
    /// [rad/(s V)] k_V, what a rotor loses for each volt that the battery is below full.
    pub voltage_gain: f64,
    /// [V] v_bmax, voltage of the full battery.
    pub full_voltage: f64,
}

impl PlantParameters {
    /// [LPC16] Tables I and IV.
    ///
    /// **Deviation:** the thrust curve of Fig. 4 is not given; f = c ω² with the tangent of Table IV
    /// (slope c_p1, intercept c_p0 = -6.0771 N) gives c = c_p1² / (4 · 6.0771) and hover at 2 · 6.0771 / c_p1.
    #[must_use]
    pub fn paper() -> Self {
        let (c_p1, c_p0) = (0.0197, -6.0771);
        Self {
            inertia: 0.032,
            arm: 0.25,
            pole: 16.0,
            thrust_slope: c_p1,
            thrust_coefficient: c_p1 * c_p1 / (-4.0 * c_p0),
            hover_rate: -2.0 * c_p0 / c_p1,
            steady_rate_quadratic: 447.1,
            steady_rate_linear: 1124.5,
            voltage_gain: 40.0,
            full_voltage: 12.6,
        }
    }

    /// [1/s per rad/s] b = d c_p1 / J, angular acceleration for each rad/s of rotor difference. [LPC16] Eq. (14).
    #[must_use]
    pub fn torque_gain(&self) -> f64 {
        self.arm * self.thrust_slope / self.inertia
    }

    /// [rad/s] g(u), rotor speed that the command `u` settles at on a full battery. [LPC16] Eq. (7).
    #[must_use]
    #[inline]
    pub fn steady_rate(&self, u: f64) -> f64 {
        (self.steady_rate_quadratic * u + self.steady_rate_linear) * u
    }

    /// [-] inverse of g, for the rate that g should give. Not clipped: above 1 means out of reach.
    #[must_use]
    pub fn command_for(&self, steady_rate: f64) -> f64 {
        self.commands_for([steady_rate; 2])[0]
    }

    /// [-] inverse of g for both rotors at once, which is one packed root and one packed division.
    #[must_use]
    #[inline]
    pub(super) fn commands_for(&self, rates: [f64; 2]) -> [f64; 2] {
        let (c_g1, c_g2) = (self.steady_rate_quadratic, self.steady_rate_linear);
        let inside = [c_g2 * c_g2 + 4.0 * c_g1 * rates[0], c_g2 * c_g2 + 4.0 * c_g1 * rates[1]];
        let root = [inside[0].max(0.0).sqrt(), inside[1].max(0.0).sqrt()];
        // This form of the root has no cancellation near zero and also holds for c_g1 = 0.
        [2.0 * rates[0] / (c_g2 + root[0]), 2.0 * rates[1] / (c_g2 + root[1])]
    }

    /// Whether the parabola alone rises from 0 to 1.
    pub(super) fn parabola_rises(&self) -> bool {
        let slope_at_full = 2.0 * self.steady_rate_quadratic + self.steady_rate_linear;
        self.steady_rate_linear > 0.0 && slope_at_full.is_finite() && slope_at_full > 0.0
    }

    /// Refuses what no controller can be built on. Whether the static curve has an inverse is judged with all its terms, by
    /// [`Allocator::build`](super::Allocator::build).
    ///
    /// # Errors
    /// [`ControlError::Parameter`] names the parameter.
    pub fn validate(&self) -> Result<(), ControlError> {
        let positive = [
            ("inertia", self.inertia),
            ("arm", self.arm),
            ("pole", self.pole),
            ("thrust_slope", self.thrust_slope),
            ("thrust_coefficient", self.thrust_coefficient),
            ("hover_rate", self.hover_rate),
            ("full_voltage", self.full_voltage),
        ];
        for (name, value) in positive {
            require_positive(name, value)?;
        }
        require_not_negative("voltage_gain", self.voltage_gain)
    }
}
