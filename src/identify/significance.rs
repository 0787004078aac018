//! What the logs hardly show is not put into the model: the template's number is kept, and it is said.

use super::Estimate;
use super::thresholds::THRESHOLDS;
use crate::screening::Finding;

/// Whether a number that was fitted is one.
pub(crate) fn is_significant(estimate: &Estimate) -> bool {
    estimate.standard_error <= THRESHOLDS.insignificant_share * estimate.value.abs()
}

/// `finding` with a number and its error.
pub(crate) fn with_estimate(finding: Finding, estimate: &Estimate) -> Finding {
    finding.with("value", estimate.value).with("error", estimate.standard_error)
}

/// Why a pole that was fitted is none.
pub(crate) fn no_pole(pole: &Estimate) -> Option<Finding> {
    (!is_significant(pole)).then(|| with_estimate(Finding::new("pole_not_significant", "pole"), pole))
}

/// Why a k_V that was fitted is none. A battery that gives way never makes a rotor faster.
pub(crate) fn no_gain(gain: &Estimate) -> Option<Finding> {
    (!is_significant(gain) || gain.value < 0.0)
        .then(|| with_estimate(Finding::new("voltage_gain_not_significant", "voltage_gain"), gain))
}

/// Whether a k_V that hardly shows is plainly not the template's: it is next to nothing, then, and known to be.
pub(crate) fn is_none(gain: &Estimate, template: f64) -> bool {
    !is_significant(gain) && gain.distance(template) > THRESHOLDS.against_template_errors
}

/// Why a J that was fitted is none.
pub(crate) fn no_inertia(inertia: &Estimate) -> Option<Finding> {
    (!is_significant(inertia))
        .then(|| with_estimate(Finding::new("inertia_not_significant", "inertia"), inertia))
}
