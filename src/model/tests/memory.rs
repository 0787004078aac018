//! Laws of a user's own that remember.

use crate::model::*;

/// Play in the command is the run of the commands that it lets through, whatever else the model has.
#[test]
fn play_in_the_command_is_a_run_of_other_commands() {
    let number = |name: &str, start: f64| UserParameter {
        name: name.to_owned(),
        unit: String::new(),
        start,
        lower: -1.0,
        upper: 1.0,
    };
    let mut with_play = Model::paper();
    with_play.user_effects.push(UserEffect {
        id: "slack".to_owned(),
        site: Site::Command,
        expression: "k*(play(command,w)-command)".to_owned(),
        parameters: vec![number("k", 1.0), number("w", 0.05)],
        meaning: String::new(),
    });
    with_play = with_play.with(&with_play.effect("slack").expect("it parses"));
    let delay = crate::effect::acting_as(Site::Command, Term::DeadTime).expect("a dead time");
    let delay = Model::paper().effect(delay.id).expect("known");
    let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
    let command: Vec<f64> = time.iter().map(|time| 0.5 + 0.15 * (3.0 * time).sin()).collect();
    let mut held = command[0];
    let through: Vec<f64> = command
        .iter()
        .map(|command| {
            held = held.clamp(command - 0.05, command + 0.05);
            held
        })
        .collect();
    for delayed in [false, true] {
        let run = |model: &Model, command: &[f64]| {
            let model = if delayed { model.with(&delay) } else { model.clone() };
            let input = RotorInput { time: &time, command, command_from: None, voltage: None, side: 1.0 };
            let mut trace = RotorTrace::default();
            model.equations().expect("known").simulate_rotor(&input, &RotorStart::default(), &mut trace);
            trace.rate
        };
        let (played, plain) = (run(&with_play, &command), run(&Model::paper(), &through));
        assert!(played.iter().zip(&plain).all(|(played, plain)| (played - plain).abs() < 1e-6), "{delayed}");
    }
}

/// A part of the command that follows late is a second lag before the rotor's own.
#[test]
fn a_lag_in_the_steady_rate_follows_its_time_constant() {
    let mut model = Model::paper();
    model.user_effects.push(UserEffect {
        id: "creep".to_owned(),
        site: Site::SteadyRate,
        expression: "100*(lag(command,2)-command)".to_owned(),
        parameters: Vec::new(),
        meaning: String::new(),
    });
    model = model.with(&model.effect("creep").expect("it parses"));
    let time: Vec<f64> = (0..1000).map(|row| 0.02 * f64::from(row)).collect();
    let command: Vec<f64> = time.iter().map(|time| if *time < 1.0 { 0.4 } else { 0.6 }).collect();
    let run = |model: &Model| {
        let input =
            RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
        let mut trace = RotorTrace::default();
        model.equations().expect("known").simulate_rotor(&input, &RotorStart::default(), &mut trace);
        trace.rate
    };
    let (late, plain) = (run(&model), run(&Model::paper()));
    let (pole, slow) = (16.0, 0.5);
    for row in [40, 60, 150, 400, 999] {
        let since = (time[row] - 1.0).max(0.0);
        // 100 × 0.2 × the rotor's answer to -exp(-t/2), which it is at rest before.
        let answer = pole / (pole - slow) * ((-slow * since).exp() - (-pole * since).exp());
        let expected = if time[row] < 1.0 { 0.0 } else { -20.0 * answer };
        // Held over steps of 20 ms: a hundredth of the law.
        assert!(
            (late[row] - plain[row] - expected).abs() < 0.2,
            "{row}: {} {expected}",
            late[row] - plain[row]
        );
    }
}

/// Hysteresis over the angle: within its width a spring, beyond it a torque that stays, against the way that the body went.
#[test]
fn a_torque_that_remembers_sees_the_body_as_it_was_measured() {
    let mut model = Model::paper();
    model.user_effects.push(UserEffect {
        id: "rubber".to_owned(),
        site: Site::Torque,
        expression: "2*(play(body_angle,0.1)-body_angle)".to_owned(),
        parameters: Vec::new(),
        meaning: String::new(),
    });
    model = model.with(&model.effect("rubber").expect("it parses"));
    let equations = model.equations().expect("known");
    assert!(
        equations.has_remembered_torque()
            && !Model::paper().equations().expect("known").has_remembered_torque()
    );
    let angle = [0.0, 0.05, 0.3, 0.25, 0.0];
    let time: Vec<f64> = (0..angle.len()).map(|row| 0.01 * row as f64).collect();
    let mut input = BodyInput { torque: vec![1.0; time.len()], time: time.into(), ..BodyInput::default() };
    equations.add_remembered_torque(&mut input, &angle, &[0.0; 5]);
    // At the samples 0, -0.1, -0.2, -0.1, 0.2 N m: each interval has the mean of its ends.
    let expected = [0.95, 0.85, 0.85, 1.05, 1.2];
    let near = |(found, expected): (&f64, &f64)| (found - expected).abs() < 1e-12;
    assert!(input.torque.iter().zip(&expected).all(near), "{:?}", input.torque);
}
