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
