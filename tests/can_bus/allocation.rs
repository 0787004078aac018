//! The cycle of bridge and run with a real socket allocates nothing: frames in and out, error frames, garbage, another
//! sender's commands, an interface that goes down, comes up, is deleted and made again.

use std::os::fd::AsRawFd;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use rotorbench::bench::StepTrigger;
use rotorbench::can::{Frame, Id};
use rotorbench::guard::OperatorAct;
use rotorbench::rt::{LogQueue, Shutdown};
use rotorbench::runtime::bridge::BridgeLoop;
use rotorbench::runtime::run::RunLoop;
use rotorbench::runtime::{controller_plant, operator};
use rotorbench::shm::{APPLIED, BenchMember, ProcessRole};
use socketcan::{CanErrorFrame, CanSocket, Socket};

use crate::bus::{Bus, ip};
use crate::counting::allocations;
use crate::faults::{Hardware, bench};
use crate::processes::{Patience, TestBench, say};

/// State code of an armed guard, as a bit.
const ARMED: u32 = 1 << 2;

/// Lets `turn` run on a thread of its own, which is counted, while everything that can happen on a bus does.
fn cycle_does_not_allocate(
    bench: &TestBench,
    bus: &Bus,
    open: impl FnOnce() -> Box<dyn FnMut()> + Send,
    name: &str,
) {
    let stop = AtomicBool::new(false);
    let hardware = Hardware::start(bench);
    let (turns, count, states) = std::thread::scope(|scope| {
        let (opened, is_open) = std::sync::mpsc::channel();
        let cycle = scope.spawn({
            let stop = &stop;
            move || {
                let mut turn = open();
                opened.send(()).expect("waited for");
                allocations(|| {
                    let mut turns = 0_u64;
                    while !stop.load(Ordering::Relaxed) {
                        turn();
                        turns += 1;
                    }
                    turns
                })
            }
        });
        is_open.recv().expect("it opens");
        let states = everything_happens(bench, bus);
        stop.store(true, Ordering::Relaxed);
        let (turns, count) = cycle.join().expect("no panic");
        (turns, count, states)
    });
    drop(hardware);
    say(&format!("{name}: {count} allocations in {turns} turns"));
    assert_eq!(count, 0, "allocations in the cycle of {name}, in {turns} turns");
    assert!(turns > 200, "{turns}");
    assert_ne!(states & ARMED, 0, "the bench was armed, so the test went the whole way");
}

/// The bits of the guard's states that were visited.
fn everything_happens(bench: &TestBench, bus: &Bus) -> u32 {
    let member = BenchMember::join(&bench.config.name, &bench.config.shared_memory, ProcessRole::Monitor)
        .expect("joined");
    let mut applied = member.subscribe(&APPLIED).expect("subscribed");
    let mut states = 0;
    let mut patience = Patience::seconds(30);
    while states & ARMED == 0 {
        assert!(patience.lasts(), "the bench is never armed");
        let _ = operator::act(&bench.config, OperatorAct::Disarm);
        let _ = operator::act(&bench.config, OperatorAct::Arm);
        while let Some(applied) = applied.next_in_order() {
            states |= 1 << applied.state;
        }
    }
    std::thread::sleep(Duration::from_millis(300));
    let mut port = bus.port();
    let mut send = |id: u32, data: &[u8]| {
        let id = Id::new(id, id > 0x7FF).expect("an id");
        let _ = port.send(&Frame::classic(id, data).expect("fits"));
        let _ = port.receive(|_| {});
    };
    for (id, data) in
        [(0x20, &[1, 2][..]), (0x123, &[0; 8]), (0x1234_5678, &[]), (0x10, &[0; 8]), (0x20, &[0xFF; 8])]
    {
        send(id, data);
    }
    let raw = CanSocket::open(&bus.name).expect("the bus is up");
    let error = CanErrorFrame::new_error(0x244, &[0, 0x20, 0, 0, 0, 0, 255, 3]).expect("eight bytes");
    raw.write_frame(&error).expect("there is room");
    assert!(raw.as_raw_fd() >= 0);
    for _ in 0..2_000 {
        send(0x555, &[0; 8]);
    }
    let moment = || std::thread::sleep(Duration::from_millis(200));
    bus.down();
    moment();
    bus.up();
    moment();
    ip(&["link", "delete", &bus.name]);
    moment();
    ip(&["link", "add", "dev", &bus.name, "type", "vcan"]);
    ip(&["link", "set", &bus.name, "mtu", "72", "up"]);
    moment();
    states
}

#[test]
fn the_bridges_cycle_on_a_socket_does_not_allocate() {
    let bus = Bus::new();
    let bench = bench("alloc", &bus);
    let _control = bench.start(&["control"]);
    let config = bench.config.clone();
    let open = move || {
        let mut bridge =
            BridgeLoop::open(&config, LogQueue::new(64), &Shutdown::default()).expect("the only bridge");
        Box::new(move || bridge.turn()) as Box<dyn FnMut()>
    };
    cycle_does_not_allocate(&bench, &bus, open, "bridge");
}

#[test]
fn the_cycle_of_run_on_a_socket_does_not_allocate() {
    for trigger in [StepTrigger::Timer, StepTrigger::Imu] {
        let bus = Bus::new();
        let mut bench = bench("allocrun", &bus);
        bench.config.trigger = trigger;
        let config = bench.config.clone();
        let open = move || {
            let source = controller_plant::command_source(&config).expect("the built-in bench");
            let mut run = RunLoop::open(&config, source, LogQueue::new(64), &Shutdown::default())
                .expect("the only one");
            Box::new(move || run.turn()) as Box<dyn FnMut()>
        };
        cycle_does_not_allocate(&bench, &bus, open, &format!("run, trigger {trigger:?}"));
    }
}
