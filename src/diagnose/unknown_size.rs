//! Effects whose size these logs do not tell: by its standard error it could be none. Where the base leaves nothing but noise, such an
//! effect explains nothing that anybody could see, and is not named.

use super::not_named::{NotNamed, Unmet};
use super::search_result::SearchResult;
use super::thresholds::THRESHOLDS;
use crate::effect::{Parameter, find};
use crate::model::Model;

/// A number of an effect as it was found.
pub(crate) struct Size {
    /// In its unit.
    pub(crate) value: f64,
    /// In its unit.
    pub(crate) standard_error: f64,
    /// Whether it is told from that of no effect.
    pub(crate) is_known: bool,
}

/// A number of effect `id`; `None` where it has no standard error.
pub(crate) fn size(model: &Model, id: &str, parameter: &Parameter) -> Option<Size> {
    let name = format!("{id}.{}", parameter.name);
    let value = model.parameter(&name)?;
    let standard_error = *model.standard_errors.get(&name).filter(|error| error.is_finite())?;
    // An angle may well be zero, and is known by its error all the same.
    let is_size = parameter.neutral.is_finite() || parameter.lower > 0.0;
    let none = if parameter.neutral.is_finite() { parameter.neutral } else { 0.0 };
    let is_known = !is_size || (value - none).abs() > THRESHOLDS.identifiable * standard_error;
    Some(Size { value, standard_error, is_known })
}

/// Whether effect `id` of this model could be none.
fn could_be_none(model: &Model, id: &str) -> bool {
    let mut parameters = find(id).map_or(&[][..], |card| card.parameters).iter();
    parameters.any(|it| it.neutral.is_finite() && size(model, id, it).is_some_and(|size| !size.is_known))
}

/// Takes back an answer all of whose effects could be none, where the base as it is leaves nothing but noise.
pub(crate) fn withdraw(found: &mut SearchResult) {
    let answer = &found.answer;
    let all_could =
        !answer.effects.is_empty() && answer.effects.iter().all(|id| could_be_none(&answer.model, id));
    let is_at_floor = found.over_floor(&found.nominal).0 <= found.at_floor();
    if !(all_could && is_at_floor && found.alternatives.is_empty()) {
        return;
    }
    for single in found.singles.iter_mut().filter(|single| found.answer.effects.contains(&single.effect)) {
        single.not_named = Some(NotNamed { beside: Vec::new(), condition: Unmet::NotDetermined });
    }
    found.answer = found.nominal.clone();
    found.ladder = vec![found.refitted.clone()];
    (found.two_for_one, found.dropped) = (Vec::new(), Vec::new());
    (found.changed, found.shifts) = (Vec::new(), Vec::new());
}

#[cfg(test)]
mod tests {
    use super::super::diagnosis::Verdict;
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::super::verdict::verdict;
    use super::*;

    /// A base that leaves so many times the noise, and a dead time of 3 ms that leaves the noise, known to `error` [s].
    fn found(base: f64, error: f64) -> SearchResult {
        let left = |size: f64| leaves((0..ROWS).map(|row| size * noise(row)).collect());
        let mut answer = left(1.0);
        answer.effects = vec!["transport_delay".to_owned()];
        answer.model = answer.model.with(&answer.model.effect("transport_delay").expect("of the catalogue"));
        answer.model.set_parameter("transport_delay.delay", 0.003);
        answer.model.standard_errors.insert("transport_delay.delay".to_owned(), error);
        let mut found = SearchResult::of_one(split(), [left(base), left(base), answer], Vec::new());
        found.floors = [1.0; 2];
        found
    }

    #[test]
    fn of_a_size_that_could_be_none_nothing_is_named_where_nothing_is_left() {
        let named = |base: f64, error: f64| {
            let mut found = found(base, error);
            withdraw(&mut found);
            (found.answer.effects.len(), verdict(&found))
        };
        assert_eq!(named(1.05, 0.002), (0, Verdict::Adequate));
        assert_eq!(named(1.05, 0.001), (1, Verdict::MissingEffect), "three standard errors");
        assert_eq!(named(1.5, 0.002), (1, Verdict::MissingEffect), "something is left to explain");
    }

    #[test]
    fn what_another_set_does_as_well_is_not_taken_back() {
        let mut found = found(1.05, 0.002);
        found.alternatives.push(found.answer.clone());
        withdraw(&mut found);
        assert_eq!(found.answer.effects.len(), 1);
    }
}
