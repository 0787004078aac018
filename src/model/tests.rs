use crate::model::*;

mod ended;
mod memory;
mod order;
mod rotor_stride;
mod sensors;
mod stride;

#[test]
fn the_paper_has_its_printed_numbers() {
    let model = Model::paper();
    // paper-given: b = d c_p1 / J with c_p1 = 2 c ω_0, hover at 617 rad/s and 0.4633.
    let slope = 2.0 * model.actuator.thrust_coefficient * model.actuator.hover_rate;
    assert!((slope - 0.0197).abs() < 1e-12);
    assert!((model.body.arm * slope / model.body.inertia - 0.15391).abs() < 1e-5);
    assert!((model.hover_command() - 0.4633).abs() < 5e-5);
    assert!((model.actuator.hover_rate - 617.0).abs() < 0.05);
}

#[test]
fn a_model_file_reads_back_the_same() {
    let mut model = Model::paper().with(&Model::paper().effect("gravity_pendulum").expect("known"));
    model.user_effects.push(UserEffect {
        id: "creak".to_owned(),
        site: Site::Torque,
        expression: "-k*body_rate^3".to_owned(),
        parameters: vec![UserParameter {
            name: "k".to_owned(),
            unit: String::new(),
            start: 0.1,
            lower: 0.0,
            upper: 1.0,
        }],
        meaning: String::new(),
    });
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.toml");
    model.save(&path).expect("saved");
    assert_eq!(Model::load(&path).expect("reads"), model);
}

#[test]
fn stepping_back_restores_the_numbers_and_how_well_they_are_known() {
    let mut base = Model::paper();
    base.standard_errors = [("pole".to_owned(), 0.5), ("steady_rate_linear".to_owned(), 3.0)].into();
    let mut after = base.with(&base.effect("transport_delay").expect("known"));
    after.set_parameter("pole", 20.0);
    after.standard_errors.insert("pole".to_owned(), 0.2);
    after.standard_errors.insert("transport_delay.delay".to_owned(), 1e-3);
    let error = ErrorFall {
        measure: Measure::of_fit("a_rate_rad_s", "rad/s"),
        noise_floor: 1.0,
        train_before: 3.0,
        train_after: 1.0,
        validate_before: 3.0,
        validate_after: 1.0,
    };
    after.ladder.push(ModelStep {
        added: vec!["transport_delay".to_owned()],
        logs: Vec::new(),
        validation: Vec::new(),
        error,
        before: base.parameters(),
        standard_errors_before: base.standard_errors.clone(),
    });
    assert_eq!(after.step_back().expect("a rung"), base);
    // A file of before says nothing of them: what was not moved is known as it was.
    after.ladder[0].standard_errors_before.clear();
    let back = after.step_back().expect("a rung");
    assert_eq!(back.standard_errors, [("steady_rate_linear".to_owned(), 3.0)].into());
}

#[test]
fn a_wrong_model_file_says_where() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.toml");
    let base = Model::paper().emit().expect("emits");
    let cases = [
        (
            "[[effects]]\nid = \"gravity_pendulun\"\n",
            "unknown effect `gravity_pendulun`; did you mean `gravity_pendulum`?",
        ),
        (
            "[[effects]]\nid = \"delay\"\n",
            "unknown effect `delay`; did you mean `transport_delay`, `torque_delay`?",
        ),
        ("[[effects]]\nid = \"torque_bias\"\n", "lacks its parameter `torque`"),
        (
            "[[effects]]\nid = \"torque_bias\"\n[effects.parameters]\ntorque = 1.0\ntork = 2.0\n",
            "no parameter `tork`",
        ),
        (
            "[[user_effects]]\nid = \"mine\"\nsite = \"torque\"\nexpression = \"-0.1*body_rat\"\n",
            "^ `body_rat` is neither",
        ),
        ("bodyy = 3\n", "unknown field `bodyy`"),
    ];
    for (text, words) in cases {
        let text =
            if text.starts_with("bodyy") { format!("{text}{base}") } else { format!("{base}\n{text}") };
        std::fs::write(&path, text).expect("written");
        let message = Model::load(&path).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("model.toml"), "{message}");
    }
}

