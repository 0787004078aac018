//! No allocation in any step.

use rotorbench::control::{Compensation, Controller, ControllerConfig, ControllerKind, PlantParameters};
use rotorbench::guard::{GuardConfig, GuardState, OperatorAct, State};
use rotorbench::signal::{Applied, Request, Sample};

use super::truth::{Truth, free};
use crate::counting::allocations;

#[test]
fn controllers_and_guard_allocate_nothing() {
    let guard = GuardConfig::default().build(0.02).expect("defaults");
    let known = Compensation { pendulum_moment: 0.1, coulomb_torque: 0.01, ..Compensation::default() };
    for kind in [ControllerKind::Emc, ControllerKind::Pid] {
        let config = ControllerConfig { kind, ..ControllerConfig::default() };
        let controller = config.build_compensated(&PlantParameters::paper(), &known, 0.02).expect("stable");
        let generator = config.reference.build(0.02).expect("valid");
        let (mut state, mut time) = (controller.start(), generator.start());
        let (mut guard_state, mut truth) = (GuardState::new(), Truth::new(0.02, 0.0, free));
        let mut last = Applied::default();
        let ((), count) = allocations(|| {
            for k in 1..500_u32 {
                let now = 20_000_000 * u64::from(k);
                let mut sensors = truth.sensors(k, 1e-3 * f64::from(k % 7));
                for sample in [&mut sensors.body_rate, &mut sensors.battery_voltage] {
                    sample.stamp_ns = now;
                }
                sensors.propeller_rate = [Sample::good(600.0 + f64::from(k % 5), now, k); 2];
                let request =
                    Request { sequence: 1, stamp_ns: now, act: OperatorAct::Arm as u32, reserved: 0 };
                let wanted = generator.next(&mut time, &last);
                let mut command = controller.step(&mut state, &sensors, &wanted, &last);
                command.stamp_ns = now;
                // From the 400th on the controller is silent: failsafe and events are on the path too.
                let newest = (k < 400).then_some(&command);
                last = guard.step(&mut guard_state, now, &sensors, newest, (k == 10).then_some(&request));
                guard_state.take_events().for_each(drop);
                truth.delay.clear();
                if k == 399 {
                    assert_eq!(guard_state.state(), State::Armed);
                }
            }
        });
        assert_eq!(count, 0, "{kind:?}");
        assert_eq!(guard_state.state(), State::FailsafeLatched);
    }
    let (_, count) = allocations(|| std::hint::black_box(vec![0_u8; 1]));
    assert!(count > 0, "the allocator counts");
}
