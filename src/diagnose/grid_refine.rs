//! The numbers of a grid in a fit: moved to the best values nearby, and their standard errors. A law ahead of a grid, as a dead zone, has
//! no slope either: where it moves rows, it moves them by whole steps.

use super::block_data::{BlockData, Runs};
use super::grid_cost::{fine, taken_up};
use super::grid_search::{sizes, spacing};
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::normal_equations::{remove, sum_of_squares};
use crate::estimation::output_error::{Fit, OutputError, Residuals};
use crate::estimation::quantile::{distinct, extremes, median};

/// Share of their range by which two commands differ that are not the same.
const SAME_COMMAND: f64 = 1e-6;

/// Places of the numbers without a slope among those of a problem.
#[derive(Debug, Clone)]
pub(crate) struct WithoutSlope {
    /// The step of the grid.
    pub grid: usize,
    /// Numbers of laws ahead of it.
    pub ahead: Vec<usize>,
}

/// Moves a grid of a fit to the best one nearby, where the numbers at `moves`, of these sizes, may move beside it.
pub(crate) fn refine(
    problem: &Problem,
    data: &BlockData,
    places: &WithoutSlope,
    moves: &[(usize, f64)],
    found: &mut Fit,
) {
    let Some((_, typical)) = sizes(data) else { return };
    let mut scratch = vec![0.0; problem.len()];
    let mut globals = found.globals.clone();
    let taken_up = bent(problem, places, moves, found);
    let mut cost = |globals: &[f64]| {
        problem.residuals(globals, &found.locals, &mut scratch);
        remove(&taken_up, &mut scratch);
        sum_of_squares(&scratch)
    };
    let mut move_one = |globals: &mut Vec<f64>, place: usize, width: f64, held: Option<&Held>| {
        let at = |value: f64| places.moved(problem, globals, (place, value), held);
        let (best, least) = fine(|value| cost(&at(value)), globals[place], width, THRESHOLDS.grid_looks);
        *globals = at(best);
        least
    };
    let step = globals[places.grid];
    let mut left = f64::INFINITY;
    for round in 0..THRESHOLDS.most_grid_turns {
        // Where the grid lies comes first: off its place no other step is better. A whole step further it lies there again, on another
        // curve.
        let width = step * if round == 0 { THRESHOLDS.steps_ahead_of_grid } else { THRESHOLDS.place_on_grid };
        let spacing_held = Held::spacing(problem, data, places, &globals);
        for place in &places.ahead {
            move_one(&mut globals, *place, width, spacing_held.as_ref());
        }
        let mut now = move_one(&mut globals, places.grid, spacing(step, typical), None);
        let place_held = Held::place(problem, data, places, &globals);
        for place in &places.ahead {
            now = move_one(&mut globals, *place, width, place_held.as_ref());
        }
        let is_settled = now > (1.0 - THRESHOLDS.settled_grid) * left;
        if places.ahead.is_empty() || is_settled {
            break;
        }
        left = now;
    }
    found.globals = globals;
}

