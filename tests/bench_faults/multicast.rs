//! Benches on UDP multicast, which need no CAN: beside DroneCAN's reference implementation in Python, in a network of the test's
//! own, which reaches nothing.

use std::io::Write;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use rotorbench::bench::BenchConfig;
use rotorbench::can::dronecan::NodeId;
use rotorbench::can::{Arrival, Bus, BusPort, Frame, Id};
use rotorbench::clock;
use rotorbench::guard::{Cause, State};
use rotorbench::rt::{LogQueue, Shutdown};
use rotorbench::runtime::controller_plant;
use rotorbench::runtime::run::RunLoop;

use crate::counting::allocations;
use crate::processes::reference::{Reference, asked, text};
use crate::processes::{Patience, Process, TestBench, say, up_to_six_times};

/// Set where the test has its own network already.
const INSIDE: &str = "ROTORBENCH_TEST_NETWORK";
/// The reference leaves it to the routes which device it speaks and listens on. A device that leads elsewhere, too: what is said
/// there must not be heard on the loopback.
const NETWORK: &str = "ip link set lo up && ip route add 239.65.82.0/24 dev lo && exec \"$@\"";

/// Runs a test of this name once more, in a network namespace that has its loopback and nothing else.
fn in_own_network(test: &str, scenario: impl FnOnce()) {
    if std::env::var_os(INSIDE).is_some() {
        return scenario();
    }
    // SAFETY: a plain question to the kernel.
    let is_root = unsafe { libc::geteuid() } == 0;
    let this = std::env::current_exe().expect("this program");
    let status = Command::new("unshare")
        .arg(if is_root { "-n" } else { "-rn" })
        .args(["sh", "-c", NETWORK, "sh"])
        .arg(this)
        .args(["--exact", &format!("multicast::{test}"), "--nocapture"])
        .env(INSIDE, "1")
        .status()
        .expect("unshare (util-linux) is installed");
    assert!(status.success(), "{test}, in a network of its own: {status}");
}

/// The bench of `examples/benches/dronecan.toml` on a bus that needs no CAN.
fn bench(test: &str, change: impl FnOnce(&mut BenchConfig)) -> TestBench {
    let template = include_str!("../../examples/benches/dronecan.toml");
    TestBench::new(test, |config| {
        let name = std::mem::take(&mut config.name);
        *config = BenchConfig::parse(template, Path::new("dronecan.toml")).expect("valid");
        config.name = name;
        config.bus.interface = "mcast:3".to_owned();
        config.guard.rotor_maximum = 0.8;
        config.real_time.lock_memory = false;
        change(config);
    })
}

/// Says which nodes it sees, in which health, and what it read, once the rotors turn; on a line that it is given, it commands them.
const READS_ALONG: &str = r#"
import select, signal, sys, time, dronecan
from dronecan.app.node_monitor import NodeMonitor
signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
node = dronecan.make_node(sys.argv[1], node_id=126, bitrate=1000000)
monitor, seen = NodeMonitor(node), dict(raw=0, rpm=0, arming=0)
def raw(event): seen["raw"] = max([seen["raw"], *event.message.cmd])
def status(event): seen["rpm"] = max(seen["rpm"], event.message.rpm)
def arming(event): seen["arming"] = max(seen["arming"], event.message.status)
node.add_handler(dronecan.uavcan.equipment.esc.RawCommand, raw)
node.add_handler(dronecan.uavcan.equipment.esc.Status, status)
node.add_handler(dronecan.uavcan.equipment.safety.ArmingStatus, arming)
time.sleep(0.5)
print("there", flush=True)
while True:
    end = time.monotonic() + 0.5
    while time.monotonic() < end:
        try: node.spin(0.02)
        except dronecan.UAVCANException as error: print("error", error, flush=True)
    nodes = {e.node_id: (int(e.status.health), e.info.name.decode() if e.info else None) for e in monitor.find_all(lambda _: True)}
    if seen["rpm"] > 500 and seen["raw"] > 500 and len([1 for it in nodes.values() if it[1]]) >= 5:
        print(sorted(nodes.items()), seen["arming"], flush=True)
        break
while not select.select([sys.stdin], [], [], 0)[0]: node.spin(0.02)
node.broadcast(dronecan.uavcan.equipment.esc.RawCommand(cmd=[4000, 4000]))
print("commanded", flush=True)
while True: node.spin(0.05)
"#;

