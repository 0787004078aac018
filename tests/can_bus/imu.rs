//! `run` with the IMU frame as its trigger: an IMU that sends faster than the control period, one that is silent, an operator who
//! rings, and one who does not.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rotorbench::bench::{BenchConfig, StepTrigger};
use rotorbench::can::Roles;
use rotorbench::clock;
use rotorbench::guard::{OperatorAct, State};
use rotorbench::rt::{LogQueue, Shutdown};
use rotorbench::runtime::controller_plant;
use rotorbench::runtime::run::RunLoop;
use rotorbench::shm::{BenchMember, COMMAND, ProcessRole, STOPS, Waiter};
use rotorbench::signal::{Request, Sample, Sensors};

use crate::bus::Bus;
use crate::faults::bench;
use crate::processes::{TestBench, late, say, up_to_six_times};

fn triggered(test: &str, bus: &Bus, period_s: f64) -> TestBench {
    let mut bench = bench(test, bus);
    bench.config.trigger = StepTrigger::Imu;
    bench.config.period_s = period_s;
    bench
}

fn run_of(config: &BenchConfig) -> RunLoop {
    let source = controller_plant::command_source(config).expect("the built-in bench");
    RunLoop::open(config, source, LogQueue::new(16), &Shutdown::default()).expect("the only one")
}

#[test]
fn an_imu_at_four_times_the_rate_steps_the_controller_with_each_fourth_frame() {
    const FRAMES: u32 = 160;
    let bus = Bus::new();
    // Frames each 20 ms: User-Mode Linux sleeps 10 ms at least.
    let bench = triggered("imu", &bus, 0.08);
    let roles = Roles::build(&bench.config.bus, bench.config.period_s).expect("valid");
    let gyro = roles.sensor_messages().iter().position(|message| message.name == "GYRO").expect("it has one");
    let stop = AtomicBool::new(false);
    let (commands, frames) = std::thread::scope(|scope| {
        let (opened, is_open) = std::sync::mpsc::channel();
        let run = scope.spawn({
            let (config, stop) = (&bench.config, &stop);
            move || {
                let mut run = run_of(config);
                opened.send(()).expect("waited for");
                while !stop.load(Ordering::Relaxed) {
                    run.turn();
                }
            }
        });
        is_open.recv().expect("it opens");
        let member = BenchMember::join(&bench.config.name, &bench.config.shared_memory, ProcessRole::Monitor)
            .expect("joined");
        let mut commands = member.subscribe(&COMMAND).expect("subscribed");
        let mut port = bus.port();
        let (mut sender, mut sensors, mut count) = (roles.sensor_sender(), Sensors::default(), 0_usize);
        for frame in 0..FRAMES {
            sensors.body_rate = Sample::good(1e-4 * f64::from(frame), 1, 1);
            let frame = roles.encode_sensors(&mut sender, gyro, &sensors).expect("a frame");
            port.send(&frame).expect("there is room");
            let _ = port.receive(|_| {});
            std::thread::sleep(Duration::from_secs_f64(bench.config.period_s / 4.0));
            count += std::iter::from_fn(|| commands.next_in_order()).count();
        }
        stop.store(true, Ordering::Relaxed);
        run.join().expect("no panic");
        (count, FRAMES)
    });
    say(&format!("{commands} steps of the controller on {frames} frames of an IMU at four times its rate"));
    // A machine that holds the sender up makes the frames rarer, and each second or third of them due: never each one.
    assert!(commands as u32 >= frames / 5 && commands as u32 <= frames / 2, "{commands} of {frames}");
}

/// A `stop` that died between its request and its ring is found after a frame's answer is out, and the next turn makes it: it
/// waits for neither frame nor slot.
#[test]
fn a_stop_that_nobody_rang_for_is_made_in_the_next_turn() {
    let bus = Bus::new();
    let bench = triggered("unrung", &bus, 0.02);
    let config = &bench.config;
    let roles = Roles::build(&config.bus, config.period_s).expect("valid");
    let gyro = roles.sensor_messages().iter().position(|message| message.name == "GYRO").expect("it has one");
    let mut run = run_of(config);
    // A guard refuses what was asked before its first step.
    run.start();
    while run.guard().cycle().slots() == 0 {
        run.turn();
    }
    let operator =
        BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Operator).expect("joined");
    let (mut port, mut sender, mut sensors) = (bus.port(), roles.sensor_sender(), Sensors::default());
    // Not too old by the time that `run` has opened the place of the request.
    let mut stops = operator.publish(&STOPS[0]).expect("free");
    for sequence in 1.. {
        let (stamp_ns, act) = (clock::monotonic_ns(), OperatorAct::Stop as u32);
        stops.send(&Request { sequence, stamp_ns, act, reserved: 0 });
        sensors.body_rate = Sample::good(1e-4 * sequence as f64, 1, 1);
        let frame = roles.encode_sensors(&mut sender, gyro, &sensors).expect("a frame");
        port.send(&frame).expect("there is room");
        run.turn();
        assert_ne!(run.guard().applied().state, State::EmergencyStop as u32, "not on the way of a frame");
        if run.guard().is_stop() {
            break;
        }
        assert!(sequence < 1_000, "it is never found");
        std::thread::sleep(Duration::from_millis(5));
    }
    let slots = run.guard().cycle().slots();
    run.turn();
    assert_eq!(run.guard().applied().state, State::EmergencyStop as u32);
    assert_eq!(run.guard().cycle().slots(), slots, "at once, and not when a slot was due");
}

/// Who rings wakes `run` from its wait for a frame, before a frame or a slot does, and is heard.
#[test]
fn a_stop_that_is_rung_for_ends_the_wait_for_a_frame() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = triggered("rung", &bus, 1.0);
        let config = &bench.config;
        let mut run = run_of(config);
        run.start();
        let operator =
            BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Operator).expect("joined");
        let mut stops = operator.publish(&STOPS[0]).expect("free");
        let bell = operator.bell(Waiter::Guard).expect("a bell");
        // More than once: the first may be too early for `run` to have opened the place of the request.
        for sequence in 1..=20 {
            let slots = run.guard().cycle().slots();
            std::thread::scope(|scope| {
                scope.spawn(|| {
                    std::thread::sleep(Duration::from_millis(30));
                    let (stamp_ns, act) = (clock::monotonic_ns(), OperatorAct::Stop as u32);
                    stops.send(&Request { sequence, stamp_ns, act, reserved: 0 });
                    bell.ring();
                });
                run.turn();
            });
            let guard = run.guard();
            if guard.cycle().slots() != slots {
                late("a slot came before the ring".to_owned());
            }
            if guard.applied().state == State::EmergencyStop as u32 {
                return;
            }
            assert!(!guard.is_stop(), "woken by the ring, which was not heard");
        }
        panic!("it is never heard");
    });
}

/// Nor does it sleep on when no frame comes: each turn ends at its slot.
#[test]
fn without_frames_each_slot_ends_the_wait() {
    up_to_six_times(|| {
        let bus = Bus::new();
        // User-Mode Linux sleeps 10 ms at least.
        let bench = triggered("slots", &bus, 0.05);
        let mut run = run_of(&bench.config);
        run.start();
        for _ in 0..40 {
            run.turn();
        }
        let timing = run.guard().cycle().statistics().summary();
        say(&format!("{} slots in 40 turns without frames, {} of them run", timing.slots, timing.run));
        if timing.skipped > 4 {
            late(format!("{} slots skipped", timing.skipped));
        }
        // A wait never ends before its time; a signal or a frame of somebody else may end some.
        assert!(timing.run >= 36, "{timing:?}");
    });
}
