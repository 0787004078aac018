use crate::effect::Site;

use super::hidden::HiddenLaw;
use crate::emulate::*;

const SECOND: u64 = clock::NANOSECONDS_PER_SECOND;

/// No noise, no quantization, a battery that never gives way, no stops.
fn ideal() -> EmulatorConfig {
    let mut config = EmulatorConfig::default();
    for sensor in [
        &mut config.sensors.body_rate,
        &mut config.sensors.body_angle,
        &mut config.sensors.propeller_rate,
        &mut config.sensors.battery_voltage,
    ] {
        sensor.noise = 0.0;
        sensor.quantization = 0.0;
    }
    config.battery.internal_resistance = 0.0;
    config.battery.capacity_ah = 1e9;
    config.plant.angle_stop = 0.0;
    config.esc_timeout_s = Some(3600.0);
    config.hold_until_commanded = false;
    config
}

fn hidden(text: &str) -> EmulatorConfig {
    EmulatorConfig { hidden: vec![HiddenConfig::parse(text).expect("readable")], ..ideal() }
}

/// Runs `config` for `seconds` with constant commands.
fn run(config: &EmulatorConfig, rotor: [f64; 2], seconds: f64) -> (Emulator, EmulatorState) {
    let emulator = config.build().expect("valid");
    let mut state = emulator.start(1);
    emulator.command(&mut state, rotor);
    emulator.advance(&mut state, clock::span_ns(seconds));
    (emulator, state)
}

fn truth(config: &EmulatorConfig, rotor: [f64; 2], seconds: f64) -> Truth {
    let (emulator, state) = run(config, rotor, seconds);
    emulator.truth(&state)
}

#[test]
fn a_rotor_answers_a_step_as_the_closed_form_says() {
    let (u, t) = (0.5, 0.1);
    let z = 447.1 * u * u + 1124.5 * u;
    let exact = z * (1.0 - (-16.0_f64 * t).exp());
    // RK4 at 0.5 ms: (p h)^4 / 120 relative is 3e-11.
    assert!((truth(&ideal(), [u, 0.0], t).propeller_rate[0] - exact).abs() < 1e-6);
}

#[test]
fn the_integrator_is_of_fourth_order() {
    let error = |step: f64| {
        let config = EmulatorConfig {
            integration_step_s: step,
            sensors: SensorsConfig::default().at_rate(1.0),
            ..ideal()
        };
        let exact = (447.1 * 0.25 + 1124.5 * 0.5) * (1.0 - (-16.0_f64 * 0.1).exp());
        (truth(&config, [0.5, 0.0], 0.1).propeller_rate[0] - exact).abs()
    };
    let ratio = error(0.005) / error(0.0025);
    // Halving the step divides the error by 2^4; higher orders move it a little.
    assert!((14.0..18.0).contains(&ratio), "{ratio}");
}

#[test]
fn hover_holds_the_hover_rate_and_rotor_1_drives_the_angle_up() {
    let config = ideal();
    let hover = config.plant.hover_command();
    assert!((hover - 0.4633).abs() < 5e-5, "paper-notes' u_0");
    let still = truth(&config, [hover; 2], 2.0);
    assert!((still.propeller_rate[0] - 616.96).abs() < 0.01);
    assert!((still.thrust[0] - 6.0771).abs() < 1e-3);
    assert!(still.body_angle.abs() < 1e-12);
    assert!(truth(&config, [hover + 0.01, hover - 0.01], 0.5).body_angle > 0.01);
}

#[test]
fn a_battery_under_load_gives_its_charge_and_the_rotor_follows() {
    let mut config = ideal();
    config.battery =
        BatteryConfig { capacity_ah: 0.05, internal_resistance: 0.0, ..BatteryConfig::default() };
    let hover = config.plant.hover_command();
    let (early, late) = (truth(&config, [hover; 2], 1.0), truth(&config, [hover; 2], 11.0));
    let fall = early.battery_voltage - late.battery_voltage;
    assert!(fall > 0.3, "{fall}");
    // [LPC16] Eq. (6): the rotor loses k_V for each volt, once the transient of 1/p has gone.
    let ratio = (early.propeller_rate[0] - late.propeller_rate[0]) / fall;
    assert!((ratio - 40.0).abs() < 0.3, "{ratio}");
}

