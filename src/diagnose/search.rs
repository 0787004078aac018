//! The search of one block: forwards with a beam of several sets, backwards by dropping one out, everything refitted each time.

use super::candidate_fit::CandidateFit;
use super::candidate_set::Candidate;
use super::data_split::DataSplit;
use super::looks::LookCache;
use super::model_selection::{best_of_each, indistinguishable, joint_floors, loss, period, steps};
use super::parallel::run_singles;
use super::refusal::EffectRefusal;
use super::reweigh::Found;
use super::search_result::{SearchResult, SingleEffect};
use super::search_space::Search;
use super::surrogate_test::{SurrogateTest, surrogate};
use super::thresholds::THRESHOLDS;
use super::unnamed;

/// Whether sets of effects grow from the single ones.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Growth {
    None,
    ToTheEnd,
}

impl Search<'_> {
    /// Searches one block. Where one effect does little beside levels that are held, effects are looked for beside free ones, too: a
    /// curve that was fitted without the right ones may not fit beside them.
    #[must_use]
    pub fn run(&self, mut split: DataSplit) -> SearchResult {
        let bases = self.bases(&mut split);
        let held = self.with_singles(split, bases);
        if !held.split.holds_levels {
            return self.among(held, Growth::ToTheEnd).0;
        }
        let (of_base, of_one) = self.least_of_bases_and_singles(&held);
        let does_much = |left: f64, of: f64| left < (1.0 - THRESHOLDS.explained_by_one) * of;
        if does_much(of_one, of_base) {
            let (held, _) = self.among(held, Growth::ToTheEnd);
            if !held.answer.effects.is_empty() {
                return held;
            }
            let (free, _) = self.beside_free_levels(&held.split, &held.nominal);
            return better_beside_free(held, free);
        }
        let (free, in_vain) = self.beside_free_levels(&held.split, &held.bases.0);
        if does_much(free.answer.validate(&free.split), of_one) {
            // Whatever else is found beside held ones: only time is saved.
            return free;
        }
        let growth = if is_in_vain_held(in_vain, &held) { Growth::None } else { Growth::ToTheEnd };
        better_beside_free(self.among(held, growth).0, free)
    }

    /// What the better base leaves of what is held out, and what the best single effect does.
    fn least_of_bases_and_singles(&self, found: &Found) -> (f64, f64) {
        let left = |fitted: &CandidateFit| fitted.validate(&found.split);
        let of_base = left(&found.bases.0).min(left(&found.bases.1));
        let singles = found.fits.iter().filter(|single| !self.has_run_off(single));
        (of_base, singles.map(left).fold(of_base, f64::min))
    }

    fn beside_free_levels(&self, held: &DataSplit, nominal: &CandidateFit) -> (SearchResult, Option<f64>) {
        let mut split = held.clone();
        let refitted = self.with_free_levels(&mut split);
        self.among(self.with_singles(split, (nominal.clone(), refitted)), Growth::ToTheEnd)
    }

    /// The base as it is and refitted, and each effect by itself.
    fn with_singles(&self, split: DataSplit, (nominal, mut refitted): (CandidateFit, CandidateFit)) -> Found {
        let base_names = split.base_parameters(self.base);
        let mut singles = self.singles(&split, (&nominal, &refitted), &base_names);
        if let Some(better) = self.base_of_single(&split, &refitted, &singles, &base_names) {
            refitted = better;
            singles = self.singles(&split, (&nominal, &refitted), &base_names);
        }
        let fits: Vec<CandidateFit> = singles.iter().filter_map(|single| single.fitted.clone()).collect();
        Found { split, bases: (nominal, refitted), singles, fits }
    }

    /// The base's own numbers, fitted from where the single effect that leaves least has them: what they do as well by themselves is
    /// none of an effect's doing. `None` where they were fitted as well before.
    fn base_of_single(
        &self,
        split: &DataSplit,
        refitted: &CandidateFit,
        singles: &[SingleEffect],
        base: &[String],
    ) -> Option<CandidateFit> {
        let fits = singles.iter().filter_map(|single| single.fitted.as_ref());
        let best = fits.min_by(|a, b| a.fit.cost.total_cmp(&b.fit.cost))?;
        if best.fit.cost > (1.0 - THRESHOLDS.least_gain) * refitted.fit.cost {
            return None;
        }
        let from = best.effects.iter().fold(best.model.clone(), |model, id| model.without(id));
        let again = Candidate { effects: Vec::new(), ..self.start(&from, base) }.run(split);
        let is_better = again.fit.cost < (1.0 - THRESHOLDS.least_gain) * refitted.fit.cost;
        (is_better && !self.has_run_off(&again)).then_some(again)
    }

    /// The answer among the sets tried, and those that they lead to. Again without them where laws that read the battery are
    /// part of it by chance. With it, where more effects were in vain, far above the noise, the least cost that any set left of what it was
    /// fitted on.
    fn among(
        &self,
        Found { split, bases, singles, mut fits }: Found,
        growth: Growth,
    ) -> (SearchResult, Option<f64>) {
        let base_names = split.base_parameters(self.base);
        let mut in_vain = None;
        if growth == Growth::ToTheEnd {
            let mut looks = LookCache::default();
            self.grow_sets(&split, &base_names, &bases.1, (&mut fits, &mut looks));
            let is_in_vain = self.look_wider(&split, &base_names, &bases.1, (&mut fits, &mut looks));
            let costs = fits.iter().map(|fitted| fitted.fit.cost);
            in_vain = is_in_vain.then(|| costs.fold(f64::INFINITY, f64::min));
            self.look_beside_answer(&split, &base_names, &bases.1, (&mut fits, &mut looks));
            drop(looks);
            self.fit_jointly(&split, &base_names, &bases.1, &mut fits);
        }
        fits = best_of_each(&split, fits);
        let best = self.grow_answer(&split, &bases.1, &fits);
        let found = Found { split, bases, singles, fits };
        let Found { split, bases, singles, mut fits } = self.reweighed(found, &base_names, &best);
        let best = self.grow_answer(&split, &bases.1, &fits);
        let mut found = self.conclude(split, bases, singles, &mut fits, best);
        let Some((p_value, ids)) = self.battery_p_value(&found) else { return (found, in_vain) };
        fits.retain(|fitted| !fitted.effects.iter().any(|id| ids.contains(id)));
        let mut eligible = self.eligible.clone();
        let refusal = EffectRefusal::BatteryByChance { p_value };
        for (_, why) in eligible.iter_mut().filter(|(effect, _)| ids.contains(&effect.id)) {
            *why = Some(refusal.clone());
        }
        for single in found.singles.iter_mut().filter(|single| ids.contains(&single.effect)) {
            single.surrogate = single
                .surrogate
                .map(|surrogate| SurrogateTest { p_value: surrogate.p_value.max(p_value), ..surrogate });
            single.refusal = Some(refusal.clone());
        }
        let SearchResult { split, nominal, refitted, singles, .. } = found;
        Search { eligible, ..*self }.among(Found { split, bases: (nominal, refitted), singles, fits }, growth)
    }

    fn singles(
        &self,
        split: &DataSplit,
        (nominal, refitted): (&CandidateFit, &CandidateFit),
        base: &[String],
    ) -> Vec<SingleEffect> {
        let admitted = self.admitted();
        // A body whose weight or friction nobody modelled asks for any inertia, and from there no fit finds its way back.
        let inertia = |fitted: &CandidateFit| fitted.model.body.inertia;
        let has_run_off = inertia(refitted) > THRESHOLDS.held_inertia * inertia(nominal);
        let from = if has_run_off { &nominal.model } else { &refitted.model };
        let candidates: Vec<Candidate> = admitted
            .iter()
            .map(|effect| Candidate {
                effects: vec![*effect],
                without: Some(refitted.fit.cost),
                ..self.start(from, base)
            })
            .collect();
        let fits = run_singles(&candidates, split, self.progress);
        let tried = admitted.iter().zip(fits).map(|(effect, fitted)| SingleEffect {
            effect: effect.id.clone(),
            surrogate: Some(surrogate(refitted, &fitted, period(split))),
            fitted: Some(fitted),
            refusal: None,
            not_named: None,
        });
        let refused = self.eligible.iter().filter_map(|(effect, why)| {
            let refusal = Some(why.clone()?);
            let effect = effect.id.clone();
            Some(SingleEffect { effect, fitted: None, surrogate: None, refusal, not_named: None })
        });
        tried.chain(refused).collect()
    }

    /// The answer from the best set: effects that gain nothing dropped, confused ones exchanged, parameters selected.
    fn conclude(
        &self,
        split: DataSplit,
        (nominal, refitted): (CandidateFit, CandidateFit),
        singles: Vec<SingleEffect>,
        fits: &mut Vec<CandidateFit>,
        mut best: CandidateFit,
    ) -> SearchResult {
        let mut dropped = self.least_of_exchanges(&split, (&mut best, &refitted), fits);
        if self.has_run_off(&best) {
            // What was left when effects were dropped.
            (best, dropped) = (refitted.clone(), Vec::new());
        }
        let mut alternatives = indistinguishable(&split, &best, fits, self.known);
        let mut ladder = vec![refitted.clone()];
        ladder.extend(steps(&split, &best, fits));
        let (mut answer, mut changed) = self.select_parameters(&split, &nominal, &refitted, &best);
        if !best.effects.is_empty() && self.has_run_off(&answer) {
            // With all of the base's numbers free it did not.
            (answer, changed) = (best.clone(), split.base_parameters(self.base));
        }
        let is_change = best.effects.is_empty() && !changed.is_empty();
        let instead = is_change.then(|| self.single_effect_instead(&split, &answer, changed.len())).flatten();
        if let Some((effect, as_good)) = instead {
            alternatives = as_good;
            (best, answer, changed) = (effect.clone(), effect, Vec::new());
            dropped = vec![refitted.clone()];
            ladder.push(answer.clone());
        }
        if !best.effects.is_empty() {
            ladder.pop();
            ladder.push(answer.clone());
        }
        let mut found = SearchResult {
            floors: joint_floors(&split, &answer),
            two_for_one: self.two_for_one(&split, &best, &alternatives, fits),
            split,
            nominal,
            refitted,
            singles,
            answer,
            ladder,
            alternatives,
            dropped,
            changed,
            shifts: Vec::new(),
        };
        unnamed::judge(&mut found, &best, fits, self.known);
        found
    }

    /// Drops from `best` what gains nothing, and puts the set in its place that leaves least among those with one or two other effects;
    /// the sets without each of its effects. Fits what has as many numbers in more effects, too.
    fn least_of_exchanges(
        &self,
        split: &DataSplit,
        (best, refitted): (&mut CandidateFit, &CandidateFit),
        fits: &mut Vec<CandidateFit>,
    ) -> Vec<CandidateFit> {
        let base_names = split.base_parameters(self.base);
        let mut dropped = self.eliminate(split, best, &base_names, refitted, fits);
        let swapped = self.swaps(split, best, fits, &base_names);
        fits.extend(swapped);
        let exchanged_twice = self.two_exchanged(split, best, fits, &base_names);
        fits.extend(exchanged_twice);
        fits.retain(|fitted| !self.has_run_off(fitted));
        for _ in 0..THRESHOLDS.most_exchanges {
            let Some(better) = self.exchanged(split, (best, refitted), fits) else { break };
            (*best, dropped) = better;
        }
        let with_as_many = self.two_with_as_many_numbers(split, best, fits, &base_names);
        fits.extend(with_as_many.into_iter().filter(|fitted| !self.has_run_off(fitted)));
        dropped
    }

    /// Where another set does better on all data, that one and what goes on from it; and the sets without each of its effects.
    fn exchanged(
        &self,
        split: &DataSplit,
        (best, refitted): (&CandidateFit, &CandidateFit),
        fits: &mut [CandidateFit],
    ) -> Option<(CandidateFit, Vec<CandidateFit>)> {
        let base_names = split.base_parameters(self.base);
        let better = indistinguishable(split, best, fits, self.known).into_iter().next();
        let better = better.filter(|fitted| loss(split, fitted) < loss(split, best))?;
        // What goes on from it may have been passed over with it: a law that shows in one stretch gains nothing by itself.
        let size = better.effects.len();
        let mut best = self.grow_answer_from(split, better.clone(), fits);
        if best.effects.len() > size {
            let dropped = self.eliminate(split, &mut best, &base_names, refitted, fits);
            if is_no_step_back(split, &better, &best) {
                return Some((best, dropped));
            }
            best = better;
        }
        let dropped = self.each_dropped(split, &best, &base_names, refitted, fits);
        Some((best, dropped))
    }
}

