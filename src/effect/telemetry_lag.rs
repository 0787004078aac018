//! The speed controller filters the rotor rate that it reports.

use super::lag::pole;
use super::{Card, Law, Site, Symmetry, Term};
use crate::signal::columns::{ANY_COMMAND, ANY_PROPELLER_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "telemetry_lag",
    meaning: "The speed controller filters the rotor rate that it reports.",
    equation: "y' = p_t (ω_p - y)",
    source: "first-order filter in the telemetry of the speed controller",
    site: Site::RotorRateSensor,
    parameters: &[pole("p_t", 1.0, (60.0, &[20.0, 200.0]), "pole of the filter")],
    law: Law::Memory(lag!(propeller_rate, slow: false)),
    needs: &[ANY_COMMAND, ANY_PROPELLER_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: true,
    acts_as: Some(Term::Lag),
    report: [
        "The reported rotor rate lags behind the true one.",
        "The rotor itself is as fast as the model says.",
    ],
    residual: "As a second lag of the rotor, seen from the telemetry; the body, driven by the true rotor, seems to run ahead.",
    confused_with: &["second_order_lag", "transport_delay"],
    experiment: "A body rate or a load cell beside the telemetry: they see the true rotor.",
};
