//! Effects that nobody named, beside an answer: one may gain too little to be named and still more than chance does. How large the
//! answer's numbers are then hangs on whether it is there.

use super::candidate_fit::{CandidateFit, noise_multiple};
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::model_selection::unidentified;
use super::not_named::Unmet;
use super::search_result::{SearchResult, UnnamedShift};
use super::search_space::Search;
use super::thresholds::THRESHOLDS;
use crate::estimation::thresholds::THRESHOLDS as ESTIMATION;
use crate::model::{Effect, Model};
use crate::threads::spread;

/// An effect beside the answer: the answer's numbers with it.
struct Beside {
    id: String,
    /// By how much the squared error falls, over the noise variance of one reading; what free initial states take off by chance is none.
    gain: f64,
    model: Model,
}

impl Search<'_> {
    /// For each number of the answer the effect that moves it most, of those that gain nearly as much as the one that gains most.
    pub(super) fn unnamed_shifts(&self, found: &SearchResult) -> Vec<UnnamedShift> {
        // Of very many rows a part has to do: a fit of each effect to all of them would take longer than the search.
        let part = found.split.shortened().map(|part| DataSplit::new(part.clone(), Some(part.clone())));
        let split = part.as_ref().unwrap_or(&found.split);
        if split.train.len() > ESTIMATION.kept_slopes {
            return Vec::new();
        }
        let (start, mut others) = self.beside_answer(found, split);
        let most = others.iter().map(|other| other.gain).fold(0.0, f64::max);
        others.retain(|other| other.gain >= THRESHOLDS.unnamed_share * most);
        let of_number = |name: &String| {
            let value = start.model.parameter(name)?;
            let shifts =
                others.iter().filter_map(|other| Some((other, other.model.parameter(name)? - value)));
            let (other, shift) = shifts.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
            Some(UnnamedShift { parameter: name.clone(), effect: other.id.clone(), shift })
        };
        found.answer.names.iter().filter_map(of_number).collect()
    }

    /// The answer fitted to these data, and each other effect beside it that gains more than chance does.
    fn beside_answer(&self, found: &SearchResult, split: &DataSplit) -> (CandidateFit, Vec<Beside>) {
        let answer = &found.answer;
        let base: Vec<String> = answer.names.iter().filter(|name| !name.contains('.')).cloned().collect();
        let effects = self.lookup(&answer.effects);
        let alone = Candidate { effects, nominal: &answer.model, ..self.start(&answer.model, &base) };
        let Some(start) = alone.fit_grids_held(std::slice::from_ref(&answer.model), None, split) else {
            return (answer.clone(), Vec::new());
        };
        let noise = noise_multiple(&start.fit, &split.train);
        let goal = start.fit.cost - THRESHOLDS.more_than_chance * noise;
        let is_refused = |effect: &&Effect| {
            found.singles.iter().any(|single| single.effect == effect.id && single.refusal.is_some())
        };
        let others = self.admitted().into_iter().filter(|effect| !answer.effects.contains(&effect.id));
        let others: Vec<&Effect> = others.filter(|effect| !effect.is_grid() && !is_refused(effect)).collect();
        let beside = |effect: &&Effect| {
            let effects = alone.effects.iter().copied().chain([*effect]).collect();
            let candidate = Candidate { effects, from: &start.model, nominal: &start.model, ..alone.clone() };
            let starts = candidate.faint_starts(effect, &start.model.with(effect), split);
            let fitted = candidate.fit_grids_held(&starts, Some(goal), split)?;
            let more_starts = fitted.fit.locals.len().saturating_sub(start.fit.locals.len());
            let gain = (start.fit.cost - fitted.fit.cost) / noise - more_starts as f64;
            (gain > THRESHOLDS.more_than_chance && self.can_stand_beside(effect, &fitted, split))
                .then(|| Beside { id: effect.id.clone(), gain, model: fitted.model })
        };
        let others = spread(&others, beside).into_iter().flatten().collect();
        (start, others)
    }

    /// Whether an effect of a set can be physics. The others of it may be as good as none beside it: what was taken for them is its doing
    /// then.
    fn can_stand_beside(&self, effect: &Effect, fitted: &CandidateFit, split: &DataSplit) -> bool {
        match unidentified(split, fitted, self.known) {
            None => true,
            Some(Unmet::NotDetermined) => {
                let own = CandidateFit { effects: vec![effect.id.clone()], ..fitted.clone() };
                own.is_determined(split, self.known) && !fitted.cancels(split, self.known)
            }
            Some(_) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::block_data::{BlockData, Runs};
    use super::super::rotor_block::rotor_runs;
    use super::super::tests::noise;
    use super::*;
    use crate::log::Dataset;

    /// What is found of the paper's rotor with a pole of 12 1/s and a dead time of `delay`, less than a row, that nobody named, read with
    /// a noise of 2 rad/s: its pole, the standard error that the fit says and the one that allows for the unnamed, and what moves it.
    fn pole(delay: f64) -> (f64, [f64; 2], Option<UnnamedShift>) {
        let command: Vec<f64> = (0..6000).map(|row| 0.4 + 0.1 * f64::from(row / 40 * 7 % 5)).collect();
        let goes_to = |command: f64| command * (1124.5 + 447.1 * command);
        let (mut rate, mut before) = (500.0, command[0]);
        let mut rates = Vec::new();
        for (row, command) in command.iter().enumerate() {
            rates.push(rate + 2.0 * noise(row));
            for (command, time) in [(before, delay), (*command, 0.01 - delay)] {
                rate += (goes_to(command) - rate) * -(-12.0 * time).exp_m1();
            }
            before = *command;
        }
        let time = (0..6000).map(|row| 0.01 * f64::from(row)).collect();
        let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
        let mut split = DataSplit::new(data.clone(), Some(data));
        let base = Model::paper();
        let known = base.known_effects().expect("the catalogue");
        let names = ["transport_delay", "speed_dependent_pole", "command_dead_zone"];
        let eligible = known.iter().filter(|effect| names.contains(&effect.id.as_str()));
        let eligible = eligible.map(|effect| (effect, None)).collect();
        let search = Search { base: &base, known: &known, eligible, progress: &|_| () };
        let (nominal, refitted) = search.bases(&mut split);
        let answer = refitted.clone();
        let mut found = SearchResult::of_one(split, [nominal, refitted, answer], Vec::new());
        let before = found.answer.model.standard_errors["pole"];
        search.allow_for_what_is_missing(&mut found);
        let model = found.answer.model;
        let shift = found.shifts.into_iter().find(|unnamed| unnamed.parameter == "pole");
        (model.actuator.pole, [before, model.standard_errors["pole"]], shift)
    }

    /// A dead time of 1 ms is far too little to be named, and makes the pole another one; without it nothing is allowed for.
    #[test]
    fn an_error_allows_for_an_effect_that_gains_too_little_to_be_named() {
        let (pole, [before, after], shift) = pole(1e-3);
        let shift = shift.expect("it moves the pole");
        assert_eq!(shift.effect, "transport_delay");
        let off = (12.0 - pole).abs();
        assert!(off > 2.0 * before && off < 2.0 * after, "{pole} ± {before}, {after}");
        assert!((0.5..2.0).contains(&(shift.shift / (12.0 - pole))), "{pole}: {shift:?}");
        let (pole, [before, after], shift) = self::pole(0.0);
        assert!(shift.is_none() && after < 1.5 * before, "{pole} ± {before}, {after}: {shift:?}");
    }

    /// Where no command reaches a limit it has no slope.
    #[test]
    fn a_limit_is_tried_where_commands_reach_it_and_other_laws_near_none() {
        let (base, split) = (Model::paper(), super::super::tests::split());
        let known = base.known_effects().expect("the catalogue");
        let values = |id: &str, number: &str| -> Vec<f64> {
            let effect = known.iter().find(|effect| effect.id == id).expect("known");
            let search = Search { base: &base, known: &known, eligible: Vec::new(), progress: &|_| () };
            let candidate = Candidate { effects: vec![effect], ..search.start(&base, &[]) };
            let starts = candidate.faint_starts(effect, &base.with(effect), &split);
            starts.iter().filter_map(|start| start.parameter(&format!("{id}.{number}"))).collect()
        };
        assert!(values("command_saturation", "limit").iter().any(|limit| *limit < 0.7));
        let widths = values("command_dead_zone", "width");
        assert!(widths.len() == 1 && widths[0] > 0.0 && widths[0] < 1e-3, "{widths:?}");
    }

    /// What the named one was taken for may be the other one's doing: then it is nothing beside that.
    #[test]
    fn an_effect_stands_beside_one_that_is_nothing_then_and_not_the_other_way_round() {
        let (base, split) = (Model::paper(), super::super::tests::split());
        let known = base.known_effects().expect("the catalogue");
        let search = Search { base: &base, known: &known, eligible: Vec::new(), progress: &|_| () };
        let law = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let mut fitted = super::super::tests::leaves(vec![0.0; super::super::tests::ROWS]);
        for (id, number, value, error) in
            [("command_dead_zone", "width", 0.01, 1e-3), ("transport_delay", "delay", 0.002, 0.002)]
        {
            fitted.model = fitted.model.with(law(id));
            fitted.model.set_parameter(&format!("{id}.{number}"), value);
            fitted.model.standard_errors.insert(format!("{id}.{number}"), error);
            fitted.effects.push(id.to_owned());
        }
        assert!(search.can_stand_beside(law("command_dead_zone"), &fitted, &split));
        assert!(!search.can_stand_beside(law("transport_delay"), &fitted, &split));
    }
}
