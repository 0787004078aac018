//! After start-up the cycles allocate nothing: neither the controller's nor the guard's, not even when a peer comes
//! back from the dead. Counted by the allocator itself, per thread.

use std::time::{Duration, Instant};

use rotorbench::bench::{BenchConfig, StepTrigger};
use rotorbench::bus_guard::BusGuard;
use rotorbench::can::{BusConfig, Frame, Id, ProtocolName, RotorCommands, protocol};
use rotorbench::clock;
use rotorbench::guard::GuardConfig;
use rotorbench::rt::LogQueue;
use rotorbench::runtime::control::ControlProcess;
use rotorbench::runtime::controller_plant;
use rotorbench::shm::{BenchMember, BenchPlace, ProcessRole, SENSORS, SharedMemoryConfig};
use rotorbench::signal::{Applied, Sample, Sensors};

use crate::counting::allocations;

const PERIOD_S: f64 = 0.002;
const PERIOD_NS: u64 = 2_000_000;
/// State code of an armed guard, as a bit.
const ARMED: u32 = 1 << 2;

fn config(test: &str, trigger: StepTrigger) -> BenchConfig {
    // Short pre-arm checks: on a loaded machine 200 ms without one late command at 500 Hz may never come.
    let guard = GuardConfig { arm_checks_s: 0.02, ..GuardConfig::default() };
    BenchConfig {
        name: format!("t{}-allocation-{test}", std::process::id()),
        period_s: PERIOD_S,
        trigger,
        guard,
        ..BenchConfig::default()
    }
}

fn remove(config: &BenchConfig) {
    BenchPlace::open(&config.name, &SharedMemoryConfig::default()).expect("there").remove().expect("removed");
}

fn sensors(sequence: u64) -> Sensors {
    let stamp_ns = clock::monotonic_ns();
    // A count that changes and a value that does too: live, fresh and not frozen.
    let sample = |value: f64| Sample::good(value + sequence as f64 * 1e-6, stamp_ns, sequence as u32);
    Sensors {
        sequence,
        stamp_ns,
        body_rate: sample(0.01),
        battery_voltage: sample(12.4),
        propeller_rate: [sample(600.0), sample(610.0)],
        ..Sensors::default()
    }
}

#[test]
fn the_counter_counts() {
    let (kept, count) = allocations(|| vec![0_u8; 100]);
    assert_eq!((kept.len(), count), (100, 1));
}

/// Controller and guard on two threads, as in two processes: hundreds of cycles of each, armed, through a restart of each peer.
fn cycles_do_not_allocate(test: &str, trigger: StepTrigger) {
    let config = config(test, trigger);
    let incarnations = 3;
    let gate_config = config.clone();
    let gate_thread = std::thread::spawn(move || {
        let guard = gate_config.guard.build(gate_config.period_s).expect("valid");
        for _ in 0..incarnations {
            let bench =
                BenchMember::join(&gate_config.name, &SharedMemoryConfig::default(), ProcessRole::Emulate)
                    .expect("joined");
            let mut guard = BusGuard::open(&bench, guard.clone(), PERIOD_NS).expect("the only guard");
            guard.arm_by_itself();
            let (states, count) = allocations(|| {
                let mut states = 0_u32;
                for sequence in 1..20_000 {
                    // The range only ends a test that hangs.
                    if sequence > 500 && states & ARMED != 0 {
                        break;
                    }
                    let sensors = sensors(sequence);
                    guard.publish_sensors(&sensors, true);
                    let end_ns = sensors.stamp_ns + PERIOD_NS;
                    while clock::monotonic_ns() < end_ns {
                        let _ = rotorbench::rt::wait(
                            [guard.bell().descriptor()],
                            guard.deadline_ns().min(end_ns),
                        );
                        guard.bell().quiet();
                        let now_ns = clock::monotonic_ns();
                        guard.look(now_ns);
                        if let Some((release, applied)) = guard.step_if_due(now_ns, &sensors) {
                            guard.finish(release, clock::monotonic_ns(), &sensors);
                            states |= 1 << applied.state;
                        }
                    }
                }
                states
            });
            assert_eq!(count, 0, "allocations in the cycle of the guard");
            assert_ne!(states & ARMED, 0, "the bench was armed, so the test went the whole way");
        }
    });
    let source = controller_plant::command_source(&config).expect("the built-in bench");
    let mut control = ControlProcess::open(&config, source, LogQueue::new(8)).expect("the only controller");
    let observer = BenchMember::join(&config.name, &SharedMemoryConfig::default(), ProcessRole::Monitor)
        .expect("joined");
    let mut sensors_seen = observer.subscribe(&SENSORS).expect("subscribed");
    let start = Instant::now();
    let (commands, count) = allocations(|| {
        let mut commands = 0;
        while !gate_thread.is_finished() && start.elapsed() < Duration::from_secs(60) {
            commands += u64::from(control.turn());
        }
        commands
    });
    gate_thread.join().expect("no panic at the guard");
    let _ = sensors_seen.newest();
    assert_eq!(count, 0, "allocations in the cycle of the controller");
    let summary = control.cycle().statistics().summary();
    assert_eq!(summary.slots, summary.run + summary.skipped);
    assert_eq!(summary.slots, control.cycle().slots());
    assert!(
        commands > 100 && sensors_seen.incarnations() > 0,
        "{commands} commands through {incarnations} incarnations of the guard"
    );
    drop((control, observer));
    remove(&config);
}

