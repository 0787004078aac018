//! The card of an effect: what people read about it, and what the other rooms must know of it.

use super::{Law, Site};

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
    /// Further starts of a fit, because the error may have several minima.
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

/// A term of the equations of motion as every textbook has it, with its parameters in the order of the card. Of two effects
/// that are the same term, each acts at a site of its own.
///
/// Whoever solves the equations some other way than by running the laws goes by it: a controller that cancels a term, a
/// linear loop, a fit of rotors alone, and a search that must not add what the model has already. A test holds every card to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// x(t - τ).
    DeadTime,
    /// y' = p (x - y), y in place of x.
    Lag,
    /// y that follows x by at most so much a second, in place of x.
    SlewLimit,
    /// A constant, whatever else.
    Constant,
    /// -k (v_bmax - v_b) in the steady rate: the paper's own k_V.
    VoltageDrop,
    /// u v_b / v_bmax in place of u.
    VoltageScaling,
    /// max(0, u - u_d) / (1 - u_d) in place of u.
    DeadZone,
    /// min(u, u_max) in place of u.
    Saturation,
    /// c_3 (u - u_0)³, about the command that holds hover.
    Cubic,
    /// -τ_c tanh(ω_b / ω_s).
    CoulombFriction,
    /// -b ω_b.
    ViscousFriction,
    /// -c ω_b |ω_b|.
    QuadraticDrag,
    /// -m sin(θ + θ_0).
    Pendulum,
    /// -k θ.
    Stiffness,
    /// -k c ω_p v of the thrust of a rotor that moves at v = ±d ω_b.
    AxialDamping,
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
    /// Whether it is a difference between speeding up and slowing down: data that show one of the two say nothing of it.
    pub needs_both_directions: bool,
    /// Whether only a rotor on its way to a new rate shows it: in rows at rest its effect is none, or another g(u)'s.
    pub needs_transients: bool,
    /// The term of the equations that it is, for those who know the term but not the effect.
    pub acts_as: Option<Term>,
    /// Two plain sentences for the report.
    pub report: [&'static str; 2],
    /// How it shows in the residual.
    pub residual: &'static str,
    /// Ids of what it is confused with.
    pub confused_with: &'static [&'static str],
    /// Which experiment excites it, or tells it from what it is confused with.
    pub experiment: &'static str,
}
