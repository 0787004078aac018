//! The numbers of a grid in a fit: moved to the best values nearby, and their standard errors. A law ahead of a grid, as a dead zone, has
//! no slope either: where it moves rows, it moves them by whole steps.

use super::block_data::BlockData;
use super::followed_cost::FollowedCost;
use super::grid_constraint::{BoundedNumber, GridConstraint, WithoutSlope};
use super::grid_cost::fine;
use super::grid_search::{sizes, spacing};
use super::joint_scan::JointScan;
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::estimation::output_error::Fit;

/// Moves a grid of a fit to the best one nearby, where the numbers at `moves`, of these sizes, may move beside it.
pub(crate) fn refine(
    problem: &Problem,
    data: &BlockData,
    places: &WithoutSlope,
    moves: &[(usize, f64)],
    found: &mut Fit,
) {
    let Some((_, typical)) = sizes(data) else { return };
    let mut globals = found.globals.clone();
    let mut followed = FollowedCost::near(problem, (&globals, places.grid.index), &found.locals, moves);
    let mut cost = |globals: &[f64]| followed.at(globals);
    let mut move_one =
        |globals: &mut Vec<f64>, place: &BoundedNumber, width: f64, constraint: Option<&GridConstraint>| {
            let at = |value: f64| places.moved(problem, globals, (place, value), constraint);
            let (best, least) =
                fine(|value| cost(&at(value)), globals[place.index], width, THRESHOLDS.grid_looks);
            *globals = at(best);
            least
        };
    let step = globals[places.grid.index];
    let mut left = f64::INFINITY;
    for round in 0..THRESHOLDS.most_grid_turns {
        // Where the grid lies comes first: off its place no other step is better. A whole step further it lies there again, on another
        // curve.
        let width = step * if round == 0 { THRESHOLDS.steps_ahead_of_grid } else { THRESHOLDS.phase_reach };
        let same_spacing = GridConstraint::spacing(problem, data, places, &globals);
        for place in &places.ahead {
            move_one(&mut globals, place, width, same_spacing.as_ref());
        }
        let mut now = move_one(&mut globals, &places.grid, spacing(step, typical), None);
        let same_place = GridConstraint::place(problem, data, places, &globals);
        for place in &places.ahead {
            now = move_one(&mut globals, place, width, same_place.as_ref());
        }
        let has_converged = now > (1.0 - THRESHOLDS.grid_turn_tolerance) * left;
        if places.ahead.is_empty() || has_converged {
            break;
        }
        left = now;
    }
    found.globals = globals;
}

/// What [`refine_with_error`] goes by beside the numbers.
pub(crate) struct Around<'a> {
    pub problem: &'a Problem<'a>,
    pub data: &'a BlockData,
    pub places: &'a WithoutSlope,
    /// Places and sizes of the numbers that may move beside them.
    pub moves: &'a [(usize, f64)],
}

impl<'a> Around<'a> {
    fn cost_beside(&self, found: &Fit) -> FollowedCost<'a> {
        FollowedCost::near(self.problem, (&found.globals, self.places.grid.index), &found.locals, self.moves)
    }
}

/// Moves the numbers without a slope of a fit to the best values nearby, and gives them standard errors: how far each must move until
/// the cost rises by the variance of the noise. Where one puts the grid elsewhere, the step goes with it, and so do the numbers that
/// may move beside: a curve takes up what a dead zone a hair wider leaves, and `follow` fits it to where they are moved. Where the fit
/// is worse for it, beyond the noise, they stay. Answers numbers that the data can hardly tell from these.
pub(crate) fn refine_with_error(
    around: &Around,
    follow: impl Fn(&[f64]) -> Fit,
    found: &mut Fit,
) -> Vec<Vec<f64>> {
    let Around { problem, data, places, .. } = *around;
    let Some((_, typical)) = sizes(data) else { return Vec::new() };
    let used = found.residuals.measured().iter().filter(|residual| **residual != 0.0).count().max(1);
    let limit_of = |cost: f64| cost + cost / used as f64;
    let mut cost = around.cost_beside(found);
    let mut cost_at = |globals: &[f64]| cost.at(globals);
    let scan = JointScan::around(problem, data, places, &found.globals, (&mut cost_at, limit_of));
    let moved = scan.best().unwrap_or(&found.globals).clone();
    let moved = best_nearby(around, moved, typical, &mut cost_at);
    if moved != found.globals {
        let followed = follow(&moved);
        if followed.cost <= limit_of(found.cost) {
            *found = followed;
        }
    }
    let mut cost = around.cost_beside(found);
    let mut cost_at = |globals: &[f64]| cost.at(globals);
    let at = found.globals.clone();
    let cost = cost_at(&at);
    let (grid, limit, mut step_error) = (places.grid.index, limit_of(cost), 0.0_f64);
    let worse = cost + THRESHOLDS.hardly_worse_errors.powi(2) * (limit - cost);
    let mut hardly_worse = scan.below(worse);
    for place in places.all() {
        let line = Line::through(around, place, at.clone());
        let own = standard_error(
            |value| cost_at(&line.at(value)),
            (at[place.index], place.bounds),
            at[grid],
            limit,
        );
        step_error = step_error.hypot(line.step_error(own));
        found.standard_errors[place.index] = own.hypot(scan.spread(place.index, &at, limit));
        let near = line.near(own).into_iter();
        hardly_worse.extend(near.filter(|globals| cost_at(globals) <= worse));
    }
    found.standard_errors[grid] = step_error.hypot(scan.spread(grid, &at, limit));
    hardly_worse
}