/// What the motor gets is what its whole curve is a function of: beside a scaling battery, a parabola and a cubic are one curve.
#[test]
fn a_cubic_bends_the_curve_of_what_the_motor_gets() {
    let mut config = ideal();
    // Between full and cut-off, so that a scaled command is another.
    config.battery.used = 0.5;
    for laws in [
        ["battery_scaling", "static_cubic:coefficient=5000"],
        ["static_cubic:coefficient=5000", "battery_scaling"],
    ] {
        config.hidden = laws.map(|law| HiddenConfig::parse(law).expect("readable")).into();
        let found = truth(&config, [0.7; 2], 3.0);
        let motor = 0.7 * found.battery_voltage / config.plant.full_voltage;
        assert!(motor < 0.69, "{motor}");
        let curve = config.plant.steady_rate(motor) + 5000.0 * (motor - config.plant.hover_command()).powi(3);
        assert!(
            (found.propeller_rate[0] - curve).abs() < 0.01,
            "{laws:?}: {}, {curve}",
            found.propeller_rate[0]
        );
    }
}

#[test]
fn an_impulse_gives_its_momentum_and_nothing_else() {
    let mut config = ideal();
    config.impulse = vec![Impulse { at_s: 0.1003, duration_s: 0.0501, torque: 0.6 }];
    // Edges between samples and integration steps are met exactly.
    let rate = truth(&config, [0.0; 2], 0.3).body_rate;
    assert!((rate - 0.6 * 0.0501 / 0.032).abs() < 1e-9, "{rate}");
    config.impulse_period_s = 0.5;
    let twice = truth(&config, [0.0; 2], 0.8).body_rate;
    assert!((twice - 2.0 * rate).abs() < 1e-9, "the script repeats");
}

#[test]
fn a_command_takes_its_transport_delay() {
    let delayed = EmulatorConfig { command_delay_s: 0.0237, ..ideal() };
    let at_once = truth(&ideal(), [0.5; 2], 0.1).propeller_rate[0];
    let later = truth(&delayed, [0.5; 2], 0.1237).propeller_rate[0];
    assert!((at_once - later).abs() < 1e-6);
    let hidden_delay = truth(&hidden("transport_delay:delay=0.0237"), [0.5; 2], 0.1237);
    assert_eq!(hidden_delay.propeller_rate[0].to_bits(), later.to_bits());
}

#[test]
fn an_esc_stops_on_its_own_when_nobody_commands() {
    let config = EmulatorConfig { esc_timeout_s: Some(0.5), ..ideal() };
    assert!(truth(&config, [0.5; 2], 0.5).propeller_rate[0] > 600.0);
    assert!(truth(&config, [0.5; 2], 1.5).propeller_rate[0] < 1.0);
}

#[test]
fn a_command_that_is_no_number_stops_the_rotor() {
    let (emulator, mut state) = run(&ideal(), [0.5; 2], 1.0);
    emulator.command(&mut state, [f64::NAN, f64::INFINITY]);
    emulator.advance(&mut state, 3 * SECOND);
    assert!(emulator.truth(&state).propeller_rate.iter().all(|rate| *rate < 1e-6));
}

#[test]
fn noise_has_its_rms_and_quantization_its_grid() {
    let mut config = ideal();
    config.sensors.propeller_rate = SensorConfig { rate_hz: 1000.0, noise: 1.5, quantization: 0.5 };
    let emulator = config.build().expect("valid");
    let mut state = emulator.start(1);
    let (mut sum, mut square, count) = (0.0, 0.0, 20_000);
    for index in 0..count {
        emulator.advance(&mut state, (index + 1) * 1_000_000);
        let value = state.sensors().propeller_rate[0].value;
        assert_eq!(value, (value / 0.5).round() * 0.5);
        sum += value;
        square += value * value;
    }
    let rms = (square / count as f64).sqrt();
    // Noise and the quantizer's q²/12; four standard deviations of an rms over 20,000 samples are 2 %.
    let expected = f64::sqrt(1.5 * 1.5 + 0.25 / 12.0);
    assert!((rms / expected - 1.0).abs() < 0.02, "{rms}");
    assert!((sum / count as f64).abs() < 0.05);
}