/// A step of a first-order rotor is known in closed form, whatever the sampling.
#[test]
fn the_bare_rotor_is_exact_between_irregular_samples() {
    let model = Model::paper();
    let time: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k) + 0.007 * f64::from(k % 3)).collect();
    let command = vec![0.5; time.len()];
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let mut trace = RotorTrace::default();
    let start = RotorStart { rate: Some(100.0), ..RotorStart::default() };
    model.equations().expect("binds").simulate_rotor(&input, &start, &mut trace);
    let target = model.steady_rate(0.5);
    for (at, rate) in time.iter().zip(&trace.rate) {
        let exact = target + (100.0 - target) * (-16.0 * at).exp();
        assert!((rate - exact).abs() < 1e-9);
    }
}

/// Heat outlives a hole of a log; across a long one it decays to its steady state.
#[test]
fn a_motor_stays_warm_across_a_hole() {
    let mut model = Model::paper().with(&Model::paper().effect("motor_heating").expect("known"));
    model.set_parameter("motor_heating.gain", 0.1);
    model.set_parameter("motor_heating.time_constant", 10.0);
    let equations = model.equations().expect("binds");
    let time: Vec<f64> = (0..2000).map(|k| 0.02 * f64::from(k)).collect();
    let command: Vec<f64> = (0..2000).map(|k| if k < 1000 { 0.3 } else { 0.6 }).collect();
    let run = |rows: std::ops::Range<usize>, start: &RotorStart| {
        let (time, command) = (&time[rows.clone()], &command[rows]);
        let input = RotorInput { time, command, command_from: None, voltage: None, side: 1.0 };
        let mut rates = vec![0.0; time.len()];
        let end = equations.rotor_readings(&input, start, &mut rates);
        (rates, end)
    };
    let (whole, _) = run(0..2000, &RotorStart::default());
    let (_, before) = run(0..1100, &RotorStart::default());
    let from = |hole, remembers: bool| {
        let before = remembers.then(|| before.across(hole));
        run(1105..2000, &RotorStart { rate: Some(whole[1105]), before, ..RotorStart::default() }).0[100]
    };
    // Of a hole of 0.12 s only what the rate did in it is lost: a hundredth of the way.
    assert!((from(0.12, true) - whole[1205]).abs() < 0.1, "{} {}", from(0.12, true), whole[1205]);
    // Taken as steady it would be wrong by far more; after an hour that is what it is.
    assert!((from(0.12, false) - whole[1205]).abs() > 5.0);
    assert!((from(3600.0, true) - from(0.12, false)).abs() < 1e-6);
}

/// A delay of two and a half samples moves the response by just that.
#[test]
fn a_delay_between_samples_is_exact() {
    let mut model = Model::paper().with(&Model::paper().effect("transport_delay").expect("known"));
    model.set_parameter("transport_delay.delay", 0.05);
    let time: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
    let command: Vec<f64> = (0..100).map(|k| if k < 10 { 0.4 } else { 0.5 }).collect();
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let mut trace = RotorTrace::default();
    model.equations().expect("binds").simulate_rotor(&input, &RotorStart::default(), &mut trace);
    let (low, high) = (model.steady_rate(0.4), model.steady_rate(0.5));
    for (at, rate) in time.iter().zip(&trace.rate) {
        let exact = high + (low - high) * (-16.0 * (at - 0.25).max(0.0)).exp();
        assert!((rate - exact).abs() < 1e-9, "{at}");
    }
}

/// The mean of the squared rate behind a delay that ends within intervals, against small steps of the closed form.
#[test]
fn the_mean_square_of_a_delayed_rotor_is_exact() {
    let model = Model::paper();
    let time: Vec<f64> = (0..60).map(|k| 0.02 * f64::from(k)).collect();
    let command: Vec<f64> = (0..60).map(|k| if k < 10 { 0.4 } else { 0.5 }).collect();
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let mut trace = RotorTrace::with_squares();
    let equations = model.bare_equations().with_command_delay(0.013);
    equations.simulate_rotor(&input, &RotorStart::default(), &mut trace);
    let (low, high) = (model.steady_rate(0.4), model.steady_rate(0.5));
    let exact = |at: f64| high + (low - high) * (-16.0 * (at - 0.213).max(0.0)).exp();
    let squares = trace.mean_square.expect("asked for");
    for (at, square) in time.iter().zip(&squares).take(59) {
        let middle = |step: u32| exact(at + 0.02 * (f64::from(step) + 0.5) / 1000.0).powi(2);
        let expected = (0..1000).map(middle).sum::<f64>() / 1000.0;
        // The rule of midpoints, (p h)² / 24 of the change, and a kink within one step.
        assert!((square / expected - 1.0).abs() < 1e-7, "{at}: {square} {expected}");
    }
}

