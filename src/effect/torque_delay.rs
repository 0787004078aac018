//! The torque comes late.

use super::{Card, Law, Site, Symmetry, Term, dead_time};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "torque_delay",
    meaning: "The torque comes late.",
    equation: "τ_cmd(t - T)",
    source: "link and processing time",
    site: Site::Torque,
    parameters: &[dead_time::parameter("T", &[0.03, 0.08])],
    law: Law::Delay(dead_time::of),
    needs: &[BODY_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::DeadTime),
    report: [
        "The torque acts a fixed time after it was commanded.",
        "The body repeats exactly what the model says, only later.",
    ],
    residual: "The error follows the rate of change of the commanded torque.",
    confused_with: &["rotor_lag", "gyro_lag"],
    experiment: "Torque steps with fast sampling: a delay starts late, a lag starts at once and bends.",
};
