//! A run of an hour that nobody wants any more is left within it.

use crate::cancel::is_left_within;
use crate::model::*;

#[test]
fn a_run_of_a_rotor_is_left_when_its_end_is_asked_for() {
    let (time, command) = ([0.0, 0.02, 0.04], [0.4; 3]);
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let paper = Model::paper();
    // As a first-order lag, and in steps.
    for model in [paper.clone(), paper.with(&paper.effect("second_order_lag").expect("known"))] {
        let equations = model.equations().expect("known effects");
        let run = || equations.simulate_rotor(&input, &RotorStart::default(), &mut RotorTrace::default());
        assert!(is_left_within(run), "{:?}", model.effects);
    }
}