/// What was commanded before the log began is not known: a rotor with a dead time goes on as it is found until the first row's
/// command arrives. Behind a hole that command was in force before.
#[test]
fn a_rotor_with_a_dead_time_goes_on_as_it_is_found() {
    let mut model = Model::paper().with(&Model::paper().effect("transport_delay").expect("known"));
    model.set_parameter("transport_delay.delay", 0.05);
    let time: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
    let input =
        RotorInput { time: &time, command: &[0.5; 100], command_from: None, voltage: None, side: 1.0 };
    let (low, high) = (model.steady_rate(0.4), model.steady_rate(0.5));
    for (is_first, arrival) in [(true, 0.05), (false, 0.0)] {
        let start = RotorStart { rate: Some(low), is_first, ..RotorStart::default() };
        let mut trace = RotorTrace::default();
        model.equations().expect("binds").simulate_rotor(&input, &start, &mut trace);
        for (at, rate) in time.iter().zip(&trace.rate) {
            let exact = high + (low - high) * (-16.0 * (at - arrival).max(0.0)).exp();
            assert!((rate - exact).abs() < 1e-9, "{at}: {rate} {exact}");
        }
    }
}

/// The rate is known of a time, and not what was before: laws that would move it until then do not.
#[test]
fn a_rotor_whose_rate_is_known_of_a_later_time_goes_on_from_there() {
    let time: Vec<f64> = (0..100).map(|k| 0.02 * f64::from(k)).collect();
    let input =
        RotorInput { time: &time, command: &[0.5; 100], command_from: None, voltage: None, side: 1.0 };
    let (low, known) = (500.0, 0.13);
    let start = RotorStart { rate: Some(low), rate_holds_until: Some(known), ..RotorStart::default() };
    let run = |model: &Model| {
        let mut trace = RotorTrace::default();
        model.equations().expect("binds").simulate_rotor(&input, &start, &mut trace);
        trace.rate
    };
    let high = Model::paper().steady_rate(0.5);
    for (at, rate) in time.iter().zip(run(&Model::paper())) {
        let exact = high + (low - high) * (-16.0 * (at - known).max(0.0)).exp();
        assert!((rate - exact).abs() < 1e-9, "{at}: {rate} {exact}");
    }
    let heated = Model::paper().with(&Model::paper().effect("motor_heating").expect("known"));
    let rates = run(&heated);
    assert!(rates[..7].iter().all(|rate| *rate == low) && rates[7] != low, "{:?}", &rates[..8]);
}

/// The body under a constant torque: half t squared.
#[test]
fn the_rigid_body_is_exact() {
    let equations = Model::paper().equations().expect("binds");
    let time: Vec<f64> = (0..50).map(|k| 0.01 * f64::from(k)).collect();
    let torque = equations.torque_means(&time, &vec![0.064; time.len()], &vec![0.0; time.len()]);
    let input = BodyInput { time: time.clone().into(), torque, ..BodyInput::default() };
    let mut trace = BodyTrace::default();
    equations.simulate_body(
        &input,
        0,
        time.len(),
        &BodyStart { angle: 0.1, rate: -1.0, sensor: 0.0 },
        &mut trace,
    );
    for (row, at) in time.iter().enumerate() {
        assert!((trace.rate[row] - (-1.0 + 2.0 * at)).abs() < 1e-12);
        assert!((trace.angle[row] - (0.1 - at + at * at)).abs() < 1e-12);
    }
}

/// A body that friction brings to rest within 40 ms, in a log whose rows are 50 ms apart.
#[test]
fn a_body_slows_down_between_rows_that_are_far_apart() {
    let mut model = Model::paper();
    model = model.with(&model.effect("pivot_viscous_friction").expect("known"));
    model.set_parameter("pivot_viscous_friction.coefficient", model.body.inertia / 0.04);
    let time: Vec<f64> = (0..6).map(|row| 0.05 * f64::from(row)).collect();
    let torque = vec![0.0; time.len()];
    let input = BodyInput { time: time.clone().into(), torque, ..BodyInput::default() };
    let mut trace = BodyTrace::default();
    let start = BodyStart { angle: 0.0, rate: 1.0, sensor: 0.0 };
    model.equations().expect("binds").simulate_body(&input, 0, time.len(), &start, &mut trace);
    for (rate, at) in trace.rate.iter().zip(&time) {
        // 1e-5 for each of the five steps between two rows.
        assert!((rate - (-at / 0.04).exp()).abs() < 5e-5, "{at} s: {rate}");
    }
}

