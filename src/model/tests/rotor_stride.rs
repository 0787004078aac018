//! Steps between the rows of an uneven clock, against the same equations in steps of a fortieth of a row.

use super::*;

/// A law of every kind that a rotor's free run goes through, strong: a motor that warms within a second, a lag behind
/// that, a pole that follows the speed, and telemetry behind the rate.
fn model(laws: &[(&str, &str, f64)]) -> Model {
    let mut model = Model::paper();
    for (id, parameter, value) in laws {
        if !model.has(id) {
            model = model.with(&model.effect(id).expect("known"));
        }
        model.set_parameter(&format!("{id}.{parameter}"), *value);
    }
    model
}

const HEAT: [(&str, &str, f64); 2] =
    [("motor_heating", "gain", 0.05), ("motor_heating", "time_constant", 1.0)];
const LAG: (&str, &str, f64) = ("second_order_lag", "pole", 60.0);
const LATE: (&str, &str, f64) = ("transport_delay", "delay", 0.013);
const DRAG: (&str, &str, f64) = ("speed_dependent_pole", "slope", 0.5);
/// Commands move z by up to 200 rad/s.
const RAMP: (&str, &str, f64) = ("slew_rate_limit", "rate", 3000.0);
const TELEMETRY: (&str, &str, f64) = ("telemetry_lag", "pole", 40.0);

/// [rad/s] not at the steady rate, of which each law has its own.
const START: RotorStart =
    RotorStart { rate: Some(500.0), rate_holds_until: None, slow: 0.0, before: None, is_first: false };

/// Rows at intervals that come back in turns and singly, each cut into parts; a command for each row.
fn clock(parts: usize) -> (Vec<f64>, Vec<f64>) {
    let intervals = [0.010, 0.010, 0.014, 0.010, 0.014, 0.007, 0.021, 0.0101];
    let (mut time, mut command, mut at) = (Vec::new(), Vec::new(), 0.0);
    for row in 0..240 {
        let interval: f64 = intervals[row % intervals.len()];
        for part in 0..parts {
            time.push(at + interval * part as f64 / parts as f64);
            command.push(0.4 + 0.03 * ((row / 6 * 5) % 7) as f64);
        }
        at += interval;
    }
    (time, command)
}

fn run(model: &Model, parts: usize) -> RotorTrace {
    let (time, command) = clock(parts);
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let mut trace = RotorTrace::default();
    model.equations().expect("binds").simulate_rotor(&input, &START, &mut trace);
    trace
}

#[test]
fn each_interval_of_an_uneven_clock_has_its_own_steps() {
    for laws in [
        &HEAT[..],
        &[HEAT[0], HEAT[1], LATE],
        &[LAG, LATE],
        &[RAMP, LATE],
        &[HEAT[0], HEAT[1], RAMP, LAG],
        &[DRAG, TELEMETRY, LATE],
        &[HEAT[0], HEAT[1], LAG, DRAG, TELEMETRY, LATE],
    ] {
        let model = model(laws);
        let (rows, parts) = (run(&model, 1), run(&model, 40));
        let spread =
            |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max((value - values[0]).abs()));
        for (name, rows, parts) in
            [("rate", &rows.rate, &parts.rate), ("reading", &rows.measured, &parts.measured)]
        {
            let apart = rows.iter().zip(parts.iter().step_by(40)).map(|(row, part)| (row - part).abs());
            let apart = apart.fold(0.0, f64::max);
            // What a step leaves whose warmth goes by the rate at its begin, and telemetry by its mean; those of another interval are off by
            // a hundred times as much.
            assert!(apart < 5e-3 * spread(parts), "{laws:?}: {name} off by {apart} of {}", spread(parts));
        }
    }
}

/// [rad/s] how far the rates of a run of one step a row are from those in forty, of what these spread over.
fn off_in_parts(model: &Model) -> f64 {
    let (rows, parts) = (run(model, 1).rate, run(model, 40).rate);
    let off = rows.iter().zip(parts.iter().step_by(40)).map(|(row, part)| (row - part).abs());
    let (least, most) = parts.iter().fold((f64::MAX, f64::MIN), |(a, b), rate| (a.min(*rate), b.max(*rate)));
    off.fold(0.0, f64::max) / (most - least)
}

/// A ramp ends within a row, where no step but its own does.
#[test]
fn a_step_ends_where_a_slew_limit_lets_go() {
    // Steps of the classical Runge-Kutta rule over a third of a time constant; in steps that go over the corner it is 2e-3.
    assert!(off_in_parts(&model(&[RAMP])) < 1e-4);
    assert!(off_in_parts(&model(&[("static_offset", "coefficient", 80.0), RAMP])) < 1e-4);
}

