//! A grid behind a dead zone, fitted on some levels and judged on others.

use crate::diagnose::block_data::Runs;
use crate::diagnose::candidate::*;
use crate::diagnose::grid_refine::Around;
use crate::diagnose::rotor_block::rotor_runs;
use crate::diagnose::tests::noise;
use crate::diagnose::whole_steps::best_of_whole_steps;
use crate::log::Dataset;
use crate::model::Effect;

const WIDTH: f64 = 0.08;
const STEP: f64 = 0.012;

/// So many levels, held for 0.3 s each, in twenty small Euler steps a row: no code of the model.
fn levels(count: usize, seed: usize) -> BlockData {
    let rows = 15 * count;
    let time: Vec<f64> = (0..rows).map(|row| 0.02 * row as f64).collect();
    // From a multiplicative hash.
    let level =
        |row: usize| f64::from((((row / 15 + seed) as u32).wrapping_mul(2_654_435_761) >> 16) & 0xfff);
    let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.4 * level(row) / 4096.0).collect();
    let g = |u: f64| 1124.5 * u + 447.1 * u * u;
    let of = |u: f64| g(((u - WIDTH) / (1.0 - WIDTH) / STEP).round() * STEP);
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

/// A curve that bent after a grid some steps off leaves little, and a look nearby sees nothing better.
#[test]
fn a_grid_that_lies_whole_steps_off_is_moved_by_just_those() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let data = levels(120, 1);
    for steps in [-1.0, 3.0] {
        let model = lying(&known, steps);
        let base: Vec<String> = ["steady_rate_linear", "steady_rate_quadratic"].map(str::to_owned).to_vec();
        let candidate = Candidate {
            from: &model,
            nominal: &model,
            effects: effects(&known),
            base,
            known: &known,
            without: None,
        };
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

/// Fifty levels do not say to which side of a step each of a hundred others comes.
#[test]
fn new_levels_between_those_fitted_on_are_no_error_of_the_grid() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let model = lying(&known, 0.0);
    let split = DataSplit::new(levels(50, 1), Some(levels(100, 400)));
    let base = vec!["steady_rate_linear".to_owned()];
    let candidate = Candidate {
        from: &model,
        nominal: &model,
        effects: effects(&known),
        base,
        known: &known,
        without: None,
    };
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