/// The best numbers near some, one moved after the other.
fn best_nearby(
    around: &Around,
    mut numbers: Vec<f64>,
    typical: f64,
    cost_at: &mut impl FnMut(&[f64]) -> f64,
) -> Vec<f64> {
    for place in around.places.all() {
        let line = Line::through(around, place, numbers.clone());
        let width = spacing(numbers[around.places.grid.index], typical);
        let along = |value: f64| cost_at(&line.at(value));
        numbers = line.at(fine(along, numbers[place.index], width, THRESHOLDS.grid_looks).0);
    }
    numbers
}

/// The numbers near some where one of them moves, and a step with it that keeps the place on the grid.
struct Line<'a> {
    around: &'a Around<'a>,
    place: &'a BoundedNumber,
    start: Vec<f64>,
    same_place: Option<GridConstraint>,
}

impl<'a> Line<'a> {
    fn through(around: &'a Around, place: &'a BoundedNumber, start: Vec<f64>) -> Self {
        let Around { problem, data, places, .. } = *around;
        let is_grid = place.index == places.grid.index;
        let same_place = GridConstraint::place(problem, data, places, &start).filter(|_| !is_grid);
        Self { around, place, start, same_place }
    }

    fn at(&self, value: f64) -> Vec<f64> {
        let Around { problem, places, .. } = *self.around;
        places.moved(problem, &self.start, (self.place, value), self.same_place.as_ref())
    }

    /// Standard error of the step where this is that of the number. Where nothing says how the step follows, nothing is known of it
    /// beside the number.
    fn step_error(&self, error: f64) -> f64 {
        let grid = self.around.places.grid.index;
        match &self.same_place {
            Some(_) => self.at(self.start[self.place.index] + error)[grid] - self.start[grid],
            None if self.place.index == grid => error,
            None => f64::INFINITY,
        }
    }

    /// Numbers a few standard errors to each side.
    fn near(&self, error: f64) -> Vec<Vec<f64>> {
        let looks = THRESHOLDS.hardly_worse_looks;
        let shares =
            (-looks..=looks).filter(|look| *look != 0).map(|look| f64::from(look) / f64::from(looks));
        let reach = THRESHOLDS.hardly_worse_errors * error;
        shares.map(|share| self.at(self.start[self.place.index] + share * reach)).collect()
    }
}

/// How far a number of a grid of this step can move until its cost stays above a limit; a side on which its bound comes first does not
/// count.
fn standard_error(
    mut cost: impl FnMut(f64) -> f64,
    (value, bounds): (f64, (f64, f64)),
    step: f64,
    limit: f64,
) -> f64 {
    // A number at zero has no size of its own.
    let size = value.abs().max(step);
    let mut reach = |sign: f64, room: f64| {
        let away = |count: i32| 2f64.powf(0.5 * f64::from(count)) * 1e-6 * size;
        let mut is_near = |count: &i32| cost(value + sign * away(*count)) <= limit;
        // The cost has steps of its own: it may rise, and fall again further away.
        match (0..THRESHOLDS.error_steps).rev().find(&mut is_near) {
            None => away(0),
            Some(last) if last + 1 < THRESHOLDS.error_steps => away(last + 1),
            // As large as itself, and no worse: it may be anything up to where it is.
            Some(last) => {
                let mut further = (last + 1..).take_while(|count| away(*count) < room);
                further.find(|count| !is_near(count)).map_or(room, away)
            }
        }
    };
    let rooms = [bounds.1 - value, value - bounds.0];
    let sides = [(reach(1.0, rooms[0]), rooms[0]), (reach(-1.0, rooms[1]), rooms[1])];
    let inside: Vec<f64> = sides.iter().filter(|(reach, room)| reach < room).map(|side| side.0).collect();
    if inside.is_empty() { bounds.1 - bounds.0 } else { inside.iter().sum::<f64>() / inside.len() as f64 }
}

