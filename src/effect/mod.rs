//! Physical effects: what the base model can lack. An effect is one file: a card and its law.
//!
//! The same law serves simulation, fitting and ranking. Every law answers what it *adds* to the quantity of
//! its site, so that effects of one site add up and an effect that is not there adds nothing.

#[macro_use]
mod lag;
mod expression;
mod program;
mod syntax;

pub use expression::{Expression, ExpressionError};

macro_rules! catalogue {
    ($($effect:ident),* $(,)?) => {
        $(mod $effect;)*

        /// Every effect the house knows, rotors first.
        pub static CATALOGUE: &[&Card] = &[$(&$effect::CARD),*];
    };
}

// Adding an effect is one file, and one line here.
catalogue![
    battery_sag,
    battery_scaling,
    transport_delay,
    asymmetric_pole,
    speed_dependent_pole,
    quadratic_rotor_drag,
    second_order_lag,
    telemetry_lag,
    command_dead_zone,
    command_saturation,
    command_quantization,
    slew_rate_limit,
    motor_heating,
    static_offset,
    static_cubic,
    pivot_coulomb_friction,
    pivot_viscous_friction,
    quadratic_air_drag,
    gravity_pendulum,
    torque_bias,
    cable_stiffness,
    inflow_damping,
    actuator_mismatch,
    ground_effect,
    rotor_lag,
    torque_delay,
    gyro_bias,
    gyro_scale,
    gyro_lag,
];

/// The card with this id.
#[must_use]
pub fn find(id: &str) -> Option<&'static Card> {
    CATALOGUE.iter().copied().find(|card| card.id == id)
}

/// Where an effect acts: the quantity its law adds to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Site {
    /// [-] the command before the static curve.
    Command,
    /// [rad/s] the steady rate z after the static curve.
    SteadyRate,
    /// [rad/s²] the rotor's acceleration.
    RotorAcceleration,
    /// [rad/s] the measured rotor rate.
    RotorRateSensor,
    /// [N] the thrust of each rotor.
    Thrust,
    /// [N m] the torque on the body.
    Torque,
    /// [rad/s] the measured body rate.
    BodyRateSensor,
}

impl Site {
    /// Whether it acts in the rotors, before thrust; else in the body.
    #[must_use]
    pub fn is_rotor(self) -> bool {
        matches!(self, Self::Command | Self::SteadyRate | Self::RotorAcceleration | Self::RotorRateSensor)
    }

    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Command => "command",
            Self::SteadyRate => "steady_rate",
            Self::RotorAcceleration => "rotor_acceleration",
            Self::RotorRateSensor => "rotor_rate_sensor",
            Self::Thrust => "thrust",
            Self::Torque => "torque",
            Self::BodyRateSensor => "body_rate_sensor",
        }
    }
}

impl Site {
    /// The signals that an expression there may look at, by name without unit: those that are known wherever the site's law is
    /// worked out, in `diagnose`, in `compare` and in the emulator.
    #[must_use]
    pub fn signals(self) -> &'static [&'static str] {
        match self {
            Self::Command => &["time", "command", "battery_voltage", "full_voltage", "hover_rate", "side"],
            Self::SteadyRate | Self::RotorAcceleration | Self::RotorRateSensor => &[
                "time",
                "command",
                "battery_voltage",
                "full_voltage",
                "steady_rate",
                "propeller_rate",
                "hover_rate",
                "side",
            ],
            Self::Thrust => {
                &["thrust", "propeller_rate", "hover_rate", "body_angle", "body_rate", "full_voltage", "side"]
            }
            Self::Torque => &[
                "time",
                "torque",
                "propeller_rate_1",
                "propeller_rate_2",
                "hover_rate",
                "body_angle",
                "body_rate",
                "full_voltage",
            ],
            Self::BodyRateSensor => &["time", "body_angle", "body_rate", "hover_rate", "full_voltage"],
        }
    }
}

/// What a law may look at, at one instant. Rotor laws see one rotor; `side` tells which.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// [s] time as the log counts it.
    pub time: f64,
    /// [-] u, the rotor's command as it is after the laws before.
    pub command: f64,
    /// [V] v_b.
    pub battery_voltage: f64,
    /// [V] v_bmax.
    pub full_voltage: f64,
    /// [rad/s] z, the steady rate as it is after the laws before.
    pub steady_rate: f64,
    /// [rad/s] ω_p, the rotor's rate.
    pub propeller_rate: f64,
    /// [1/s] p, the rotor's pole.
    pub pole: f64,
    /// [rad/s] ω_0, the rotor's rate in hover.
    pub hover_rate: f64,
    /// [-] u_0, the command that holds hover at full battery.
    pub hover_command: f64,
    /// +1 for rotor 1, -1 for rotor 2. See the drawing in the crate's page.
    pub side: f64,
    /// [m] d, the lever arm.
    pub arm: f64,
    /// [N s²/rad²] c in f = c ω_p².
    pub thrust_coefficient: f64,
    /// [N] the rotor's thrust as it is after the laws before.
    pub thrust: f64,
    /// [rad/s] rate of rotor 1.
    pub propeller_rate_1: f64,
    /// [rad/s] rate of rotor 2.
    pub propeller_rate_2: f64,
    /// [N m] torque of the actuators on the body, as it is after the laws before.
    pub torque: f64,
    /// [rad] θ.
    pub body_angle: f64,
    /// [rad/s] ω_b.
    pub body_rate: f64,
}

/// A law without memory: parameters and point in, what it adds to its site out.
pub type StaticLaw = fn(&[f64], &Point) -> f64;

