//! Parameters without a slope: the step of a grid moves the error in jumps, so that no derivative leads to it. They
//! are found by looking at every value that could make a difference.

use super::block_data::{BlockData, Runs};
use super::problem::Problem;
use super::thresholds::THRESHOLDS;
use crate::effect::Site;
use crate::estimation::normal_equations::{orthonormal, remove, sum_of_squares};
use crate::estimation::output_error::{Fit, OutputError, Residuals};
use crate::estimation::pseudo_huber::pseudo_huber;
use crate::estimation::quantile::extremes;
use crate::model::{Effect, Model};

/// Share of its typical size by which a number is moved to see what it takes up.
const SLOPE_STEP: f64 = 1e-4;

/// A number that a fit may move beside a grid.
#[derive(Debug, Clone)]
pub(crate) struct MovableNumber {
    /// What the model calls it.
    pub name: String,
    /// The size it typically has, in its unit.
    pub scale: f64,
}

/// Values of the parameter `name` of `template` from which a fit is promising, best first.
pub(crate) fn values(
    data: &BlockData,
    template: &Model,
    name: &str,
    bounds: (f64, f64),
    (inside, beside): (&[&Effect], &[MovableNumber]),
) -> Vec<f64> {
    let plain = without_other_laws(data, template, name, inside);
    let (data, template) = plain.as_ref().map_or((data, template), |(data, model)| (data, model));
    let inside: Vec<&Effect> = inside.iter().copied().filter(|effect| template.has(&effect.id)).collect();
    let inside = inside.as_slice();
    let beside: Vec<&MovableNumber> =
        beside.iter().filter(|it| template.parameter(&it.name).is_some()).collect();
    let beside = beside.as_slice();
    let quieter = in_units_of_what_is_left(data, template, name, inside);
    let data = quieter.as_ref().unwrap_or(data);
    let Some((least, typical)) = sizes(data) else { return Vec::new() };
    let few = data.in_short_pieces((data.len() / THRESHOLDS.grid_first_samples).max(1));
    // A hair beside the right grid all levels but one or two fit, and those are off by a whole step: squares would rank it
    // behind grids on which nothing fits.
    let mut cost = cost_of(&few, template, name, (inside, beside));
    let mut grid = Vec::new();
    // From the coarse end: where there are too many, the finest, which matter least, are left out.
    let mut value = bounds.1;
    while value >= least.max(bounds.0) && value > 0.0 && grid.len() < THRESHOLDS.most_grid_values {
        grid.push(value);
        value -= spacing(value, typical);
    }
    let kept = apart(grid, &mut cost, typical, THRESHOLDS.grid_values_second);
    let some = data.in_short_pieces((data.len() / THRESHOLDS.grid_second_samples).max(1));
    let mut cost = cost_of(&some, template, name, (inside, beside));
    let closer = |values: Vec<f64>, cost: &mut dyn FnMut(f64) -> f64| -> Vec<f64> {
        values.into_iter().map(|value| fine(&mut *cost, value, spacing(value, typical), 1).0).collect()
    };
    let kept = closer(kept, &mut cost);
    let left = apart(kept, &mut cost, typical, THRESHOLDS.grid_values_third);
    let mut cost = cost_of(data, template, name, (inside, beside));
    let left = closer(left, &mut cost);
    let best = apart(left, &mut cost, typical, THRESHOLDS.grid_values_closer);
    best.into_iter()
        .map(|value| fine(&mut cost, value, spacing(value, typical), THRESHOLDS.grid_looks).0)
        .collect()
}

/// The same context for a rotor that merely follows: what `template` leaves of the data on top of what the rotor would
/// do by itself, and the model without its laws behind the command. Thousands of values are looked at, and a grid moves
/// both in the same way; `None` where there is nothing to leave out.
fn without_other_laws(
    data: &BlockData,
    template: &Model,
    name: &str,
    inside: &[&Effect],
) -> Option<(BlockData, Model)> {
    let mut model = inside
        .iter()
        .filter(|effect| effect.site != Site::Command)
        .fold(template.clone(), |model, effect| model.without(&effect.id));
    if model.effects.len() == template.effects.len() {
        return None;
    }
    let simulated = |of: &Model| {
        let mut smooth = of.clone();
        smooth.set_parameter(name, 0.0);
        Problem::new(data, smooth, Vec::new(), inside).simulated()
    };
    let (whole, alone) = (simulated(template)?, simulated(&model)?);
    let mut plain = data.clone();
    if let Runs::Rotor(runs) = &mut plain.runs {
        for (run, (whole, alone)) in runs.iter_mut().zip(whole.iter().zip(&alone)) {
            let rates = run.measured.iter_mut().zip(whole.iter().zip(alone));
            rates.for_each(|(rate, (whole, alone))| *rate += alone - whole);
        }
    }
    model.standard_errors.clear();
    Some((plain, model))
}