/// Moves the numbers without a slope of a fit to the best values nearby, and gives them standard errors: how far each must move until
/// the cost rises by the variance of the noise. Where one puts the grid elsewhere, the step goes with it, and so do the numbers at
/// `moves`, of these sizes: a curve takes up what a dead zone a hair wider leaves.
pub(crate) fn refine_with_error(
    problem: &Problem,
    data: &BlockData,
    places: &WithoutSlope,
    moves: &[(usize, f64)],
    found: &mut Fit,
) {
    let Some((_, typical)) = sizes(data) else { return };
    let used = found.residuals.measured().iter().filter(|residual| **residual != 0.0).count().max(1);
    let mut scratch = vec![0.0; problem.len()];
    let taken_up = if places.ahead.is_empty() { Vec::new() } else { bent(problem, places, moves, found) };
    let mut cost_at = |globals: &[f64]| {
        problem.residuals(globals, &found.locals, &mut scratch);
        remove(&taken_up, &mut scratch);
        sum_of_squares(&scratch)
    };
    let looked = Looked::around(problem, data, places, &found.globals, &mut cost_at);
    if let Some(best) = looked.best() {
        found.globals.clone_from(best);
    }
    let (mut step_error, mut limit) = (0.0, 0.0);
    for place in places.ahead.iter().copied().chain([places.grid]) {
        let start = found.globals.clone();
        let held = Held::place(problem, data, places, &start).filter(|_| place != places.grid);
        let at = |value: f64| places.moved(problem, &start, (place, value), held.as_ref());
        let mut cost = |value: f64| cost_at(&at(value));
        let width = spacing(start[places.grid], typical);
        let (value, least) = fine(&mut cost, start[place], width, THRESHOLDS.grid_looks);
        limit = least + least / used as f64;
        let error = 0.5 * [1.0, -1.0].map(|sign| reach(&mut cost, value, sign, limit)).iter().sum::<f64>();
        found.globals = at(value);
        let step_moves = at(value + error)[places.grid] - found.globals[places.grid];
        step_error =
            if place == places.grid { error.hypot(step_error) } else { step_moves.hypot(step_error) };
        found.standard_errors[place] = error;
    }
    found.standard_errors[places.grid] = step_error;
    for place in places.ahead.iter().copied().chain([places.grid]) {
        let error = &mut found.standard_errors[place];
        *error = error.hypot(looked.spread(place, &found.globals, limit));
    }
    problem.residuals(&found.globals, &found.locals, &mut scratch);
    found.cost = sum_of_squares(&scratch);
    found.residuals = Residuals::of(scratch, problem.measured());
}

/// How far a value can move to one side until its cost stays above a limit.
fn reach(mut cost: impl FnMut(f64) -> f64, value: f64, sign: f64, limit: f64) -> f64 {
    let step = |count: i32| 2f64.powf(0.5 * f64::from(count)) * 1e-6 * value;
    // The cost has steps of its own: it may rise, and fall again further away.
    let is_near = |count: &i32| cost(value + sign * step(*count)) <= limit;
    let last = (0..THRESHOLDS.error_steps).rev().find(is_near);
    last.map_or_else(|| step(0), |last| step(last + 1)).min(value)
}

/// What the numbers at `moves` take up of the residuals of a fit without its grid: on one they have no slope.
fn bent(problem: &Problem, places: &WithoutSlope, moves: &[(usize, f64)], found: &Fit) -> Vec<Vec<f64>> {
    let mut globals = found.globals.clone();
    globals[places.grid] = 0.0;
    taken_up(problem, &globals, &found.locals, moves)
}

/// Numbers of a grid and of a law ahead of it, looked at together, and their costs. Wherever a command that was sent comes to another
/// level the cost has a step: moved one by one they stay where they are.
#[derive(Default)]
struct Looked {
    looked: Vec<(Vec<f64>, f64)>,
    /// By how much each of the numbers, all of the problem, differs from one look to the next.
    apart: Vec<f64>,
}

