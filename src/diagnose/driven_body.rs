//! A body under what drives it: how well it is explained, and which of two is explained better.

use super::candidate_fit::CandidateFit;
use super::model_selection::same_set;
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;

/// A set of the rotors' that drives the body, and what is found in that.
pub(super) struct TriedDriver {
    pub selected: CandidateFit,
    /// Of the base's numbers.
    pub changed: Vec<String>,
    pub body: SearchResult,
    /// What is missing or changed in both.
    pub size: usize,
}

impl TriedDriver {
    fn is_explained(&self) -> bool {
        is_explained(&self.body, &self.body.answer)
    }

    /// Squared error of the body over the noise.
    fn left(&self, floors: &[f64; 2]) -> f64 {
        misfit(&self.body, &self.body.answer, floors)
    }

    /// Sets of the rotors that stand for this one as well: the body misses the same with them, and is left as little. Not the numbers of
    /// the base alone.
    pub fn as_good(&self, others: Vec<Self>, floors: &[f64; 2]) -> impl Iterator<Item = CandidateFit> {
        let limit = (1.0 + THRESHOLDS.decides_between_drivers) * self.left(floors);
        let is_as_good = move |other: &Self| {
            same_set(&other.body.answer.effects, &self.body.answer.effects)
                && other.left(floors) <= limit
                && !other.selected.effects.is_empty()
        };
        others.into_iter().filter(is_as_good).map(|other| other.selected)
    }
}

/// First those that explain the body, among them that with least missing in all; of as many, and of those that do not explain it, that
/// which leaves least. A rotor that answers late may be taken for one that is read late, and then the torque is late, too. What leaves no
/// number is out.
pub(super) fn sort_by_what_is_missing(drivers: &mut Vec<TriedDriver>, floors: &[f64; 2]) {
    drivers.retain(|driver| driver.left(floors).is_finite());
    let rank = |it: &TriedDriver| (!it.is_explained(), if it.is_explained() { it.size } else { 0 });
    drivers.sort_by(|a, b| rank(a).cmp(&rank(b)).then(a.left(floors).total_cmp(&b.left(floors))));
}

/// Whether a fit leaves nothing but noise, on the data fitted on as on those held out.
pub(super) fn is_explained(found: &SearchResult, fitted: &CandidateFit) -> bool {
    let limit = found.at_floor();
    let training =
        |channel: usize| fitted.channel_error(&found.split, channel, false) / found.floors[channel];
    found.over_floor(fitted).0 <= limit
        && (0..found.split.train.channels().len()).all(|channel| training(channel) <= limit)
}

/// Squared error of a fit, fitted and held out, over the noise.
pub(super) fn misfit(found: &SearchResult, fitted: &CandidateFit, floors: &[f64; 2]) -> f64 {
    let share = |channel: usize, held_out| {
        (fitted.channel_error(&found.split, channel, held_out) / floors[channel]).powi(2)
    };
    (0..found.split.train.channels().len()).map(|channel| share(channel, false) + share(channel, true)).sum()
}

/// Whether the body that another set drives is better explained; `sizes` count what each of the two asks for.
pub(super) fn is_better(body: &SearchResult, driven: &SearchResult, sizes: (usize, usize)) -> bool {
    let explained = (is_explained(body, &body.answer), is_explained(driven, &driven.answer));
    match explained {
        (true, false) => false,
        (false, true) => true,
        // As many for the one as for the other: the rotors' own sensors speak for the other, too.
        (true, true) => sizes.1 <= sizes.0,
        _ => {
            misfit(driven, &driven.answer, &body.floors)
                < (1.0 - THRESHOLDS.driver_gain) * misfit(body, &body.answer, &body.floors)
        }
    }
}

/// Whether the first body is the simpler explanation; `None` where both are as good.
pub(super) fn prefers(one: &SearchResult, other: &SearchResult) -> Option<bool> {
    let at_floor = |found: &SearchResult| found.over_floor(&found.answer).0 <= found.at_floor();
    if at_floor(one) != at_floor(other) {
        return Some(at_floor(one));
    }
    let size = |found: &SearchResult| found.answer.effects.len() + found.changed.len();
    if size(one) != size(other) {
        return Some(size(one) < size(other));
    }
    let channels = 0..one.split.train.channels().len();
    let score = |found: &SearchResult| {
        let share = |channel: usize| {
            (found.answer.channel_error(&found.split, channel, true) / one.floors[channel]).powi(2)
        };
        channels.clone().map(share).sum::<f64>()
    };
    let (a, b) = (score(one), score(other));
    ((a - b).abs() > THRESHOLDS.decides_between_drivers * a.min(b)).then_some(a < b)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;

    /// A driver with `ids` in the rotors, `body` in the body, and an error of so many times the noise left.
    fn driver(ids: &[&str], body: &[&str], left: f64) -> TriedDriver {
        let slow = |row: usize| (left * left - 1.0).sqrt() * noise(ROWS + row / 100);
        let set = |ids: &[&str]| {
            let residuals = (0..ROWS).map(|row| noise(row) + slow(row)).collect();
            CandidateFit { effects: ids.iter().map(|id| (*id).to_owned()).collect(), ..leaves(residuals) }
        };
        let mut found = SearchResult::of_one(split(), [set(&[]), set(&[]), set(body)], Vec::new());
        found.floors = [1.0; 2];
        TriedDriver { selected: set(ids), changed: Vec::new(), body: found, size: ids.len() + body.len() }
    }

    #[test]
    fn the_driver_with_least_missing_in_all_comes_first() {
        let read_late = || driver(&["telemetry_lag"], &["pivot_viscous_friction", "torque_delay"], 1.0);
        let late = |id: &str, left: f64| driver(&[id], &["pivot_viscous_friction"], left);
        let (far, ran_away) = (driver(&["slew_rate_limit"], &[], 3.0), driver(&[], &[], f64::NAN));
        let mut drivers = vec![
            ran_away,
            far,
            read_late(),
            late("second_order_lag", 1.03),
            late("transport_delay", 1.01),
            driver(&[], &["pivot_viscous_friction", "rotor_lag"], 1.05),
            late("asymmetric_pole", 1.08),
        ];
        sort_by_what_is_missing(&mut drivers, &[1.0; 2]);
        let order: Vec<String> = drivers.iter().map(|it| it.selected.effects.concat()).collect();
        let expected = [
            "transport_delay",
            "second_order_lag",
            "",
            "asymmetric_pole",
            "telemetry_lag",
            "slew_rate_limit",
        ];
        assert_eq!(order, expected);
        let least = drivers.remove(0);
        // Of the square four and fourteen percent more.
        let others: Vec<Vec<String>> = least.as_good(drivers, &[1.0; 2]).map(|it| it.effects).collect();
        assert_eq!(
            others,
            [["second_order_lag"]],
            "with the others the body misses something else, or more is left"
        );
    }
}
