//! The port on a real bus.

use rotorbench::can::{
    Arrival, BusConfig, BusFault, CanError, Frame, FrameKind, Id, InterfaceStatus, Port, Roles, RotorCommands,
};
use rotorbench::clock::monotonic_ns;
use rotorbench::signal::Applied;
use socketcan::{CanErrorFrame, CanSocket, Socket, SocketOptions};

use crate::bus::{Bus, ip, receive, run};
use crate::processes::{Patience, TestBench};

fn frame(number: u32, data: &[u8]) -> Frame {
    Frame::classic(Id::new(number, number > 0x7FF).expect("valid"), data).expect("fits")
}

#[test]
fn frames_of_every_kind_cross_with_stamps_and_come_back_as_echo() {
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    let fd = FrameKind::Fd { bit_rate_switch: true, error_state: false };
    let long = Frame::new(Id::Extended(0x1234_5678), fd, &[0xA5; 64]).expect("fits");
    let remote = Frame::remote(Id::Standard(7), 4).expect("fits");
    let sent = [frame(0x7FF, &[1, 2, 3]), frame(0x1ABC_DEF0, &[0xFF; 8]), frame(1, &[]), long, remote];
    let before = monotonic_ns();
    for frame in &sent {
        one.send(frame).expect("there is room");
    }
    let arrived = receive(&mut other, |arrivals| arrivals.len() == sent.len());
    let after = monotonic_ns();
    // Carried from the kernel's clock to ours no more exactly than the two could be compared: the port says how exactly.
    let off = other.stamp_uncertainty_ns(before);
    let around = before - off..=after + off;
    // They were compared in between.
    assert!(off > 0 && off < after - before, "{off} ns for all of {} ns", after - before);
    for (arrival, sent) in arrived.iter().zip(&sent) {
        let Arrival::Frame { frame, stamp_ns, hardware_ns } = arrival else { panic!("{arrival:?}") };
        assert_eq!(frame, sent);
        assert!(around.contains(stamp_ns), "{stamp_ns} is not in {before}..{after}, give or take {off} ns");
        assert_eq!(*hardware_ns, None, "a virtual bus has no clock");
    }
    let echoes = receive(&mut one, |arrivals| arrivals.len() == sent.len());
    assert!(echoes.iter().all(|arrival| matches!(arrival, Arrival::Echo { .. })), "{echoes:?}");
    assert_eq!(one.echo_age_ns(monotonic_ns()), 0);
    assert_eq!((one.counts().sent, one.counts().echoed, one.counts().received), (5, 5, 0));
    assert_eq!((other.counts().received, other.counts().echoed), (5, 0));
}

#[test]
fn a_stamp_is_when_the_frame_came_and_not_when_it_was_read() {
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    one.send(&frame(1, &[])).expect("there is room");
    let sent = monotonic_ns();
    std::thread::sleep(std::time::Duration::from_millis(200));
    let arrived = receive(&mut other, |arrivals| arrivals.len() == 1);
    let Some(Arrival::Frame { stamp_ns, .. }) = arrived.first() else { panic!("{arrived:?}") };
    // Half of the 200 ms for a machine that is busy elsewhere.
    assert!(*stamp_ns < sent + 100_000_000, "stamped {} ns after it was sent", stamp_ns - sent);
}

/// The port makes room for a few frames at first: that there are more shows only when that is full.
#[test]
fn all_that_is_there_is_taken_at_once_and_in_order() {
    let bus = Bus::new();
    // What came first hears last: once it has them all, the other has, too.
    let (mut witness, mut one, mut other) = (bus.port(), bus.port(), bus.port());
    for count in [1_u8, 3, 4, 5, 19, 20, 21, 60] {
        for number in 0..count {
            one.send(&frame(1, &[number])).expect("there is room");
        }
        receive(&mut witness, |arrivals| arrivals.len() == usize::from(count));
        let mut numbers = Vec::new();
        let taken = other.receive(|arrival| {
            if let Arrival::Frame { frame, .. } = arrival {
                numbers.push(frame.data()[0]);
            }
        });
        assert_eq!((taken, numbers), (Ok(usize::from(count)), (0..count).collect()));
    }
}

