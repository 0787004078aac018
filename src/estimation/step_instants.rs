//! When, between two rows of a record, its input stepped.
//!
//! A logger that writes rows on a clock of its own shows a step in the first row behind it: the step happened somewhere in the interval
//! before, and what the output did says where. Each step is a nuisance of its own with an even prior over its interval; a pole, which
//! may differ between steps up and down and along the input, a second lag, a dead time that all steps share, and a level of each hold
//! are fitted beside, so that none of them has to be known, and none of them is taken for an instant.

use std::ops::Range;

use super::golden_section::golden;
use super::quantile::median;
use super::step_course::Curve;
use super::step_trial::{Following, Profile, Steps, Trial};
pub(crate) use super::step_trial::{Hold, Stepped};
use super::thresholds::THRESHOLDS;

/// Rounds of a search, and of these each in which what did not show is asked for again.
const ROUNDS: usize = 8;
const ASKED_AGAIN: usize = 3;

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
    /// [-] of all changes of the output's level, the share that goes with the input; below zero, against it.
    pub answered: f64,
    /// [unit of the output] rms of what is left of the output, the steps at their instants.
    pub left: f64,
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

impl Stepped<'_> {
    /// The instants; `None` where fewer steps than `fewest` can be looked at.
    pub(crate) fn instants(&self, fewest: usize) -> Option<Instants> {
        if !self.is_stepwise(fewest) {
            return None;
        }
        let (few, many) =
            (self.first_holds(THRESHOLDS.searched_steps), self.first_holds(THRESHOLDS.judged_steps));
        let (few, many) = (Stepped { stretches: &few, ..*self }, Stepped { stretches: &many, ..*self });
        let trial = |following: Following, curve| Trial { following, steps: Steps::Between, curve };
        let poles = (0..THRESHOLDS.tried_poles).map(|power| 2.0 * 1.5_f64.powi(power));
        let tried = poles.map(|pole| Following::plain(pole, 0.0));
        let tried = tried.map(|it| (few.carry_out(&trial(it, None)).likelihood(), it));
        let coarse = tried.max_by(|a, b| a.0.total_cmp(&b.0))?.1;
        let latest = (0.5 * self.usual_hold()).min(THRESHOLDS.longest_step_delay).max(2.0 * self.interval);
        let first = few.follow(trial(coarse, None), 0.0..latest);
        let looked = many.carry_out(&trial(first, None));
        let curve = Curve::of(&looked.levels, looked.mean_square());
        let between = few.follow(trial(first, curve), 0.0..latest);
        let at_rows = Trial { steps: Steps::AtRows, ..trial(between, curve) };
        let [fixed, leads] = [0.0, -THRESHOLDS.longest_lead * self.interval].map(|earliest| {
            let following = few.follow(at_rows, earliest..latest);
            many.carry_out(&Trial { following, ..at_rows }).likelihood()
        });
        // Pole and lag go with the dead time: without one they are others.
        let without = few.follow(trial(between, curve), 0.0..0.0);
        let (found, delay_deviation, best) = many.delayed(&trial(between, curve), without);
        let judged = many.carry_out(&trial(between, curve));
        let (noise, answered) = (judged.mean_square(), judged.answered());
        let steps = self.carry_out(&trial(found, curve)).steps;
        let steps: Vec<Instant> = steps.iter().map(|step| instant(step, noise)).collect();
        (steps.len() >= fewest).then_some(Instants {
            steps,
            over_rows: best - fixed,
            over_lead: best - leads,
            delay_deviation,
            answered,
            left: noise.sqrt(),
        })
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

    /// The way to follow that leaves least, from one that is near, with no more in it than the data ask for.
    fn follow(&self, near: Trial, delays: Range<f64>) -> Following {
        let search = Search { record: self, trial: near, delays, interval: self.interval };
        let mut at = search.delay_on_a_grid();
        for round in 0..ROUNDS {
            let before = at;
            let asks = round % ASKED_AGAIN == 0;
            search.refine(&mut at, asks);
            search.go_on(&before.0, &mut at);
            if at.1 - before.1 < THRESHOLDS.step_search_end && asks {
                break;
            }
        }
        at.0
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
        let place = |at: usize| self.interval * (2.0 * at as f64 / grid as f64 - 1.0);
        let delays = (0..=grid).map(|at| (near.following.delay + place(at)).max(0.0));
        let all: Vec<(f64, f64)> =
            delays.map(|delay| (delay, marginal(Following { delay, ..near.following }))).collect();
        let none = marginal(without);
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

/// A search for the way to follow.
struct Search<'a> {
    record: &'a Stepped<'a>,
    trial: Trial,
    delays: Range<f64>,
    interval: f64,
}

/// A way to follow, and the logarithm of its likelihood.
type Found = (Following, f64);

impl Search<'_> {
    fn of(&self, following: Following) -> Found {
        (following, self.record.carry_out(&Trial { following, ..self.trial }).likelihood())
    }

    fn within(&self, delay: f64) -> f64 {
        delay.clamp(self.delays.start, self.delays.end)
    }

    /// The delay has several valleys.
    fn delay_on_a_grid(&self) -> Found {
        let Range { start, end } = self.delays;
        let count =
            (2.0 * (end - start) / self.interval).ceil().clamp(1.0, THRESHOLDS.most_step_delays) as usize;
        let delays = (0..=count).map(|step| start + (end - start) * step as f64 / count as f64);
        let tried = delays.map(|delay| self.of(Following::plain(self.trial.following.pole, delay)));
        let near = self.of(self.trial.following);
        tried.fold((near.0, f64::NEG_INFINITY), |best, next| if next.1 > best.1 { next } else { best })
    }

    /// Along one number, where that gains more than `gain`.
    fn along(&self, at: &mut Found, span: Range<f64>, gain: f64, with: impl Fn(f64) -> Following) {
        let (value, _) = golden(|value| -self.of(with(value)).1, span.start, span.end);
        let next = self.of(with(value));
        if next.1 > at.1 + gain {
            *at = next;
        }
    }

    /// Each number in turn. What shows already is refined; what does not is asked for where it `asks`, and has to show.
    fn refine(&self, at: &mut Found, asks: bool) {
        let gain = |value: f64| if value == 0.0 { THRESHOLDS.step_shape_gain } else { 0.0 };
        let it = at.0;
        self.along(at, it.pole / 1.5..it.pole * 1.5, 0.0, |pole| Following { pole, ..it });
        let it = at.0;
        let near = self.within(it.delay - self.interval)..self.within(it.delay + self.interval);
        self.along(at, near, 0.0, |delay| Following { delay, ..it });
        let it = at.0;
        if asks || it.upward != 0.0 {
            self.along(at, -0.4..0.4, gain(it.upward), |upward| Following { upward, ..it });
        }
        let it = at.0;
        let middles: &[f64] = if it.by_input != 0.0 { &[it.by_input] } else { &[-1.5, 0.0, 1.5] };
        if asks || it.by_input != 0.0 {
            for middle in middles {
                let with = |by_input: f64| Following { by_input, ..it };
                self.along(at, middle - 1.0..middle + 1.0, gain(it.by_input), with);
            }
        }
        let it = at.0;
        if asks || it.second != 0.0 {
            let pole = |second: f64| it.pole * (1.0 + second) / (1.0 + it.second);
            let lag = |second: f64| Following { second, pole: pole(second), ..it };
            // The sum of all times stays: what a second lag takes, the dead time gives.
            let delay = |second: f64| self.within(it.delay - (second - it.second) / it.pole);
            let late = |second: f64| Following { second, delay: delay(second), ..it };
            self.along(at, 0.0..THRESHOLDS.longest_second_lag, gain(it.second), lag);
            self.along(at, 0.0..THRESHOLDS.longest_second_lag, gain(it.second), late);
        }
    }

    /// Further on the way that a round has gone: pole, second lag and dead time stand in for each other.
    fn go_on(&self, from: &Following, at: &mut Found) {
        let to = at.0;
        self.along(at, 0.0..4.0, 0.0, |share| Following {
            pole: to.pole * (to.pole / from.pole).powf(share),
            upward: to.upward + share * (to.upward - from.upward),
            by_input: to.by_input + share * (to.by_input - from.by_input),
            second: (to.second + share * (to.second - from.second)).clamp(0.0, THRESHOLDS.longest_second_lag),
            delay: self.within(to.delay + share * (to.delay - from.delay)),
        });
    }
}

fn instant((row, inputs, profile): &(usize, [f64; 2], Profile), noise: f64) -> Instant {
    let (_, ahead, deviation) = profile.evidence(noise);
    Instant { row: *row, ahead, deviation, inputs: *inputs }
}
