//! Allocation of a torque to two rotor commands, and back. [LPC16] Eqs. (7), (16)-(19).

use std::cmp::Ordering;

use super::compensation::Compensation;
use super::error::{ControlError, require};
use super::parameters::PlantParameters;
use super::thresholds::THRESHOLDS;

/// Two rotor commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocation {
    /// [-] u_1, u_2 in 0..1.
    pub rotor: [f64; 2],
    /// Less than what was asked for is possible.
    pub saturated: bool,
}

/// Through the inverse of g, with the battery and known faults of the command compensated.
///
/// ```
/// use rotorbench::control::{Allocator, Compensation, PlantParameters};
///
/// let plant = PlantParameters::paper();
/// let allocator = Allocator::build(&plant, &Compensation::default())?;
/// // Rotor 1 shall turn 40 rad/s faster than rotor 2, on a full battery.
/// let commands = allocator.allocate(40.0, plant.full_voltage).rotor;
/// assert!((allocator.difference(commands, plant.full_voltage) - 40.0).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allocator {
    plant: PlantParameters,
    known: Compensation,
    /// [s/rad] 1 / (2 ω_0).
    per_two_hover: f64,
    /// Nothing is known of the actuators beyond the paper's g and battery: the short way, and the usual one.
    plain: bool,
    /// The static curve bends so little off its parabola that Newton's method from there finds the command.
    from_parabola: bool,
}

impl Allocator {
    /// # Errors
    /// [`ControlError::Parameter`] for a plant or a compensation that no command can be found for; [`ControlError::Falls`] for a
    /// static curve without an inverse.
    pub fn build(plant: &PlantParameters, known: &Compensation) -> Result<Self, ControlError> {
        plant.validate()?;
        known.validate()?;
        check_curve(plant, known)?;
        Ok(Self {
            plant: *plant,
            known: *known,
            per_two_hover: 0.5 / plant.hover_rate,
            plain: !known.acts_on_actuators(),
            from_parabola: known.follows_parabola(plant),
        })
    }

    /// [-] commands whose rotor speeds differ by `difference` [rad/s] around hover on a battery of `voltage` [V].
    // In place, as what it calls: a step is a chain of a few operations, each waiting for the one before, and each
    // detour through memory is as long as one of them.
    #[must_use]
    #[inline(always)]
    pub fn allocate(&self, difference: f64, voltage: f64) -> Allocation {
        let hover = self.plant.hover_rate;
        // Symmetric about hover, so that the torque d c (ω_1² - ω_2²) is linear in the difference.
        let half = 0.5 * difference;
        let is_beyond = half.abs() > hover;
        let half = if is_beyond { hover.copysign(half) } else { half };
        let rotor = self.commands([hover + half, hover - half], voltage);
        let limit = self.known.command_limit;
        // As a rule nothing is to be limited, which these four know sooner than the limits would.
        if rotor[0] >= 0.0 && rotor[0] <= limit && rotor[1] >= 0.0 && rotor[1] <= limit {
            return Allocation { rotor, saturated: is_beyond };
        }
        Allocation { rotor: rotor.map(|command| limited(command, 0.0, limit)), saturated: true }
    }

    /// [rad/s] u_x that two commands stand for: the difference about hover that gives the same torque.
    ///
    /// **Deviation:** [LPC16] Eq. (16) has g(u_1) - g(u_2), which is the same for commands symmetric about hover.
    /// When the guard limits them, their sum changes too, and with f = c ω² so does the torque of a difference.
    #[must_use]
    #[inline(always)]
    pub fn difference(&self, rotor: [f64; 2], voltage: f64) -> f64 {
        let [z_1, z_2] = self.rates(rotor, voltage);
        (z_1 - z_2) * (z_1 + z_2) * self.per_two_hover
    }

    /// [-] commands that rotors settle with at `rates` [rad/s]; below 0 and above 1 are out of reach.
    #[inline(always)]
    fn commands(&self, rates: [f64; 2], voltage: f64) -> [f64; 2] {
        if !self.plain {
            return self.known_commands(rates.into(), voltage).into();
        }
        // **Deviation:** [LPC16] Eq. (2) adds k_V (v_bmax - v_b); a rotor slows down as its battery drops.
        let drop = self.drop(voltage);
        self.plant.commands_for([rates[0] + drop, rates[1] + drop])
    }

    // Pairs here and below: an array would go through memory, and make the others' step go through it, too.
    #[cold]
    #[inline(never)]
    fn known_commands(&self, rates: (f64, f64), voltage: f64) -> (f64, f64) {
        (self.known_command(rates.0, voltage), self.known_command(rates.1, voltage))
    }

    /// [rad/s] z, the speeds that rotors settle at under the commands `u`.
    #[inline(always)]
    fn rates(&self, u: [f64; 2], voltage: f64) -> [f64; 2] {
        if !self.plain {
            return self.known_rates(u.into(), voltage).into();
        }
        let drop = self.drop(voltage);
        u.map(|u| (self.plant.steady_rate(limited(u, 0.0, 1.0)) - drop).max(0.0))
    }