/// A ramp of torque through delay and lag, against the closed form of a lagged, delayed ramp.
#[test]
fn torque_lag_and_delay_follow_a_ramp() {
    let mut model = Model::paper();
    for id in ["torque_delay", "rotor_lag"] {
        model = model.with(&model.effect(id).expect("known"));
    }
    model.set_parameter("torque_delay.delay", 0.013);
    model.set_parameter("rotor_lag.pole", 20.0);
    let time: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
    let bare: Vec<f64> = time.iter().map(|at| at + 0.005).collect();
    let means = model.equations().expect("binds").torque_means(&time, &bare, &vec![1.0; time.len()]);
    for row in 100..199 {
        // Long after the start a lagged ramp is the ramp 1/p later. The mean over a quarter of a sample is
        // taken at its middle: (p h)² / 24 of its growth, below 1e-5 here.
        let expected = time[row] + 0.005 - 0.013 - 1.0 / 20.0;
        assert!((means[row] - expected).abs() < 1e-5, "{row}: {} {expected}", means[row]);
    }
}

/// Behind a filter a rate that rises in a straight line is read with a delay of the filter's time constant, also where samples, 5 ms
/// apart, are slower than the filter.
#[test]
fn a_fast_filter_of_the_gyroscope_lags_by_its_time_constant() {
    let mut model = Model::paper().with(&Model::paper().effect("gyro_lag").expect("known"));
    model.set_parameter("gyro_lag.pole", 300.0);
    let time: Vec<f64> = (0..200).map(|row| 0.005 * f64::from(row)).collect();
    let rate: Vec<f64> = time.iter().map(|time| 2.0 * time).collect();
    let shown = model.equations().expect("binds").gyroscope(&time, &rate, &[0.0; 200]);
    let delay = (rate[199] - shown[199]) / 2.0;
    // Each of the four parts of an interval is held at its mean: 1.2 % more.
    assert!((delay * 300.0 - 1.0).abs() < 0.02, "{delay} s");
}

/// A torque that swings goes through a lag faster than the samples as it does in the closed form: what it does between two
/// samples counts.
#[test]
fn a_torque_lag_faster_than_the_samples_sees_what_happens_between_them() {
    let mut model = Model::paper().with(&Model::paper().effect("rotor_lag").expect("known"));
    let (swing, pole, interval) = (20.0_f64, 150.0, 0.02);
    model.set_parameter("rotor_lag.pole", pole);
    let time: Vec<f64> = (0..200).map(|row| interval * f64::from(row)).collect();
    let mean = |integral: &dyn Fn(f64) -> f64, at: f64| (integral(at + interval) - integral(at)) / interval;
    let bare: Vec<f64> = time.iter().map(|at| mean(&|t| -(swing * t).cos() / swing, *at)).collect();
    let slopes: Vec<f64> = time.iter().map(|at| mean(&|t| (swing * t).sin(), *at)).collect();
    let means = model.equations().expect("binds").torque_means(&time, &bare, &slopes);
    let lagged = |t: f64| {
        let (sine, cosine) = (swing * t).sin_cos();
        -(pole * pole * cosine / swing + pole * sine) / (pole * pole + swing * swing)
    };
    for row in 100..199 {
        let expected = mean(&lagged, time[row]);
        // Held at its mean over each sample it would be off by 0.012.
        assert!((means[row] - expected).abs() < 0.006, "{row}: {} {expected}", means[row]);
    }
}

/// The paper's model with a law of a user's in force.
fn with_law(site: Site, expression: &str) -> Model {
    let mut model = Model::paper();
    model.user_effects.push(UserEffect {
        id: "mine".to_owned(),
        site,
        expression: expression.to_owned(),
        parameters: Vec::new(),
        meaning: String::new(),
    });
    model.with(&model.effect("mine").expect("known"))
}

