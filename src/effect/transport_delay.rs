//! The command reaches the motor late.

use super::{Card, Law, Site, Symmetry, Term, dead_time};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "transport_delay",
    meaning: "The command reaches the motor late.",
    equation: "u(t - τ)",
    source: "pure delay of link and speed controller",
    site: Site::Command,
    parameters: &[dead_time::parameter("τ", &[0.03, 0.06, 0.12])],
    law: Law::Delay(dead_time::of),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: Some(Term::DeadTime),
    report: [
        "Every command takes effect a fixed time after it was sent.",
        "The rotor repeats exactly what the model says, only later.",
    ],
    residual: "Spikes right after each change of the command, in the direction of the old value, the same up and down.",
    confused_with: &["second_order_lag", "telemetry_lag"],
    experiment: "Small and large steps (0.05 and 0.3 of the command), sampled ten times or more within the delay: it leaves the \
                 rotor untouched at first, whatever the size; a lag bends the start, a limit slows only the large ones.",
};
