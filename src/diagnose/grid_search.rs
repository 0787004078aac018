//! Parameters without a slope: the step of a grid moves the error in jumps, so that no derivative leads to it. They
//! are found by looking at every value that could make a difference.

use super::block_data::{BlockData, Runs};
use super::grid_cost::{GridCost, MovableNumber};
use super::problem::Problem;
use super::rotor_block::RotorRun;
use super::thresholds::THRESHOLDS;
use crate::effect::Site;
use crate::estimation::normal_equations::sum_of_squares;
use crate::estimation::output_error::{OutputError, Residuals};
use crate::estimation::quantile::{distinct, extremes};
use crate::model::{Effect, Model};

/// Share of their range by which two commands differ that are not the same.
const SAME_COMMAND: f64 = 1e-6;

/// A grid, and where a law ahead of it puts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Grid {
    /// [-] its step.
    pub step: f64,
    /// The number of that law; `None` without one.
    pub ahead: Option<f64>,
}

impl Grid {
    /// Gives a model the numbers of a grid, of which these are the names.
    pub(crate) fn put_into(&self, model: &mut Model, (step, ahead): (&str, Option<&str>)) {
        model.set_parameter(step, self.step);
        if let (Some(name), Some(value)) = (ahead, self.ahead) {
            model.set_parameter(name, value);
        }
    }
}