#[cfg(test)]
mod tests {
    use super::super::block_data::Runs;
    use super::super::rotor_block::rotor_runs;
    use super::super::tests::{at_once, behind_a_dead_zone, noise};
    use super::*;
    use crate::estimation::normal_equations::sum_of_squares;
    use crate::estimation::output_error::{Free, OutputError, fit};
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

    /// A fit that holds the step and the width at these numbers, before and after they are refined; and what the truth leaves.
    fn refined(data: &BlockData, numbers: [f64; 2], places: &WithoutSlope) -> (Fit, Fit, f64) {
        let known = Model::paper().known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let inside: [&Effect; 2] = [effect("command_dead_zone"), effect("command_quantization")];
        let mut template = inside.iter().fold(Model::paper(), |model, effect| model.with(effect));
        let names = ["command_quantization.step", "command_dead_zone.width"].map(str::to_owned);
        for (name, value) in names.iter().zip(numbers) {
            template.set_parameter(name, value);
        }
        let problem = Problem::new(data, template, names.to_vec(), &inside);
        let held = numbers.map(|start| Free { start, bounds: (start, start), scale: 1.0 });
        let before = fit(&problem, &held, None, &THRESHOLDS.full_fit);
        let mut after = before.clone();
        let follow = |numbers: &[f64]| {
            let held =
                [numbers[0], numbers[1]].map(|start| Free { start, bounds: (start, start), scale: 1.0 });
            fit(&problem, &held, Some(&before.locals), &THRESHOLDS.full_fit)
        };
        refine_with_error(&Around { problem: &problem, data, places, moves: &[] }, follow, &mut after);
        let mut left = vec![0.0; problem.len()];
        problem.residuals(&[STEP, WIDTH], &after.locals, &mut left);
        (before, after, sum_of_squares(&left))
    }

    /// Where one of thirty commands comes to another level a row too late, to move the width or the step alone makes it worse: from
    /// beside them both are found together, and their errors say how well.
    #[test]
    fn a_width_and_a_step_that_are_a_row_off_are_found_together() {
        let data = ramp();
        for (width, step) in [(-2.7e-4, 8e-6), (3.5e-4, -1.1e-5)] {
            let (_, fitted, of_truth) = refined(&data, [STEP + step, WIDTH + width], &behind_a_dead_zone());
            // A crossing that is a row off costs a tenth.
            assert!(fitted.cost < 1.02 * of_truth, "{} and {of_truth} of the truth", fitted.cost);
            for (at, (truth, most)) in [(STEP, 2e-5), (WIDTH, 4e-4)].into_iter().enumerate() {
                let (found, error) = (fitted.globals[at], fitted.standard_errors[at]);
                assert!((found - truth).abs() < 3.0 * error, "{found} ± {error}, {truth} is right");
                // The ramp goes on by 4e-4 from row to row.
                assert!(error < most, "± {error}");
            }
        }
    }

    /// Of a parabola that reaches the limit 0.01 from its lowest point; what is looked at are places the root of two apart.
    #[test]
    fn an_error_is_how_far_a_number_may_go() {
        for (value, bounds) in
            [(0.1, (0.0, 0.5)), (0.0, (0.0, 0.5)), (0.004, (0.0, 0.5)), (-0.2, (-0.2, 0.5))]
        {
            // Beyond a bound it stays there.
            let cost = |at: f64| ((at.max(bounds.0).min(bounds.1) - value) / 0.01).powi(2);
            let error = standard_error(cost, (value, bounds), STEP, 1.0);
            assert!((0.01..0.0142).contains(&error), "{value} within {bounds:?}: {error}");
        }
        assert_eq!(
            standard_error(|_| 0.0, (0.01, (0.0, 0.03)), STEP, 1.0),
            0.03,
            "anywhere within its bounds"
        );
        // One near zero that may be anything up to twenty times a step.
        let far = |at: f64| f64::from(at > 0.6);
        let error = standard_error(far, (0.0, (0.0, 1.0)), STEP, 0.5);
        assert!((0.6..0.9).contains(&error), "{error}");
    }

    /// Bounds that leave out where the numbers are move them to worse ones.
    #[test]
    fn what_makes_a_fit_worse_is_not_kept() {
        let data = ramp();
        let mut places = behind_a_dead_zone();
        places.ahead[0].bounds.0 = 0.2;
        let (before, after, _) = refined(&data, [STEP, WIDTH], &places);
        assert_eq!((after.globals, after.cost), (before.globals, before.cost));
    }

    /// No command gets through: nothing says how the step would follow the width.
    #[test]
    fn of_a_grid_that_no_command_comes_to_nothing_is_known() {
        let mut data = at_once((0..400).map(|row| 0.3 * f64::from(row) / 399.0));
        data.sigma[0] = 1.0;
        let (_, after, _) = refined(&data, [STEP, 0.4], &behind_a_dead_zone());
        assert_eq!(after.standard_errors[0], f64::INFINITY);
    }
}