/// On a bus where every look finds a frame, nobody has time to compare the clocks but the one who has sent his command.
#[test]
fn clocks_are_compared_when_the_command_is_out() {
    let bus = Bus::new();
    let (mut port, mut other) = (commander(&bus), bus.port());
    let off_ns = |port: &Port| port.stamp_uncertainty_ns(monotonic_ns());
    // The drift since is more than a comparison is off, unless it was held up each time; or so was the sleep, and the look had to
    // compare them.
    let is_better = (0..50).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(60));
        other.send(&frame(0x20, &[])).expect("there is room");
        receive(&mut port, |arrivals| !arrivals.is_empty());
        let before_ns = off_ns(&port);
        port.listen();
        off_ns(&port) < before_ns
    });
    assert!(is_better);
}

/// Whoever gives the port the time spares it the clock, and not the truth: what came since has its own time.
#[test]
fn a_frame_that_came_after_the_time_that_was_told_has_its_own() {
    use rotorbench::can::Bus as _;
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    other.receive(|_| ()).expect("up");
    let told_ns = monotonic_ns();
    std::thread::sleep(std::time::Duration::from_millis(20));
    let before_ns = monotonic_ns();
    one.send(&frame(1, &[])).expect("there is room");
    let after_ns = monotonic_ns();
    // Its echo says that the kernel has handed it over, which takes a busy one a while.
    receive(&mut one, |arrivals| arrivals.len() == 1);
    other.look_at(told_ns);
    let mut stamps = Vec::new();
    other
        .receive(|arrival| {
            if let Arrival::Frame { stamp_ns, .. } = arrival {
                stamps.push(stamp_ns)
            }
        })
        .expect("up");
    let off = other.stamp_uncertainty_ns(before_ns);
    assert!(stamps.len() == 1 && (before_ns - off..=after_ns + off).contains(&stamps[0]), "{stamps:?}");
    assert!(other.looked_ns() >= stamps[0], "no arrival is later than the look that handed it over");
}

#[test]
fn what_a_slow_receiver_loses_is_counted() {
    const FLOOD: u64 = 3_000;
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    for number in 0..FLOOD {
        one.send(&frame((number & 0x3FF) as u32, &number.to_le_bytes())).expect("a virtual bus has room");
    }
    // The drop count comes with the next frame that finds room: make room, then send it.
    other.receive(|_| ()).expect("up");
    one.send(&frame(0x7FF, &[])).expect("there is room");
    let is_last = |arrival: &Arrival| matches!(arrival, Arrival::Frame { frame, .. } if frame.id() == Id::Standard(0x7FF));
    receive(&mut other, |arrivals| arrivals.last().is_some_and(is_last));
    let counts = other.counts();
    assert!(counts.dropped > 0, "the default buffer cannot hold {FLOOD} frames: {counts:?}");
    assert_eq!(counts.received + counts.dropped, FLOOD + 1, "{counts:?}");
}

#[test]
fn an_interface_that_goes_down_and_up_is_said_and_used_again() {
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    bus.down();
    assert_eq!(one.send(&frame(1, &[])), Err(BusFault::Down));
    assert_eq!(other.receive(|_| ()), Err(BusFault::Down));
    assert_eq!(other.receive(|_| ()), Ok(0), "said once");
    assert!(!InterfaceStatus::read(&bus.name).expect("there").is_up);
    assert!(matches!(Port::open(&bus.name, false), Err(CanError::Interface { .. })));
    bus.up();
    one.send(&frame(2, &[])).expect("up again");
    let arrived = receive(&mut other, |arrivals| !arrivals.is_empty());
    assert!(matches!(arrived.first(), Some(Arrival::Frame { frame, .. }) if frame.id() == Id::Standard(2)));
    assert_eq!(one.counts().down, 1);
}

#[test]
fn an_interface_that_is_not_there_or_goes_away_is_said_by_name() {
    let Err(error) = Port::open("nope0", false) else { panic!("there is no such interface") };
    assert!(error.to_string().contains("`nope0`: there is none of that name"), "{error}");
    let bus = Bus::new();
    let mut port = bus.port();
    let name = bus.name.clone();
    drop(bus);
    assert_eq!(port.send(&frame(1, &[])), Err(BusFault::Gone), "{name}");
    assert!(InterfaceStatus::read(&name).is_err());
    assert_eq!(InterfaceStatus::find(&name).expect("a kernel with CAN"), None);
}

