//! The adversary's plant: the bench of [LPC16] with any effect hidden in it, written from the paper and from
//! the table of effects alone. It shares no law, no integrator and no step with the library, which is why a
//! diagnosis of what it makes means something.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::laws::{Family, Numbers, Seen};

/// What the diagnosis starts from: the numbers of [LPC16] Tables I and IV, before any change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Base {
    /// c_g1, c_g2 [rad/s]: steady rate over command.
    pub steady: [f64; 2],
    /// k_V [rad/(s V)].
    pub voltage_gain: f64,
    /// p [rad/s].
    pub pole: f64,
    /// c [N s²/rad²].
    pub thrust: f64,
    /// J [kg m²].
    pub inertia: f64,
    /// [-] at which it hovers, as it was designed.
    pub hover_command: f64,
}

/// Lever arm of a rotor [m], full battery [V], hover rate [rad/s], hover command [-].
pub const ARM: f64 = 0.25;
pub const FULL_BATTERY: f64 = 12.6;
pub const HOVER_RATE: f64 = 617.0;
pub const HOVER_COMMAND: f64 = 0.4633;

impl Base {
    pub const PAPER: Self = Self {
        steady: [447.1, 1124.5],
        voltage_gain: 40.0,
        pole: 16.0,
        thrust: 0.0197 * 0.0197 / (4.0 * 6.0771),
        inertia: 0.032,
        hover_command: HOVER_COMMAND,
    };

    /// Another motor, battery and body than the paper's; arm and propeller were measured on a scale.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        let mut factor = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        let paper = Self::PAPER;
        let own = Self {
            steady: [paper.steady[0] * factor(0.5, 1.4), paper.steady[1] * factor(0.8, 1.3)],
            voltage_gain: paper.voltage_gain * factor(0.5, 1.6),
            pole: paper.pole * factor(0.45, 2.2),
            inertia: paper.inertia * factor(0.6, 1.6),
            ..paper
        };
        Self { hover_command: own.command_for(HOVER_RATE), ..own }
    }

    /// The model file of a bench that has these numbers.
    pub fn model(&self, name: &str) -> String {
        let [quadratic, linear] = self.steady;
        format!(
            "name = \"{name}\"\n\n[actuator]\nsteady_rate = [0.0, {linear}, {quadratic}]\nvoltage_gain = {}\n\
             full_voltage = {FULL_BATTERY}\npole = {}\nthrust_coefficient = {}\nhover_rate = 616.964467\n\n[body]\n\
             inertia = {}\narm = {ARM}\n",
            self.voltage_gain, self.pole, self.thrust, self.inertia
        )
    }

    pub fn steady_rate(&self, command: f64) -> f64 {
        (self.steady[0] * command + self.steady[1]) * command
    }

    /// The command whose steady rate at full battery is `rate`.
    pub fn command_for(&self, rate: f64) -> f64 {
        let [a, b] = self.steady;
        (-b + (b * b + 4.0 * a * rate.max(0.0)).sqrt()) / (2.0 * a)
    }
}

/// Every law of the catalogue at once, each neutral until its field is set.
#[derive(Debug, Clone)]
pub struct Hidden {
    pub battery_scaling: bool,
    /// [rad/(s V)] beside what the base knows.
    pub battery_sag: f64,
    pub transport_delay: f64,
    pub asymmetric_pole: f64,
    pub speed_dependent_pole: f64,
    pub quadratic_rotor_drag: f64,
    pub second_order_lag: f64,
    pub telemetry_lag: f64,
    pub command_dead_zone: f64,
    pub command_saturation: f64,
    pub command_quantization: f64,
    pub slew_rate_limit: f64,
    pub motor_heating: [f64; 2],
    pub static_offset: f64,
    pub static_cubic: f64,
    pub pivot_coulomb_friction: f64,
    pub pivot_viscous_friction: f64,
    pub quadratic_air_drag: f64,
    pub gravity_pendulum: [f64; 2],
    pub torque_bias: f64,
    pub cable_stiffness: f64,
    pub inflow_damping: f64,
    pub actuator_mismatch: f64,
    pub ground_effect: [f64; 2],
    pub rotor_lag: f64,
    pub torque_delay: f64,
    pub gyro_bias: f64,
    pub gyro_scale: f64,
    pub gyro_lag: f64,
    pub outside: Outside,
}