impl Looked {
    /// Looks where each command still comes to the level at which it is, or to the one beside it, and closer about the best; nowhere
    /// without a law ahead, or on very many rows.
    fn around(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
        cost: &mut impl FnMut(&[f64]) -> f64,
    ) -> Self {
        let (Runs::Rotor(runs), [ahead]) = (&data.runs, &places.ahead[..]) else { return Self::default() };
        let commands: Vec<f64> = runs.iter().flat_map(|run| run.command.iter().copied()).collect();
        let (low, high) = extremes(commands.iter().copied());
        let gaps = distinct(&commands).windows(2).map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>();
        // Less is the same command, written with other last digits.
        let gap = median(gaps.into_iter().filter(|gap| *gap > SAME_COMMAND * (high - low)));
        let (Some(gap), false) = (gap, problem.len() > THRESHOLDS.most_searched_rows) else {
            return Self::default();
        };
        let mut all =
            Self { looked: vec![(globals.to_vec(), cost(globals))], apart: vec![0.0; globals.len()] };
        let [shifts, stretches] = THRESHOLDS.looks_around;
        let side = |count: i32| (-count..=count).map(move |at| f64::from(at) / f64::from(count));
        for reach in THRESHOLDS.commands_around.map(|gaps| gaps * gap) {
            let Some(about) = all.best().cloned() else { break };
            let Some(held) = Held::spacing(problem, data, places, &about) else { break };
            let share = reach / (high - low);
            for shift in side(shifts) {
                let shifted = (*ahead, about[*ahead] + reach * shift);
                let shifted = places.moved(problem, &about, shifted, Some(&held));
                for stretch in side(stretches) {
                    let mut at = shifted.clone();
                    at[places.grid] *= 1.0 + stretch * share;
                    let cost = cost(&at);
                    all.looked.push((at, cost));
                }
            }
            all.apart[*ahead] = reach / f64::from(shifts);
            all.apart[places.grid] = about[places.grid] * share / f64::from(stretches);
        }
        all
    }

    /// The best of them.
    fn best(&self) -> Option<&Vec<f64>> {
        self.looked.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(best, _)| best)
    }

    /// By how much the number at `place` differs from `best` at most where the cost is below a limit: from one look to the next, at least.
    fn spread(&self, place: usize, best: &[f64], limit: f64) -> f64 {
        let near = self.looked.iter().filter(|(_, cost)| *cost <= limit);
        let apart = self.apart.get(place).copied().unwrap_or(0.0);
        near.map(|(at, _)| (at[place] - best[place]).abs()).fold(apart, f64::max)
    }
}

/// What stays of a grid where a law ahead of it moves, at a command in the middle.
struct Held {
    command: f64,
    /// [-] commands to each side between which a slope is taken; zero where the place on the grid stays, and not its spacing.
    reach: f64,
    /// What stays, in steps.
    steps: f64,
}

impl Held {
    /// The place on the grid as `globals` have it; `None` where nothing is ahead of the grid.
    fn place(problem: &Problem, data: &BlockData, places: &WithoutSlope, globals: &[f64]) -> Option<Self> {
        Self::of(problem, data, places, globals, 0.0)
    }

    /// How many commands as they are sent lie between two steps: so many whole steps further the grid lies as before.
    fn spacing(problem: &Problem, data: &BlockData, places: &WithoutSlope, globals: &[f64]) -> Option<Self> {
        Self::of(problem, data, places, globals, THRESHOLDS.spacing_reach)
    }

    fn of(
        problem: &Problem,
        data: &BlockData,
        places: &WithoutSlope,
        globals: &[f64],
        reach: f64,
    ) -> Option<Self> {
        let Runs::Rotor(runs) = &data.runs else { return None };
        let (low, high) = extremes(runs.iter().flat_map(|run| run.command.iter().copied()));
        let held = Self { command: 0.5 * (low + high), reach: reach * (high - low), steps: 1.0 };
        let steps = places.kept(problem, globals, &held)? / globals[places.grid];
        (!places.ahead.is_empty() && steps.is_finite() && steps > 0.0).then_some(Self { steps, ..held })
    }
}

impl WithoutSlope {
    /// The same numbers with another one at a place; `held` says what stays of the grid.
    fn moved(
        &self,
        problem: &Problem,
        globals: &[f64],
        (place, value): (usize, f64),
        held: Option<&Held>,
    ) -> Vec<f64> {
        let mut moved = globals.to_vec();
        // Neither a step nor what is ahead of one is negative.
        moved[place] = value.max(0.0);
        if let Some(held) = held {
            let kept = self.kept(problem, &moved, held);
            moved[self.grid] = kept.map_or(moved[self.grid], |kept| kept / held.steps);
        }
        moved
    }

