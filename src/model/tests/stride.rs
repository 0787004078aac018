//! Strides over several rows, against the same equations in steps of a fiftieth of a row.

use super::*;

/// Laws that see nothing but how the body moves, one alone and all together, strong: motion is gone within 40 ms.
fn models() -> Vec<Model> {
    let strong = |model: Model, id: &str, values: &[(&str, f64)]| {
        let mut model = model.with(&model.effect(id).expect("known"));
        for (name, value) in values {
            model.set_parameter(&format!("{id}.{name}"), *value);
        }
        model
    };
    let inertia = Model::paper().body.inertia;
    let pendulum =
        |model| strong(model, "gravity_pendulum", &[("moment", 40.0 * inertia), ("angle_offset", 0.2)]);
    let friction = |model| strong(model, "pivot_viscous_friction", &[("coefficient", inertia / 0.04)]);
    let drag = |model| strong(model, "quadratic_air_drag", &[("coefficient", 0.5 * inertia)]);
    let cable = |model| strong(model, "cable_stiffness", &[("stiffness", 30.0 * inertia)]);
    vec![
        pendulum(Model::paper()),
        friction(Model::paper()),
        drag(Model::paper()),
        cable(Model::paper()),
        cable(drag(friction(pendulum(Model::paper())))),
    ]
}

/// Rows 1 ms apart, late by up to a third of that, and a hole of 9 ms; a torque that jumps each fifth row.
fn input(parts: usize) -> BodyInput {
    let late = |row: usize| 1e-3 * (row as f64 + 0.3 * ((row * row * 7) % 11) as f64 / 11.0);
    let rows: Vec<f64> = (0..400).map(|row| late(row) + if row < 200 { 0.0 } else { 9e-3 }).collect();
    let torque = |row: usize| 0.3 * Model::paper().body.inertia * (((row / 5) * 29) % 13) as f64;
    let (mut time, mut held) = (Vec::new(), Vec::new());
    for (row, pair) in rows.windows(2).enumerate() {
        for part in 0..parts {
            time.push(pair[0] + (pair[1] - pair[0]) * part as f64 / parts as f64);
            held.push(torque(row));
        }
    }
    BodyInput { time: time.into(), torque: held, ..BodyInput::default() }
}

/// Row by row, or in strides.
fn run(model: &Model, parts: usize, strides: bool) -> BodyTrace {
    let input = input(parts);
    let mut equations = model.equations().expect("binds");
    equations.sees_motion_only &= strides;
    let start = BodyStart { angle: 0.4, rate: 2.0, sensor: 0.01 };
    let mut trace = BodyTrace::default();
    equations.simulate_body(&input, 0, input.time.len(), &start, &mut trace);
    trace
}

/// Both channels are the same but for this share of the greatest, and not to the last digit: strides were taken.
fn are_near(ids: &[&str], strides: &BodyTrace, (rows, step): (&BodyTrace, usize), share: f64) {
    let size = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    for (name, strides, rows) in [("rate", &strides.rate, &rows.rate), ("angle", &strides.angle, &rows.angle)]
    {
        let apart = strides.iter().zip(rows.iter().step_by(step)).map(|(stride, row)| stride - row);
        let apart = size(&apart.collect::<Vec<f64>>());
        assert!(apart > 0.0 && apart < share * size(rows), "{ids:?}: {name} off by {apart}");
    }
}

#[test]
fn a_stride_over_several_rows_tells_each_of_them() {
    for model in models() {
        let ids: Vec<&str> = model.effects.iter().map(|effect| effect.id.as_str()).collect();
        let strides = run(&model, 1, true);
        // What a step of 5.5 ms leaves of a motion that is gone within 40 ms: 1e-5 of it.
        are_near(&ids, &strides, (&run(&model, 50, false), 50), 2e-5);
    }
}

/// What the gyroscope shows of them, too: behind a filter, with a bias, and read too large.
#[test]
fn the_gyroscope_reads_each_row_of_a_stride() {
    for id in ["gyro_lag", "gyro_bias", "gyro_scale"] {
        let mut model = models().pop().expect("all together");
        model = model.with(&model.effect(id).expect("known"));
        let without = run(&models().pop().expect("all together"), 1, true);
        let strides = run(&model, 1, true);
        are_near(&[id], &strides, (&run(&model, 1, false), 1), 2e-5);
        // Far more than that: the law is at work.
        let shows = strides.rate.iter().zip(&without.rate).any(|(one, other)| (one - other).abs() > 1e-3);
        assert!(shows, "{id}");
    }
}

/// A window that begins or ends anywhere, and a law of the gyroscope, read the rows as a longer run does.
#[test]
fn a_stride_may_end_at_any_row() {
    let mut model = models().pop().expect("all together");
    model = model.with(&model.effect("gyro_lag").expect("known"));
    model.set_parameter("gyro_lag.pole", 200.0);
    let (input, equations) = (input(1), model.equations().expect("binds"));
    let run = |to: usize| {
        let mut trace = BodyTrace::default();
        let start = BodyStart { angle: 0.4, rate: 2.0, sensor: 0.0 };
        equations.simulate_body(&input, 0, to, &start, &mut trace);
        trace
    };
    let whole = run(300);
    for to in 1..60 {
        let part = run(to);
        assert_eq!((part.rate.len(), part.angle.len()), (to, to));
        for row in 0..to {
            let apart = (part.rate[row] - whole.rate[row]).abs() + (part.angle[row] - whole.angle[row]).abs();
            // A shorter last stride is more exact.
            assert!(apart < 1e-4, "{to}, {row}: {apart}");
        }
    }
}

/// Laws that look at the propellers, turn round at once or are a user's own go row by row.
#[test]
fn other_laws_take_no_strides() {
    let with = |id: &str| Model::paper().with(&Model::paper().effect(id).expect("known"));
    let sees = |model: Model| {
        let equations = model.equations().expect("binds");
        equations.sees_motion_only && !equations.is_stiff
    };
    assert!(sees(with("gravity_pendulum")) && sees(with("gyro_bias")) && sees(with("motor_heating")));
    assert!(!sees(with("inflow_damping")) && !sees(with("ground_effect")));
    assert!(!sees(with("pivot_coulomb_friction")) && !sees(with_law(Site::Torque, "-0.1*body_rate")));
}

/// One interval from a state of one's own: what a run of two rows says, over rows near each other and across a hole of several steps.
#[test]
fn the_next_row_is_that_of_a_run_of_two() {
    let (input, model) = (input(1), models().pop().expect("all together"));
    let equations = model.equations().expect("binds");
    for row in [0, 7, 199] {
        let start = BodyStart { angle: 0.4, rate: 2.0, sensor: 0.0 };
        let mut trace = BodyTrace::default();
        equations.simulate_body(&input, row, row + 2, &start, &mut trace);
        let next = equations.next_body_rate(&input, row, start.angle, start.rate).expect("a next row");
        assert!(next == trace.rate[1] && (next - start.rate).abs() > 1e-3, "{row}: {next}");
    }
    assert!(equations.next_body_rate(&input, input.time.len() - 1, 0.4, 2.0).is_none());
}
