//! The rotor follows with two poles, not one.

use super::lag::pole;
use super::{Card, Law, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "second_order_lag",
    meaning: "The rotor follows with two poles, not one.",
    equation: "z2' = p_2 (z - z2), ω_p' = p (z2 - ω_p)",
    source: "electrical or controller lag ahead of the mechanical one",
    site: Site::SteadyRate,
    parameters: &[pole("p_2", 1.0, (60.0, &[20.0, 200.0]), "the second pole")],
    law: Law::Memory(lag!(steady_rate, slow: true)),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: Some(Term::Lag),
    report: [
        "The rotor does not start at full acceleration after a step; something ahead of it lags.",
        "A second, faster lag sits between the command and the rotor.",
    ],
    residual: "Spikes right after each change of the command that bend the start of the step response.",
    confused_with: &["telemetry_lag", "transport_delay"],
    experiment: "Steps with fast sampling for the delay; a body rate driven by the rotors for the telemetry: it sees the true rotor, not the telemetry.",
};
