//! A grid behind a law that moves the command lies as before where that moves it by whole steps: each command still comes to the level
//! that it came to with the others, all of them a step higher or lower, on another curve. No look from nearby leads from one to the next:
//! between them levels are off.

use super::followed_cost::FollowedCost;
use super::grid_constraint::{BoundedNumber, GridConstraint};
use super::grid_refine::Around;
use super::thresholds::THRESHOLDS;

/// The numbers with which the grid lies some whole steps further and the least is left when the numbers that may move beside have followed;
/// `None` where it is best left where it is.
pub(super) fn best_of_whole_steps(around: &Around, globals: &[f64], locals: &[f64]) -> Option<Vec<f64>> {
    let Around { problem, places, moves, .. } = *around;
    let cost = |globals: &[f64]| {
        FollowedCost::near(problem, (globals, places.grid.index), locals, moves).at(globals)
    };
    let most = THRESHOLDS.promising_share * cost(globals);
    let steps = (1..=THRESHOLDS.whole_steps).flat_map(|steps| [-f64::from(steps), f64::from(steps)]);
    let further = places.ahead.iter().flat_map(|place| steps.clone().map(move |steps| (place, steps)));
    let further = further.filter_map(|(place, steps)| moved_by(around, globals, place, steps));
    let best = further.map(|at| (cost(&at), at)).min_by(|a, b| a.0.total_cmp(&b.0));
    best.filter(|(cost, _)| *cost < most).map(|(_, at)| at)
}

/// The numbers with the one at `place` where the grid lies so many steps further, as many commands between two of them as before.
fn moved_by(around: &Around, globals: &[f64], place: &BoundedNumber, steps: f64) -> Option<Vec<f64>> {
    let Around { problem, data, places, .. } = *around;
    let spacing = GridConstraint::spacing(problem, data, places, globals)?;
    let here = GridConstraint::place(problem, data, places, globals)?;
    let at = |value: f64| places.moved(problem, globals, (place, value), Some(&spacing));
    let off = |globals: &[f64]| Some(places.steps_at(problem, globals, &here)? - here.steps() - steps);
    let (mut before, mut value) = (globals[place.index], globals[place.index] + globals[places.grid.index]);
    let mut off_before = -steps;
    for _ in 0..THRESHOLDS.most_secants {
        let (now, room) = (off(&at(value))?, place.bounds);
        if now.abs() < THRESHOLDS.whole_step_tolerance {
            return (room.0..=room.1).contains(&value).then(|| at(value));
        }
        let next = value - now * (value - before) / (now - off_before);
        (before, value, off_before) = (value, next, now);
        if !value.is_finite() {
            return None;
        }
    }
    None
}