/// Emulator, bridge and controller fly on it; the reference sees each node healthy; then it commands the rotors, as no second node
/// may, and the guard latches.
#[test]
fn a_bench_flies_on_multicast_and_the_reference_sees_it_and_is_seen() {
    in_own_network("a_bench_flies_on_multicast_and_the_reference_sees_it_and_is_seen", || {
        up_to_six_times(|| {
            let bench = bench("mcast-flies", |_| {});
            let check = bench.run(&["check"]);
            assert!(check.status.success(), "{}", text(&check));
            assert!(
                text(&check).contains("bus mcast:3 (UDP multicast 239.65.82.3 on lo, up)"),
                "{}",
                text(&check)
            );
            let mut emulator =
                bench.start(&["emulate", "--can", "mcast:3", "--protocol", "dronecan", "--json"]);
            let mut bridge = bench.start(&["bridge", "--json"]);
            let mut control = bench.start(&["control", "--json"]);
            let mut reference = Reference::start(READS_ALONG, &["mcast:3"]);
            let mut watcher = bench.watch();
            bench.arm_and_wait(&mut watcher);
            let seen = reference.line();
            for node in [
                "100, (0, 'org.rotorbench.bridge')",
                "20, (0, 'org.rotorbench.emulated')",
                "21, (0, 'org.rotorbench.emulated')",
                "30, (0, 'org.rotorbench.emulated')",
                "31, (0, 'org.rotorbench.emulated')",
            ] {
                assert!(seen.contains(node), "{node}: {seen}");
            }
            assert!(seen.ends_with(" 255"), "what ArmingStatus said: {seen}");
            say(&format!("the reference on multicast sees {seen}"));
            let mut stdin = reference.child.stdin.take().expect("piped");
            stdin.write_all(b"go on\n").expect("it reads");
            let latched = watcher.until("a latch", |it| it.state == State::FailsafeLatched as u32);
            let cause = Cause::from_code(latched.cause).unwrap_or_default();
            if cause != Cause::ForeignCommand {
                crate::processes::late(format!("latched before the reference commanded: {cause}"));
            }
            assert_eq!(reference.line(), "commanded");
            for process in [&mut control, &mut emulator, &mut bridge] {
                process.signal(libc::SIGTERM);
                assert!(process.wait().success());
            }
            let summary: serde_json::Value = serde_json::from_str(&bridge.output()).expect("JSON");
            let (port, decoded) = (&summary["bus"]["port"], &summary["bus"]["decoded"]);
            // Nobody listens any more for what was sent in the last period.
            let count = |name: &str| port[name].as_u64().expect("a number");
            assert!(count("sent") - count("echoed") <= 8, "each datagram came back: {port}");
            assert_eq!((port["malformed"].as_u64(), port["dropped"].as_u64()), (Some(0), Some(0)), "{port}");
            for cause in ["checksum", "toggle", "not_a_number", "out_of_range", "other_node"] {
                assert_eq!(decoded[cause].as_u64().unwrap_or(0), 0, "{cause}: {decoded}");
            }
        });
    });
}

/// Ids for the reference, for emulated nodes that have none, and for a bench; parameters and the list of nodes, all without CAN.
#[test]
fn nodes_without_an_id_get_one_and_are_asked_on_multicast() {
    in_own_network("nodes_without_an_id_get_one_and_are_asked_on_multicast", || {
        let bench = bench("mcast-ids", |config| config.bus.dronecan.node_id = NodeId::Dynamic);
        let mut server = bench.start(&["dronecan", "allocate", "--from", "20"]);
        let mut emulator = bench.start(&["emulate", "--can", "mcast:3", "--dynamic-ids", "--json"]);
        let mut run = bench.start(&["run", "--json"]);
        let mut watcher = bench.watch();
        // Who asks while another node does waits: five nodes take a while.
        watcher.until("a guard", |it| it.sequence > 10);
        let mut patience = Patience::seconds(60);
        let list = loop {
            // The allocator is 127: whoever asks takes another number by itself.
            let list = asked(&bench, &["list"]);
            if ["20 ", "21 ", "30 ", "31 ", "125 "]
                .iter()
                .all(|id| text(&list).lines().any(|line| line.trim_start().starts_with(id)))
            {
                break text(&list);
            }
            assert!(patience.lasts(), "{}\n{}{}", text(&list), server.output(), emulator.log());
        };
        assert_eq!(list.matches("org.rotorbench.emulated").count(), 4, "{list}");
        assert_eq!(list.matches("org.rotorbench.bridge").count(), 1, "{list}");
        // Read only: written is nothing while any bench of this machine is armed, and benches of other tests are.
        let read = asked(&bench, &["param", "21", "timeout_s"]);
        assert!(read.status.success() && text(&read).contains("timeout_s"), "{}", text(&read));
        for process in [&mut run, &mut emulator, &mut server] {
            process.signal(libc::SIGTERM);
            assert!(process.wait().success(), "{}", process.log());
        }
        assert_eq!(server.output().matches(" is node ").count(), 5, "{}", server.output());
    });
}

