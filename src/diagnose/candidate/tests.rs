mod grid;

use crate::diagnose::block_data::Runs;
use crate::diagnose::candidate::*;
use crate::diagnose::rotor_block::rotor_runs;
use crate::diagnose::tests::at_once;
use crate::log::Dataset;

const ROWS: usize = 3000;

/// Every third stretch a rotor turns 3 % faster. A curve fitted to all leaves 2, 1 and 1 % in them, squared 6; a curve
/// that has not seen the stretch it is validated on leaves 3, 1.5 and 1.5 %, squared 13.5.
#[test]
fn what_is_held_out_is_judged_by_numbers_that_have_not_seen_it() {
    let time: Vec<f64> = (0..ROWS).map(|row| 0.02 * row as f64).collect();
    let command: Vec<f64> = (0..ROWS).map(|row| 0.5 + 0.01 * (row / 7 % 2) as f64).collect();
    let mut log = Dataset::new("here", "", time).expect("time rises");
    let model = Model::paper();
    let turning = |row: usize| if (row * 30 / ROWS).is_multiple_of(3) { 1.03 } else { 1.0 };
    let steady = 1124.5 * 0.505 + 447.1 * 0.505 * 0.505;
    log.insert("command_1", command).expect("fits");
    log.insert("propeller_rate_1_rad_s", (0..ROWS).map(|row| steady * turning(row)).collect()).expect("fits");
    let split = DataSplit::new(BlockData::new(Runs::Rotor(rotor_runs(&[log.into()]))), None);
    let base = vec!["steady_rate_linear".to_owned()];
    let candidate =
        Candidate { from: &model, nominal: &model, effects: Vec::new(), base, known: &[], without: None };
    let fitted = candidate.run(&split);
    let ratio = fitted.held_out.cost / fitted.fit.cost;
    // The commands' own ripple, and the one initial state that all stretches share, are the rest.
    assert!((2.0..2.5).contains(&ratio), "{ratio}");
}
/// Of a long log some pieces show the way, and here they hold nothing of what its first sixteenth is: the answer is of all.
#[test]
fn a_long_log_is_fitted_on_all_of_it_in_the_end() {
    const LONG: usize = 40_000;
    let time: Vec<f64> = (0..LONG).map(|row| 0.02 * row as f64).collect();
    let command: Vec<f64> = (0..LONG).map(|row| 0.4 + 0.2 * (row / 7 * 3 % 5) as f64 / 4.0).collect();
    let mut log = Dataset::new("here", "", time.clone()).expect("time rises");
    let model = Model::paper();
    // The paper's rotor, a row at a time, and what reads a tenth more in the beginning.
    let (mut rate, kept) = (0.0, (-model.actuator.pole * 0.02).exp());
    let rate = command.iter().enumerate().map(|(row, u)| {
        let steady = 1124.5 * u + 447.1 * u * u;
        rate = if row == 0 { steady } else { rate };
        let read = rate * if row < LONG / 16 { 1.1 } else { 1.0 };
        rate = steady + (rate - steady) * kept;
        read
    });
    let rate: Vec<f64> = rate.collect();
    log.insert("command_1", command).expect("fits");
    log.insert("propeller_rate_1_rad_s", rate).expect("fits");
    let data = BlockData::new(Runs::Rotor(rotor_runs(&[log.into()])));
    let split = DataSplit::new(data.clone(), Some(data));
    let part = split.shortened().expect("a long log");
    assert!(part.readings() < LONG / 2, "{}", part.readings());
    let base: Vec<String> = model.rotor_parameters().into_iter().map(str::to_owned).collect();
    let candidate =
        Candidate { from: &model, nominal: &model, effects: Vec::new(), base, known: &[], without: None };
    let [on_part, on_all] = [part, &split.train].map(|data| candidate.cost_on(data, &model, None));
    assert!(on_part < 1e-6 * on_all, "{on_part} of {on_all}: the pieces hold none of it");
    let fitted = candidate.run(&split);
    assert!((fitted.fit.cost / on_all - 1.0).abs() < 1e-3, "{} and {on_all}", fitted.fit.cost);
}

