//! Rates that are those of another unit, by what the model's rotor does at the same commands.

use crate::estimation::quantile::quantiles;
use crate::model::Model;
use crate::screening::Finding;
use crate::screening::plausibility::{LEAST_HELD, UNITS, is_another, nearest};
use crate::screening::rotor_data::{RotorLog, bounds};
use crate::screening::suspicion::{Stops, Suspicion};
use crate::screening::thresholds::THRESHOLDS;

/// Rates that are many times the model's, or few of it: in a unit, where it is one factor and near that unit's. Who makes a
/// model of the rotor is not stopped by it: a slow rotor turns as often in a second as the paper's does in a sixth.
pub(crate) fn check(rotor: &RotorLog, model: &Model) -> Option<Suspicion> {
    let [low, ratio, high] = quartiles(rotor, model);
    // What a dead zone takes away is no factor, and neither is the noise of a rotor that stands.
    let is_factor = |spread: f64| low > 0.0 && high <= spread * low;
    if !is_another(&ratio, THRESHOLDS.another_rate_unit) || !is_factor(THRESHOLDS.unlike_ratio_spread) {
        return None;
    }
    let (least, most) = bounds(&rotor.rate);
    let is_near = |unit: &&(&str, f64)| !is_another(&(ratio / unit.1), THRESHOLDS.unit_factor);
    let unit = UNITS.iter().find(is_near).filter(|_| is_factor(THRESHOLDS.unit_ratio_spread));
    let with = |finding: Finding, unit: &str| {
        finding.with("least", least).with("greatest", most).with("ratio", ratio).with("unit", unit)
    };
    Some(match unit {
        Some((unit, _)) => {
            Suspicion { finding: with(rotor.finding("rate_in_other_unit"), unit), stops: Stops::Searches }
        }
        None => {
            let unit = nearest(&UNITS, ratio).unwrap_or_default();
            Suspicion::said(with(rotor.finding("rate_unlike_template"), unit))
        }
    })
}

/// Quartiles of how many times the model's rates the measured ones are, where the model's are a fair share of its greatest.
fn quartiles(rotor: &RotorLog, model: &Model) -> [f64; 3] {
    let rows = || rotor.stretches.iter().cloned().flatten().filter(|row| rotor.command[*row] >= LEAST_HELD);
    let expected = || rows().map(|row| (row, model.steady_rate(rotor.command[row])));
    let fair = THRESHOLDS.fair_rate_share * expected().map(|(_, rate)| rate).fold(0.0, f64::max);
    let is_fair = |(_, rate): &(usize, f64)| fair > 0.0 && *rate >= fair;
    let ratios = expected().filter(is_fair).map(|(row, rate)| rotor.rate[row].abs() / rate);
    quantiles(ratios, [0.25, 0.5, 0.75]).unwrap_or_default()
}