/// What arrives, until `enough` says so.
fn receive(port: &mut BusPort, enough: impl Fn(&[Arrival]) -> bool) -> Vec<Arrival> {
    let mut arrivals = Vec::new();
    let mut patience = Patience::seconds(10);
    while !enough(&arrivals) {
        assert!(patience.lasts(), "only {} arrived: {arrivals:?}", arrivals.len());
        port.receive(|arrival| arrivals.push(arrival)).expect("the device is up");
        std::thread::sleep(Duration::from_millis(1));
    }
    arrivals
}

fn frame(number: u8) -> Frame {
    Frame::classic(Id::Extended(0x1801_5500 | u32::from(number)), &[number; 8]).expect("fits")
}

/// The kernel begins to stamp what comes a moment after it is first asked to, on a busy machine a long one; until then a stamp is when
/// somebody looked. Waits for it, on a bus of its own.
fn until_the_kernel_stamps() {
    let mut one = BusPort::open("mcast:5", false).expect("the loopback is up");
    let mut other = BusPort::open("mcast:5", false).expect("the same");
    let mut patience = Patience::seconds(10);
    loop {
        let sent_ns = clock::monotonic_ns();
        one.send(&frame(0)).expect("there is room");
        std::thread::sleep(Duration::from_millis(60));
        let arrivals = receive(&mut other, |it| !it.is_empty());
        let [Arrival::Frame { stamp_ns, .. }] = arrivals[..] else { panic!("{arrivals:?}") };
        if stamp_ns < sent_ns + 50_000_000 {
            return;
        }
        assert!(patience.lasts(), "no stamp of the kernel's");
    }
}

