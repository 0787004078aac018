//! Why a controller cannot be built, and the checks of its numbers.

/// Why a controller cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ControlError {
    /// A number that no controller can be built on.
    #[error("{name} is {}: it {rule}", crate::unit::short(*value))]
    Parameter {
        /// Name of the parameter in the file.
        name: &'static str,
        /// Value found, in SI.
        value: f64,
        /// What it has to be.
        rule: &'static str,
    },
    /// A static curve without an inverse.
    #[error(
        "g(u), the static curve of its rotors, falls between u = {from:.3} and {to:.3}, and a controller inverts only one that \
         rises from 0 to 1: `identify --degree {degree}` makes a model of a simpler curve"
    )]
    Falls {
        /// [-] command from which it falls.
        from: f64,
        /// [-] command up to which it falls.
        to: f64,
        /// Degree of a curve that bends less.
        degree: usize,
    },
    /// A move of the reference that cannot be made.
    #[error(
        "reference move {index} at {at_s} s must consist of numbers, last at least 0 s and begin at or after {free_from_s} s"
    )]
    Move {
        /// Position in the list, from 0.
        index: usize,
        /// [s] when it should begin.
        at_s: f64,
        /// [s] when the move before it ends.
        free_from_s: f64,
    },
    /// Margins that no PID has on this plant.
    #[error(
        "no PID has a phase margin of {phase_margin_deg:.0}° and a gain margin of {gain_margin:.2} on this plant"
    )]
    Unreachable {
        /// [°] asked for.
        phase_margin_deg: f64,
        /// [-] asked for.
        gain_margin: f64,
    },
    /// A design with an eigenvalue on or outside the unit circle.
    #[error(
        "the {what} is unstable: eigenvalue {real:.4}{imaginary:+.4}i has modulus {modulus:.4}, not below 1"
    )]
    Unstable {
        /// Which matrix.
        what: &'static str,
        /// Real part of the worst eigenvalue.
        real: f64,
        /// Imaginary part.
        imaginary: f64,
        /// Its modulus.
        modulus: f64,
    },
}

/// Refuses a period that is not a positive number of seconds.
pub(crate) fn check_period(period_s: f64) -> Result<(), ControlError> {
    let holds = period_s.is_finite() && period_s > 0.0;
    require(holds, "period_s", period_s, "must be a positive number of seconds")
}

/// Refuses the parameter `name` unless what its rule says holds.
pub(crate) fn require(
    holds: bool,
    name: &'static str,
    value: f64,
    rule: &'static str,
) -> Result<(), ControlError> {
    if holds { Ok(()) } else { Err(ControlError::Parameter { name, value, rule }) }
}

pub(crate) fn require_finite(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite(), name, value, "must be a number")
}

pub(crate) fn require_positive(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite() && value > 0.0, name, value, "must be a positive number")
}

pub(crate) fn require_not_negative(name: &'static str, value: f64) -> Result<(), ControlError> {
    require(value.is_finite() && value >= 0.0, name, value, "must be zero or a positive number")
}
