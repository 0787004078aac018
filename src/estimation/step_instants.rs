//! When, between two rows of a record, its input stepped.
//!
//! A logger that writes rows on a clock of its own shows a step in the first row behind it: the step happened somewhere in the interval
//! before, and what the output did says where. Each step is a nuisance of its own with an even prior over its interval; a pole, which
//! may differ between steps up and down and along the input, a second lag, a dead time that all steps share, and a level of each hold
//! are fitted beside, so that none of them has to be known, and none of them is taken for an instant.

use std::ops::Range;

use super::quantile::median;
use super::step_course::Curve;
use super::step_trial::{Following, Profile, Steps, Trial};
pub(crate) use super::step_trial::{Hold, Stepped};
use super::thresholds::THRESHOLDS;

/// What is known of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instant {
    /// The first row that shows it.
    pub row: usize,
    /// [-] of the interval before the row that it lay ahead of it, and the standard deviation of that.
    pub ahead: f64,
    pub deviation: f64,
    /// The input before, and behind.
    pub inputs: [f64; 2],
}

/// Instants of steps, and what speaks for them.
#[derive(Debug, Clone)]
pub(crate) struct Instants {
    pub steps: Vec<Instant>,
    /// Logarithm of the likelihood over that of steps at their rows, all with one dead time; and with one lead.
    pub over_rows: f64,
    pub over_lead: f64,
    /// [s] standard deviation of the dead time.
    pub delay_deviation: f64,
    /// [s] the dead time behind the instants.
    pub delay: f64,
    /// [-] of all changes of the output's level, the share that goes with the input; below zero, against it.
    pub answered: f64,
    /// Rows, ascending, in which the output hangs on steps whose instant is not known.
    pub unknown: Vec<usize>,
}

impl Instants {
    /// [intervals] rms of the standard deviations.
    pub(crate) fn deviation(&self) -> f64 {
        let squares = self.steps.iter().map(|step| step.deviation.powi(2)).sum::<f64>();
        (squares / self.steps.len().max(1) as f64).sqrt()
    }

    /// [intervals²] of the instants about the middle of their interval.
    pub(crate) fn spread(&self) -> f64 {
        let squares = self.steps.iter().map(|step| (step.ahead - 0.5).powi(2)).sum::<f64>();
        squares / self.steps.len().max(1) as f64
    }

    /// [intervals²] variance of the instants that neither direction, middle and size of the step nor time explain: a law that was not
    /// known, or that drifts, looks like instants that hang on these.
    pub(crate) fn unexplained_variance(&self) -> f64 {
        let last = self.steps.last().map_or(1.0, |step| step.row.max(1) as f64);
        // Of few steps a trend says nothing.
        let count = if self.steps.len() < THRESHOLDS.steps_with_trend { 5 } else { 7 };
        let terms = |step: &Instant| {
            let [from, to] = step.inputs;
            let (direction, middle) = ((to - from).signum(), 0.5 * (from + to));
            let at = step.row as f64 / last;
            [1.0, direction, middle, direction * middle, (to - from).abs(), at, direction * at]
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let take = |from: &mut Vec<f64>, along: &[f64]| {
            let share = dot(from, along);
            from.iter_mut().zip(along).for_each(|(value, along)| *value -= share * along);
        };
        let mut left: Vec<f64> = self.steps.iter().map(|step| step.ahead).collect();
        let mut directions: Vec<Vec<f64>> = Vec::new();
        for term in 0..count {
            let mut column: Vec<f64> = self.steps.iter().map(|step| terms(step)[term]).collect();
            let size = dot(&column, &column);
            directions.iter().for_each(|along| take(&mut column, along));
            let own = dot(&column, &column);
            // What the columns before say already.
            if own > THRESHOLDS.least_pivot * size {
                column.iter_mut().for_each(|value| *value /= own.sqrt());
                take(&mut left, &column);
                directions.push(column);
            }
        }
        dot(&left, &left) / self.steps.len().saturating_sub(directions.len()).max(1) as f64
    }
}

/// The holds by which one looks.
struct Looked<'a> {
    /// Those by which a way to follow is searched for, and those by which it is judged.
    few: &'a [Vec<Hold>],
    many: &'a [Vec<Hold>],
    /// [s] the longest dead time.
    latest: f64,
}