#[test]
fn frames_come_with_their_stamps_the_own_ones_as_echoes_and_garbage_is_counted() {
    in_own_network("frames_come_with_their_stamps_the_own_ones_as_echoes_and_garbage_is_counted", || {
        let mut one = BusPort::open("mcast:3", false).expect("the loopback is up");
        let mut other = BusPort::open("mcast:3@lo", false).expect("the same");
        let mut elsewhere = BusPort::open("mcast:4", false).expect("another bus");
        until_the_kernel_stamps();
        let sent_ns = clock::monotonic_ns();
        one.send(&frame(1)).expect("there is room");
        // Young as it is, its stamp is when it came, and not when somebody looked.
        std::thread::sleep(Duration::from_millis(60));
        let arrivals = receive(&mut other, |it| !it.is_empty());
        let [Arrival::Frame { frame: came, stamp_ns, .. }] = arrivals[..] else { panic!("{arrivals:?}") };
        assert_eq!(came, frame(1));
        assert!((sent_ns..sent_ns + 50_000_000).contains(&stamp_ns), "{} ns", stamp_ns - sent_ns);
        assert!(one.echo_age_ns(clock::monotonic_ns()) > 50_000_000, "nobody has listened yet");
        let arrivals = receive(&mut one, |it| !it.is_empty());
        assert!(
            matches!(arrivals[..], [Arrival::Echo { frame: came, .. }] if came == frame(1)),
            "{arrivals:?}"
        );
        assert_eq!(one.echo_age_ns(clock::monotonic_ns()), 0);
        // Garbage: what is no datagram of this protocol, a damaged one, one that is too long, an FD frame.
        let stranger = std::net::UdpSocket::bind("127.0.0.1:0").expect("a port");
        let good = [0x34, 0x29, 0xc3, 0x91, 0, 0, 0x7e, 0x55, 1, 0x98, 1, 0, 0, 0, 0, 0, 0, 0xc0];
        let mut damaged = good;
        damaged[17] ^= 1;
        let fd = [0x34, 0x29, 0xfa, 0xfd, 1, 0, 0x7e, 0x55, 1, 0x98, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];
        for garbage in [&b"hello"[..], &damaged, &[0; 1400], &[], &fd, &good] {
            // By the route that the test has made.
            stranger.send_to(garbage, "239.65.82.3:57732").expect("sent");
        }
        let arrivals = receive(&mut one, |it| !it.is_empty());
        assert_eq!(arrivals.len(), 1, "{arrivals:?}");
        assert_eq!((one.counts().malformed, one.counts().received, one.counts().echoed), (5, 1, 1));
        let mut fd = BusPort::open("mcast:3", true).expect("with FD");
        stranger
            .send_to(
                &[0x34, 0x29, 0xfa, 0xfd, 1, 0, 0x7e, 0x55, 1, 0x98, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
                "239.65.82.3:57732",
            )
            .expect("sent");
        assert!(
            matches!(receive(&mut fd, |it| !it.is_empty())[..], [Arrival::Frame { frame, .. }] if frame.length() == 12)
        );
        assert_eq!(elsewhere.receive(|_| {}), Ok(0), "another bus hears nothing of it");
    });
}

/// A flood is taken in bounded pieces, what found no room is counted, and a bus that is down says so.
#[test]
fn a_flood_is_bounded_and_a_bus_that_is_down_is_said_to_be() {
    in_own_network("a_flood_is_bounded_and_a_bus_that_is_down_is_said_to_be", || {
        let mut port = BusPort::open("mcast:3", false).expect("the loopback is up");
        let mut flood = BusPort::open("mcast:3", false).expect("the loopback is up");
        for number in 0..20_000_u32 {
            flood.send(&frame(number as u8)).expect("there is room");
        }
        let first = port.receive(|_| {}).expect("the device is up");
        assert!(first <= 256, "{first} in one go");
        while port.receive(|_| {}).expect("the device is up") > 0 {}
        flood.send(&frame(7)).expect("there is room");
        receive(&mut port, |it| !it.is_empty());
        let counts = port.counts();
        assert_eq!(counts.received + counts.dropped, 20_001, "{counts:?}");
        assert!(counts.dropped > 10_000, "{counts:?}");
        let down = Command::new("ip").args(["link", "set", "lo", "down"]).status().expect("ip is installed");
        assert!(down.success());
        assert!(port.send(&frame(1)).is_err(), "the loopback is down");
        assert!(port.echo_age_ns(clock::monotonic_ns() + 1_000) > 0);
        let Err(error) = BusPort::open("mcast:3", false) else { panic!("the device is down") };
        assert_eq!(error.to_string(), "CAN interface `mcast:3`: the device is down (sudo ip link set lo up)");
    });
}

/// Only what is said on its own device is heard: a group has the same address on all of them.
#[test]
fn what_is_said_on_another_device_is_not_heard() {
    in_own_network("what_is_said_on_another_device_is_not_heard", || {
        let ip = |arguments: &str| {
            let status = Command::new("ip").args(arguments.split(' ')).status().expect("ip is installed");
            assert!(status.success(), "ip {arguments}");
        };
        ip("tuntap add dev tap9 mode tap");
        ip("addr add 10.9.9.1/24 dev tap9");
        ip("link set tap9 up");
        let mut local = BusPort::open("mcast:3", false).expect("the loopback is up");
        let mut there = BusPort::open("mcast:3@tap9", false).expect("the device is up");
        there.send(&frame(1)).expect("there is room");
        let arrivals = receive(&mut there, |it| !it.is_empty());
        assert!(matches!(arrivals[..], [Arrival::Echo { .. }]), "{arrivals:?}");
        local.send(&frame(2)).expect("there is room");
        receive(&mut local, |it| matches!(it, [Arrival::Echo { frame: came, .. }] if *came == frame(2)));
        assert_eq!(there.receive(|_| {}), Ok(0), "what is said on the loopback stays there");
        assert_eq!((local.counts().received, there.counts().received), (0, 0));
        let bench = bench("mcast-open", |config| config.bus.interface = "mcast:3@tap9".to_owned());
        let check = text(&bench.run(&["check"]));
        assert!(check.contains("whoever is in that network can command the rotors"), "{check}");
        let refused = bench.run(&["run", "--arm"]);
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
        assert!(text(&refused).contains("--arm is for the emulator"), "{}", text(&refused));
    });
}

/// The cycle of `run` on multicast, in this thread, which is counted.
#[test]
fn the_cycle_on_multicast_does_not_allocate() {
    in_own_network("the_cycle_on_multicast_does_not_allocate", || {
        let bench = bench("mcast-alloc", |_| {});
        let mut emulator: Process = bench.start(&["emulate", "--can", "mcast:3", "--json"]);
        let source = controller_plant::command_source(&bench.config).expect("a controller");
        let mut run = RunLoop::open(&bench.config, source, LogQueue::new(64), &Shutdown::default())
            .expect("the only one");
        run.start();
        let stranger = std::net::UdpSocket::bind("127.0.0.1:0").expect("a port");
        let group: SocketAddr = "239.65.82.3:57732".parse().expect("an address");
        let ((), count) = allocations(|| {
            for turn in 0..400 {
                run.turn();
                if turn % 50 == 0 {
                    stranger.send_to(&[turn as u8; 9], group).expect("sent");
                }
            }
        });
        say(&format!("run on multicast: {count} allocations in 400 turns"));
        assert_eq!(count, 0);
        emulator.signal(libc::SIGTERM);
        assert!(emulator.wait().success());
    });
}