/// A law with one state of its own.
#[derive(Debug, Clone, Copy)]
pub struct Memory {
    /// The state that has settled at a point.
    pub settle: fn(&[f64], &Point) -> f64,
    /// The state a span [s] later, the point held.
    pub advance: fn(&[f64], f64, &Point, f64) -> f64,
    /// What it adds to its site.
    pub add: fn(&[f64], f64, &Point) -> f64,
    /// [1/s] the fastest rate a simulation has to resolve.
    pub rate: fn(&[f64]) -> f64,
    /// Whether the state at a log's start is unknown and matters, so that a fit must find it.
    pub slow: bool,
}

/// How an effect acts.
#[derive(Debug, Clone)]
pub enum Law {
    /// Holds the quantity of its site back by the time [s] it answers.
    Delay(fn(&[f64]) -> f64),
    /// Without memory.
    Static(StaticLaw),
    /// Without memory, and one that turns round within a few milliseconds, as friction does where a body comes to rest.
    Sharp(StaticLaw),
    /// Without memory, and in jumps over its one parameter: a fit must look at every value.
    Stairs(StaticLaw),
    /// With one state.
    Memory(Memory),
    /// A user's expression, without memory.
    Expression(std::sync::Arc<Expression>),
}

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameter {
    /// Name in files.
    pub name: &'static str,
    /// Symbol in the equation.
    pub symbol: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Smallest value a fit may take, in the unit.
    pub lower: f64,
    /// Largest value a fit may take.
    pub upper: f64,
    /// Where a fit starts.
    pub start: f64,
    /// Further values a fit tries before it settles, because the error may have several valleys.
    pub others: &'static [f64],
    /// The value at which the effect is not there, whatever the other parameters; not-a-number = none.
    pub neutral: f64,
    /// What it is.
    pub meaning: &'static str,
}

/// A symmetry of the law, which a test holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symmetry {
    /// None claimed.
    None,
    /// Turning (θ, ω_b) about the origin turns the sign of what it adds.
    OddInBodyMotion,
    /// Odd in the body's motion, and it never feeds energy in.
    Dissipative,
}

/// What people read about an effect, and its law.
#[derive(Debug)]
pub struct Card {
    /// Name in files.
    pub id: &'static str,
    /// One line.
    pub meaning: &'static str,
    /// The law, in the paper's symbols.
    pub equation: &'static str,
    /// Where the law is from.
    pub source: &'static str,
    /// Where it acts.
    pub site: Site,
    /// Its parameters, in the order the law takes them.
    pub parameters: &'static [Parameter],
    /// How it acts.
    pub law: Law,
    /// Log columns it cannot be judged without (`*` stands for the rotor).
    pub needs: &'static [&'static str],
    /// A symmetry of the law.
    pub symmetry: Symmetry,
    /// Two plain sentences for the report.
    pub report: [&'static str; 2],
    /// How it shows in the residual.
    pub residual: &'static str,
    /// Ids of what it is confused with.
    pub confused_with: &'static [&'static str],
    /// Which experiment excites it, or tells it from its twins.
    pub experiment: &'static str,
}

/// A span of first-order following: the share of the way that is gone after `span` seconds at `rate` [1/s].
#[must_use]
pub fn followed(rate: f64, span: f64) -> f64 {
    let whole = rate * span;
    if whole.abs() < 0.5 {
        let tangent = small_tanh(0.5 * whole);
        return 2.0 * tangent / (1.0 + tangent);
    }
    // An infinite rate follows at once.
    1.0 - (-whole).exp()
}

/// The hyperbolic tangent, to the last digits but one. A fit asks for it, and for [`followed`], a hundred million times, and
/// the library's takes three times as long.
#[must_use]
pub(crate) fn tanh(value: f64) -> f64 {
    match value.abs() {
        small if small < 0.25 => small_tanh(value),
        // One to the last digit, as of most friction.
        large if large > 20.0 => value.signum(),
        _ => 1.0 - 2.0 / ((2.0 * value).exp() + 1.0),
    }
}

/// The sine, to the last digit. Most benches turn by less than an eighth of a circle, where a series does: asked for as often,
/// and the library's takes three times as long.
#[must_use]
pub(crate) fn sin(angle: f64) -> f64 {
    if angle.abs() > std::f64::consts::FRAC_PI_4 {
        return angle.sin();
    }
    let square = angle * angle;
    // 1/3!, 1/5! and so on: what follows is below 1e-17 of it.
    const TERMS: [f64; 8] = [
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
        1.0 / 355_687_428_096_000.0,
    ];
    angle + angle * square * TERMS.iter().rev().fold(0.0, |sum, term| sum * square + term)
}

/// Up to a quarter: there the sixth convergent of Lambert's continued fraction is right to the last digit.
fn small_tanh(value: f64) -> f64 {
    let square = value * value;
    value * (10_395.0 + square * (1260.0 + 21.0 * square))
        / (10_395.0 + square * (4725.0 + square * (210.0 + square)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the library's own, on both sides of where they change over.
    #[test]
    fn the_quick_functions_are_the_functions() {
        let near = |ours: f64, theirs: f64| (ours - theirs).abs() <= 2e-15 * theirs.abs();
        for step in -40_000..=40_000 {
            let value = 1e-3 * f64::from(step);
            assert!(near(tanh(value), value.tanh()), "tanh {value}");
            assert!(near(sin(value), value.sin()), "sin {value}");
            assert!(near(followed(value.abs(), 0.1), -(-0.1 * value.abs()).exp_m1()), "{value}");
        }
        assert_eq!((followed(f64::INFINITY, 1.0), tanh(f64::INFINITY), tanh(-1e3)), (1.0, 1.0, -1.0));
        assert!(tanh(f64::NAN).is_nan() && followed(f64::NAN, 1.0).is_nan());
    }
}
