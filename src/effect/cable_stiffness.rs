//! The cables pull the body back.

use super::{Card, Law, Parameter, Point, Site, Symmetry, Term};
use crate::signal::columns::{BODY_ANGLE, BODY_RATE};

/// The card.
pub(super) static CARD: Card = Card {
    id: "cable_stiffness",
    meaning: "The cables pull the body back.",
    equation: "-k θ",
    source: "torsion of the supply and signal cables",
    site: Site::Torque,
    parameters: &[Parameter {
        name: "stiffness",
        symbol: "k",
        unit: "N m/rad",
        // A cable that pushes on is none: a body whose centre of mass lies above the pivot is a pendulum of negative moment.
        lower: 0.0,
        upper: 50.0,
        start: 0.1,
        others: &[],
        neutral: 0.0,
        meaning: "torque per angle",
    }],
    law: Law::Static(add),
    needs: &[BODY_RATE, BODY_ANGLE],
    symmetry: Symmetry::OddInBodyMotion,
    needs_both_directions: false,
    needs_transients: false,
    acts_as: Some(Term::Stiffness),
    report: [
        "Cables pull the body back in proportion to its angle.",
        "They act like a weak spring about the axis.",
    ],
    residual: "An unknown torque in proportion to the body angle.",
    confused_with: &["gravity_pendulum"],
    experiment: "Large angles: a cable keeps to a straight line, a pendulum bends away from it.",
};

fn add(parameters: &[f64], point: &Point) -> f64 {
    let [stiffness] = *parameters else { return 0.0 };
    -stiffness * point.body_angle
}
