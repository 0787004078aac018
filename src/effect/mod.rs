//! Physical effects: what the base model can lack. An effect is one file: a card and its law.
//!
//! The same law serves simulation, fitting and ranking. Every law answers what it *adds* to the quantity of
//! its site, so that effects of one site add up and an effect that is not there adds nothing.
//!
//! Not in the catalogue, and yet in a model: an expression of one's own, `examples/own_effect.rs`.

#[macro_use]
mod lag;
mod card;
mod dead_time;
mod expression;
mod functions;
mod law;
mod program;
pub mod signals;
mod site;
mod syntax;
pub mod thresholds;

pub use card::{Card, Parameter, Symmetry, Term};
pub use expression::{Expression, ExpressionError};
use functions::response_after;
pub use functions::step_response;
pub(crate) use functions::{RowResponse, SAME_SPAN, sin, tanh};
use law::constant;
pub use law::{Law, Memory, StateLaw, StaticLaw};
pub use site::{Point, Site};

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

/// The card of the effect that is this term at this site.
#[must_use]
pub fn acting_as(site: Site, term: Term) -> Option<&'static Card> {
    CATALOGUE.iter().copied().find(|card| card.site == site && card.acts_as == Some(term))
}
