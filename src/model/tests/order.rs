use super::*;

fn with_effects(model: Model, ids: &[&str]) -> Model {
    ids.iter().fold(model, |model, id| {
        let effect = model.effect(id).expect("known");
        model.with(&effect)
    })
}

/// [rad/s] The steady rate behind a command at a voltage: where a rotor that starts at rest under it stays.
fn steady(model: &Model, command: f64, voltage: f64) -> f64 {
    let (command, voltage) = ([command; 2], Some(&[voltage; 2][..]));
    let input = RotorInput { time: &[0.0, 0.02], command: &command, command_from: None, voltage, side: 1.0 };
    let mut rates = [0.0; 2];
    model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut rates);
    rates[1]
}

/// A command of 0.523 from a full battery or one at four fifths, on a grid of 0.1, cut off: it is rounded to 0.5, cut off where the limit
/// is, be that on the grid or not, and that is scaled, whichever was added first.
#[test]
fn the_battery_scales_what_was_rounded_and_then_cut_off() {
    let mut paper = Model::paper();
    paper.actuator.voltage_gain = 0.0;
    let full = paper.actuator.full_voltage;
    for (ids, limit, got) in [
        (["battery_scaling", "command_quantization"], f64::NAN, 0.8 * 0.5),
        (["command_quantization", "battery_scaling"], f64::NAN, 0.8 * 0.5),
        (["battery_scaling", "command_saturation"], 0.45, 0.8 * 0.45),
        (["command_saturation", "command_quantization"], 0.47, 0.47),
        (["command_quantization", "command_saturation"], 0.47, 0.47),
    ] {
        let mut model = with_effects(paper.clone(), &ids);
        model.set_parameter("command_quantization.step", 0.1);
        model.set_parameter("command_saturation.limit", limit);
        let rate = steady(&model, 0.523, 0.8 * full);
        let expected = paper.steady_rate(got);
        assert!((rate - expected).abs() < 1e-9, "{ids:?}: {rate}, {expected}");
    }
}

/// Beyond the greatest command of a model with a dead zone and a limit nothing happens, and a little below it something does.
#[test]
fn the_greatest_command_is_that_beyond_which_nothing_happens() {
    let mut model = with_effects(Model::paper(), &["command_saturation", "command_dead_zone"]);
    assert_eq!(Model::paper().greatest_command(), None);
    model.set_parameter("command_dead_zone.width", 0.1);
    model.set_parameter("command_saturation.limit", 0.5);
    let greatest = model.greatest_command().expect("limited");
    assert!((greatest - 0.55).abs() < 1e-12, "{greatest}");
    let most = steady(&model, 1.0, 12.0);
    assert!((steady(&model, greatest, 12.0) - most).abs() < 1e-9);
    assert!(steady(&model, greatest - 0.01, 12.0) < most - 5.0);
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
            let model = with_effects(Model::paper(), &ids);
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
