//! The gyroscope is filtered.

use super::lag::pole;
use super::{Card, Law, Site, Symmetry, Term};
use crate::signal::columns::BODY_RATE;

/// The card.
pub(super) static CARD: Card = Card {
    id: "gyro_lag",
    meaning: "The gyroscope is filtered.",
    equation: "y' = p_g (ω_b - y)",
    source: "low-pass in the sensor",
    site: Site::BodyRateSensor,
    parameters: &[pole("p_g", 2.0, (60.0, &[20.0, 200.0]), "pole of the filter")],
    law: Law::Memory(lag!(body_rate, slow: false)),
    needs: &[BODY_RATE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Lag),
    report: [
        "The gyroscope follows the true rate with a lag.",
        "The low-pass in the sensor is slower than the model assumes.",
    ],
    residual: "An error in proportion to the body's acceleration.",
    confused_with: &["rotor_lag", "torque_delay"],
    experiment: "An encoder beside the gyroscope: its slope does not lag.",
};
