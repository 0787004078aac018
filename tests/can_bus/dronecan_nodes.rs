//! Parameters of nodes and node ids that are given, on a real bus, beside DroneCAN's reference implementation in Python.

use std::process::Output;
use std::time::Duration;

use rotorbench::can::dronecan::NodeId;
use rotorbench::guard::{Cause, OperatorAct, State};
use rotorbench::runtime::operator;

use crate::bus::Bus;
use crate::dronecan::bench;
use crate::processes::reference::{Reference, asked, text};
use crate::processes::{Patience, TestBench, say, up_to_six_times};

/// Cells of the table's line that begins with `name`.
fn cells(output: &Output, name: &str) -> Vec<String> {
    let text = text(output);
    let mut lines = text.lines().map(|line| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
    lines.find(|cells| cells.first().is_some_and(|it| it == name)).unwrap_or_else(|| panic!("{text}"))
}

/// Reads a parameter of a node, sets it, and reads it again.
const ASKS: &str = r#"
import sys, dronecan
node = dronecan.make_node(sys.argv[1], node_id=126, bitrate=1000000)
get_set = dronecan.uavcan.protocol.param.GetSet
def ask(request):
    answer = []
    for _ in range(10):
        node.request(request, int(sys.argv[2]), lambda event: answer.append(event and event.response), timeout=5)
        while not answer: node.spin(0.05)
        if answer[-1]: return answer[-1]
        answer.clear()
print("there", flush=True)
before = ask(get_set.Request(name="timeout_s"))
wish = get_set.Request(name="timeout_s", value=dronecan.uavcan.protocol.param.Value(real_value=float(sys.argv[3])))
after = ask(wish)
third = ask(get_set.Request(index=2))
none = ask(get_set.Request(index=3))
saved = ask(dronecan.uavcan.protocol.param.ExecuteOpcode.Request(opcode=0))
print(round(before.value.real_value, 4), round(after.value.real_value, 4), after.max_value.real_value, after.name.decode(),
      third.name.decode(), third.value.boolean_value, len(none.name), saved.ok, flush=True)
"#;

#[test]
fn parameters_are_read_and_written_and_not_while_the_bench_is_armed() {
    up_to_six_times(|| {
        let bus = Bus::new();
        let bench = bench("dronecan-param", &bus, 50.0);
        let _emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
        let all = asked(&bench, &["param", "20"]);
        assert!(all.status.success(), "{}", text(&all));
        assert_eq!(cells(&all, "esc_index")[..5], ["esc_index", "0", "0", "0", "19"]);
        assert_eq!(cells(&all, "timeout_s")[1], "0.5");
        let written = asked(&bench, &["param", "20", "timeout_s", "0.125", "--save"]);
        assert!(written.status.success(), "{}", text(&written));
        assert_eq!(cells(&written, "timeout_s")[1..3], ["0.125", "0.5"]);
        for (arguments, said) in [
            (["param", "20", "timeout_s", "9"], "`timeout_s` takes 0.05 to 5: 9 is out of range"),
            (["param", "20", "esc_index", "x"], "`esc_index` is a whole number: `x` is none"),
            (["param", "20", "gain", "1"], "node 20 has no parameter `gain`"),
        ] {
            let refused = asked(&bench, &arguments);
            assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
            assert!(text(&refused).contains(said), "{}", text(&refused));
        }
        let silent = bench.run(&["dronecan", "param", "99"]);
        assert_eq!((silent.status.code(), text(&silent).trim()), (Some(1), "node 99 does not answer"));

        let mut run = bench.start(&["run", "--json"]);
        let mut watcher = bench.watch();
        bench.arm_and_wait(&mut watcher);
        // Starting a program may have latched the guard here: it is not disarmed in any case.
        let refused = bench.run(&["dronecan", "param", "20", "timeout_s", "0.5"]);
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
        assert!(text(&refused).contains("parameters are written only while"), "{}", text(&refused));
        assert!(operator::act(&bench.config, OperatorAct::Disarm).expect("the bench runs").obeyed);
        let one = asked(&bench, &["param", "20", "timeout_s"]);
        assert_eq!(cells(&one, "timeout_s")[1], "0.125", "nothing was written");
        let written = asked(&bench, &["param", "20", "timeout_s", "0.5"]);
        assert!(written.status.success(), "{}", text(&written));
        run.signal(libc::SIGTERM);
        assert!(run.wait().success());
    });
}

/// Ten frames of each message a second: in Python, on one emulated processor, more of them would be read later and later.
#[test]
fn the_reference_reads_and_writes_parameters_of_an_emulated_esc() {
    let bus = Bus::new();
    let bench = bench("dronecan-asked", &bus, 10.0);
    let _emulator = bench.start(&["emulate", "--can", &bus.name, "--json"]);
    let mut reference = Reference::start(ASKS, &[&bus.name, "21", "0.25"]);
    assert_eq!(reference.line(), "0.5 0.25 5.0 timeout_s reversed 0 0 True");
    let one = asked(&bench, &["param", "21", "timeout_s"]);
    assert_eq!(cells(&one, "timeout_s")[1], "0.25", "{}", text(&one));
}

/// A node of the reference with parameters of every type.
const HAS_PARAMETERS: &str = r#"
import sys, dronecan
node = dronecan.make_node(sys.argv[1], node_id=60, bitrate=1000000)
param = dronecan.uavcan.protocol.param
values = [("gain", "real_value", 1.5), ("label", "string_value", "left"), ("poles", "integer_value", -7),
          ("zz_on", "boolean_value", True)]
saved = []
def get_set(event):
    response, wish = param.GetSet.Response(), event.request
    name = wish.name.decode() or (values[wish.index][0] if wish.index < len(values) else "")
    for at, (known, kind, value) in enumerate(values):
        if known != name: continue
        if dronecan.get_active_union_field(wish.value) == kind:
            value = getattr(wish.value, kind)
            value = value.decode() if kind == "string_value" else value
            values[at] = (known, kind, value)
        response.name = known
        response.value = param.Value(**{kind: value})
        response.default_value = param.Value(**{kind: value})
        if kind == "integer_value":
            response.min_value, response.max_value = param.NumericValue(integer_value=-9), param.NumericValue(integer_value=9)
    return response
def opcode(event):
    saved.append(event.request.opcode)
    return param.ExecuteOpcode.Response(ok=True)
node.add_handler(param.GetSet, get_set)
node.add_handler(param.ExecuteOpcode, opcode)
print("there", flush=True)
while not saved: node.spin(0.05)
end = [0]
for _ in range(20): node.spin(0.05)
print(values, saved, flush=True)
"#;

#[test]
fn a_node_of_the_reference_says_and_takes_parameters_of_every_type() {
    let bus = Bus::new();
    let bench = bench("dronecan-types", &bus, 50.0);
    let mut reference = Reference::start(HAS_PARAMETERS, &[&bus.name]);
    let all = asked(&bench, &["param", "60"]);
    assert_eq!(cells(&all, "gain")[1], "1.5", "{}", text(&all));
    assert_eq!(cells(&all, "label")[1], "left");
    assert_eq!(cells(&all, "poles")[1..5], ["-7", "-7", "-9", "9"]);
    assert_eq!(cells(&all, "zz_on")[1], "true");
    for (name, value) in [("label", "right"), ("poles", "9"), ("zz_on", "false"), ("gain", "-0.25")] {
        let written = asked(&bench, &["param", "60", name, value]);
        assert!(written.status.success(), "{}", text(&written));
        assert_eq!(cells(&written, name)[1], value);
    }
    assert_eq!(asked(&bench, &["param", "60", "poles", "10"]).status.code(), Some(2));
    assert!(asked(&bench, &["param", "60", "--save"]).status.success());
    let said = reference.line();
    for part in ["-0.25", "'right'", "'poles', 'integer_value', 9", "'zz_on', 'boolean_value', ", "[0]"] {
        assert!(said.contains(part), "{said}");
    }
}

/// The reference as the allocator; it says which ids it gave, and which nodes it sees, each second.
const GIVES: &str = r#"
import sys, time, dronecan
from dronecan.app.node_monitor import NodeMonitor
from dronecan.app.dynamic_node_id import CentralizedServer
node = dronecan.make_node(sys.argv[1], node_id=126, bitrate=1000000)
monitor = NodeMonitor(node)
server = CentralizedServer(node, monitor)
print("there", flush=True)
while True:
    end = time.monotonic() + 1
    while time.monotonic() < end: node.spin(0.05)
    seen = [(e.node_id, e.info.name.decode() if e.info else None) for e in monitor.find_all(lambda _: True)]
    print(sorted(seen), flush=True)
"#;

fn dynamic(test: &str, bus: &Bus) -> TestBench {
    let mut bench = bench(test, bus, 50.0);
    bench.config.bus.dronecan.node_id = NodeId::Dynamic;
    std::fs::write(&bench.file, toml::to_string(&bench.config).expect("TOML")).expect("written");
    bench
}

#[test]
fn the_reference_gives_a_bench_its_node_id_and_no_second_allocator_begins() {
    let bus = Bus::new();
    let bench = dynamic("dronecan-asks", &bus);
    let mut reference = Reference::start(GIVES, &[&bus.name]);
    let refused = asked(&bench, &["allocate", "--seconds", "1"]);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
    assert!(text(&refused).contains("node 126 gives node ids on this bus already"), "{}", text(&refused));
    let mut run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    watcher.until("a guard", |it| it.sequence > 10);
    assert_eq!(watcher.newest.state, State::Disarmed as u32);
    let mut patience = Patience::seconds(60);
    let mut seen = String::new();
    while !seen.contains("'org.rotorbench.bridge'") {
        assert!(patience.lasts(), "{seen}\n{}", run.log());
        seen = reference.line();
    }
    say(&format!("the reference gave a node id and sees: {seen}"));
    assert!(seen.contains("(125, 'org.rotorbench.bridge')"), "the highest free one: {seen}");
    run.signal(libc::SIGTERM);
    assert!(run.wait().success());
}

/// A node without an id, as the reference sends frames of one.
const ASKS_FOR_AN_ID: &str = r#"
import sys, time, random, dronecan
from dronecan import transport
allocation = dronecan.uavcan.protocol.dynamic_node_id.Allocation
node = dronecan.make_node(sys.argv[1], bitrate=1000000)
own = bytes.fromhex(sys.argv[2])
state = dict(next=time.monotonic() + 0.6, at=0, given=0, sent=0)
def heard(event):
    state.update(next=time.monotonic() + random.uniform(0.6, 1.0), at=0)
    part = bytes(event.message.unique_id.to_bytes())
    if not event.transfer.source_node_id or not own.startswith(part): return
    if len(part) == 16: state["given"] = event.message.node_id
    else: state.update(next=time.monotonic() + random.uniform(0, 0.4), at=len(part))
node.add_handler(allocation, heard)
print("there", flush=True)
while not state["given"]:
    node.spin(0.01)
    if time.monotonic() < state["next"]: continue
    message = allocation(node_id=0, first_part_of_unique_id=state["at"] == 0)
    message.unique_id.from_bytes(own[state["at"]:state["at"] + 6])
    state.update(next=time.monotonic() + random.uniform(0.6, 1.0), at=0)
    transfer = transport.Transfer(payload=message, source_node_id=0, transfer_id=state["sent"] % 32, transfer_priority=24,
                                  service_not_message=False, discriminator=random.randrange(1 << 14))
    state["sent"] += 1
    for frame in transfer.to_frames(): node.can_driver.send(frame.message_id, frame.bytes, extended=True)
print(state["given"], flush=True)
"#;

#[test]
fn our_allocator_gives_ids_to_the_reference_and_to_a_bench_and_remembers_them() {
    let bus = Bus::new();
    let bench = dynamic("dronecan-gives", &bus);
    let folder = tempfile::tempdir().expect("a folder");
    let table = folder.path().join("nodes.toml");
    let serve = ["dronecan", "allocate", "--table", table.to_str().expect("UTF-8")];
    let unique = "00112233445566778899aabbccddeeff";
    let mut server = bench.start(&serve);
    let mut reference = Reference::start(ASKS_FOR_AN_ID, &[&bus.name, unique]);
    assert_eq!(reference.line(), "125");
    drop(reference);
    let mut run = bench.start(&["run", "--json"]);
    let mut watcher = bench.watch();
    watcher.until("a guard", |it| it.sequence > 10);
    let list = asked(&bench, &["list"]);
    assert_eq!(cells(&list, "124")[1], "org.rotorbench.bridge", "{}", text(&list));
    run.signal(libc::SIGTERM);
    assert!(run.wait().success());
    server.signal(libc::SIGTERM);
    assert!(server.wait().success());
    let said = server.output();
    assert!(said.contains(&format!("{unique} is node 125\n")), "{said}");
    let kept = std::fs::read_to_string(&table).expect("the table");
    assert!(kept.contains(&format!("{unique} = 125")) && kept.lines().count() == 2, "{kept}");
    // Another allocator with the same table, and the same two again.
    let mut server = bench.start(&serve);
    let mut reference = Reference::start(ASKS_FOR_AN_ID, &[&bus.name, unique]);
    assert_eq!(reference.line(), "125");
    server.signal(libc::SIGTERM);
    assert!(server.wait().success());
    assert!(server.output().contains("as before"), "{}", server.output());
    assert_eq!(std::fs::read_to_string(&table).expect("the table"), kept);
}

/// Whatever their indices: each command of one holds a number for the ESCs of the other, and arming names nobody.
#[test]
fn of_two_benches_on_one_bus_both_latch_before_a_rotor_turns() {
    let bus = Bus::new();
    let one = bench("dronecan-one", &bus, 50.0);
    let mut other = bench("dronecan-other", &bus, 50.0);
    other.config.bus.dronecan.node_id = NodeId::Fixed(101);
    other.config.bus.dronecan.esc_index = [2, 3];
    std::fs::write(&other.file, toml::to_string(&other.config).expect("TOML")).expect("written");
    let mut runs = [one.start(&["run", "--json"]), other.start(&["run", "--json"])];
    for bench in [&one, &other] {
        let mut watcher = bench.watch();
        watcher.until("a latch", |it| it.state == State::FailsafeLatched as u32);
        watcher.assert_latched(&[Cause::ForeignCommand]);
    }
    for run in &mut runs {
        run.signal(libc::SIGTERM);
        assert!(run.wait().success());
    }
}

/// Nobody gives ids: the bench says so and ends, without a word on the bus but the question.
#[test]
fn a_bench_that_gets_no_node_id_says_so_and_ends() {
    let bus = Bus::new();
    let bench = dynamic("dronecan-nobody", &bus);
    let mut port = bus.port();
    let run = bench.run(&["run", "--json"]);
    assert_eq!(run.status.code(), Some(2), "{}", text(&run));
    assert!(text(&run).contains("nobody gave this bench a node id within 10 s"), "{}", text(&run));
    std::thread::sleep(Duration::from_millis(20));
    let mut frames = Vec::new();
    port.receive(|arrival| {
        if let rotorbench::can::Arrival::Frame { frame, .. } = arrival {
            frames.push(frame.id().number());
        }
    })
    .expect("the bus is up");
    assert!((5..=20).contains(&frames.len()), "{frames:x?}");
    assert!(frames.iter().all(|id| id & 0x3FF == 0x100), "requests without a sender's number: {frames:x?}");
}