impl Hidden {
    pub fn nothing() -> Self {
        Self {
            battery_scaling: false,
            battery_sag: 0.0,
            transport_delay: 0.0,
            asymmetric_pole: 1.0,
            speed_dependent_pole: 0.0,
            quadratic_rotor_drag: 0.0,
            second_order_lag: f64::INFINITY,
            telemetry_lag: f64::INFINITY,
            command_dead_zone: 0.0,
            command_saturation: f64::INFINITY,
            command_quantization: 0.0,
            slew_rate_limit: f64::INFINITY,
            motor_heating: [0.0, 20.0],
            static_offset: 0.0,
            static_cubic: 0.0,
            pivot_coulomb_friction: 0.0,
            pivot_viscous_friction: 0.0,
            quadratic_air_drag: 0.0,
            gravity_pendulum: [0.0, 0.0],
            torque_bias: 0.0,
            cable_stiffness: 0.0,
            inflow_damping: 0.0,
            actuator_mismatch: 0.0,
            ground_effect: [0.0, 1.0],
            rotor_lag: f64::INFINITY,
            torque_delay: 0.0,
            gyro_bias: 0.0,
            gyro_scale: 1.0,
            gyro_lag: f64::INFINITY,
            outside: Outside::None,
        }
    }
}

/// Laws that no catalogue holds. `Path` adds a signal of time, held over each sample, to the torque [N m]
/// or to the steady rate [rad/s].
#[derive(Debug, Clone)]
pub enum Outside {
    None,
    /// A law with a formula, and its numbers.
    Law(&'static Family, Numbers),
    TorquePath(Vec<f64>),
    RatePath(Vec<f64>),
    /// Torque of teeth: amplitude [N m], teeth per radian.
    Cogging(f64, f64),
    /// Stick-slip with memory (LuGre): level [N m], break-away over level [-], bristle stiffness [N m/rad].
    StickSlip([f64; 3]),
    /// Torque of a hysteretic spring (Bouc-Wen): amplitude [N m], angle to saturate [rad].
    Hysteresis([f64; 2]),
    /// Soft stops: angle [rad], stiffness [N m/rad].
    Stops([f64; 2]),
    /// The rotor rings: natural rate [rad/s], damping [-], share [-].
    Resonance([f64; 3]),
    /// Play in the command path, half width [-].
    Backlash(f64),
    /// Two levels of the steady rate by the command, or of the torque by the angle: half their distance [rad/s, N m], between which
    /// two places the one that holds is where it came from: their middle, and half of what lies between [-, rad].
    Relay([f64; 3]),
    /// The pole falls as the motor warms: share [-], time constant [s].
    WarmPole([f64; 2]),
}

impl Outside {
    /// What a law with a formula adds at `site`; none of any other.
    pub fn at(&self, site: &str, seen: &Seen) -> f64 {
        match self {
            Self::Law(family, numbers) if family.site == site => (family.adds)(numbers, seen),
            _ => 0.0,
        }
    }

    /// The numbers of a law that has a formula, in its family's order; of a play its half width.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        match *self {
            Self::Law(_, numbers) => Some(numbers.to_vec()),
            Self::Cogging(amplitude, teeth) => Some(vec![amplitude, teeth]),
            Self::Stops([angle, stiffness]) => Some(vec![stiffness, angle]),
            Self::Backlash(half_width) => Some(vec![half_width]),
            Self::Relay(numbers) => Some(numbers.to_vec()),
            _ => None,
        }
    }

    /// The same law, this many times as strong.
    pub fn scaled(self, factor: f64) -> Self {
        let all = |path: Vec<f64>| path.into_iter().map(|value| factor * value).collect();
        match self {
            Self::None => Self::None,
            Self::Law(family, [strength, rest @ ..]) => {
                Self::Law(family, [factor * strength, rest[0], rest[1], rest[2]])
            }
            Self::TorquePath(path) => Self::TorquePath(all(path)),
            Self::RatePath(path) => Self::RatePath(all(path)),
            Self::Cogging(amplitude, teeth) => Self::Cogging(factor * amplitude, teeth),
            Self::StickSlip([level, ratio, stiffness]) => Self::StickSlip([factor * level, ratio, stiffness]),
            Self::Hysteresis([amplitude, angle]) => Self::Hysteresis([factor * amplitude, angle]),
            Self::Stops([angle, stiffness]) => Self::Stops([angle, factor * stiffness]),
            Self::Resonance([rate, damping, share]) => Self::Resonance([rate, damping, factor * share]),
            Self::Backlash(width) => Self::Backlash(factor * width),
            Self::Relay([size, middle, half]) => Self::Relay([factor * size, middle, half]),
            Self::WarmPole([share, time]) => Self::WarmPole([factor * share, time]),
        }
    }
}
