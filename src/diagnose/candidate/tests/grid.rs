//! A grid behind a dead zone, fitted on some levels and judged on others.

use crate::diagnose::block_data::Runs;
use crate::diagnose::candidate::*;
use crate::diagnose::grid_refine::{Around, refine_with_error};
use crate::diagnose::grid_search::finest;
use crate::diagnose::rotor_block::rotor_runs;
use crate::diagnose::tests::noise;
use crate::diagnose::whole_steps::best_of_whole_steps;
use crate::log::Dataset;
use crate::model::Effect;

const WIDTH: f64 = 0.08;
const STEP: f64 = 0.012;
const CURVE: [&str; 2] = ["steady_rate_linear", "steady_rate_quadratic"];

/// So many levels behind a dead zone of this width, held for 0.3 s each, in twenty small Euler steps a row: no code of the model.
fn levels(count: usize, seed: usize, width: f64) -> BlockData {
    let rows = 15 * count;
    let time: Vec<f64> = (0..rows).map(|row| 0.02 * row as f64).collect();
    // From a multiplicative hash.
    let level =
        |row: usize| f64::from((((row / 15 + seed) as u32).wrapping_mul(2_654_435_761) >> 16) & 0xfff);
    let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.4 * level(row) / 4096.0).collect();
    let g = |u: f64| 1124.5 * u + 447.1 * u * u;
    let of = |u: f64| g(((u - width) / (1.0 - width) / STEP).round() * STEP);
    let mut rate = of(command[0]);
    let mut rates = Vec::new();
    for (row, u) in command.iter().enumerate() {
        rates.push(rate + 1.5 * noise(row + 7919 * seed));
        for _ in 0..20 {
            rate += 0.001 * 16.0 * (of(*u) - rate);
        }
    }
    let log = Dataset::made(time, [("command_1", command), ("propeller_rate_1_rad_s", rates)]);
    let mut data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
    data.sigma[0] = 1.5;
    data
}

fn effects(known: &[Effect]) -> Vec<&Effect> {
    let ids = ["command_dead_zone", "command_quantization"];
    ids.iter().filter_map(|id| known.iter().find(|effect| effect.id == *id)).collect()
}

/// The paper's model with a dead zone and a grid that lies as the truth's does, so many whole steps further.
fn lying(known: &[Effect], steps: f64) -> Model {
    let mut model = effects(known).into_iter().fold(Model::paper(), |model, effect| model.with(effect));
    let spacing = (1.0 - WIDTH) * STEP;
    let width = WIDTH + steps * spacing;
    model.set_parameter("command_dead_zone.width", width);
    model.set_parameter("command_quantization.step", spacing / (1.0 - width));
    model
}

/// Both laws, from a model that may have them, beside these numbers of the curve.
fn candidate<'a>(model: &'a Model, known: &'a [Effect], base: &[&str]) -> Candidate<'a> {
    let base = base.iter().map(|name| (*name).to_owned()).collect();
    Candidate { from: model, nominal: model, effects: effects(known), base, known, without: None }
}

/// A curve that bent after a grid some steps off leaves little, and a look nearby sees nothing better.
#[test]
fn a_grid_that_lies_whole_steps_off_is_moved_by_just_those() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let data = levels(120, 1, WIDTH);
    for steps in [-1.0, 3.0] {
        let model = lying(&known, steps);
        let candidate = candidate(&model, &known, &CURVE);
        let inside = candidate.inside(&model);
        let names = candidate.names_in(&inside, true);
        let problem = Problem::new(&data, model.clone(), names.clone(), &inside);
        let bent = fit(&problem, &candidate.frees(&names, &model), None, &THRESHOLDS.full_fit);
        let grid = names.iter().position(|name| name == "command_quantization.step").expect("the step");
        let places = candidate.without_slope(grid, &names, &model);
        let moves = candidate.moves(&names, &model);
        let around = Around { problem: &problem, data: &data, places: &places, moves: &moves };
        let moved = best_of_whole_steps(&around, &bent.globals, &bent.locals).expect("a better place");
        let width = moved[places.ahead[0].index];
        assert!((width - WIDTH).abs() < 1e-7, "{steps}: {width}");
        assert!((moved[grid] - STEP).abs() < 1e-7, "{steps}: {}", moved[grid]);
        let followed =
            fit(&problem, &candidate.frees(&names, &problem.model(&moved)), None, &THRESHOLDS.full_fit);
        assert!(followed.cost < 0.9 * bent.cost, "{} of {}", followed.cost, bent.cost);
        assert_eq!(best_of_whole_steps(&around, &followed.globals, &followed.locals), None, "it is there");
    }
}

