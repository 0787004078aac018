//! The body of a log as the checks see it.

use super::rotor_data::RotorLog;
use crate::log::Dataset;

/// A body that is being judged.
pub(crate) struct CheckedBody<'a> {
    /// A log whose channels were judged.
    pub log: &'a Dataset,
    /// [rad/s] rate of the body.
    pub rate: &'a [f64],
    /// The rotors whose commands the log holds.
    pub rotors: Vec<&'a RotorLog>,
}