#[test]
fn cycles_on_a_timer_do_not_allocate() {
    cycles_do_not_allocate("timer", StepTrigger::Timer);
}

#[test]
fn cycles_on_the_imu_frame_do_not_allocate() {
    cycles_do_not_allocate("imu", StepTrigger::Imu);
}

/// Both ends of a bus on DroneCAN, and whatever comes on it.
#[test]
fn frames_of_dronecan_do_not_allocate() {
    let bus = BusConfig { protocol: ProtocolName::Dronecan, ..BusConfig::default() };
    let spoken = protocol(&bus, 0.02).expect("sound");
    let (mut bridge, mut bench) = (spoken.bridge_end(), spoken.bench_end(1));
    let asks = Frame::classic(Id::Extended(0x1801_E489), &[0xC0]).expect("short");
    let garbage: Vec<Frame> = (0..=255_u8)
        .map(|byte| {
            let id = Id::Extended(0x0804_0600 | u32::from(byte) << 16 | u32::from(byte % 128));
            Frame::classic(id, &[byte; 8]).expect("short")
        })
        .collect();
    let mut received = [asks; 64];
    let (mut read, mut commands) = (Sensors::default(), RotorCommands::default());
    let mut frames = 0;
    let ((), count) = allocations(|| {
        for turn in 1..500_u64 {
            let now_ns = turn * 20_000_000;
            let applied = Applied { state: 2, rotor: [0.3, 0.4], ..Applied::default() };
            let mut used = 0;
            bench.send_due(now_ns, &sensors(turn), &mut |frame| {
                if let Some(place) = received.get_mut(used) {
                    *place = *frame;
                    used += 1;
                }
            });
            // Node 20 is asked for its first parameter, and told to save all.
            let id = |service: u32| Id::Extended(0x1800_94E4 | service << 16);
            let asked = |service, data: [u8; 2]| {
                let bytes = [data[0], data[1], 0, 0, 0, 0, 0, 0xC0 | turn as u8 & 31];
                Frame::classic(id(service), &bytes).expect("short")
            };
            let parameters = [asked(11, [0, 0]), asked(10, [0, 0])];
            for frame in received[..used].iter().chain(&garbage).chain([&asks]).chain(&parameters) {
                bridge.receive(frame, now_ns, &mut read);
                bench.receive(frame, now_ns, &mut commands);
            }
            for frame in bridge.commands(&applied) {
                bench.receive(frame, now_ns, &mut commands);
            }
            for frame in bridge.due_frames(now_ns, &applied) {
                bench.receive(frame, now_ns, &mut commands);
            }
            assert!(bridge.trouble(now_ns).is_none() && bench.may_turn(now_ns));
            frames += used;
        }
    });
    assert_eq!(count, 0, "allocations by the frame");
    assert!(frames > 5_000 && read.propeller_rate[1].is_good(), "{frames}");
    assert!((commands.rotor[1] - 0.4).abs() < 1e-4, "{commands:?}");
}