/// Grids of `template` from which a fit is promising, best first. `name` is that of their step, `ahead` that of a number that moves
/// the command before the grid takes it, as the width of a dead zone does: where the grid lies is then as unknown as its step.
pub(crate) fn grids(
    data: &BlockData,
    template: &Model,
    (name, ahead): (&str, Option<&str>),
    bounds: (f64, f64),
    (inside, beside): (&[&Effect], &[MovableNumber]),
) -> Vec<Grid> {
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
    let of = |data, shifts| GridCost::new((data, template), (name, ahead, shifts), (inside, beside));
    let mut cost = of(&few, THRESHOLDS.grid_places_first);
    let mut grid = Vec::new();
    // From the coarse end: where there are too many, the finest, which matter least, are left out.
    let (mut value, least) = (bounds.1, least.max(finest(data)));
    while value >= least.max(bounds.0) && value > 0.0 && grid.len() < THRESHOLDS.most_grid_values {
        grid.push(value);
        value -= spacing(value, typical);
    }
    let kept = apart(grid, &mut |step| cost.at(step), typical, THRESHOLDS.grid_values_second);
    let some = data.in_short_pieces((data.len() / THRESHOLDS.grid_second_samples).max(1));
    let closer = |values: Vec<f64>, cost: &mut GridCost| -> Vec<f64> {
        values.into_iter().map(|step| cost.closer(step, spacing(step, typical), 1)).collect()
    };
    let mut cost = of(&some, THRESHOLDS.grid_places);
    let kept = closer(kept, &mut cost);
    let left = apart(kept, &mut |step| cost.at(step), typical, THRESHOLDS.grid_values_third);
    let mut cost = of(data, THRESHOLDS.grid_places);
    let left = closer(left, &mut cost);
    let best = apart(left, &mut |step| cost.at(step), typical, THRESHOLDS.grid_values_closer);
    best.into_iter()
        .map(|step| {
            let step = cost.closer(step, spacing(step, typical), THRESHOLDS.grid_looks);
            Grid { step, ahead: cost.ahead_at(step, THRESHOLDS.grid_places_closer) }
        })
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

/// By how much the next value of a grid looked at differs.
pub(crate) fn spacing(value: f64, typical: f64) -> f64 {
    (THRESHOLDS.grid_phase * value * value / typical).min(THRESHOLDS.most_grid_spacing * value)
}

/// [-] The smallest grid that shows above the noise, and a typical command.
pub(crate) fn sizes(data: &BlockData) -> Option<(f64, f64)> {
    let Runs::Rotor(runs) = &data.runs else { return None };
    let command = extremes(runs.iter().flat_map(|run| run.command.iter().copied()));
    let rate = extremes(runs.iter().flat_map(|run| run.measured.iter().copied()));
    let slope = (rate.1 - rate.0) / (command.1 - command.0);
    // A rounding error is spread evenly over a step: its rms is the step over the root of 12.
    let least = THRESHOLDS.least_grid_noise * data.sigma[0] * 12f64.sqrt() / slope;
    (least.is_finite() && least > 0.0 && command.1 > 0.0).then_some((least, command.1))
}

/// [-] The smallest grid that is no offset of each command at will: on a finer one hardly two of these share a level. Of commands that
/// come in clusters some do, and it says too little.
pub(crate) fn finest(data: &BlockData) -> f64 {
    let Runs::Rotor(runs) = &data.runs else { return 0.0 };
    let gaps = command_gaps(runs);
    THRESHOLDS.least_commands_of_step * gaps.iter().sum::<f64>() / (gaps.len() + 1) as f64
}

/// [-] by how much each command differs from the next greater one.
pub(crate) fn command_gaps(runs: &[RotorRun]) -> Vec<f64> {
    let commands: Vec<f64> = runs.iter().flat_map(|run| run.command.iter().copied()).collect();
    let (low, high) = extremes(commands.iter().copied());
    let gaps = distinct(&commands);
    let gaps = gaps.windows(2).map(|pair| pair[1] - pair[0]);
    // Less is the same command, written with other last digits.
    gaps.filter(|gap| *gap > SAME_COMMAND * (high - low)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::grid_refine::{Around, refine, refine_with_error};
    use super::super::rotor_block::rotor_runs;
    use super::super::tests::{at_once, behind_a_dead_zone};
    use super::*;
    use crate::estimation::output_error::{Free, fit};
    use crate::log::Dataset;

    const STEP: f64 = 0.0061;

    /// A number from 0 to 4095 for every quarter of a second, from a multiplicative hash.
    fn level(row: u32) -> u32 {
        (row / 12).wrapping_mul(2_654_435_761) >> 16 & 0xfff
    }

    fn on_a_grid() -> BlockData {
        on_a_grid_behind(0.0)
    }

    /// A rotor that gets its command on a grid behind a dead zone of this width.
    fn on_a_grid_behind(width: f64) -> BlockData {
        followed(
            |row| 0.3 + 0.3 * f64::from(level(row)) / 4096.0,
            |u| (((u - width) / (1.0 - width)) / STEP).round() * STEP,
        )
    }

    /// A rotor behind two lags that gets these commands as something makes them of those, in a hundred small Euler steps a sample: no
    /// code of the model.
    fn followed(command: impl Fn(u32) -> f64, made: impl Fn(f64) -> f64) -> BlockData {
        let (rows, parts) = (2000, 100);
        let time: Vec<f64> = (0..rows).map(|row| 0.02 * f64::from(row)).collect();
        let command: Vec<f64> = (0..rows).map(command).collect();
        let g = |u: f64| 1124.5 * u + 447.1 * u * u;
        let (mut behind, mut rate) = (g(0.3), g(0.3));
        let mut rates = Vec::new();
        for u in &command {
            rates.push(rate);
            for _ in 0..parts {
                let step = 0.02 / f64::from(parts);
                behind += step * 40.0 * (g(made(*u)) - behind);
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
        let named = ("command_quantization.step", None);
        let found = grids(data, &template, named, (0.0, 0.3), (&inside, beside));
        found.first().expect("a grid").step
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

    /// Of commands 0.008 apart one of two comes to the level of its neighbour on a grid of 0.0207; on one of 0.0086 nearly each has its
    /// own, and any curve that waves a few times would look so.
    #[test]
    fn a_grid_with_less_than_two_commands_to_a_step_is_none() {
        for (step, is_found) in [(0.0207, true), (0.0086, false)] {
            let command = |row: u32| 0.3 + 0.008 * f64::from(level(row) % 40);
            let best = found(&followed(command, |u| (u / step).round() * step));
            assert_eq!((best / step - 1.0).abs() < 1e-3, is_found, "{step}: {best}");
            assert!(best > 0.0155, "{step}: {best}");
        }
    }

    #[test]
    fn a_command_in_other_last_digits_is_the_same() {
        let of = |off: f64| {
            let command = |row: u32| 0.3 + 0.05 * f64::from(row % 6) + off * f64::from(row % 7);
            finest(&at_once((0..420).map(command)))
        };
        // Six levels over 0.25.
        let two_of_them = 2.0 * 0.25 / 6.0;
        for off in [0.0, 1e-10] {
            assert!((of(off) / two_of_them - 1.0).abs() < 1e-6, "{off}: {}", of(off));
        }
        assert!(of(1e-4) < 0.2 * two_of_them, "others");
    }

    /// A dead zone that was found without the grid is known to a few steps of it, and where the grid lies is not.
    #[test]
    fn a_grid_behind_a_dead_zone_is_found_where_it_lies() {
        let (data, width) = (on_a_grid_behind(0.0457), 0.0457);
        let known = Model::paper().known_effects().expect("the catalogue");
        let effect = |id: &str| known.iter().find(|effect| effect.id == id).expect("known");
        let inside =
            [effect("second_order_lag"), effect("command_dead_zone"), effect("command_quantization")];
        let mut template = inside.iter().fold(Model::paper(), |model, effect| model.with(effect));
        template.set_parameter("second_order_lag.pole", 40.0);
        let ahead = "command_dead_zone.width";
        for away in [0.4, 0.9, -1.3] {
            template.set_parameter(ahead, width + away * STEP);
            let curve = ["steady_rate_linear", "steady_rate_quadratic"];
            let beside = curve.map(|name| MovableNumber { name: name.to_owned(), scale: 1000.0 });
            let named = ("command_quantization.step", Some(ahead));
            let found = grids(&data, &template, named, (0.0, 0.3), (&inside, &beside));
            let grid = found.first().expect("a grid");
            grid.put_into(&mut template, named);
            // A whole step further the grid lies there again: so many commands are between two steps.
            let spacing = |step: f64, width: f64| step * (1.0 - width);
            let commands = spacing(grid.step, grid.ahead.expect("a dead zone")) / spacing(STEP, width);
            // Looked at with sixteen places, it is off by an eighth of a step at most, which the curve takes up: over 90 steps that is
            // 0.14 % of one.
            assert!((commands - 1.0).abs() < 2e-3, "{away}: {grid:?}");
            let names = [named.0.to_owned(), ahead.to_owned()];
            let problem = Problem::new(&data, template.clone(), names.to_vec(), &inside);
            let held = |name: &String| {
                let start = template.parameter(name).expect("put in");
                Free { start, bounds: (start, start), scale: 1.0 }
            };
            let mut fitted = fit(&problem, &names.each_ref().map(held), None, &THRESHOLDS.full_fit);
            let places = behind_a_dead_zone();
            refine(&problem, &data, &places, &[], &mut fitted);
            let follow = |numbers: &[f64]| {
                let held = [0, 1].map(|at| Free {
                    start: numbers[at],
                    bounds: (numbers[at], numbers[at]),
                    scale: 1.0,
                });
                fit(&problem, &held, None, &THRESHOLDS.full_fit)
            };
            let around = Around { problem: &problem, data: &data, places: &places, moves: &[] };
            refine_with_error(&around, follow, &mut fitted);
            let errors = &fitted.standard_errors;
            // Steps of Euler's are late by half of one: a tenth of a thousandth of a step of the grid.
            assert!(
                (fitted.globals[1] - width).abs() < 3.0 * errors[1] + 1e-5,
                "{away}: {:?} ± {errors:?}",
                fitted.globals
            );
            assert!(
                (fitted.globals[0] - STEP).abs() < 3.0 * errors[0] + 1e-5,
                "{away}: {:?} ± {errors:?}",
                fitted.globals
            );
            assert!(errors.iter().all(|error| *error > 0.0 && *error < 0.25 * STEP), "{away}: {errors:?}");
        }
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