#[test]
fn the_corner_of_a_ramp_is_behind_what_acts_ahead_of_it() {
    let equations =
        model(&[("static_offset", "coefficient", 80.0), HEAT[0], HEAT[1], RAMP]).equations().expect("binds");
    let start = RotorStart { rate: Some(600.0), ..START };
    let at = |z: f64| crate::effect::Point { steady_rate: z, ..equations.constants };
    let state = equations.initial_state(at(500.0), &start);
    // Warm as a rotor at 600 rad/s is: a twentieth of (600 / hover)³ less of z and the offset.
    let left = 1.0 - 0.05 * (600.0 / equations.constants.hover_rate).powi(3);
    let corner = equations.corner(&state, &at(680.0));
    assert!(corner.is_some_and(|corner| (corner.after - 180.0 * left / 3000.0).abs() < 1e-9));
}

/// A battery that falls moves z at each row by what a ramp does in a hundredth of it: the rotor follows as without one.
#[test]
fn a_ramp_that_ends_at_once_holds_nothing_back() {
    let (time, _) = clock(1);
    let command = vec![0.4; time.len()];
    // 20 rad/s a second.
    let voltage: Vec<f64> = time.iter().map(|time| 12.4 - 0.5 * time).collect();
    let input =
        RotorInput { time: &time, command: &command, command_from: None, voltage: Some(&voltage), side: 1.0 };
    let run = |laws: &[(&str, &str, f64)]| {
        let mut model = model(laws);
        model.actuator.voltage_gain = 40.0;
        let mut readings = vec![0.0; time.len()];
        model.equations().expect("binds").rotor_readings(&input, &RotorStart::default(), &mut readings);
        readings
    };
    let off = run(&[RAMP]).iter().zip(run(&[])).map(|(ramp, none)| (ramp - none).abs()).fold(0.0, f64::max);
    // Half of a hundredth of a row at 20 rad/s²; held back by a sixth of a row it would be off by 0.03.
    assert!(off < 5e-3, "{off}");
}

/// A law of one's own that moves by itself moves the corner of the ramp that follows it.
#[test]
fn a_corner_that_moves_is_resolved() {
    let ramp = |model: Model| model.with(&model.effect("slew_rate_limit").expect("known"));
    let fastest = |model: Model| model.equations().expect("binds").fastest();
    let pole = Model::paper().actuator.pole;
    assert_eq!(fastest(ramp(Model::paper())), 0.5 * pole);
    assert_eq!(fastest(ramp(with_law(Site::SteadyRate, "0.1*steady_rate"))), 0.5 * pole);
    let own = || with_law(Site::SteadyRate, "0.1*lag(steady_rate, 0.5)");
    assert!(fastest(own()) < 0.1 * fastest(ramp(own())), "to a few milliseconds");
}

/// What is logged of instants may fall, or be missing; a fit may try any delay.
#[test]
fn a_run_ends_whatever_its_times_are() {
    let (time, command) = clock(1);
    let mut from = time.clone();
    // The next command of another level is in force ahead of one of the same that is late.
    (from[47], from[48]) = (time[47] + 0.004, time[40]);
    (from[101], from[150]) = (f64::NAN, time[140]);
    for delay in [0.013, 1e3, f64::NAN] {
        let equations = model(&[DRAG, (LATE.0, LATE.1, delay)]).equations().expect("binds");
        let input = RotorInput {
            time: &time,
            command: &command,
            command_from: Some(&from),
            voltage: None,
            side: 1.0,
        };
        let mut readings = vec![0.0; time.len()];
        equations.rotor_readings(&input, &START, &mut readings);
        assert!(readings.iter().all(|rate| rate.is_finite()), "{delay}");
    }
}

/// Alone a law on the acceleration does what it does beside one that does nothing.
#[test]
fn one_law_on_the_acceleration_is_what_it_is_among_several() {
    let neutral = ("asymmetric_pole", "ratio", 1.0);
    let (alone, beside) = (run(&model(&[DRAG]), 1).rate, run(&model(&[DRAG, neutral]), 1).rate);
    assert_eq!(alone, beside);
    assert_ne!(alone, run(&model(&[neutral]), 1).rate);
}

/// Nothing that a rotor is given changes, but the time.
#[test]
fn a_law_on_the_command_that_looks_at_the_time_is_asked_at_each_row() {
    let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
    let command = vec![0.4; time.len()];
    let input = RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
    let mut shifting = with_law(Site::Command, "0.02*time");
    shifting = shifting.with(&shifting.effect("motor_heating").expect("known"));
    shifting.set_parameter("motor_heating.gain", 0.0);
    let mut readings = vec![0.0; time.len()];
    shifting.equations().expect("binds").rotor_readings(&input, &START, &mut readings);
    let behind = Model::paper().steady_rate(0.4 + 0.02 * 3.9);
    // Behind a ramp of the command by its pole: 0.02 1/s over 16 rad/s of 1500 rad/s.
    assert!((readings[399] - behind).abs() < 5.0, "{} {behind}", readings[399]);
}