/// The same data with the noise that what is left without the grid shows, weighed as [`weigh_channels`] does: what the data came
/// with may be of a model that lacks more. `None` where it is no less.
fn in_units_of_what_is_left(
    data: &BlockData,
    template: &Model,
    name: &str,
    inside: &[&Effect],
) -> Option<BlockData> {
    let mut smooth = template.clone();
    smooth.set_parameter(name, 0.0);
    let problem = Problem::new(data, smooth, Vec::new(), inside);
    let mut left = vec![0.0; problem.len()];
    problem.residuals(&[], &vec![0.0; problem.units().len() * problem.locals()], &mut left);
    let used = left.iter().filter(|left| **left != 0.0).count().max(1);
    let rms = (sum_of_squares(&left) / used as f64).sqrt() * data.sigma[0];
    let left = Residuals::of(left, problem.measured());
    let noise = data.white_noise(&left, 0).max(THRESHOLDS.least_channel_weight * rms);
    (noise < data.sigma[0]).then(|| {
        let mut quieter = data.clone();
        quieter.sigma[0] = noise;
        quieter
    })
}

/// The best of some values, not two from one valley.
fn apart(values: Vec<f64>, cost: &mut impl FnMut(f64) -> f64, typical: f64, most: usize) -> Vec<f64> {
    let mut scored: Vec<(f64, f64)> = values.into_iter().map(|value| (cost(value), value)).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut apart: Vec<f64> = Vec::new();
    for (_, value) in scored {
        if apart.iter().all(|other| (value - other).abs() > THRESHOLDS.starts_apart * spacing(value, typical))
        {
            apart.push(value);
        }
        if apart.len() == most {
            break;
        }
    }
    apart
}

/// Moves the parameter `index` of a fit to the best value nearby, where the numbers at `moves`, of these sizes, may move beside it.
pub(crate) fn refine(
    problem: &Problem,
    data: &BlockData,
    index: usize,
    moves: &[(usize, f64)],
    found: &mut Fit,
) {
    let Some((_, typical)) = sizes(data) else { return };
    let mut scratch = vec![0.0; problem.len()];
    let mut globals = found.globals.clone();
    // On a grid a dead zone's width moves single rows by whole steps: slopes are those without it.
    globals[index] = 0.0;
    let taken_up = taken_up(problem, &globals, &found.locals, moves);
    let cost = |value: f64| {
        globals[index] = value;
        problem.residuals(&globals, &found.locals, &mut scratch);
        remove(&taken_up, &mut scratch);
        sum_of_squares(&scratch)
    };
    let start = found.globals[index];
    found.globals[index] = fine(cost, start, spacing(start, typical), THRESHOLDS.grid_looks).0;
}

/// Moves the parameter `index` of a fit to the best value nearby, and gives it a standard error: how far it must
/// move until the cost rises by the variance of the noise.
pub(crate) fn refine_with_error(problem: &Problem, data: &BlockData, index: usize, found: &mut Fit) {
    let Some((_, typical)) = sizes(data) else { return };
    let start = found.globals[index];
    let mut scratch = vec![0.0; problem.len()];
    let mut globals = found.globals.clone();
    let mut cost = |value: f64| {
        globals[index] = value;
        problem.residuals(&globals, &found.locals, &mut scratch);
        sum_of_squares(&scratch)
    };
    let (value, least) = fine(&mut cost, start, spacing(start, typical), THRESHOLDS.grid_looks);
    let used = found.residuals.measured().iter().filter(|residual| **residual != 0.0).count().max(1);
    let rise = least / used as f64;
    let side = |sign: f64, cost: &mut dyn FnMut(f64) -> f64| {
        let step = |count: i32| 2f64.powf(0.5 * f64::from(count)) * 1e-6 * value;
        (0..THRESHOLDS.error_steps)
            .map(step)
            .find(|step| cost(value + sign * step) > least + rise)
            .unwrap_or(value)
    };
    let error = 0.5 * (side(1.0, &mut cost) + side(-1.0, &mut cost));
    found.globals[index] = value;
    found.cost = least;
    problem.residuals(&found.globals, &found.locals, &mut scratch);
    found.residuals = Residuals::of(scratch, problem.measured());
    found.standard_errors[index] = error;
}