    /// [-] what comes to the grid of a command, or how much more of one that is more.
    fn kept(&self, problem: &Problem, globals: &[f64], held: &Held) -> Option<f64> {
        let mut without = globals.to_vec();
        without[self.grid] = 0.0;
        let equations = problem.model(&without).equations().ok()?;
        let of = |command: f64| equations.command_behind_laws(command);
        let (command, reach) = (held.command, held.reach);
        Some(if reach > 0.0 { of(command + reach) - of(command - reach) } else { of(command) })
    }
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::super::tests::noise;
    use super::*;
    use crate::estimation::output_error::{Free, fit};
    use crate::log::Dataset;
    use crate::model::{Effect, Model};

    const WIDTH: f64 = 0.0123;
    const STEP: f64 = 0.03;

    /// A slow ramp up to full command behind a dead zone and on a grid, in a hundred small Euler steps a row: no code of the model.
    fn ramp() -> BlockData {
        let (rows, parts) = (2250, 100);
        let time: Vec<f64> = (0..rows).map(|row| 0.02 * row as f64).collect();
        let command: Vec<f64> = time.iter().map(|time| 0.1 + 0.02 * time).collect();
        let g = |u: f64| 1124.5 * u + 447.1 * u * u;
        let of = |u: f64| g(((u - WIDTH) / (1.0 - WIDTH) / STEP).round() * STEP);
        let mut rate = of(0.1);
        let mut rates = Vec::new();
        for (row, u) in command.iter().enumerate() {
            rates.push(rate + 1.5 * noise(row));
            for _ in 0..parts {
                rate += 0.02 / f64::from(parts) * 16.0 * (of(*u) - rate);
            }
        }
        let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
        let mut data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
        data.sigma[0] = 1.5;
        data
    }

    /// Where one of thirty commands comes to another level a row too late, to move the width or the step alone makes it worse: from
    /// beside them both are found together, and their errors say how well.
    #[test]
    fn a_width_and_a_step_that_are_a_row_off_are_found_together() {
        let data = ramp();
        let known = Model::paper().known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let inside: [&Effect; 2] = [effect("command_dead_zone"), effect("command_quantization")];
        let mut template = inside.iter().fold(Model::paper(), |model, effect| model.with(effect));
        for (width, step) in [(-2.7e-4, 8e-6), (3.5e-4, -1.1e-5)] {
            template.set_parameter("command_dead_zone.width", WIDTH + width);
            template.set_parameter("command_quantization.step", STEP + step);
            let names = ["command_quantization.step", "command_dead_zone.width"].map(str::to_owned);
            let problem = Problem::new(&data, template.clone(), names.to_vec(), &inside);
            let held = |name: &String| {
                let start = template.parameter(name).expect("put in");
                Free { start, bounds: (start, start), scale: 1.0 }
            };
            let mut fitted = fit(&problem, &names.each_ref().map(held), None, &THRESHOLDS.full_fit);
            let places = WithoutSlope { grid: 0, ahead: vec![1] };
            refine_with_error(&problem, &data, &places, &[], &mut fitted);
            let (found, errors) = (&fitted.globals, &fitted.standard_errors);
            let mut left = vec![0.0; problem.len()];
            problem.residuals(&[STEP, WIDTH], &fitted.locals, &mut left);
            let of_truth = sum_of_squares(&left);
            // A crossing that is a row off costs a tenth.
            assert!(fitted.cost < 1.02 * of_truth, "{} and {of_truth} of the truth", fitted.cost);
            for (at, (truth, most)) in [(STEP, 2e-5), (WIDTH, 4e-4)].into_iter().enumerate() {
                let (found, error) = (found[at], errors[at]);
                assert!((found - truth).abs() < 3.0 * error, "{found} ± {error}, {truth} is right");
                // The ramp goes on by 4e-4 from row to row.
                assert!(error < most, "± {error}");
            }
        }
    }
}