/// A dead zone that was found without a grid may be one of its steps off, on a curve that bent after it.
#[test]
fn a_grid_found_beside_a_dead_zone_a_step_off_ends_where_it_lies() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let data = levels(120, 1, WIDTH);
    let split = DataSplit::new(data.clone(), Some(data));
    for steps in [-1.0, 2.0] {
        let alone = lying(&known, steps).without("command_quantization");
        let curve: Vec<String> = CURVE.map(str::to_owned).to_vec();
        let inside: Vec<&Effect> = effects(&known)[..1].to_vec();
        let problem = Problem::new(&split.train, alone.clone(), curve.clone(), &inside);
        let bent = candidate(&alone, &known, &CURVE);
        let end = fit(&problem, &bent.frees(&curve, &alone), None, &THRESHOLDS.full_fit);
        let bent = problem.model(&end.globals);
        let found = candidate(&bent, &known, &CURVE).run(&split).model;
        let (width, error) = (found.parameter("command_dead_zone.width"), "command_dead_zone.width");
        let (width, error) = (width.expect("in it"), found.standard_errors[error]);
        // All it could come to by whole steps are five errors and more off.
        assert!((width - WIDTH).abs() < 3.0 * error && error < 0.2 * STEP, "{steps}: {width} ± {error}");
    }
}

/// Held, the curve would let a step seem far better known than it is: it takes up what a step a hair off leaves.
#[test]
fn a_curve_follows_a_grid_that_stands_alone() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let data = levels(120, 1, 0.0);
    let lone = effects(&known)[1..].to_vec();
    let mut model = Model::paper().with(lone[0]);
    model.set_parameter("command_quantization.step", STEP);
    let candidate = Candidate { effects: lone, ..candidate(&model, &known, &CURVE) };
    let inside = candidate.inside(&model);
    let names = candidate.names_in(&inside, true);
    let problem = Problem::new(&data, model.clone(), names.clone(), &inside);
    let grid = names.iter().position(|name| name == "command_quantization.step").expect("the step");
    let places = candidate.without_slope(grid, &names, &model);
    let from = |model: &Model| fit(&problem, &candidate.frees(&names, model), None, &THRESHOLDS.full_fit);
    let follow = |globals: &[f64]| from(&problem.model(globals));
    let fitted = from(&model);
    let found = |moves: &[(usize, f64)]| {
        let mut found = fitted.clone();
        refine_with_error(
            &Around { problem: &problem, data: &data, places: &places, moves },
            follow,
            &mut found,
        );
        (found.globals[grid], found.standard_errors[grid])
    };
    let (held, (step, error)) = (found(&[]), found(&candidate.moves(&names, &model)));
    assert!(error > 2.0 * held.1, "± {error}, held ± {}", held.1);
    assert!((step - STEP).abs() < 2.0 * error, "{step} ± {error}");
}

