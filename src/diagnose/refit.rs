//! Given effects added and everything refitted, without a search; and the errors before and after in one measure.

use super::block_data::BlockData;
use super::candidate_fit::Trial;
use super::data_split::Stage;
use super::model_selection::{joint_floors, weigh};
use super::problem::Problem;
use super::search::Search;
use super::search_result::Found;
use crate::estimation::noise_floor::floors;
use crate::estimation::output_error::judge;
use crate::model::Effect;

impl Search<'_> {
    /// The given effects added and everything refitted.
    #[must_use]
    pub fn refit(&self, mut stage: Stage, ids: &[String]) -> Found {
        let base_names = stage.base_parameters(self.base);
        let (stale, recalibrated) = self.bases(&mut stage);
        let best = self.with(&recalibrated, ids, &base_names, &stage);
        let (answer, changed) = self.settle(&stage, &stale, &recalibrated, &best);
        found(stage, [stale, recalibrated, answer], changed)
    }

    /// The same for a rung of a ladder: fitted again with each channel weighed by what is left with the effects in, and all
    /// errors in one measure.
    #[must_use]
    pub fn rung(&self, mut stage: Stage, ids: &[String]) -> Found {
        let base_names = stage.base_parameters(self.base);
        let (mut stale, mut recalibrated) = self.bases(&mut stage);
        let mut best = self.with(&recalibrated, ids, &base_names, &stage);
        if !ids.is_empty() {
            weigh(&mut stage, &best);
            stale = self.plan(self.base, &[], &[]).run(&stage);
            recalibrated = self.plan(&recalibrated.model, &[], &base_names).run(&stage);
            best = self.plan(&best.model, ids, &base_names).run(&stage);
        }
        let (mut answer, changed) = self.settle(&stage, &stale, &recalibrated, &best);
        self.measure_alike(&mut stage, [&mut stale, &mut recalibrated, &mut answer]);
        found(stage, [stale, recalibrated, answer], changed)
    }

    /// One after another as the search goes, and all at once: the first finds the way where they are far from where they
    /// start, the second where they only make sense together.
    fn with(&self, recalibrated: &Trial, ids: &[String], base_names: &[String], stage: &Stage) -> Trial {
        let mut best = recalibrated.clone();
        for count in 1..=ids.len() {
            best = self.plan(&best.model, &ids[..count], base_names).run(stage);
        }
        if ids.len() > 1 {
            let at_once = self.plan(&recalibrated.model, ids, base_names).run(stage);
            best = if at_once.fit.cost < best.fit.cost { at_once } else { best };
        }
        best
    }

    /// The errors of the trials, their last the answer, with initial states that the noise alone weighs: a model's error is
    /// the same then, whatever it was fitted beside, and the rungs of a ladder agree. Not where parts of the logs that are fitted
    /// on are held out: there each part has a fit of its own.
    fn measure_alike(&self, stage: &mut Stage, trials: [&mut Trial; 3]) {
        if !stage.folds.is_empty() {
            return;
        }
        let [.., answer] = &trials;
        stage.set_sigma(floors(&stage.train, &answer.fit.residuals, answer.model.body.inertia));
        for trial in trials {
            let inside: Vec<&Effect> =
                self.known.iter().filter(|effect| trial.model.has(&effect.id)).collect();
            let of =
                |data: &BlockData| judge(&Problem::new(data, trial.model.clone(), Vec::new(), &inside), &[]);
            (trial.fit, trial.judged) = (of(&stage.train), of(&stage.validate));
        }
    }
}

fn found(stage: Stage, [stale, recalibrated, answer]: [Trial; 3], changed: Vec<String>) -> Found {
    let floors = joint_floors(&stage, &answer);
    let ladder = vec![recalibrated.clone(), answer.clone()];
    let (singles, alternatives, dropped) = (Vec::new(), Vec::new(), Vec::new());
    Found { stage, stale, recalibrated, singles, answer, ladder, alternatives, dropped, floors, changed }
}
