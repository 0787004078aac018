//! Effects whose size these logs do not tell: by its standard error it could be none. Where the base leaves nothing but noise, such an
//! effect explains nothing that anybody could see, and is not named.

use super::candidate_fit::CandidateFit;
use super::model_selection::{joint_floors, same_set};
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
    /// Whether it differs from that of no effect by more than its error.
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

/// Whether all effects of an answer could be none, where the base as it is leaves nothing but noise and no other set does as well.
pub(crate) fn is_nothing(found: &SearchResult) -> bool {
    let answer = &found.answer;
    let all_could =
        !answer.effects.is_empty() && answer.effects.iter().all(|id| could_be_none(&answer.model, id));
    let is_alone = found.alternatives.is_empty() && found.two_for_one.is_empty() && found.changed.is_empty();
    all_could && is_alone && found.over_floor(&found.nominal).0 <= THRESHOLDS.at_floor
}

/// Takes back an answer, in whose place is that of the base's own numbers, with those that changed.
pub(crate) fn withdraw(found: &mut SearchResult, (answer, changed): (CandidateFit, Vec<String>)) {
    let withdrawn = std::mem::replace(&mut found.answer, answer).effects;
    for single in &mut found.singles {
        if withdrawn.contains(&single.effect) {
            single.not_named = Some(NotNamed { beside: Vec::new(), condition: Unmet::NotDetermined });
        } else if single.not_named.as_ref().is_some_and(|why| same_set(&why.beside, &withdrawn)) {
            // It was judged beside what is no longer named.
            single.not_named = Some(NotNamed { beside: Vec::new(), condition: Unmet::NothingLeft });
        }
    }
    found.floors = joint_floors(&found.split, &found.answer);
    found.ladder = vec![found.refitted.clone()];
    (found.changed, found.dropped, found.shifts) = (changed, Vec::new(), Vec::new());
}

#[cfg(test)]
mod tests {
    use super::super::diagnosis::Verdict;
    use super::super::search_result::SingleEffect;
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
    fn a_size_that_could_be_none_is_nothing_where_nothing_is_left() {
        assert!(is_nothing(&found(1.05, 0.002)));
        assert!(!is_nothing(&found(1.05, 0.001)), "three standard errors");
        assert!(!is_nothing(&found(1.15, 0.002)), "something is left to explain");
        let mut with_another = found(1.05, 0.002);
        with_another.alternatives.push(with_another.answer.clone());
        assert!(!is_nothing(&with_another), "another set does as well");
        let mut with_changed = found(1.05, 0.002);
        with_changed.changed.push("pole".to_owned());
        assert!(!is_nothing(&with_changed), "a number of the base has changed");
    }

    #[test]
    fn in_the_place_of_what_is_taken_back_the_base_stands() {
        let mut found = found(1.05, 0.002);
        let single = |effect: &str, beside: &[&str]| SingleEffect {
            effect: effect.to_owned(),
            fitted: None,
            surrogate: None,
            refusal: None,
            not_named: (!beside.is_empty()).then(|| NotNamed {
                beside: beside.iter().map(|id| (*id).to_owned()).collect(),
                condition: Unmet::LessThanAnother,
            }),
        };
        found.singles = vec![single("transport_delay", &[]), single("telemetry_lag", &["transport_delay"])];
        let base = (found.nominal.clone(), Vec::new());
        withdraw(&mut found, base);
        assert_eq!(verdict(&found), Verdict::Adequate);
        let whys: Vec<_> = found.singles.iter().filter_map(|it| it.not_named.clone()).collect();
        assert!(whys.iter().all(|why| why.beside.is_empty()), "{whys:?}");
        assert_eq!([&whys[0].condition, &whys[1].condition], [&Unmet::NotDetermined, &Unmet::NothingLeft]);
    }
}