#[test]
fn sensors_keep_their_own_rates_and_their_own_noise() {
    let slow_gyro = {
        let mut config = EmulatorConfig::default();
        config.sensors.body_rate.rate_hz = 100.0;
        run(&config, [0.4; 2], 1.0).1
    };
    let fast_gyro = run(&EmulatorConfig::default(), [0.4; 2], 1.0).1;
    assert_eq!(fast_gyro.sensors().body_rate.count, 1001);
    assert_eq!(slow_gyro.sensors().body_rate.count, 101);
    assert_eq!(fast_gyro.sensors().propeller_rate[1].count, 201);
    let bits = |state: &EmulatorState| state.sensors().body_angle.value.to_bits();
    assert_eq!(bits(&slow_gyro), bits(&fast_gyro), "one sensor's rate is not another's noise");
    assert_eq!(fast_gyro.sensors().thrust[0].stamp_ns, 0, "no load cell: never a value");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_does_not() {
    let config = EmulatorConfig::default();
    let sensors = |config: &EmulatorConfig| *run(config, [0.47, 0.45], 3.0).1.sensors();
    assert_eq!(sensors(&config), sensors(&config));
    assert_ne!(sensors(&config), sensors(&EmulatorConfig { seed: 2, ..config.clone() }));
}

#[test]
fn hidden_body_laws_move_the_body_as_their_closed_forms_say() {
    let coast = |text: &str, seconds: f64| {
        let mut config = hidden(text);
        config.impulse = vec![Impulse { at_s: 0.0, duration_s: 0.01, torque: 3.2 }];
        truth(&config, [0.0; 2], seconds)
    };
    // The impulse leaves 1 rad/s; laws act on it from 0.01 s, the impulse itself costs them at most 1 %.
    let viscous = coast("pivot_viscous_friction:coefficient=0.032", 1.01).body_rate;
    assert!((viscous - (-1.0_f64).exp()).abs() < 0.005, "{viscous}");
    let coulomb = coast("pivot_coulomb_friction:torque=0.016", 1.01).body_rate;
    assert!((coulomb - 0.5).abs() < 0.005, "{coulomb}");
    let drag = coast("quadratic_air_drag:coefficient=0.032", 1.01).body_rate;
    assert!((drag - 0.5).abs() < 0.005, "{drag}");
    let spring = coast("cable_stiffness:stiffness=0.32", 0.01).body_rate;
    let quarter = std::f64::consts::FRAC_PI_2 / 10.0_f64.sqrt();
    assert!(coast("cable_stiffness:stiffness=0.32", quarter + 0.005).body_rate.abs() < 0.02 * spring);
}

#[test]
fn every_hidden_law_shows_in_some_sensor() {
    let record = |config: &EmulatorConfig| {
        let emulator = config.build().expect("valid");
        let mut state = emulator.start(1);
        let mut values = Vec::new();
        for slot in 0..400_u64 {
            let wave = if slot % 40 < 20 { 0.15 } else { -0.15 };
            emulator.command(&mut state, [0.463 + wave, 0.463 - wave]);
            emulator.advance(&mut state, (slot + 1) * SECOND / 100);
            let sensors = state.sensors();
            values.extend([sensors.propeller_rate[0].value, 100.0 * sensors.body_rate.value]);
        }
        values
    };
    let mut base = ideal();
    base.battery = BatteryConfig::default();
    let plain = record(&base);
    for (id, names) in catalogue() {
        let mut config = base.clone();
        config.hidden = vec![HiddenConfig::parse(id).expect("an id")];
        let difference = record(&config).iter().zip(&plain).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference > 0.5, "{id} ({}) shows by {difference} only", names.join(", "));
    }
}

#[test]
fn a_drawn_effect_depends_on_the_seed_alone_and_always_builds() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..300 {
        let drawn = HiddenConfig::draw(seed, |_| true).expect("the table is not empty");
        assert_eq!(Some(&drawn), HiddenConfig::draw(seed, |_| true).as_ref());
        assert!(HiddenLaw::build(&drawn).is_ok(), "{drawn}");
        seen.insert(drawn.effect);
    }
    assert_eq!(seen.len(), catalogue().count(), "every law is drawn sometimes");
    assert!(HiddenConfig::draw(1, |_| false).is_none());
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let refused = |change: fn(&mut EmulatorConfig)| {
        let mut config = EmulatorConfig::default();
        change(&mut config);
        config.build().expect_err("must be refused").to_string()
    };
    assert!(refused(|config| config.plant.inertia = 0.0).contains("`inertia`"));
    assert!(refused(|config| config.plant.pole = f64::NAN).contains("`pole`"));
    assert!(refused(|config| config.integration_step_s = 1.0).contains("`integration_step_s`"));
    assert!(refused(|config| config.sensors.body_rate.rate_hz = -1.0).contains("`body_rate`"));
    assert!(refused(|config| config.battery.used = 2.0).contains("`battery.used`"));
    let unknown = HiddenConfig::parse("warp_drive:power=1").expect("readable");
    let sentence = HiddenLaw::build(&unknown).unwrap_err().to_string();
    assert!(sentence.contains("warp_drive") && sentence.contains("rotorbench effects"), "{sentence}");
    let misnamed = HiddenConfig::parse("gravity_pendulum:mass=1").expect("readable");
    assert!(HiddenLaw::build(&misnamed).unwrap_err().to_string().contains("no parameter `mass`"));
    assert!(HiddenConfig::parse("gravity_pendulum:moment").is_err());
    let heavy = HiddenConfig::parse("gravity_pendulum:moment=300").expect("readable");
    let sentence = HiddenLaw::build(&heavy).unwrap_err().to_string();
    assert!(sentence.ends_with("`moment` must lie in -20..20 N m, not 300"), "{sentence}");
}

