//! What one search has seen of its candidates: a later round asks for many of them again.

use std::collections::HashMap;

use super::candidate::StartingPoints;
use super::candidate_set::Candidate;
use crate::threads::spread_out;

/// How closely a candidate was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LookDepth {
    /// From every start for a few steps.
    Look,
    /// From the best start for a while, with this goal (its bits).
    BriefFit(Option<u64>),
}

/// What is known of candidates on one split of the data.
#[derive(Default)]
pub struct LookCache(HashMap<Key, StartingPoints>);

/// A candidate's effects in order, the cost (its bits) of the set that the last one was added to, and how it was looked at.
type Key = (Vec<String>, u64, LookDepth);

impl LookCache {
    /// What `look` makes of each candidate with what comes beside it, or has made of it before.
    pub fn of<T: Send>(
        &mut self,
        candidates: Vec<(&Candidate, T)>,
        stage: LookDepth,
        look: impl Fn(&Candidate, T) -> StartingPoints + Sync,
    ) -> Vec<StartingPoints> {
        let keys: Vec<Option<Key>> = candidates.iter().map(|(candidate, _)| key(candidate, stage)).collect();
        let known = &self.0;
        let seen = spread_out(candidates.into_iter().zip(&keys).collect(), |((candidate, beside), key)| {
            let before = key.as_ref().and_then(|key| known.get(key)).cloned();
            before.unwrap_or_else(|| look(candidate, beside))
        });
        self.0.extend(keys.into_iter().zip(&seen).filter_map(|(key, seen)| Some((key?, seen.clone()))));
        seen
    }
}

/// `None` for one that did not grow from a fitted set: another one may have the same effects.
fn key(candidate: &Candidate, stage: LookDepth) -> Option<Key> {
    let ids = candidate.effects.iter().map(|effect| effect.id.clone()).collect();
    Some((ids, candidate.without?.to_bits(), stage))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::super::tests::split;
    use super::*;
    use crate::model::Model;

    #[test]
    fn a_candidate_is_looked_at_once_from_one_set_and_in_one_way() {
        let (model, split, seen) = (Model::paper(), split(), AtomicUsize::new(0));
        let known = model.known_effects().expect("the catalogue");
        let grown = |effect: usize, without: Option<f64>| Candidate {
            from: &model,
            nominal: &model,
            effects: vec![&known[effect]],
            base: Vec::new(),
            known: &[],
            without,
        };
        let mut looks = LookCache::default();
        let mut looked_at = |candidate: &Candidate, stage: LookDepth| {
            seen.store(0, Ordering::Relaxed);
            let found = looks.of(vec![(candidate, ())], stage, |candidate, ()| {
                seen.fetch_add(1, Ordering::Relaxed);
                Candidate { effects: Vec::new(), ..candidate.clone() }.starting_points(&split)
            });
            assert_eq!(found.len(), 1);
            seen.load(Ordering::Relaxed)
        };
        assert_eq!(looked_at(&grown(0, Some(1.0)), LookDepth::Look), 1);
        assert_eq!(looked_at(&grown(0, Some(1.0)), LookDepth::Look), 0, "seen before");
        assert_eq!(looked_at(&grown(1, Some(1.0)), LookDepth::Look), 1, "another effect");
        assert_eq!(looked_at(&grown(0, Some(2.0)), LookDepth::Look), 1, "beside another set");
        assert_eq!(looked_at(&grown(0, Some(1.0)), LookDepth::BriefFit(None)), 1, "more closely");
        assert_eq!(looked_at(&grown(0, Some(1.0)), LookDepth::BriefFit(Some(3))), 1, "with a goal");
        for _ in 0..2 {
            assert_eq!(looked_at(&grown(0, None), LookDepth::Look), 1, "nobody knows beside what");
        }
    }
}
