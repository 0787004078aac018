//! Known physics beyond [LPC16], which a controller may cancel instead of estimating it.
//!
//! The process layer fills this from the effects of an extended model; the controllers know nothing of
//! effects or models. Everything defaults to "not there".

use super::error::{ControlError, require, require_finite, require_positive};
use super::parameters::PlantParameters;

/// Known torques on the body, and known faults of the actuator's command. All zero = the paper's plant.
///
/// ```
/// use rotorbench::control::Compensation;
///
/// // A body that hangs below its axis: the controller cancels the torque instead of estimating it.
/// let known = Compensation { pendulum_moment: 0.4, ..Compensation::default() }; // [N m]
/// # assert!(known.stiffness == 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compensation {
    /// [N m] m of the torque -m sin(θ + θ_0).
    pub pendulum_moment: f64,
    /// [rad] θ_0.
    pub pendulum_offset: f64,
    /// [N m/rad] k of the torque -k θ.
    pub stiffness: f64,
    /// [N m] constant torque.
    pub constant_torque: f64,
    /// [N m] τ_c of the torque -τ_c tanh(ω_b / ω_s).
    pub coulomb_torque: f64,
    /// [rad/s] ω_s, how fast the Coulomb torque turns over; must be positive where `coulomb_torque` is not zero.
    pub coulomb_rate: f64,
    /// [N m s/rad] b of the torque -b ω_b.
    pub viscous_friction: f64,
    /// [N m s²/rad²] c of the torque -c ω_b |ω_b|.
    pub quadratic_drag: f64,
    /// [-] u_d: the rotor sees max(0, u - u_d) / (1 - u_d).
    pub dead_zone: f64,
    /// [-] u_max: the rotor sees min(u, u_max).
    pub command_limit: f64,
    /// [rad/s] c_0 in g(u) + c_0.
    pub steady_rate_offset: f64,
    /// [rad/s] c_3 in g(u) + c_3 (u - u_0)³.
    pub steady_rate_cubic: f64,
    /// [-] u_0 of the cubic.
    pub cubic_center: f64,
    /// [rad/s] what the curve itself has beyond its parabola: a_3, a_4 and a_5 in g(u) + a_3 u³ + a_4 u⁴ + a_5 u⁵.
    pub steady_rate_higher: [f64; 3],
    /// The battery scales the command, z = g(u v_b / v_bmax), in place of z = g(u) - k_V (v_bmax - v_b).
    pub scales_with_battery: bool,
}

impl Default for Compensation {
    fn default() -> Self {
        Self {
            pendulum_moment: 0.0,
            pendulum_offset: 0.0,
            stiffness: 0.0,
            constant_torque: 0.0,
            coulomb_torque: 0.0,
            coulomb_rate: 0.05,
            viscous_friction: 0.0,
            quadratic_drag: 0.0,
            dead_zone: 0.0,
            command_limit: 1.0,
            steady_rate_offset: 0.0,
            steady_rate_cubic: 0.0,
            cubic_center: 0.0,
            steady_rate_higher: [0.0; 3],
            scales_with_battery: false,
        }
    }
}

impl Compensation {
    /// Refuses what cannot be cancelled.
    ///
    /// # Errors
    /// [`ControlError::Parameter`] names the number.
    pub fn validate(&self) -> Result<(), ControlError> {
        let numbers = [
            ("pendulum_moment", self.pendulum_moment),
            ("pendulum_offset", self.pendulum_offset),
            ("stiffness", self.stiffness),
            ("constant_torque", self.constant_torque),
            ("coulomb_torque", self.coulomb_torque),
            ("viscous_friction", self.viscous_friction),
            ("quadratic_drag", self.quadratic_drag),
            ("steady_rate_offset", self.steady_rate_offset),
            ("steady_rate_cubic", self.steady_rate_cubic),
            ("cubic_center", self.cubic_center),
            ("steady_rate_higher", self.steady_rate_higher[0]),
            ("steady_rate_higher", self.steady_rate_higher[1]),
            ("steady_rate_higher", self.steady_rate_higher[2]),
        ];
        for (name, value) in numbers {
            require_finite(name, value)?;
        }
        require_positive("coulomb_rate", self.coulomb_rate)?;
        let (zone, limit) = (self.dead_zone, self.command_limit);
        require((0.0..1.0).contains(&zone), "dead_zone", zone, "must be at least 0 and below 1")?;
        let rule = "must be above the dead zone and at most 1";
        require(limit > zone && limit <= 1.0, "command_limit", limit, rule)
    }

    /// Whether any torque is known.
    #[must_use]
    pub fn acts_on_body(&self) -> bool {
        [
            self.pendulum_moment,
            self.stiffness,
            self.constant_torque,
            self.coulomb_torque,
            self.viscous_friction,
            self.quadratic_drag,
        ]
        .iter()
        .any(|value| *value != 0.0)
    }

    /// Whether anything is known of the actuators beyond [`PlantParameters`].
    #[must_use]
    pub fn acts_on_actuators(&self) -> bool {
        let numbers =
            [self.dead_zone, 1.0 - self.command_limit, self.steady_rate_offset, self.steady_rate_cubic];
        self.scales_with_battery || self.bends_curve() || numbers.iter().any(|value| *value != 0.0)
    }

    /// Whether the static curve is more than a parabola.
    #[must_use]
    pub(super) fn bends_curve(&self) -> bool {
        self.steady_rate_cubic != 0.0 || self.steady_rate_higher != [0.0; 3]
    }

    /// Whether the static curve of `plant` with these terms is inverted from its parabola on, by Newton's method alone.
    pub(super) fn follows_parabola(&self, plant: &PlantParameters) -> bool {
        plant.parabola_rises() && self.steady_rate_higher[1..] == [0.0; 2]
    }

    /// What is left of it for a controller that cancels nothing: the terms of a curve that is not inverted from its parabola on.
    pub(super) fn of_curve_alone(&self, plant: &PlantParameters) -> Self {
        if self.follows_parabola(plant) {
            return Self::default();
        }
        Self {
            steady_rate_offset: self.steady_rate_offset,
            steady_rate_cubic: self.steady_rate_cubic,
            cubic_center: self.cubic_center,
            steady_rate_higher: self.steady_rate_higher,
            ..Self::default()
        }
    }

    /// [N m] known torque on the body at the angle [rad] and the rate [rad/s].
    #[must_use]
    pub fn torque(&self, angle: f64, rate: f64) -> f64 {
        self.constant_torque
            - self.pendulum_moment * (angle + self.pendulum_offset).sin()
            - self.stiffness * angle
            - self.coulomb_torque * (rate / self.coulomb_rate).tanh()
            - (self.viscous_friction + self.quadratic_drag * rate.abs()) * rate
    }

    /// [rad/s] g(u) + c_0 + c_3 (u - u_0)³ + a_3 u³ + a_4 u⁴ + a_5 u⁵, and its slope.
    pub(super) fn curve(&self, plant: &PlantParameters, u: f64) -> (f64, f64) {
        let away = u - self.cubic_center;
        let [cubic, quartic, quintic] = self.steady_rate_higher;
        let cube = u * u * u;
        let value = plant.steady_rate(u)
            + self.steady_rate_offset
            + self.steady_rate_cubic * away * away * away
            + cubic * u * u * u
            + (quartic + quintic * u) * u * cube;
        let slope = 2.0 * plant.steady_rate_quadratic * u
            + plant.steady_rate_linear
            + 3.0 * self.steady_rate_cubic * away * away
            + 3.0 * cubic * u * u
            + (4.0 * quartic + 5.0 * quintic * u) * cube;
        (value, slope)
    }
}