impl<'a> Looked<'a> {
    fn of<'b>(&self, record: &Stepped<'b>) -> (Stepped<'b>, Stepped<'b>)
    where
        'a: 'b,
    {
        (Stepped { stretches: self.few, ..*record }, Stepped { stretches: self.many, ..*record })
    }

    /// [s] dead times, and by how much all steps may have been logged late.
    fn delays_with_leads(&self, interval: f64) -> Range<f64> {
        -THRESHOLDS.longest_lead * interval..self.latest
    }
}

impl Stepped<'_> {
    /// The instants; `None` where fewer steps than `fewest` can be looked at, where steps at their rows are enough, and where instants leave
    /// more than `most_left` [unit of the output, rms].
    pub(crate) fn instants(&self, fewest: usize, most_left: f64) -> Option<Instants> {
        if !self.is_stepwise(fewest) {
            return None;
        }
        let (few, many) =
            (self.first_holds(THRESHOLDS.searched_steps), self.first_holds(THRESHOLDS.judged_steps));
        let latest = (0.5 * self.usual_hold()).min(THRESHOLDS.longest_step_delay).max(2.0 * self.interval);
        let looked = Looked { few: &few, many: &many, latest };
        let (shortly, all) = looked.of(self);
        if all.rows_explain(&shortly, looked.delays_with_leads(self.interval)) {
            return None;
        }
        let coarse = shortly.coarse(Steps::Between)?;
        let plain = Trial { following: coarse, steps: Steps::Between, curve: None };
        let first = shortly.follow(plain, 0.0..latest);
        // What another input does on the way to a level is no instant.
        let found = match self.without_other(&few, shortly.search(plain, 0.0..latest).plain(), &(0.0..latest))
        {
            Some((output, following)) => {
                let alone = Stepped { output: &output, ..*self };
                let (shortly_alone, _) = looked.of(&alone);
                let next = shortly_alone.follow(Trial { following, ..plain }, 0.0..latest);
                let likelihood = |record: &Stepped, following| {
                    record.carry_out(&Trial { following, ..plain }).likelihood()
                };
                // A shape of the way to follow may say the same.
                let shows = likelihood(&shortly_alone, next)
                    > likelihood(&shortly, first) + THRESHOLDS.step_shape_gain;
                if shows {
                    alone.estimate(&looked, next, most_left)
                } else {
                    self.estimate(&looked, first, most_left)
                }
            }
            None => self.estimate(&looked, first, most_left),
        };
        found.filter(|found| found.steps.len() >= fewest)
    }

    /// The instants, by an output that nothing but steps moves, from the way in which it follows the first of them.
    fn estimate(&self, looked: &Looked, first: Following, most_left: f64) -> Option<Instants> {
        let ((few, many), latest) = (looked.of(self), looked.latest);
        let trial = |following: Following, curve| Trial { following, steps: Steps::Between, curve };
        let judged = many.carry_out(&trial(first, None));
        // With a curve they leave more.
        if judged.mean_square().sqrt() > most_left {
            return None;
        }
        let curve = Curve::of(&judged.levels, judged.mean_square());
        let between = few.follow(trial(first, curve), 0.0..latest);
        let at_rows = Trial { steps: Steps::AtRows, ..trial(between, curve) };
        let [fixed, leads] = [0.0..latest, looked.delays_with_leads(self.interval)].map(|delays| {
            let following = few.follow(at_rows, delays);
            many.carry_out(&Trial { following, ..at_rows }).likelihood()
        });
        let judged = many.carry_out(&trial(between, curve));
        let (noise, answered) = (judged.mean_square(), judged.answered());
        // All instants together are no likelier than the best of each.
        if noise.sqrt() > most_left || judged.likelihood() < fixed {
            return None;
        }
        // Pole and lag go with the dead time: without one they are others.
        let without = few.follow(trial(between, curve), 0.0..0.0);
        let (found, delay_deviation, best) = many.delayed(&trial(between, curve), without);
        let steps = self.carry_out(&trial(found, curve)).steps;
        let steps: Vec<Instant> = steps.iter().map(|step| instant(step, noise)).collect();
        // Of an exact simulation hardly any noise is left, and rows without end would hang on a step.
        let felt = THRESHOLDS.felt_step * noise.sqrt().max(THRESHOLDS.felt_step * most_left);
        let unknown = self.unknown_rows(&steps, &trial(found, curve), felt);
        let (over_rows, over_lead) = (best - fixed, best - leads);
        Some(Instants { steps, over_rows, over_lead, delay_deviation, delay: found.delay, answered, unknown })
    }

    /// Rows behind steps, nearly as large as usual ones, whose instant is none of `steps`, for as long as that moves the output by what is
    /// `felt` [unit of the output].
    fn unknown_rows(&self, steps: &[Instant], trial: &Trial, felt: f64) -> Vec<usize> {
        let size = |inputs: [f64; 2]| (inputs[1] - inputs[0]).abs();
        let usual = median(steps.iter().map(|step| size(step.inputs))).unwrap_or(f64::INFINITY);
        let (Some(curve), following) = (trial.curve, trial.following) else { return Vec::new() };
        let mut rows: Vec<usize> = Vec::new();
        for holds in self.stretches {
            for pair in holds.windows(2) {
                let (row, inputs) = (pair[1].from, [pair[0].input, pair[1].input]);
                let step = steps.binary_search_by_key(&row, |step| step.row).ok().map(|at| &steps[at]);
                let is_known = step.is_some_and(|step| step.deviation < THRESHOLDS.known_instant);
                if is_known || size(inputs) < THRESHOLDS.disturbing_step * usual {
                    continue;
                }
                let jump = (curve.level(inputs[1]) - curve.level(inputs[0])).abs();
                // Of an even instant, which nobody knows to more than that.
                let moved = following.pole * jump * self.interval / 12.0_f64.sqrt();
                let shown = (moved / felt).ln() / following.pole;
                let until = self.time[row] + following.delay + shown;
                let last = holds.last().map_or(row, |hold| hold.end);
                let next = rows.last().map_or(row, |last| row.max(last + 1));
                rows.extend((next..last).take_while(|row| shown > 0.0 && self.time[*row] <= until));
            }
        }
        rows
    }

    /// Whether steps at their rows explain all that instants could: where it gains next to nothing to set them free, in a way to follow
    /// that was found without, the long search for them is not begun. A plain lag is asked first.
    fn rows_explain(&self, few: &Stepped, delays: Range<f64>) -> bool {
        let Some(following) = few.coarse(Steps::AtRows) else { return false };
        let at_rows = Trial { following, steps: Steps::AtRows, curve: None };
        let plain = few.search(at_rows, delays.clone()).plain();
        self.gain_of_instants(plain) < THRESHOLDS.instants_gain
            || self.gain_of_instants(few.follow(Trial { following: plain, ..at_rows }, delays))
                < THRESHOLDS.instants_gain
    }

    /// [-] logarithm of the likelihood that each step gains when its instant is free.
    fn gain_of_instants(&self, following: Following) -> f64 {
        let tried = |steps, ahead: f64| {
            let delay = following.delay + ahead * self.interval;
            self.carry_out(&Trial { following: Following { delay, ..following }, steps, curve: None })
        };
        let fixed = tried(Steps::AtRows, 0.0);
        // Steps half a row ahead of their rows on average are looked for half a row later.
        let free = [0.0, 0.5].map(|ahead| tried(Steps::Between, ahead).likelihood());
        (free[0].max(free[1]) - fixed.likelihood()) / fixed.steps.len().max(1) as f64
    }

    /// Whether so many steps can lie between holds that last, by the inputs alone: of what moves from row to row the holds would take
    /// three times the input's own memory.
    pub(crate) fn may_step<'b>(inputs: impl Iterator<Item = &'b [f64]>, fewest: usize) -> bool {
        let holds = inputs.flat_map(|inputs| inputs.chunk_by(|a, b| a == b));
        holds.filter(|hold| hold.len() > THRESHOLDS.shortest_hold_rows).take(fewest + 1).count() > fewest
    }

    /// Whether the input stands between its steps: `fewest` of them lie between holds that last, and no more do not that are nearly as
    /// large. (What moves from row to row leaves no hold in which its answer could be seen.)
    fn is_stepwise(&self, fewest: usize) -> bool {
        let lasts = |hold: &Hold| hold.end - hold.from > THRESHOLDS.shortest_hold_rows;
        let (mut clear, mut others) = (Vec::new(), Vec::new());
        for pair in self.stretches.iter().flat_map(|holds| holds.windows(2)) {
            let size = (pair[1].input - pair[0].input).abs();
            let kind = if pair.iter().all(lasts) { &mut clear } else { &mut others };
            kind.push(size);
        }
        let usual = median(clear.iter().copied()).unwrap_or(f64::INFINITY);
        let disturbing = others.iter().filter(|size| **size > THRESHOLDS.disturbing_step * usual).count();
        clear.len() >= fewest && disturbing <= clear.len()
    }

    /// [s] half of the holds last longer.
    fn usual_hold(&self) -> f64 {
        let holds = self.stretches.iter().flatten();
        let mut all: Vec<f64> = holds.map(|hold| self.time[hold.end - 1] - self.time[hold.from]).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }

    /// The first holds of all stretches, up to `most`.
    fn first_holds(&self, most: usize) -> Vec<Vec<Hold>> {
        let mut left = most;
        let mut few = Vec::new();
        for holds in self.stretches.iter().filter(|holds| holds.len() > 1) {
            let count = holds.len().min(left);
            if count > 1 {
                few.push(holds[..count].to_vec());
            }
            left -= count;
        }
        few
    }

    /// The dead time: none, and the output follows as it does `without`, where the data allow that, else its mean over what they
    /// allow; its standard deviation [s], and the logarithm of the likelihood of the best.
    fn delayed(&self, near: &Trial, without: Following) -> (Following, f64, f64) {
        let noise = self.carry_out(near).mean_square();
        let marginal = |following: Following| {
            let tried = self.carry_out(&Trial { following, ..*near });
            tried.likelihood()
                + tried.steps.iter().map(|(.., profile)| profile.evidence(noise).0).sum::<f64>()
        };
        let grid = THRESHOLDS.step_delay_grid;
        let about = |middle: f64, reach: f64| -> Vec<(f64, f64)> {
            let place = |at: usize| middle + reach * (2.0 * at as f64 / grid as f64 - 1.0);
            let delays = (0..=grid).map(|at| place(at).max(0.0));
            delays.map(|delay| (delay, marginal(Following { delay, ..near.following }))).collect()
        };
        let coarse = about(near.following.delay, self.interval);
        let top = coarse
            .iter()
            .copied()
            .fold((0.0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
        let near_top = |it: &&(f64, f64)| it.0 != top.0 && it.1 > top.1 - THRESHOLDS.far_below;
        // Even instants of many steps leave no more than a part of the interval that is one over their number.
        let mut all = match coarse.iter().find(near_top) {
            Some(_) => coarse,
            None => about(top.0, 2.0 * self.interval / grid as f64),
        };
        all.dedup_by(|a, b| a.0 == b.0);
        // A search of its own may end elsewhere.
        let plain = Following { delay: 0.0, ..near.following };
        let (without, none) = [without, plain]
            .map(|it| (it, marginal(it)))
            .into_iter()
            .fold((without, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best });
        let best = all.iter().map(|it| it.1).fold(none, f64::max);
        let weight = |value: f64| (value - best).exp();
        let sum: f64 = all.iter().map(|it| weight(it.1)).sum();
        let mean = all.iter().map(|it| weight(it.1) * it.0).sum::<f64>() / sum;
        let variance = all.iter().map(|it| weight(it.1) * (it.0 - mean).powi(2)).sum::<f64>() / sum;
        let is_none = sum == 0.0 || none > best - THRESHOLDS.no_step_delay;
        let found = if is_none { without } else { Following { delay: mean, ..near.following } };
        (found, variance.max(0.0).sqrt(), best)
    }
}

fn instant((row, inputs, profile): &(usize, [f64; 2], Profile), noise: f64) -> Instant {
    let (_, ahead, deviation) = profile.evidence(noise);
    Instant { row: *row, ahead, deviation, inputs: *inputs }
}