/// Who asks for readings alone is given those of a whole trace.
#[test]
fn readings_are_those_of_a_trace() {
    for laws in [&[DRAG][..], &[HEAT[0], HEAT[1], LATE], &[TELEMETRY, LAG]] {
        let model = model(laws);
        let (time, command) = clock(1);
        let input =
            RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
        let mut readings = vec![0.0; time.len()];
        model.equations().expect("binds").rotor_readings(&input, &START, &mut readings);
        assert_eq!(readings, run(&model, 1).measured, "{laws:?}");
    }
}

/// A law that multiplies what heat leaves of the steady rate is one that multiplies the curve.
#[test]
fn a_law_behind_one_that_remembers_sees_what_that_makes_of_the_steady_rate() {
    let heated = |mut model: Model| {
        model = model.with(&model.effect("motor_heating").expect("known"));
        HEAT.iter()
            .for_each(|(id, parameter, value)| model.set_parameter(&format!("{id}.{parameter}"), *value));
        run(&model, 1).rate
    };
    let mut scaled = Model::paper();
    scaled.actuator.steady_rate.iter_mut().for_each(|coefficient| *coefficient *= 1.1);
    let (behind, ahead) = (heated(with_law(Site::SteadyRate, "0.1*steady_rate")), heated(scaled));
    let apart = behind.iter().zip(&ahead).map(|(behind, ahead)| (behind - ahead).abs()).fold(0.0, f64::max);
    // Rounding: rates of 700 rad/s in another order.
    assert!(apart < 1e-9, "{apart}");
}

/// The guard runs a rotor step by step, a fit over a whole log: two ways of walking through one set of laws.
#[test]
fn a_rotor_run_beside_a_bench_turns_as_the_one_over_its_log() {
    let (time, command) = clock(1);
    let voltage: Vec<f64> = time.iter().map(|time| 12.4 - 0.1 * time).collect();
    let input = RotorInput {
        time: &time,
        command: &command,
        command_from: None,
        voltage: Some(&voltage),
        side: -1.0,
    };
    let mut models = [
        &[][..],
        &[("command_dead_zone", "width", 0.08), ("command_quantization", "step", 0.03)],
        &[HEAT[0], HEAT[1]],
        &[LAG, DRAG],
        &[RAMP],
        &[TELEMETRY, ("asymmetric_pole", "ratio", 0.5)],
        &[HEAT[0], HEAT[1], LAG, DRAG, TELEMETRY],
        &[("battery_sag", "gain", 10.0)],
    ]
    .map(model)
    .to_vec();
    // The battery falls while the command stays.
    models.push(models[3].with(&models[3].effect("battery_scaling").expect("known")));
    for model in models {
        let equations = model.equations().expect("binds");
        let mut over_log = vec![0.0; time.len()];
        equations.rotor_readings(&input, &RotorStart { rate: Some(0.0), ..START }, &mut over_log);
        let member = Member::new(equations, 0.0);
        let mut state = MemberState::default();
        for row in 0..time.len() - 1 {
            member.advance(&mut state, time[row + 1] - time[row], command[row], voltage[row], -1.0);
            let (beside, over_log) = (state.reading(), over_log[row + 1]);
            // Rounding of two sums in another order.
            let is_same = (beside - over_log).abs() < 1e-9 * over_log.abs();
            assert!(is_same, "{:?} {row}: {beside} {over_log}", model.effects);
        }
    }
}

/// A row that lasts longer than a rotor takes to settle is not gone through to its end, and ends as its parts do.
#[test]
fn a_rotor_that_has_settled_stays_so_until_the_next_command() {
    let model = model(&[LAG, DRAG, TELEMETRY]);
    let run = |parts: usize| {
        let time: Vec<f64> = (0..=3 * parts).map(|row| 20.0 * row as f64 / parts as f64).collect();
        let command: Vec<f64> = (0..=3 * parts).map(|row| if row < parts { 0.4 } else { 0.55 }).collect();
        let input =
            RotorInput { time: &time, command: &command, command_from: None, voltage: None, side: 1.0 };
        let mut trace = RotorTrace::default();
        model.equations().expect("binds").simulate_rotor(&input, &START, &mut trace);
        trace
    };
    let (long, short) = (run(1), run(2000));
    for row in 0..=3 {
        let parts = &short.mean[row * 2000..(row * 2000 + 2000).min(short.mean.len())];
        let mean = parts.iter().sum::<f64>() / parts.len() as f64;
        let same = |one: f64, other: f64| (one / other - 1.0).abs() < 1e-6;
        // What is left is that of the steps, which are others in parts.
        assert!(same(long.mean[row], mean), "{row}: {} {mean}", long.mean[row]);
        assert!(same(long.rate[row], short.rate[row * 2000]), "{row}");
        assert!(same(long.measured[row], short.measured[row * 2000]), "{row}");
    }
}