/// The best of the values about one, and its cost, in `looks` that come closer and closer.
fn fine(mut cost: impl FnMut(f64) -> f64, about: f64, spacing: f64, looks: i32) -> (f64, f64) {
    let mut best = (about, cost(about));
    let mut width = spacing;
    for _ in 0..looks {
        let middle = best.0;
        for step in (-THRESHOLDS.grid_fine_values..=THRESHOLDS.grid_fine_values).filter(|step| *step != 0) {
            let value = middle + width * f64::from(step) / f64::from(THRESHOLDS.grid_fine_values);
            let scored = (value, cost(value));
            if scored.1 < best.1 {
                best = scored;
            }
        }
        width *= THRESHOLDS.grid_overlap / f64::from(THRESHOLDS.grid_fine_values);
    }
    best
}

fn spacing(value: f64, typical: f64) -> f64 {
    (THRESHOLDS.grid_phase * value * value / typical).min(THRESHOLDS.most_grid_spacing * value)
}

/// The robust cost of values of a grid, whatever numbers beside it can take up taken away: a grid a hair wider is a curve a
/// hair steeper, too.
fn cost_of<'a>(
    data: &'a BlockData,
    template: &Model,
    name: &str,
    (inside, beside): (&[&Effect], &[&MovableNumber]),
) -> impl FnMut(f64) -> f64 + 'a + use<'a> {
    let names = std::iter::once(name.to_owned()).chain(beside.iter().map(|it| it.name.clone())).collect();
    let problem = Problem::new(data, template.clone(), names, inside);
    let locals = vec![0.0; problem.units().len() * problem.locals()];
    let mut globals = vec![0.0];
    globals.extend(beside.iter().map(|it| template.parameter(&it.name).unwrap_or(0.0)));
    let moves: Vec<(usize, f64)> = beside.iter().enumerate().map(|(at, it)| (at + 1, it.scale)).collect();
    let taken_up = taken_up(&problem, &globals, &locals, &moves);
    let mut residuals = vec![0.0; problem.len()];
    move |value| {
        globals[0] = value;
        problem.residuals(&globals, &locals, &mut residuals);
        remove(&taken_up, &mut residuals);
        pseudo_huber(&residuals, THRESHOLDS.grid_robust_width)
    }
}

/// What some numbers of a problem can take up of its residuals, near where they are: an orthonormal basis. `moves` are their places
/// and sizes.
fn taken_up(problem: &Problem, globals: &[f64], locals: &[f64], moves: &[(usize, f64)]) -> Vec<Vec<f64>> {
    // On a long log the grid of a part of it is near, and columns of all rows would be many.
    if problem.len() > THRESHOLDS.most_searched_rows {
        return Vec::new();
    }
    let simulated = |globals: &[f64]| {
        let mut residuals = vec![0.0; problem.len()];
        problem.residuals(globals, locals, &mut residuals);
        residuals
    };
    let here = simulated(globals);
    let slope = |(place, size): &(usize, f64)| {
        let mut moved = globals.to_vec();
        moved[*place] += SLOPE_STEP * size;
        simulated(&moved).iter().zip(&here).map(|(moved, here)| moved - here).collect::<Vec<f64>>()
    };
    let mut slopes: Vec<Vec<f64>> = moves.iter().map(slope).collect();
    // A simulation that ran away has no slope.
    slopes.retain(|slope| slope.iter().all(|value| value.is_finite()));
    orthonormal(&slopes, &(0..problem.len()))
}

