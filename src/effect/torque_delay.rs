//! The torque comes late.

use super::{Card, Law, Parameter, Site, Symmetry, Term};

/// The card.
pub(super) static CARD: Card = Card {
    id: "torque_delay",
    meaning: "The torque comes late.",
    equation: "τ_cmd(t - T)",
    source: "link and processing time",
    site: Site::Torque,
    parameters: &[Parameter {
        name: "delay",
        symbol: "T",
        unit: "s",
        lower: 0.0,
        upper: 0.3,
        start: 0.01,
        others: &[0.03, 0.08],
        neutral: 0.0,
        meaning: "how late",
    }],
    law: Law::Delay(delay),
    needs: &["body_rate_rad_s"],
    symmetry: Symmetry::None,
    acts_as: Some(Term::DeadTime),
    report: [
        "The torque acts a fixed time after it was commanded.",
        "The body repeats exactly what the model says, only later.",
    ],
    residual: "The error follows the rate of change of the commanded torque.",
    confused_with: &["rotor_lag", "gyro_lag"],
    experiment: "Torque steps with fast sampling: a delay starts late, a lag starts at once and bends.",
};

fn delay(parameters: &[f64]) -> f64 {
    parameters.first().copied().unwrap_or(0.0)
}