/// Fifty levels do not say to which side of a step each of a hundred others comes.
#[test]
fn new_levels_between_those_fitted_on_are_no_error_of_the_grid() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let model = lying(&known, 0.0);
    let split = DataSplit::new(levels(50, 1, WIDTH), Some(levels(100, 400, WIDTH)));
    let candidate = candidate(&model, &known, &CURVE[..1]);
    let starts = candidate.starting_points(&split);
    let FullFit { fit: plain, slopes, model: at, hardly_worse } = candidate.fitted(&starts, &split);
    let as_fitted = candidate.held_out(&at, (&plain, &slopes), &starts.names, &split);
    let found = candidate.run(&split);
    let over = |fit: &Fit| crate::diagnose::candidate_fit::noise_multiple(fit, &split.validate);
    assert!(hardly_worse.len() > 1);
    let (too_much, left) =
        (over(&as_fitted) - found.train(&split), found.validate(&split) - found.train(&split));
    assert!(too_much > 0.5, "{too_much}: nothing is wrong");
    assert!(left < 0.5 * too_much, "{left} of {too_much}");
    // On what it was fitted on it is hardly worse, and as well known.
    assert!(found.fit.cost < 1.01 * plain.cost, "{} and {}", found.fit.cost, plain.cost);
    for name in ["command_dead_zone.width", "command_quantization.step"] {
        assert_eq!(found.model.standard_errors.get(name), at.standard_errors.get(name), "{name}");
        let off = found.model.parameter(name).expect("in it") - at.parameter(name).expect("in it");
        let error = at.standard_errors[name];
        assert!(off.abs() < 3.0 * error, "{name}: {off} with {error}");
    }
}

/// A log of another bench asks for another dead zone; the fitted data refuse it.
#[test]
fn numbers_that_the_fitted_data_refuse_are_not_taken() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let model = lying(&known, 0.0);
    let split = DataSplit::new(levels(50, 1, WIDTH), Some(levels(50, 400, WIDTH + 0.004)));
    let candidate = candidate(&model, &known, &CURVE[..1]);
    let starts = candidate.starting_points(&split);
    let FullFit { fit: own, slopes, model: at, .. } = candidate.fitted(&starts, &split);
    let held_out = candidate.held_out(&at, (&own, &slopes), &starts.names, &split);
    let place = |name: &str| starts.names.iter().position(|other| other == name).expect("in it");
    let mut others = own.globals.clone();
    others[place("command_dead_zone.width")] = WIDTH + 0.004;
    others[place("command_quantization.step")] = STEP;
    let inside = candidate.inside(&at);
    let ratio = |data| {
        let problem = Problem::new(data, at.clone(), starts.names.clone(), &inside);
        problem.cost_of(&problem.model(&others)) / problem.cost_of(&at)
    };
    assert!(ratio(&split.validate) < 0.5, "that log has them: {}", ratio(&split.validate));
    assert!(ratio(&split.train) > 2.0, "and the fitted one has not: {}", ratio(&split.train));
    let of = (&own, &held_out);
    assert!(candidate.moved_on_held_out((&at, &starts.names), of, &[others.clone()], &split).is_none());
}

/// The card would have a fit start from a step that holds no two of these commands, a twentieth apart.
#[test]
fn no_fit_starts_from_a_grid_finer_than_the_commands() {
    let base = Model::paper();
    let known = base.known_effects().expect("the catalogue");
    let grid = known.iter().find(|effect| effect.is_grid()).expect("known");
    let mut data = levels(120, 1, 0.0);
    let Runs::Rotor(runs) = &mut data.runs else { unreachable!("a rotor") };
    runs[0].command = runs[0].command.iter().map(|command| (command / 0.05).round() * 0.05).collect();
    let least = THRESHOLDS.end_of_finest_grid * finest(&data);
    assert!(least > 0.08);
    let candidate = Candidate { effects: vec![grid], ..candidate(&base, &known, &CURVE) };
    let starts = candidate.starts(&base.with(grid), &[grid], &DataSplit::new(data, None));
    let steps: Vec<f64> = starts.iter().filter_map(|it| it.parameter("command_quantization.step")).collect();
    assert!(!steps.is_empty() && steps.iter().all(|step| *step > least), "{steps:?}");
}