/// [-] The smallest grid that shows above the noise, and a typical command.
fn sizes(data: &BlockData) -> Option<(f64, f64)> {
    let Runs::Rotor(runs) = &data.runs else { return None };
    let command = extremes(runs.iter().flat_map(|run| run.command.iter().copied()));
    let rate = extremes(runs.iter().flat_map(|run| run.measured.iter().copied()));
    let slope = (rate.1 - rate.0) / (command.1 - command.0);
    // A rounding error is spread evenly over a step: its rms is the step over the root of 12.
    let least = THRESHOLDS.least_grid_noise * data.sigma[0] * 12f64.sqrt() / slope;
    (least.is_finite() && least > 0.0 && command.1 > 0.0).then_some((least, command.1))
}

#[cfg(test)]
mod tests {
    use super::super::rotor_block::rotor_runs;
    use super::*;
    use crate::log::Dataset;

    const STEP: f64 = 0.0061;

    /// A rotor that gets its command on a grid, behind two lags, in a hundred small Euler steps a sample: no code of the
    /// model.
    fn on_a_grid() -> BlockData {
        let (rows, parts) = (2000, 100);
        let time: Vec<f64> = (0..rows).map(|row| 0.02 * f64::from(row)).collect();
        // A new level every quarter of a second, from a multiplicative hash.
        let level =
            |row: i32| f64::from((row as u32 / 12).wrapping_mul(2_654_435_761) >> 16 & 0xfff) / 4096.0;
        let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.3 * level(row)).collect();
        let g = |u: f64| 1124.5 * u + 447.1 * u * u;
        let (mut behind, mut rate) = (g(0.3), g(0.3));
        let mut rates = Vec::new();
        for u in &command {
            rates.push(rate);
            for _ in 0..parts {
                let step = 0.02 / f64::from(parts);
                behind += step * 40.0 * (g((u / STEP).round() * STEP) - behind);
                rate += step * 16.0 * (behind - rate);
            }
        }
        let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
        let mut data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
        data.sigma[0] = 1.5;
        data
    }

    /// The best grid that is found behind a second lag, with a curve so many times as steep as it is, and numbers that may move beside.
    fn found_with(data: &BlockData, steepness: f64, beside: &[MovableNumber]) -> f64 {
        let known = Model::paper().known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let inside = [effect("second_order_lag"), effect("command_quantization")];
        let mut template = inside.iter().fold(Model::paper(), |model, effect| model.with(effect));
        template.set_parameter("second_order_lag.pole", 40.0);
        template.actuator.steady_rate.iter_mut().for_each(|coefficient| *coefficient *= steepness);
        let found = values(data, &template, "command_quantization.step", (0.0, 0.3), (&inside, beside));
        found.first().copied().expect("a grid")
    }

    fn found(data: &BlockData) -> f64 {
        found_with(data, 1.0, &[])
    }

    /// Looked for without the second lag's own simulation, the grid is found to a thousandth all the same.
    #[test]
    fn a_grid_behind_a_second_lag_is_found() {
        let best = found(&on_a_grid());
        assert!((best / STEP - 1.0).abs() < 1e-3, "{best}");
    }

    /// The less noise, the finer the grids that would show, and the more there are of them: more than are looked at. And the noise that
    /// data came with may be that beside a model that lacks more: here so much that no grid of this step would show.
    #[test]
    fn a_grid_is_found_whatever_noise_the_data_came_with() {
        for sigma in [0.05, 20.0] {
            let mut data = on_a_grid();
            data.sigma[0] = sigma;
            let best = found(&data);
            assert!((best / STEP - 1.0).abs() < 1e-3, "{sigma}: {best}");
        }
    }

    /// Fitted without the grid, a curve is too steep by half a percent: a grid that makes up for it is another one.
    #[test]
    fn a_grid_is_found_beside_a_curve_that_bent_after_it() {
        let beside = |name: &str| MovableNumber { name: name.to_owned(), scale: 1000.0 };
        let curve = ["steady_rate_linear", "steady_rate_quadratic"].map(beside);
        let data = on_a_grid();
        let best = found_with(&data, 1.005, &curve);
        assert!((best / STEP - 1.0).abs() < 1e-3, "{best}");
        let held = found_with(&data, 1.005, &[]);
        assert!((held / STEP - 1.0).abs() > 1e-3, "{held}");
    }
}