    #[cold]
    #[inline(never)]
    fn known_rates(&self, u: (f64, f64), voltage: f64) -> (f64, f64) {
        (self.known_rate(u.0, voltage), self.known_rate(u.1, voltage))
    }

    /// [rad/s] what the battery takes from a rotor's speed.
    #[inline]
    fn drop(&self, voltage: f64) -> f64 {
        self.plant.voltage_gain * (self.plant.full_voltage - voltage)
    }

    /// The inverse of [`Self::known_rate`].
    fn known_command(&self, rate: f64, voltage: f64) -> f64 {
        let known = &self.known;
        let effective = if known.scales_with_battery {
            // z = g(u v_b / v_bmax)
            self.known_inverse(rate) * self.plant.full_voltage / voltage
        } else {
            self.known_inverse(rate + self.drop(voltage))
        };
        if effective > 0.0 { known.dead_zone + effective * (1.0 - known.dead_zone) } else { effective }
    }

    /// [-] inverse of g(u) + c_0 + c_3 (u - u_0)³ + a_3 u³ + a_4 u⁴ + a_5 u⁵.
    fn known_inverse(&self, steady_rate: f64) -> f64 {
        if !self.from_parabola {
            return self.bracketed_inverse(steady_rate);
        }
        let known = &self.known;
        let target = steady_rate - known.steady_rate_offset;
        let mut u = self.plant.command_for(target);
        if known.bends_curve() {
            // Newton, a fixed number of steps; `build` made sure that the curve rises from 0 to 1.
            for _ in 0..THRESHOLDS.newton_steps {
                let (value, slope) = known.curve(&self.plant, u);
                u = (u - (value - steady_rate) / slope.max(1e-3 * self.plant.steady_rate_linear))
                    .clamp(THRESHOLDS.inverse_range.0, THRESHOLDS.inverse_range.1);
            }
        }
        u
    }

    /// [-] the same of any curve that rises from 0 to 1, in a fixed number of steps. Beyond, where it may fall, it is taken to go on
    /// as it ends.
    fn bracketed_inverse(&self, steady_rate: f64) -> f64 {
        let curve = |u: f64| self.known.curve(&self.plant, u);
        for (end, sign) in [(0.0, -1.0), (1.0, 1.0)] {
            let (value, slope) = curve(end);
            if sign * (steady_rate - value) >= 0.0 {
                let (lowest, highest) = THRESHOLDS.inverse_range;
                return limited(end + (steady_rate - value) / slope, lowest, highest);
            }
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..THRESHOLDS.inverse_halvings {
            let middle = 0.5 * (low + high);
            if curve(middle).0 < steady_rate { low = middle } else { high = middle }
        }
        let mut u = 0.5 * (low + high);
        for _ in 0..THRESHOLDS.newton_steps {
            let (value, slope) = curve(u);
            let next = limited(u - (value - steady_rate) / slope, low, high);
            // Between two points at which the curve was seen to rise it may be level for a moment.
            u = if next.is_finite() { next } else { u };
        }
        u
    }

    /// [rad/s] z with what is known of the actuators' faults.
    fn known_rate(&self, u: f64, voltage: f64) -> f64 {
        let known = &self.known;
        let u = u.min(known.command_limit);
        let mut effective = ((u - known.dead_zone) / (1.0 - known.dead_zone)).max(0.0);
        let mut drop = self.drop(voltage);
        if known.scales_with_battery {
            effective *= voltage / self.plant.full_voltage;
            drop = 0.0;
        }
        (known.curve(&self.plant, effective).0 - drop).max(0.0)
    }
}

/// Refuses a static curve that falls anywhere from 0 to 1, which has no inverse, and one that does not reach hover.
fn check_curve(plant: &PlantParameters, known: &Compensation) -> Result<(), ControlError> {
    let points = THRESHOLDS.rise_points;
    let at = |point: usize| point as f64 / points as f64;
    // Not-a-number does not rise.
    let falls = |point: &usize| known.curve(plant, at(*point)).1.partial_cmp(&0.0) != Some(Ordering::Greater);
    if let Some(first) = (0..=points).find(falls) {
        let last = (first..=points).take_while(falls).last().unwrap_or(first);
        let degree = if known.bends_curve() { 2 } else { 1 };
        return Err(ControlError::Falls { from: at(first), to: at(last), degree });
    }
    let rule = "must be below g(1), or full command does not reach it";
    require(known.curve(plant, 1.0).0 > plant.hover_rate, "hover_rate", plant.hover_rate, rule)
}

/// `value` within `least..=greatest`; not-a-number stays what it is. As [`f64::clamp`], which also checks its limits:
/// `build` did.
#[inline(always)]
fn limited(value: f64, least: f64, greatest: f64) -> f64 {
    if value < least {
        least
    } else if value > greatest {
        greatest
    } else {
        value
    }
}
