//! Rates that are those of another unit, by what the template's rotor does at the same commands.

use crate::model::Model;
use crate::screening::Finding;
use crate::screening::plausibility::{ANOTHER, UNITS, is_another, nearest};
use crate::screening::rotor_data::{RotorLog, bounds};

/// Rates that are many times the template's, or few of it, and the unit that would say so.
pub(crate) fn check(rotor: &RotorLog, template: &Model) -> Option<Finding> {
    let ratio = rotor.rate_ratio(template).filter(|ratio| is_another(ratio, ANOTHER))?;
    let (least, most) = bounds(&rotor.rate);
    let finding = rotor.finding("rate_unlike_template").with("least", least).with("greatest", most);
    Some(finding.with("ratio", ratio).with("unit", nearest(&UNITS, ratio).unwrap_or_default()))
}