/// What is left out is what the law is built with.
#[test]
fn a_completed_effect_says_every_number_and_is_the_same() {
    for (id, names) in catalogue() {
        let short = HiddenConfig::parse(id).expect("an id");
        let whole = short.clone().completed();
        assert_eq!(whole.parameters.len(), names.len(), "{whole}");
        assert_eq!(
            HiddenLaw::build(&whole).expect("it can be"),
            HiddenLaw::build(&short).expect("it can be")
        );
    }
    let part = HiddenConfig::parse("gravity_pendulum:moment=0.4").expect("readable").completed();
    assert_eq!((part.parameters["moment"], part.parameters["angle_offset"]), (0.4, 0.1));
}

#[test]
fn an_expression_acts_where_it_says_and_a_typo_is_marked() {
    let own = |site, expression: &str| {
        let parameters = [("k".to_owned(), 0.032)].into();
        let expression = Some(expression.to_owned());
        let law = HiddenConfig { effect: "own".to_owned(), parameters, site: Some(site), expression };
        let mut config = EmulatorConfig { hidden: vec![law], ..ideal() };
        config.impulse = vec![Impulse { at_s: 0.0, duration_s: 0.01, torque: 3.2 }];
        config
    };
    let viscous = hidden("pivot_viscous_friction:coefficient=0.032");
    let viscous = EmulatorConfig { impulse: own(Site::Torque, "0").impulse, ..viscous };
    let difference = truth(&own(Site::Torque, "-k*body_rate"), [0.0; 2], 1.0).body_rate
        - truth(&viscous, [0.0; 2], 1.0).body_rate;
    assert!(difference.abs() < 1e-12, "{difference}");
    let faster = truth(&own(Site::SteadyRate, "1000*k"), [0.5; 2], 2.0).propeller_rate[0]
        - truth(&ideal(), [0.5; 2], 2.0).propeller_rate[0];
    assert!((faster - 32.0).abs() < 1e-6, "{faster}");
    let sentence = own(Site::Torque, "-k*body_rat").build().expect_err("a typo").to_string();
    assert!(sentence.contains("`body_rat` is neither a signal nor a parameter"), "{sentence}");
    let sentence =
        own(Site::Thrust, "k*relay(thrust-5,0.1)").build().expect_err("nothing remembers there").to_string();
    assert!(sentence.contains("`relay` are known at") && sentence.contains("not at `thrust`"), "{sentence}");
    let sentence = own(Site::Thrust, "k*command").build().expect_err("no thrust sees a command").to_string();
    assert!(sentence.contains("`command` is not known at `thrust`"), "{sentence}");
}

#[test]
fn a_model_file_gives_its_numbers() {
    let paper = PlantConfig::from_model(&crate::model::Model::paper());
    assert_eq!(paper, PlantConfig::default(), "two hands wrote Tables I and IV");
}

#[test]
fn a_held_body_falls_only_when_the_rotors_are_commanded() {
    let config = EmulatorConfig { hold_until_commanded: true, ..hidden("torque_bias:torque=0.1") };
    assert_eq!(truth(&config, [0.0; 2], 2.0).body_angle, 0.0);
    let (emulator, mut state) = run(&config, [0.3; 2], 1.0);
    let angle = emulator.truth(&state).body_angle;
    // θ = τ t² / (2 J)
    assert!((angle - 0.1 / 0.064).abs() < 1e-6, "{angle}");
    emulator.command(&mut state, [0.0; 2]);
    emulator.advance(&mut state, 2 * SECOND);
    assert!(emulator.truth(&state).body_angle > angle, "let go once, it is not caught again");
}
