//! The torque lags behind what was commanded.

use super::lag::pole;
use super::{Card, Law, Site, Symmetry, Term};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "rotor_lag",
    meaning: "The torque lags behind what was commanded.",
    equation: "τ' = p_r (τ_cmd - τ)",
    source: "rotors that the torque command does not wait for",
    site: Site::Torque,
    parameters: &[pole("p_r", 1.0, (50.0, &[15.0, 200.0]), "pole of the lag")],
    law: Law::Memory(lag!(torque, slow: false)),
    needs: &[BODY_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Lag),
    report: [
        "The torque builds up gradually after it was commanded.",
        "The rotors need time to change their speed.",
    ],
    residual: "The error follows the rate of change of the commanded torque.",
    confused_with: &["torque_delay", "gyro_lag"],
    experiment: "Torque steps with fast sampling: a lag starts at once and bends, a delay starts late.",
};
