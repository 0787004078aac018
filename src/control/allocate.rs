//! Allocation of a torque to two rotor commands, and back. [LPC16] Eqs. (7), (16)-(19).

use super::{Compensation, ControlError, PlantParameters};

/// Two rotor commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocation {
    /// [-] u_1, u_2 in 0..1.
    pub rotor: [f64; 2],
    /// Less than what was asked for is possible.
    pub saturated: bool,
}

/// Through the inverse of g, with the battery and known faults of the command compensated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocator {
    plant: PlantParameters,
    known: Compensation,
}

impl Allocator {
    /// # Errors
    /// [`ControlError::Parameter`] for a plant or a compensation that cannot be inverted.
    pub fn build(plant: &PlantParameters, known: &Compensation) -> Result<Self, ControlError> {
        plant.validate()?;
        known.validate()?;
        let falls = |percent: i32| known.curve(plant, f64::from(percent) / 100.0).1 <= 0.0;
        if (0..=100).any(falls) {
            return Err(ControlError::Parameter {
                name: "steady_rate_cubic",
                value: known.steady_rate_cubic,
                rule: "must keep the steady rate rising from 0 to 1, or it has no inverse",
            });
        }
        Ok(Self { plant: *plant, known: *known })
    }

    /// [-] commands whose rotor speeds differ by `difference` [rad/s] around hover on a battery of `voltage` [V].
    #[must_use]
    pub fn allocate(&self, difference: f64, voltage: f64) -> Allocation {
        let hover = self.plant.hover_rate;
        // Symmetric about hover, so that the torque d c (ω_1² - ω_2²) is linear in the difference.
        let half = (0.5 * difference).clamp(-hover, hover);
        let mut saturated = (0.5 * difference).abs() > hover;
        let rotor = [hover + half, hover - half].map(|rate| {
            let wanted = self.command(rate, voltage);
            let possible = wanted.clamp(0.0, self.known.command_limit);
            saturated |= wanted != possible;
            possible
        });
        Allocation { rotor, saturated }
    }

    /// [rad/s] u_x that two commands stand for: the difference about hover that gives the same torque.
    ///
    /// **Deviation:** [LPC16] Eq. (16) has g(u_1) - g(u_2), which is the same for commands symmetric about hover.
    /// When the guard limits them, their sum changes too, and with f = c ω² so does the torque of a difference.
    #[must_use]
    pub fn difference(&self, rotor: [f64; 2], voltage: f64) -> f64 {
        let [z_1, z_2] = rotor.map(|u| self.rate(u, voltage));
        (z_1 - z_2) * (z_1 + z_2) / (2.0 * self.plant.hover_rate)
    }

    /// [-] command that a rotor settles with at `rate` [rad/s]; below 0 and above 1 are out of reach.
    fn command(&self, rate: f64, voltage: f64) -> f64 {
        let known = &self.known;
        let effective = if known.battery_scaling {
            // z = g(u v_b / v_bmax)
            self.known_command(rate) * self.plant.full_voltage / voltage
        } else {
            // **Deviation:** [LPC16] Eq. (2) adds k_V (v_bmax - v_b); a rotor slows down as its battery drops.
            self.known_command(rate + self.plant.voltage_gain * (self.plant.full_voltage - voltage))
        };
        if effective > 0.0 { known.dead_zone + effective * (1.0 - known.dead_zone) } else { effective }
    }

    /// [-] inverse of g(u) + c_0 + c_3 (u - u_0)³.
    fn known_command(&self, steady_rate: f64) -> f64 {
        let known = &self.known;
        let target = steady_rate - known.steady_rate_offset;
        let mut u = self.plant.command_for(target);
        if known.steady_rate_cubic != 0.0 {
            // Newton, a fixed number of steps; `build` made sure that the curve rises from 0 to 1.
            for _ in 0..6 {
                let (value, slope) = known.curve(&self.plant, u);
                u = (u - (value - steady_rate) / slope.max(1e-3 * self.plant.steady_rate_linear))
                    .clamp(-0.5, 1.5);
            }
        }
        u
    }

    /// [rad/s] z, the speed a rotor settles at under the command `u`.
    fn rate(&self, u: f64, voltage: f64) -> f64 {
        let known = &self.known;
        let u = u.min(known.command_limit);
        let mut effective = ((u - known.dead_zone) / (1.0 - known.dead_zone)).max(0.0);
        let mut drop = self.plant.voltage_gain * (self.plant.full_voltage - voltage);
        if known.battery_scaling {
            effective *= voltage / self.plant.full_voltage;
            drop = 0.0;
        }
        (known.curve(&self.plant, effective).0 - drop).max(0.0)
    }
}