/// What one fit found of the initial states, the next one does not look for again: from none it would begin with a larger error, and may
/// end elsewhere.
#[test]
fn a_fit_goes_on_with_the_initial_states_of_the_brief_one_before() {
    let time: Vec<f64> = (0..ROWS).map(|row| 0.02 * row as f64).collect();
    let command: Vec<f64> = (0..ROWS).map(|row| 0.4 + 0.2 * (row / 7 * 3 % 5) as f64 / 4.0).collect();
    let mut log = Dataset::new("here", "", time).expect("time rises");
    let model = Model::paper();
    // The paper's rotor, a row at a time, whose first reading is off by 200 rad/s.
    let kept = (-model.actuator.pole * 0.02).exp();
    let mut rate = 1124.5 * 0.4 + 447.1 * 0.4 * 0.4;
    let rates = command.iter().map(|u| {
        let steady = 1124.5 * u + 447.1 * u * u;
        rate = steady + (rate - steady) * kept;
        rate
    });
    let mut rates: Vec<f64> = rates.collect();
    rates.rotate_right(1);
    rates[0] += 200.0;
    log.insert("command_1", command).expect("fits");
    log.insert("propeller_rate_1_rad_s", rates).expect("fits");
    let split = DataSplit::new(BlockData::new(Runs::Rotor(rotor_runs(&[log.into()]))), None);
    let base: Vec<String> = model.rotor_parameters().into_iter().map(str::to_owned).collect();
    let candidate =
        Candidate { from: &model, nominal: &model, effects: Vec::new(), base, known: &[], without: None };
    let briefly = candidate.fit_briefly(candidate.starting_points(&split), &split, None);
    assert!(briefly.is_fitted_on_all());
    let start = briefly.starts.first().expect("a start").clone();
    assert_eq!(start.locals.len(), split.train.units().len());
    let fitted = candidate.finish(briefly, &split);
    assert!(fitted.fit.cost <= start.cost, "{} behind {}", fitted.fit.cost, start.cost);
    assert!(fitted.fit.iterations < 3, "{} steps from where it ended", fitted.fit.iterations);
}

/// A grid puts the number ahead of it where it lies, whatever value the card of that one begins with: one start each.
#[test]
fn starts_with_a_grid_are_not_repeated() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let effects =
        ["command_dead_zone", "command_quantization"].map(|id| known.iter().find(|effect| effect.id == id));
    let effects: Vec<_> = effects.into_iter().flatten().collect();
    let mut data = at_once((0..600).map(|row| row as f64 / 599.0));
    data.sigma[0] = 1.0;
    let (model, split) = (Model::paper(), DataSplit::new(data.clone(), Some(data)));
    let base = Vec::new();
    let candidate = Candidate {
        from: &model,
        nominal: &model,
        effects: effects.clone(),
        base,
        known: &known,
        without: None,
    };
    let template = effects.iter().fold(model.clone(), |model, effect| model.with(effect));
    let starts = candidate.starts(&template, &effects, &split);
    let on_a_grid = |model: &&Model| model.parameter("command_quantization.step") > Some(0.0);
    assert!(starts.iter().filter(on_a_grid).count() > 1, "{}", starts.len());
    for (index, start) in starts.iter().enumerate() {
        assert!(!starts[..index].contains(start), "{index} of {}", starts.len());
    }
    let looked_at = candidate.starting_points(&split);
    assert!(!looked_at.is_fitted_on_all(), "they were only looked at");
    assert_eq!(looked_at.starts[0].locals.len(), split.train.units().len());
}

/// What single effects are found to be decides which sets are looked at: none of their starts is left out. Of a set's the best go on.
#[test]
fn every_start_of_a_single_effect_is_followed_and_the_best_of_a_set() {
    let known = Model::paper().known_effects().expect("the catalogue");
    let effects = |ids: &[&str]| -> Vec<_> {
        ids.iter().filter_map(|id| known.iter().find(|effect| effect.id == *id)).collect()
    };
    let nominal = Model::paper();
    let mut from = nominal.clone();
    // A base that has moved is tried where it was, too.
    from.set_parameter("steady_rate_linear", 2.0 * nominal.parameter("steady_rate_linear").expect("in it"));
    let mut data = at_once((0..600).map(|row| 0.4 + 0.2 * f64::from(row / 20 % 3)));
    data.sigma[0] = 1.0;
    let split = DataSplit::new(data.clone(), Some(data));
    for (ids, is_single) in [(&["motor_heating"][..], true), (&["motor_heating", "static_offset"], false)] {
        let (effects, base) = (effects(ids), vec!["steady_rate_linear".to_owned()]);
        let fresh = effects.clone();
        let candidate =
            Candidate { from: &from, nominal: &nominal, effects, base, known: &known, without: None };
        let template = fresh.iter().fold(from.clone(), |model, effect| model.with(effect));
        let starts = candidate.starts(&template, &fresh, &split).len();
        let expected = if is_single { starts } else { THRESHOLDS.starts_followed };
        assert!(starts > THRESHOLDS.starts_followed, "{starts}");
        assert_eq!(candidate.starting_points(&split).starts.len(), expected, "{ids:?}");
    }
}