/// The program's own words for it.
#[test]
fn a_bridge_on_an_interface_that_is_not_there_says_so_and_ends_with_2() {
    let bench = TestBench::new("nope", |config| config.bus.interface = "nope0".to_owned());
    let ended = bench.run(&["bridge"]);
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{said}");
    assert!(said.contains("`nope0`: there is none of that name"), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn error_frames_are_decoded_and_the_interface_is_asked() {
    let bus = Bus::new();
    let mut port = bus.port();
    let other = CanSocket::open(&bus.name).expect("the bus is up");
    other.set_error_filter_drop_all().expect("an option every kernel has");
    // CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_CNT, transmitter passive: a virtual bus carries what it is given.
    let sent = CanErrorFrame::new_error(0x244, &[0, 0x20, 0, 0, 0, 0, 255, 3]).expect("eight bytes");
    other.write_frame(&sent).expect("there is room");
    let arrived = receive(&mut port, |arrivals| !arrivals.is_empty());
    let Some(Arrival::Error { error, .. }) = arrived.first() else { panic!("{arrived:?}") };
    assert!(error.is_bus_off() && error.is_passive());
    assert_eq!((error.counters(), port.counts().errors), (Some((255, 3)), 1));

    port.ask();
    let answer = eventually(|| port.answer());
    assert!(answer.is_as_opened, "{answer:?}");
    assert!(answer.status.is_up && answer.status.fd && answer.status.state.is_none(), "{answer:?}");
}

/// Waits for what another thread will do; the limit only ends a test that hangs.
fn eventually<T>(mut ready: impl FnMut() -> Option<T>) -> T {
    let mut patience = Patience::seconds(10);
    loop {
        if let Some(value) = ready() {
            return value;
        }
        assert!(patience.lasts(), "it never happened");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

fn make(name: &str, mtu: &str) {
    ip(&["link", "add", "dev", name, "type", "vcan"]);
    ip(&["link", "set", name, "mtu", mtu, "up"]);
}

/// An adapter is unplugged while frames of it wait to be read, and is plugged in again: they are no younger for it.
#[test]
fn frames_from_before_an_interface_went_keep_their_time() {
    let bus = Bus::new();
    let (mut one, mut other) = (bus.port(), bus.port());
    // It has looked once, as a port in use has: from here on the queue is not empty.
    other.receive(|_| ()).expect("up");
    one.send(&frame(7, &[])).expect("there is room");
    ip(&["link", "delete", &bus.name]);
    let gone_ns = monotonic_ns();
    assert_eq!(other.receive(|_| ()), Err(BusFault::Gone));
    make(&bus.name, "72");
    // It is there before the port looks again: the same look joins it and reads what still waits.
    eventually(|| other.answer().filter(|answer| answer.status.is_up));
    let mut arrivals = Vec::new();
    other.receive(|arrival| arrivals.push(arrival)).expect("joined");
    assert_eq!(other.counts().rejoined, 1);
    let Some(Arrival::Frame { stamp_ns, .. }) = arrivals.first() else { panic!("{arrivals:?}") };
    let off = other.stamp_uncertainty_ns(*stamp_ns);
    assert!(
        *stamp_ns < gone_ns + off,
        "stamped {} ns after it was gone, give or take {off} ns",
        stamp_ns - gone_ns
    );
}

/// What comes back under the old name and carries less is said, and not used until it is what it was.
#[test]
fn an_interface_that_comes_back_as_another_is_not_joined() {
    let bus = Bus::new();
    let mut port = bus.port();
    ip(&["link", "delete", &bus.name]);
    assert_eq!(port.send(&frame(1, &[])), Err(BusFault::Gone));
    // Without FD, which this port was opened for.
    make(&bus.name, "16");
    let answer = eventually(|| {
        let _ = port.receive(|_| ());
        port.answer().filter(|answer| answer.status.is_up)
    });
    assert!(!answer.is_as_opened && !answer.status.fd, "{answer:?}");
    for _ in 0..100 {
        let _ = port.receive(|_| ());
        assert_eq!(port.send(&frame(1, &[])), Err(BusFault::Gone));
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert_eq!(port.counts().rejoined, 0);
    bus.down();
    ip(&["link", "set", &bus.name, "mtu", "72", "up"]);
    eventually(|| {
        let _ = port.receive(|_| ());
        port.send(&frame(1, &[])).ok()
    });
    assert_eq!(port.counts().rejoined, 1);
}

/// Whether `vcan` says what it has carried, as real adapters do. Without, the kernel's core does, for every frame that
/// found room, carried or not.
fn vcan_echoes() -> bool {
    std::fs::read_to_string("/sys/module/vcan/parameters/echo").is_ok_and(|it| it.trim() == "Y")
}

/// A bus that carries nothing until it is released: a plugged queue, as a dead bus with its transmit queue.
#[test]
fn a_dead_bus_holds_a_handful_of_old_frames_at_most_and_shows_by_its_echo() {
    const SENT: u64 = 100;
    const SECOND_NS: u64 = 1_000_000_000;
    let bus = Bus::new();
    let mut port = bus.port();
    run("tc", &["qdisc", "add", "dev", &bus.name, "root", "plug"]);
    let before_ns = monotonic_ns();
    let outcomes: Vec<_> = (0..SENT).map(|number| port.send(&frame(1, &number.to_le_bytes()))).collect();
    let after_ns = monotonic_ns();
    let accepted = outcomes.iter().filter(|outcome| outcome.is_ok()).count() as u64;
    // The kernel's least send buffer, 4,608 bytes, holds six to eight frames with their book-keeping.
    assert!((1..=10).contains(&accepted), "{accepted} frames wait to be sent");
    assert!(
        outcomes.iter().skip(accepted as usize).all(|outcome| *outcome == Err(BusFault::Full)),
        "{outcomes:?}"
    );
    assert_eq!((port.counts().sent, port.counts().full), (accepted, SENT - accepted));
    // It has waited for its echo since the first attempt, whatever became of the others.
    let age_ns = port.echo_age_ns(after_ns);
    assert!((1..=after_ns - before_ns).contains(&age_ns), "{age_ns} ns in {}", after_ns - before_ns);
    assert_eq!(port.echo_age_ns(after_ns + SECOND_NS), age_ns + SECOND_NS);
    let taken = port.receive(|_| ()).expect("up") as u64;
    assert_eq!(taken, if vcan_echoes() { 0 } else { accepted }, "echoes of a bus that carries nothing");

    run("tc", &["qdisc", "change", "dev", &bus.name, "root", "plug", "release_indefinite"]);
    receive(&mut port, |arrivals| arrivals.len() as u64 + taken == accepted);
    assert_eq!((port.counts().echoed, port.counts().received), (accepted, 0));
    assert_eq!(port.echo_age_ns(monotonic_ns() + SECOND_NS), 0, "everything was seen on the bus");
}

/// What the port sends wakes nobody and is heard when it is listened for; another sender of the same identifiers is not mistaken
/// for it, and is among the arrivals at once.
#[test]
fn an_echo_apart_is_heard_and_another_sender_is_not() {
    let bus = Bus::new();
    let (mut port, mut other) = (commander(&bus), bus.port());
    let fd = FrameKind::Fd { bit_rate_switch: true, error_state: false };
    let long = Frame::new(Id::Standard(0x10), fd, &[0xA5; 64]).expect("fits");
    let own = [frame(0x10, &[1]), frame(0x1234_5678, &[2]), long];
    let before_ns = monotonic_ns();
    own.iter().for_each(|it| port.send(it).expect("there is room"));
    let after_ns = monotonic_ns();
    assert_eq!(receive(&mut other, |arrivals| arrivals.len() == own.len()).len(), own.len());
    assert_eq!(port.receive(|arrival| panic!("{arrival:?}")), Ok(0));
    assert_eq!(port.counts().echoed, 0, "nobody listened");
    assert!((1..=after_ns - before_ns).contains(&port.echo_age_ns(after_ns)));
    port.listen();
    assert_eq!((port.counts().echoed, port.echo_age_ns(monotonic_ns())), (3, 0));

    let foreign = [frame(0x10, &[1]), frame(0x123, &[]), Frame::remote(Id::Standard(0x10), 0).expect("fits")];
    for round in 0..20_u64 {
        port.send(&own[0]).expect("there is room");
        foreign.iter().for_each(|it| other.send(it).expect("there is room"));
        // A slow kernel delivers behind the call that sends.
        let arrived = receive(&mut port, |arrivals| arrivals.len() == foreign.len());
        assert_eq!(arrived.len(), foreign.len(), "{arrived:?}");
        assert_eq!(port.receive(|arrival| panic!("{arrival:?}")), Ok(0), "and nothing else");
        for (arrival, sent) in arrived.iter().zip(&foreign) {
            assert!(matches!(arrival, Arrival::Frame { frame, .. } if frame == sent), "{arrival:?}");
        }
        if round % 4 == 3 {
            port.listen();
            assert_eq!(port.counts().echoed, 3 + round + 1);
        }
    }
    assert_eq!((port.counts().sent, port.counts().echoes_dropped), (23, 0));
}

/// A port that commands with two identifiers, one of each kind.
fn commander(bus: &Bus) -> Port {
    let ids = [Id::Standard(0x10), Id::Extended(0x1234_5678)];
    Port::open_with_echo_apart(&bus.name, true, &ids).expect("the bus is up")
}

#[test]
fn an_echo_apart_shows_a_dead_bus_and_is_heard_after_the_interface_was_made_again() {
    let bus = Bus::new();
    let mut port = commander(&bus);
    port.send(&frame(0x10, &[])).expect("there is room");
    run("tc", &["qdisc", "add", "dev", &bus.name, "root", "plug"]);
    let before_ns = monotonic_ns();
    port.send(&frame(0x10, &[])).expect("there is room");
    let after_ns = monotonic_ns();
    port.listen();
    if vcan_echoes() {
        // The first was heard: it is the second that waits, since it was sent.
        let age_ns = port.echo_age_ns(after_ns);
        assert!(age_ns <= after_ns - before_ns, "{age_ns} ns in {}", after_ns - before_ns);
        assert_eq!((port.counts().echoed, port.echo_age_ns(after_ns + 1_000) - age_ns), (1, 1_000));
    }
    run("tc", &["qdisc", "change", "dev", &bus.name, "root", "plug", "release_indefinite"]);
    eventually(|| {
        port.listen();
        (port.counts().echoed == 2).then_some(())
    });
    assert_eq!(port.echo_age_ns(monotonic_ns()), 0);

    ip(&["link", "delete", &bus.name]);
    assert_eq!(port.send(&frame(0x10, &[])), Err(BusFault::Gone));
    make(&bus.name, "72");
    eventually(|| {
        let _ = port.receive(|_| ());
        port.send(&frame(0x10, &[])).ok()
    });
    bus.port().send(&frame(0x20, &[])).expect("there is room");
    port.send(&frame(0x10, &[])).expect("there is room");
    // A bus keeps the order: the other's frame has come by when the second echo is heard.
    eventually(|| {
        port.listen();
        (port.counts().echoed >= 4).then_some(())
    });
    assert_eq!(port.counts().echoed, 4, "its own two frames, and nothing else");
}

#[test]
fn commands_cross_from_the_bridges_roles_to_the_emulators() {
    let bus = Bus::new();
    let (mut bridge, mut bench) = (bus.port(), bus.port());
    let roles = Roles::build(&BusConfig::default(), 0.02).expect("sound");
    let (mut sender, mut receiver) = (roles.command_sender(), roles.command_receiver());
    let applied = Applied { rotor: [0.25, 0.75], state: 3, ..Applied::default() };
    for frame in roles.encode_commands(&mut sender, &applied).iter() {
        bridge.send(frame).expect("there is room");
    }
    let mut commands = RotorCommands::default();
    for arrival in receive(&mut bench, |arrivals| !arrivals.is_empty()) {
        let Arrival::Frame { frame, stamp_ns, .. } = arrival else { panic!("{arrival:?}") };
        roles.decode_commands(&mut receiver, &frame, stamp_ns, &mut commands);
    }
    assert_eq!((commands.state, receiver.counts.accepted), (3, 1));
    for (got, sent) in commands.rotor.iter().zip(applied.rotor) {
        // Both are on the grid of 0.00002; what is left is the rounding of f64.
        assert!((got - sent).abs() < 1e-12, "{commands:?}");
    }
}
