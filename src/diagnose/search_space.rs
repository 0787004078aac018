//! What a search chooses from: the base, the effects that a block and its logs can show, and candidates of them.

use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::{ran_off, weigh_channels};
use super::progress::SearchEvent;
use super::refusal::EffectRefusal;
use super::thresholds::THRESHOLDS;
use crate::model::{Effect, Model};

/// A search under way.
pub struct Search<'a> {
    /// The base.
    pub base: &'a Model,
    /// Every effect there is.
    pub known: &'a [Effect],
    /// Those that this block and these logs can show, and why the others cannot be.
    pub eligible: Vec<(&'a Effect, Option<EffectRefusal>)>,
    /// Hears how far it is.
    pub progress: &'a (dyn Fn(SearchEvent) + Sync),
}

impl<'a> Search<'a> {
    pub(crate) fn lookup(&self, ids: &[String]) -> Vec<&'a Effect> {
        ids.iter().filter_map(|id| self.known.iter().find(|effect| effect.id == *id)).collect()
    }

    pub(crate) fn admitted(&self) -> Vec<&'a Effect> {
        self.eligible.iter().filter(|(_, why)| why.is_none()).map(|(effect, _)| *effect).collect()
    }

    /// The nominal and the refitted baseline; the split learns how large its noise is.
    pub(crate) fn bases(&self, split: &mut DataSplit) -> (CandidateFit, CandidateFit) {
        let base_names = split.base_parameters(self.base);
        let first = self.candidate(self.base, &[], &base_names).run(split);
        weigh_channels(split, &first);
        let nominal = self.candidate(self.base, &[], &[]).run(split);
        let refitted = self.candidate(self.base, &[], &base_names).run(split);
        let limit = THRESHOLDS.refitted_worse.powi(2) * nominal.validate(split);
        let is_worse = refitted.validate(split) > limit && !nominal.is_exact(split);
        if split.folds.is_empty() || !split.train.is_rotor() || !is_worse {
            return (nominal, refitted);
        }
        // They came from these very rows, and a part of the levels does not say them: effects would be taken for what that costs.
        split.holds_levels = true;
        let base_names = split.base_parameters(self.base);
        let held = self.candidate(self.base, &[], &base_names).run(split);
        if held.validate(split) < refitted.validate(split) {
            return (nominal, held);
        }
        // It was not for them.
        split.holds_levels = false;
        (nominal, refitted)
    }

    /// The refitted baseline with all of the base's numbers free, whatever that costs on what is held out.
    pub(crate) fn with_free_levels(&self, split: &mut DataSplit) -> CandidateFit {
        split.holds_levels = false;
        self.candidate(self.base, &[], &split.base_parameters(self.base)).run(split)
    }

    /// Whether a fit ended where no fit is to end: its effects explain what that gets wrong.
    pub(crate) fn has_run_off(&self, fitted: &CandidateFit) -> bool {
        !ran_off(fitted, self.base).is_empty()
    }

    pub(crate) fn candidate<'b>(
        &'b self,
        from: &'b Model,
        effects: &[String],
        base: &[String],
    ) -> Candidate<'b> {
        Candidate { effects: self.lookup(effects), ..self.start(from, base) }
    }

    pub(crate) fn start<'b>(&'b self, from: &'b Model, base: &[String]) -> Candidate<'b> {
        let base = base.to_vec();
        Candidate { from, effects: Vec::new(), base, known: self.known, nominal: self.base, without: None }
    }
}