/// What a user's law at a sensor looks at is that of each row, not of the first, and the same wherever it is worked out.
#[test]
fn a_law_at_a_sensor_looks_at_the_row() {
    let time: Vec<f64> = (0..50).map(|row| 100.0 + 0.02 * f64::from(row)).collect();
    let still = vec![0.0; time.len()];
    let drifting = with_law(Site::BodyRateSensor, "0.1*(time_s - 100)");
    let equations = drifting.equations().expect("binds");
    let input =
        BodyInput { time: time.clone().into(), torque: still.clone(), propeller_rate: Default::default() };
    let mut trace = BodyTrace::default();
    equations.simulate_body(&input, 0, time.len(), &BodyStart::default(), &mut trace);
    let shown = equations.gyroscope(&time, &still, &still);
    for (row, (run, shown)) in trace.rate.iter().zip(&shown).enumerate() {
        let drift = 0.1 * 0.02 * row as f64;
        assert!((run - drift).abs() < 1e-9 && (shown - drift).abs() < 1e-9, "{row}: {run} {shown} {drift}");
    }

    // Rows 0.02 s apart, the command delayed by 0.03 s: a change is in force from the second row behind it on.
    let command: Vec<f64> = (0..50).map(|row| if row < 20 { 0.4 } else { 0.5 }).collect();
    let volts: Vec<f64> = (0..50).map(|row| 12.6 - 0.01 * f64::from(row)).collect();
    for (delay, from) in [(0.0, 20), (0.03, 22)] {
        let mut model = with_law(Site::RotorRateSensor, "100*command + 10*battery_voltage");
        if delay > 0.0 {
            model = model.with(&model.effect("transport_delay").expect("known"));
            model.set_parameter("transport_delay.delay", delay);
        }
        let input = RotorInput {
            time: &time,
            command: &command,
            command_from: None,
            voltage: Some(&volts),
            side: 1.0,
        };
        let mut trace = RotorTrace::default();
        let equations = model.equations().expect("binds");
        equations.simulate_rotor(&input, &RotorStart::default(), &mut trace);
        for (row, volt) in volts.iter().enumerate() {
            let added = 100.0 * if row < from { 0.4 } else { 0.5 } + 10.0 * volt;
            let found = trace.measured[row] - trace.rate[row];
            assert!((found - added).abs() < 1e-9, "{delay}, {row}: {found}, not {added}");
        }
    }
}

/// Rows that show a command which came between them, with when it came, are the rows on which it came.
#[test]
fn a_command_acts_from_when_it_was_in_force() {
    let late = Model::paper().effect("transport_delay").expect("known");
    let mut delayed = Model::paper().with(&late);
    delayed.set_parameter("transport_delay.delay", 0.033);
    let bent = Model::paper().with(&Model::paper().effect("telemetry_lag").expect("known"));
    let steps = [(0.3151, 0.6), (0.7, 0.35), (0.9999, 0.5)];
    let in_force = |time: f64| steps.iter().rfind(|step| step.0 <= time).map_or(0.4, |step| step.1);
    for model in [Model::paper(), delayed, bent] {
        let equations = model.equations().expect("binds");
        // Every instant at which something happens is a row of these, and the steps of integration are the same.
        let mut fine: Vec<f64> = (0..300).map(|row| 0.005 * f64::from(row)).collect();
        fine.extend(steps.map(|step| step.0));
        fine.sort_by(f64::total_cmp);
        fine.dedup();
        let run = |time: &[f64], from: Option<&[f64]>| {
            let command: Vec<f64> = time.iter().map(|time| in_force(*time)).collect();
            let mut trace = RotorTrace::default();
            let input = RotorInput { time, command: &command, command_from: from, voltage: None, side: 1.0 };
            equations.simulate_rotor(&input, &RotorStart::default(), &mut trace);
            trace.measured
        };
        let coarse: Vec<f64> = (0..60).map(|row| 0.025 * f64::from(row)).collect();
        let came = |row: usize| {
            let step =
                steps.iter().rfind(|step| step.0 <= coarse[row] && row > 0 && step.0 > coarse[row - 1]);
            step.map_or(coarse[row], |step| step.0)
        };
        let from: Vec<f64> = (0..60).map(came).collect();
        let (shown, held) = (run(&coarse, Some(&from)), run(&coarse, None));
        let truth = run(&fine, None);
        let at = |row: usize| {
            fine.iter().position(|time| (time - coarse[row]).abs() < 1e-9).expect("a row of both")
        };
        // Steps of integration are parted at other places where a law asks for some.
        assert!((0..60).all(|row| (shown[row] - truth[at(row)]).abs() < 0.02), "{shown:?}");
        assert!((0..60).any(|row| (held[row] - truth[at(row)]).abs() > 5.0));
    }
}
