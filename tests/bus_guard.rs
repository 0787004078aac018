//! The guard and the controller on their bench, in the thread of the test and at times that the test says.

use rotorbench::bench::{BenchConfig, StepTrigger};
use rotorbench::bus_guard::BusGuard;
use rotorbench::clock;
use rotorbench::guard::{Cause, OperatorAct, State};
use rotorbench::rt::LogQueue;
use rotorbench::runtime::control::ControlProcess;
use rotorbench::runtime::controller_plant;
use rotorbench::shm::{
    BenchMember, BenchPlace, COMMAND, ProcessRole, REQUEST, SENSORS, SharedMemoryConfig, Waiter,
};
use rotorbench::signal::{Request, Sample, Sensors};

const PERIOD_NS: u64 = 20_000_000;

/// A bench of its own for each test; removed at the end.
struct Name(String);

impl Drop for Name {
    fn drop(&mut self) {
        if let Ok(place) = BenchPlace::open(&self.0, &SharedMemoryConfig::default()) {
            let _ = place.remove();
        }
    }
}

fn bench(test: &str, trigger: StepTrigger) -> (Name, BenchConfig) {
    let name = format!("t{}-{test}", std::process::id());
    (Name(name.clone()), BenchConfig { name, trigger, ..BenchConfig::default() })
}

fn join(config: &BenchConfig, role: ProcessRole) -> BenchMember {
    BenchMember::join(&config.name, &config.shared_memory, role).expect("joined")
}

fn sensors(sequence: u64, stamp_ns: u64) -> Sensors {
    let good = |value: f64| Sample::good(value + 1e-3 * (sequence % 97) as f64, stamp_ns, sequence as u32);
    Sensors {
        sequence,
        stamp_ns,
        body_rate: good(0.0),
        battery_voltage: good(12.0),
        propeller_rate: [good(600.0), good(610.0)],
        ..Sensors::default()
    }
}

/// States that a guard with `--arm` goes through in four seconds, when an operator says `act` after one.
fn states_with_arm(test: &str, act: Option<OperatorAct>) -> (Vec<State>, Vec<State>) {
    let (_name, config) = bench(test, StepTrigger::Timer);
    // Before the guard, which meets it as it opens.
    let operator = join(&config, ProcessRole::Operator);
    let mut requests = operator.publish(&REQUEST).expect("the only operator");
    let member = join(&config, ProcessRole::Emulate);
    let guard = config.guard.build(config.period_s).expect("valid");
    let mut guard = BusGuard::open(&member, guard, PERIOD_NS).expect("the only guard");
    guard.arm_by_itself();
    let start_ns = clock::monotonic_ns();
    let mut visited = (Vec::new(), Vec::new());
    for step in 1..=200 {
        let now_ns = start_ns + step * PERIOD_NS;
        if let Some(act) = act.filter(|_| step == 50) {
            requests.send(&Request { sequence: 1, stamp_ns: now_ns, act: act as u32, reserved: 0 });
        }
        // Without a controller the checks never pass.
        guard.look(now_ns);
        let Some((release, applied)) = guard.step_if_due(now_ns, &sensors(step, now_ns)) else { continue };
        guard.finish(release, now_ns, &Sensors::default());
        let state = State::from_code(applied.state).expect("a state");
        if step < 50 { visited.0.push(state) } else { visited.1.push(state) }
    }
    let refused = guard.refusals(Cause::RequestRefused) + guard.refusals(Cause::RequestStale);
    assert!(act.is_some() || refused == 0, "its own wishes are never out of place: {refused}");
    visited
}

#[test]
fn a_disarm_or_stop_ends_the_wish_to_arm_by_itself() {
    let (before, after) = states_with_arm("arm", None);
    assert!(before.contains(&State::PreArm), "{before:?}");
    // The checks take two seconds to fail; then it asks again.
    assert_eq!(after.last(), Some(&State::PreArm), "it asks again and again: {after:?}");
    let (before, after) = states_with_arm("disarm", Some(OperatorAct::Disarm));
    assert!(before.contains(&State::PreArm));
    assert!(after.iter().all(|state| *state == State::Disarmed), "armed against the operator: {after:?}");
    let (_, after) = states_with_arm("stop", Some(OperatorAct::Stop));
    assert!(after.iter().all(|state| *state == State::EmergencyStop), "{after:?}");
}

/// An IMU at four times the control rate: the controller is made for one period, and steps once in each.
#[test]
fn a_faster_imu_does_not_make_the_controller_faster() {
    for factor in [1, 4] {
        let (_name, config) = bench(&format!("imu{factor}"), StepTrigger::Imu);
        let imu = join(&config, ProcessRole::Emulate);
        let mut out = imu.publish(&SENSORS).expect("the only publisher");
        let bell = imu.bell(Waiter::Control).expect("opened");
        let source = controller_plant::command_source(&config).expect("the built-in bench");
        let mut control =
            ControlProcess::open(&config, source, LogQueue::new(8)).expect("the only controller");
        let mut commands = join(&config, ProcessRole::Monitor).subscribe(&COMMAND).expect("subscribed");
        let start_ns = clock::monotonic_ns();
        let mut steps = 0;
        for frame in 1..=100 * factor {
            out.send(&sensors(frame, start_ns + frame * PERIOD_NS / factor));
            bell.ring();
            steps += u32::from(control.turn());
        }
        let sent = std::iter::from_fn(|| commands.next_in_order()).count();
        // Until the IMU's interval is known, in the first of 16 frames, a step may come a quarter period early.
        assert!((99..=102).contains(&steps), "{steps} steps in 100 periods at {factor} times the rate");
        assert_eq!(sent, steps as usize);
    }
}
