//! The centre of mass is not on the axis.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term, sin};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "gravity_pendulum",
    meaning: "The centre of mass is not on the axis.",
    equation: "-m sin(θ + θ_0)",
    source: "weight times lever arm of the centre of mass",
    site: Site::Torque,
    parameters: &[
        Parameter {
            name: "moment",
            symbol: "m",
            unit: "N m",
            lower: -20.0,
            upper: 20.0,
            start: 0.1,
            others: &[-0.1],
            neutral: 0.0,
            meaning: "weight times distance from the axis",
        },
        Parameter {
            name: "angle_offset",
            symbol: "θ_0",
            unit: "rad",
            lower: -1.2,
            upper: 1.2,
            start: 0.0,
            others: &[],
            neutral: f64::NAN,
            meaning: "where the centre of mass hangs",
        },
    ],
    law: Law::Static(add),
    needs: &[BODY_RATE, BODY_ANGLE],
    symmetry: Symmetry::None,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Pendulum),
    report: [
        "The centre of mass is off the axis, so that gravity pulls the body towards an angle of its own.",
        "The pull grows with the angle, less and less towards the horizontal.",
    ],
    residual: "An unknown torque that depends on the body angle, and not on the rate.",
    confused_with: &["cable_stiffness", "torque_bias"],
    experiment: "Large angles: a pendulum bends away from a straight line, a cable does not.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [moment, angle_offset] = *parameters else { return 0.0 };
    -moment * sin(point.body_angle + angle_offset)
}