/// Whether sets beside held levels are in vain where those beside free ones were, the best of which left a cost. A held curve is one of
/// those that a free one may be: beside it no set leaves less of what it was fitted on.
fn is_in_vain_held(beside_free: Option<f64>, held: &Found) -> bool {
    let costs = held.fits.iter().chain([&held.bases.1]).map(|fitted| fitted.fit.cost);
    let least = costs.fold(f64::INFINITY, f64::min);
    beside_free.is_some_and(|left| left > THRESHOLDS.hopeless_left.powi(2) * least)
}

/// What was found beside free levels where it leaves less of what is held out; less by what an effect must gain where one is named
/// beside held ones.
fn better_beside_free(held: SearchResult, free: SearchResult) -> SearchResult {
    let left = |found: &SearchResult| found.answer.validate(&found.split);
    let margin = if held.answer.effects.is_empty() { 0.0 } else { THRESHOLDS.least_gain };
    if left(&free) < (1.0 - margin) * left(&held) { free } else { held }
}

/// Whether what is left of a set that was grown from `from` does no worse than that with as many effects: the one that did better may
/// have gone out for another that came in beside it, and does worse alone.
fn is_no_step_back(split: &DataSplit, from: &CandidateFit, left: &CandidateFit) -> bool {
    left.effects.len() > from.effects.len() || loss(split, left) <= loss(split, from)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::super::block_data::{BlockData, Runs};
    use super::super::progress::SearchEvent;
    use super::super::rotor_block::rotor_runs;
    use super::super::tests::{ROWS, leaves, noise, split};
    use super::*;
    use crate::log::Dataset;
    use crate::model::Model;

    /// The paper's rotor with a pole of `pole`, in steps of 0.4 s.
    fn rotor(pole: f64) -> DataSplit {
        let command: Vec<f64> = (0..ROWS).map(|row| 0.4 + 0.2 * (row / 40 % 3) as f64).collect();
        let (mut rate, share) = (500.0, -(-0.01 * pole).exp_m1());
        let rates = command.iter().map(|command| {
            let read = rate;
            rate += share * (command * (1124.5 + 447.1 * command) - rate);
            read
        });
        let rates = rates.collect();
        let time = (0..ROWS).map(|row| 0.01 * row as f64).collect();
        let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
        let data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
        DataSplit::new(data.clone(), Some(data))
    }

    /// Twelve levels of the paper's rotor, each off the curve by so many rad/s.
    fn off_the_curve(command: [f64; 12], off: impl Fn(usize) -> f64) -> BlockData {
        late_and_off_the_curve(0, command, off)
    }

    /// The same behind a delay of so many rows.
    fn late_and_off_the_curve(late: usize, command: [f64; 12], off: impl Fn(usize) -> f64) -> BlockData {
        let model = Model::paper();
        let level_of = |row: usize| row / (ROWS / 12);
        let goal = |row: usize| {
            let level = level_of(row.saturating_sub(late));
            model.steady_rate(command[level]) + off(level)
        };
        let (mut rate, share) = (goal(0), -(-0.01 * model.actuator.pole).exp_m1());
        let rates = (0..ROWS).map(|row| {
            let read = rate;
            rate += share * (goal(row) - rate);
            read
        });
        let rates = rates.collect();
        let time = (0..ROWS).map(|row| 0.01 * row as f64).collect();
        let commands = (0..ROWS).map(|row| command[level_of(row)]).collect();
        let log = Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)]);
        BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])))
    }

    /// Of each third of the levels another step: what is fitted to two thirds is off at the others.
    fn thirds() -> ([f64; 12], impl Fn(usize) -> f64) {
        let command = std::array::from_fn(|level| 0.3 + 0.5 * (level * 5 % 12) as f64 / 12.0);
        (command, |level: usize| if level.is_multiple_of(3) { 20.0 } else { -10.0 })
    }

    /// Each third at commands of its own, all off by a share of the command: two numbers fitted to two thirds are far off at the third, and
    /// one by itself finds it.
    fn thirds_at_commands_of_their_own() -> ([f64; 12], impl Fn(usize) -> f64) {
        let third = |level: usize| (level + 1) % 3;
        let command: [f64; 12] =
            std::array::from_fn(|level| [0.3, 0.5, 0.7][third(level)] + 0.03 * (level / 3) as f64);
        (command, move |level: usize| 40.0 * command[level] + [10.0, -10.0, 10.0][third(level)])
    }

    #[test]
    fn a_curve_that_parts_of_the_levels_do_not_show_is_held() {
        let (command, off) = thirds();
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let search = Search { base: &model, known: &known, eligible: Vec::new(), progress: &|_| () };
        let mut thirds = DataSplit::new(off_the_curve(command, off), None);
        let (nominal, refitted) = search.bases(&mut thirds);
        assert!(thirds.holds_levels, "{} {}", nominal.validate(&thirds), refitted.validate(&thirds));
        assert_eq!(refitted.names, ["pole"]);
        assert!(search.run(thirds).split.holds_levels, "free ones do no better");
        // Another log is held out, and shows what the curve is worth.
        let [train, held_out] = [10.0, -10.0].map(|off| off_the_curve(command, move |_| off));
        let mut two_logs = DataSplit::new(train, Some(held_out));
        let (nominal, refitted) = search.bases(&mut two_logs);
        assert!(refitted.validate(&two_logs) > 2.0 * nominal.validate(&two_logs));
        assert!(!two_logs.holds_levels);
    }

    #[test]
    fn where_nothing_is_found_beside_held_levels_a_number_of_the_curve_is() {
        let (command, off) = thirds_at_commands_of_their_own();
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let search = Search { base: &model, known: &known, eligible: Vec::new(), progress: &|_| () };
        let mut split = DataSplit::new(off_the_curve(command, off), None);
        search.bases(&mut split);
        assert!(split.holds_levels);
        let searched = search.run(split.clone());
        // As `extend --recalibrate` asks for it.
        let asked_for = search.refit(split, &[]);
        for found in [&searched, &asked_for] {
            assert!(!found.split.holds_levels);
            assert!(
                found.changed.len() == 1 && found.changed[0].starts_with("steady_rate"),
                "{:?}",
                found.changed
            );
            assert!(found.answer.validate(&found.split) < 0.5 * found.nominal.validate(&found.split));
        }
    }

    /// Delays of three rows and of two, which do more and less than a quarter of what the levels are off by: with free levels, which are
    /// tried for the second one, the delay leaves as much, and one that is named beside held ones stays.
    #[test]
    fn a_delay_beside_held_levels_is_named_beside_them() {
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let delay = known.iter().find(|effect| effect.id == "transport_delay").expect("known");
        let search = Search { base: &model, known: &known, eligible: vec![(delay, None)], progress: &|_| () };
        for late in [3, 2] {
            let (command, off) = thirds();
            let found = search.run(DataSplit::new(late_and_off_the_curve(late, command, off), None));
            assert_eq!(found.answer.effects, ["transport_delay"], "{late} rows");
            assert!(found.split.holds_levels, "{late} rows");
        }
    }

    /// A delay, and levels off by thirds, which no two effects explain beside a free curve: no two are tried beside the held one.
    #[test]
    fn what_is_in_vain_beside_a_free_curve_is_not_tried_beside_the_held_one() {
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let ids = ["transport_delay", "second_order_lag"];
        let eligible = ids.map(|id| (known.iter().find(|effect| effect.id == id).expect("known"), None));
        let pairs = AtomicUsize::new(0);
        let count = |event: SearchEvent| {
            let is_pair = matches!(event, SearchEvent::Tried { effects, .. } if effects.len() == 2);
            pairs.fetch_add(usize::from(is_pair), Ordering::Relaxed);
        };
        let search = Search { base: &model, known: &known, eligible: eligible.to_vec(), progress: &count };
        let (command, off) = thirds();
        let found = search.run(DataSplit::new(late_and_off_the_curve(2, command, off), None));
        assert_eq!(found.answer.effects, ["transport_delay"]);
        assert_eq!(pairs.load(Ordering::Relaxed), 1, "beside free levels only");
    }

    /// Whatever is held out: beside free levels a set may leave much of that, and little of what it was fitted on.
    #[test]
    fn sets_beside_a_held_curve_are_spared_by_what_free_ones_leave_of_what_they_were_fitted_on() {
        let left = |size: f64| leaves(vec![size; ROWS]);
        let held = Found {
            split: split(),
            bases: (left(9.0), left(4.0)),
            singles: Vec::new(),
            fits: vec![left(2.0), left(3.0)],
        };
        // Of the least, that of 2.0.
        let is_spared = |size: f64| is_in_vain_held(Some(left(size).fit.cost), &held);
        let share = THRESHOLDS.hopeless_left;
        assert!(is_spared(1.01 * share * 2.0) && !is_spared(0.99 * share * 2.0));
        assert!(!is_in_vain_held(None, &held), "more effects did much");
    }

    /// A base fit that ended in another valley, and an effect beside which it did not.
    #[test]
    fn what_the_base_does_by_itself_is_no_effects_doing() {
        let (base, split) = (Model::paper(), rotor(8.0));
        let known = base.known_effects().expect("the catalogue");
        let search = Search { base: &base, known: &known, eligible: Vec::new(), progress: &|_| () };
        let beside = |left: f64| {
            let mut model = base.with(known.iter().find(|it| it.id == "static_offset").expect("known"));
            model.set_parameter("pole", 8.0);
            let effects = vec!["static_offset".to_owned()];
            let fitted = Some(CandidateFit { effects, model, ..leaves(vec![left; ROWS]) });
            let effect = "static_offset".to_owned();
            [SingleEffect { effect, fitted, surrogate: None, refusal: None, not_named: None }]
        };
        let names = split.base_parameters(&base);
        let from = |refitted: f64, single: f64| {
            search.base_of_single(&split, &leaves(vec![refitted; ROWS]), &beside(single), &names)
        };
        let found = from(50.0, 1.0).expect("the base does as well by itself");
        assert!(found.effects.is_empty() && (found.model.actuator.pole - 8.0).abs() < 0.01, "{found:?}");
        assert!(from(0.0, 1.0).is_none(), "it was there already");
        assert!(from(1.0, 1.0).is_none(), "the effect does no better");
    }

    /// Errors in their squares: 0.98 is no gain of three per cent, 0.96 is.
    #[test]
    fn an_answer_beside_free_levels_must_gain_what_an_effect_must() {
        let result = |effects: &[&str], size: f64| {
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            let of = |size: f64| leaves((0..ROWS).map(|row| size * noise(row)).collect());
            let answer = CandidateFit { effects, ..of(size) };
            SearchResult::of_one(split(), [of(2.0), of(2.0), answer], Vec::new())
        };
        let named = |held: SearchResult, free: f64| {
            better_beside_free(held, result(&["free"], free)).answer.effects == ["free"]
        };
        assert!(!named(result(&["held"], 1.0), 0.99));
        assert!(named(result(&["held"], 1.0), 0.98));
        assert!(named(result(&[], 1.0), 0.99), "nothing is named beside held ones");
        assert!(!named(result(&[], 1.0), 1.01));
    }

    /// The refitted base may be the worse one of the two, and an effect that only undoes that does nothing.
    #[test]
    fn what_one_effect_does_is_counted_from_the_better_base() {
        let model = Model::paper();
        let known = model.known_effects().expect("the catalogue");
        let search = Search { base: &model, known: &known, eligible: Vec::new(), progress: &|_| () };
        let of = |size: f64| leaves((0..ROWS).map(|row| size * noise(row)).collect());
        let split = split();
        let [two, one] = [2.0, 1.0].map(|size| of(size).validate(&split));
        let found = |fits: Vec<CandidateFit>| Found {
            split: split.clone(),
            bases: (of(2.0), of(3.0)),
            singles: Vec::new(),
            fits,
        };
        assert_eq!(search.least_of_bases_and_singles(&found(vec![of(2.5)])), (two, two));
        assert_eq!(search.least_of_bases_and_singles(&found(vec![of(2.5), of(1.0)])), (two, one));
        let mut run_off = of(1.0);
        (run_off.names, run_off.model.body.inertia) = (vec!["inertia".to_owned()], 1e9);
        assert_eq!(search.least_of_bases_and_singles(&found(vec![run_off])), (two, two));
    }

    #[test]
    fn a_worse_effect_does_not_take_the_place_of_the_one_it_came_in_beside() {
        let split = split();
        let set = |effects: &[&str], size: f64| {
            let effects = effects.iter().map(|id| (*id).to_owned()).collect();
            CandidateFit { effects, ..leaves((0..ROWS).map(|row| size * noise(row)).collect()) }
        };
        let from = set(&["better"], 2.0);
        assert!(is_no_step_back(&split, &from, &set(&["better", "other"], 1.0)));
        assert!(is_no_step_back(&split, &from, &set(&["other"], 1.9)));
        assert!(!is_no_step_back(&split, &from, &set(&["other"], 2.1)));
    }
}
