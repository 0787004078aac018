use super::*;

/// A command of 0.523 on a grid of 0.1, cut off above 0.45 or as it is, from a battery at four fifths: what is sent is rounded and cut
/// off, and that is scaled, whichever was added first.
#[test]
fn the_battery_scales_what_the_speed_controller_made_of_a_command() {
    let mut paper = Model::paper();
    paper.actuator.voltage_gain = 0.0;
    let full = paper.actuator.full_voltage;
    for (ids, sent) in [
        (["battery_scaling", "command_quantization"], 0.5),
        (["command_quantization", "battery_scaling"], 0.5),
        (["battery_scaling", "command_saturation"], 0.45),
    ] {
        let mut model = ids.iter().fold(paper.clone(), |model, id| {
            let effect = model.effect(id).expect("known");
            model.with(&effect)
        });
        model.set_parameter("command_quantization.step", 0.1);
        model.set_parameter("command_saturation.limit", 0.45);
        let input = RotorInput {
            time: &[0.0, 0.02],
            command: &[0.523; 2],
            command_from: None,
            voltage: Some(&[0.8 * full; 2]),
            side: 1.0,
        };
        let mut rates = [0.0; 2];
        model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
        let steady = paper.steady_rate(0.8 * sent);
        assert!((rates[1] - steady).abs() < 1e-9, "{ids:?}: {rates:?}, {steady}");
    }
}

/// A command of 0.523 on a grid of 0.1 and cut off at 0.47: it is rounded to 0.5, and cut off at 0.47, which is not on the grid.
#[test]
fn a_command_is_cut_off_behind_its_grid() {
    let mut paper = Model::paper();
    paper.actuator.voltage_gain = 0.0;
    for ids in
        [["command_saturation", "command_quantization"], ["command_quantization", "command_saturation"]]
    {
        let mut model = ids.iter().fold(paper.clone(), |model, id| {
            let effect = model.effect(id).expect("known");
            model.with(&effect)
        });
        model.set_parameter("command_quantization.step", 0.1);
        model.set_parameter("command_saturation.limit", 0.47);
        let input = RotorInput {
            time: &[0.0, 0.02],
            command: &[0.523; 2],
            command_from: None,
            voltage: None,
            side: 1.0,
        };
        let mut rates = [0.0; 2];
        model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
        let steady = paper.steady_rate(0.47);
        assert!((rates[1] - steady).abs() < 1e-9, "{ids:?}: {rates:?}, {steady}");
    }
}

/// Beyond the greatest command of a model with a dead zone and a limit nothing happens, and a little below it something does.
#[test]
fn the_greatest_command_is_that_beyond_which_nothing_happens() {
    let mut model = ["command_saturation", "command_dead_zone"].iter().fold(Model::paper(), |model, id| {
        let effect = model.effect(id).expect("known");
        model.with(&effect)
    });
    assert_eq!(Model::paper().greatest_command(), None);
    model.set_parameter("command_dead_zone.width", 0.1);
    model.set_parameter("command_saturation.limit", 0.5);
    let greatest = model.greatest_command().expect("limited");
    assert!((greatest - 0.55).abs() < 1e-12, "{greatest}");
    let rate = |command: f64| {
        let (command, voltage) = ([command; 2], Some(&[12.0; 2][..]));
        let input =
            RotorInput { time: &[0.0, 0.02], command: &command, command_from: None, voltage, side: 1.0 };
        let mut rates = [0.0; 2];
        model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
        rates[1]
    };
    assert!((rate(greatest) - rate(1.0)).abs() < 1e-9);
    assert!(rate(greatest - 0.01) < rate(1.0) - 5.0);
}

/// The steady rates behind each pair of effects, whichever was added first: what a lag or a ramp goes towards has all of the curve in it,
/// a warm motor turns all of it more slowly, and what lags follows the ramp.
#[test]
fn what_goes_towards_a_steady_rate_goes_towards_all_of_it() {
    let time: Vec<f64> = (0..40).map(|row| 0.02 * f64::from(row)).collect();
    let command: Vec<f64> = (0..40).map(|row| if row < 20 { 0.4 } else { 0.6 }).collect();
    for ids in [
        ["static_cubic", "second_order_lag"],
        ["battery_sag", "slew_rate_limit"],
        ["static_offset", "motor_heating"],
        ["motor_heating", "second_order_lag"],
        ["slew_rate_limit", "second_order_lag"],
    ] {
        let rates = |ids: [&str; 2]| {
            let model = ids.iter().fold(Model::paper(), |model, id| {
                let effect = model.effect(id).expect("known");
                model.with(&effect)
            });
            let (time, command, voltage) = (&time[..], &command[..], Some(&[11.0; 40][..]));
            let input = RotorInput { time, command, command_from: None, voltage, side: 1.0 };
            let mut rates = [0.0; 40];
            model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
            rates
        };
        let [first, second] = ids;
        assert_eq!(rates(ids), rates([second, first]), "{ids:?}");
    }
    // The way is that of the lag from one level to the other, whatever bends the curve: read off between two rows behind the step.
    let lagging = |bent: bool| {
        let mut model = Model::paper();
        for id in ["second_order_lag", "static_cubic"].into_iter().take(1 + usize::from(bent)) {
            let effect = model.effect(id).expect("known");
            model = model.with(&effect);
        }
        model.set_parameter("static_cubic.coefficient", 5_000.0);
        let (time, command) = (&time[..], &command[..]);
        let input = RotorInput { time, command, command_from: None, voltage: None, side: 1.0 };
        let mut rates = [0.0; 40];
        model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
        let [from, to] = [0.4, 0.6].map(|u: f64| {
            let bend = 5_000.0 * (u - model.hover_command()).powi(3);
            Model::paper().steady_rate(u) + if bent { bend } else { 0.0 }
        });
        (rates[24] - from) / (to - from)
    };
    assert!((lagging(true) - lagging(false)).abs() < 1e-9, "{} {}", lagging(true), lagging(false));
}
