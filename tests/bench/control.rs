//! `cargo bench --bench control`: EMC, PID and guard step, against a bare copy of what they read and write.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use rotorbench::control::{Compensation, Controller, ControllerConfig, ControllerKind, PlantParameters};
use rotorbench::guard::{GuardConfig, GuardState, OperatorAct, State};
use rotorbench::signal::{Applied, Command, Reference, Request, Sample, Sensors};

/// [ns] 1 kHz.
const PERIOD: u64 = 1_000_000;

fn sensors(k: u64) -> Sensors {
    let now = 1_000_000_000 + k * PERIOD;
    let good = |value: f64| Sample::good(value + 1e-3 * (k % 17) as f64, now, k as u32);
    Sensors {
        sequence: k,
        stamp_ns: now,
        body_rate: good(0.01),
        battery_voltage: good(12.1),
        propeller_rate: [good(610.0), good(620.0)],
        ..Sensors::default()
    }
}

/// The yardstick: what a step reads and writes goes in and out, and nothing is computed.
fn copy(criterion: &mut Criterion) {
    let mut k = 0;
    criterion.bench_function("baseline: copy sensors in, command out", |bencher| {
        bencher.iter(|| {
            k += 1;
            let input = black_box(sensors(k));
            black_box(Command { sequence: input.sequence, ..Command::default() })
        });
    });
}

fn controllers(criterion: &mut Criterion) {
    let pendulum = Compensation { pendulum_moment: 0.1, coulomb_torque: 0.01, ..Compensation::default() };
    for (name, kind, known) in [
        ("emc step", ControllerKind::Emc, Compensation::default()),
        ("emc step, pendulum and friction cancelled", ControllerKind::Emc, pendulum),
        ("pid step", ControllerKind::Pid, Compensation::default()),
    ] {
        let config = ControllerConfig { kind, ..ControllerConfig::default() };
        let built = config.build_compensated(&PlantParameters::paper(), &known, 0.001);
        let Ok(controller) = built else { panic!("the defaults build") };
        let mut state = controller.start();
        let mut applied = Applied::default();
        let mut k = 0;
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                k += 1;
                let input = black_box(sensors(k));
                let command = controller.step(&mut state, &input, &Reference::default(), &applied);
                (applied.command_sequence, applied.rotor) = (command.sequence, command.rotor);
                black_box(command)
            });
        });
    }
}

fn guard(criterion: &mut Criterion) {
    let Ok(guard) = GuardConfig::default().build(0.001) else { panic!("the defaults build") };
    let mut state = GuardState::new();
    let mut k = 0;
    criterion.bench_function("guard step, armed", |bencher| {
        bencher.iter(|| {
            k += 1;
            let input = black_box(sensors(k));
            let now = input.stamp_ns;
            let command = Command {
                sequence: k,
                stamp_ns: now,
                sensors_sequence: k,
                rotor: [0.46; 2],
                ..Command::default()
            };
            let arm = Request { sequence: 1, stamp_ns: now, act: OperatorAct::Arm as u32, reserved: 0 };
            let request = (k == 2).then_some(&arm);
            black_box(guard.step(&mut state, now, &input, Some(&command), request))
        });
    });
    assert_eq!(state.state(), State::Armed);
}

criterion_group!(benches, copy, controllers, guard);
criterion_main!(benches);
