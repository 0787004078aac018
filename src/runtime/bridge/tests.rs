//! A bridge on a bus in the test's hands.

use crate::can::{Arrival, BusFault, Frame, PortCounts, Roles};
use crate::guard::OperatorAct;
use crate::runtime::bridge::*;
use crate::shm::{BenchPlace, COMMAND, Publisher, REQUEST, SENSORS};
use crate::signal::{Command, Health, Request, Sample, Sensors};

/// [ns] of the built-in bench.
const PERIOD_NS: u64 = 20_000_000;

/// A bus in the test's hands, on which looking can take time: the machine is busy, or there is much to decode.
#[derive(Debug, Default)]
struct HandBus {
    now_ns: u64,
    looked_ns: u64,
    takes_ns: u64,
    frames: Vec<Frame>,
    /// Looks at it, and how many of them came before the last command went out.
    looks: u32,
    looks_before: u32,
    /// [ns] since when no echo was heard, as far as somebody listened; and whether there is none.
    echo_age_ns: u64,
    is_dead: bool,
    /// Said while a command goes out.
    aside: Option<(Publisher<Request>, Request)>,
}

impl Bus for HandBus {
    fn receive(&mut self, mut take: impl FnMut(Arrival)) -> Result<usize, BusFault> {
        self.looks += 1;
        self.looked_ns = self.now_ns;
        self.now_ns += self.takes_ns;
        for frame in self.frames.drain(..) {
            take(Arrival::Frame { frame, stamp_ns: self.looked_ns, hardware_ns: None });
        }
        Ok(0)
    }

    fn send(&mut self, _: &Frame) -> Result<(), BusFault> {
        self.looks_before = self.looks;
        if let Some((operator, request)) = &mut self.aside {
            operator.send(request);
        }
        Ok(())
    }

    fn listen(&mut self) {
        if !self.is_dead {
            self.echo_age_ns = 0;
        }
    }

    fn echo_age_ns(&self, _: u64) -> u64 {
        self.echo_age_ns
    }

    fn counts(&self) -> PortCounts {
        PortCounts::default()
    }

    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn looked_ns(&self) -> u64 {
        self.looked_ns
    }
}

/// A bridge on such a bus, on a bench that is removed at the end.
struct Rig {
    bridge: Option<BridgeLoop<HandBus>>,
    roles: Roles,
    config: BenchConfig,
}

impl Rig {
    fn new(test: &str) -> Self {
        let name = format!("t{}-{test}", std::process::id());
        let config = BenchConfig { name, ..BenchConfig::default() };
        let bench =
            BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Bridge).expect("joined");
        let guard = config.guard.build(config.period_s).expect("valid");
        let guard = BusGuard::open(&bench, guard, PERIOD_NS).expect("the only guard");
        let roles = Roles::build(&config.bus, config.period_s).expect("valid");
        let bus = HandBus { now_ns: clock::monotonic_ns() + PERIOD_NS, ..HandBus::default() };
        let bus_io = BusIo::on(bus, roles.clone(), LogQueue::new(16));
        let bridge = BridgeLoop { guard, bus_io, hold_periods: 5, wakes_control: false, _bench: bench };
        Self { bridge: Some(bridge), roles, config }
    }

    fn bridge(&mut self) -> &mut BridgeLoop<HandBus> {
        self.bridge.as_mut().expect("until the end")
    }

    /// The commands of a controller that the bridge has met: the first of them is examined.
    fn controller(&mut self) -> Publisher<Command> {
        let mut commands = self.member(ProcessRole::Control).publish(&COMMAND).expect("the only controller");
        let stamp_ns = self.bridge().bus_io.now_ns();
        // Another thread of the bridge has to meet it.
        while self.bridge().guard.examined().0 != stamp_ns {
            commands.send(&Command { sequence: 1, stamp_ns, ..Command::default() });
            self.bridge().bus_io.port_mut().now_ns += PERIOD_NS;
            self.bridge().act(0, stamp_ns);
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        commands
    }

    fn member(&self, role: ProcessRole) -> BenchMember {
        BenchMember::join(&self.config.name, &self.config.shared_memory, role).expect("joined")
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        self.bridge = None;
        if let Ok(place) = BenchPlace::open(&self.config.name, &self.config.shared_memory) {
            let _ = place.remove();
        }
    }
}

/// A command that was made while the bridge was busy with the bus is younger than the bridge's look at it. It is not
/// from the future.
#[test]
fn a_command_made_while_the_bridge_decoded_is_examined_by_a_later_clock() {
    let mut rig = Rig::new("slow");
    let mut commands = rig.controller();
    let bus = rig.bridge().bus_io.port_mut();
    bus.takes_ns = 3 * PERIOD_NS;
    // Two periods after the look: more than the one of grace.
    let stamp_ns = bus.now_ns + 2 * PERIOD_NS;
    commands.send(&Command { sequence: 2, stamp_ns, ..Command::default() });
    rig.bridge().act(0, 0);
    assert_eq!(rig.bridge().guard.examined(), (stamp_ns, 0));
}

/// The same where the bridge was woken by the bell alone, and kept from its processor before it could look who rang.
#[test]
fn a_command_made_while_the_bridge_was_held_up_after_its_wait_is_examined_by_a_later_clock() {
    let mut rig = Rig::new("held");
    let mut commands = rig.controller();
    let bus = rig.bridge().bus_io.port_mut();
    let woken_ns = bus.now_ns;
    bus.now_ns += 3 * PERIOD_NS;
    let stamp_ns = woken_ns + 2 * PERIOD_NS;
    commands.send(&Command { sequence: 2, stamp_ns, ..Command::default() });
    rig.bridge().act(BELL, woken_ns);
    assert_eq!(rig.bridge().guard.examined(), (stamp_ns, 0));
    // Who stamps his commands with a time to come is found out all the same.
    let bus = rig.bridge().bus_io.port_mut();
    let woken_ns = bus.now_ns;
    bus.now_ns += PERIOD_NS / 2;
    let stamp_ns = woken_ns + 2 * PERIOD_NS;
    commands.send(&Command { sequence: 3, stamp_ns, ..Command::default() });
    rig.bridge().act(BELL, woken_ns);
    assert_eq!(rig.bridge().guard.examined(), (stamp_ns, 1));
}

/// Nobody listens for the echoes while the process stands still. That is no fault of the bus.
#[test]
fn a_bus_is_listened_to_before_it_is_called_dead() {
    for is_dead in [false, true] {
        let mut rig = Rig::new("echo");
        let now_ns = rig.bridge().bus_io.now_ns();
        rig.bridge().act(0, now_ns);
        let bus = rig.bridge().bus_io.port_mut();
        bus.now_ns += PERIOD_NS;
        (bus.echo_age_ns, bus.is_dead) = (50 * PERIOD_NS, is_dead);
        rig.bridge().act(0, now_ns + PERIOD_NS);
        let (state, cause) = (rig.bridge().guard.applied().state, rig.bridge().guard.applied().cause);
        let latched = (State::FailsafeLatched as u32, Cause::BusDead as u32);
        assert_eq!((state, cause) == latched, is_dead, "state {state}, cause {cause}");
    }
}

/// The bell is quieted when the command is out. What rang it since the bridge looked last must not be forgotten with it:
/// nobody would wake the bridge for an emergency stop before the next slot.
#[test]
fn a_stop_that_comes_while_a_command_goes_out_is_obeyed_at_once() {
    let mut rig = Rig::new("aside");
    let mut operator = rig.member(ProcessRole::Operator).publish(&REQUEST).expect("the only operator");
    let ask = |sequence, act, stamp_ns| Request { sequence, stamp_ns, act: act as u32, reserved: 0 };
    // Until the bridge hears the operator, whom another thread of it has to meet.
    let mut now_ns = rig.bridge().bus_io.now_ns();
    while rig.bridge().guard.refusals(Cause::RequestRefused) == 0 {
        now_ns += PERIOD_NS;
        rig.bridge().bus_io.port_mut().now_ns = now_ns;
        operator.send(&ask(1, OperatorAct::Disarm, now_ns));
        rig.bridge().act(0, now_ns);
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    // What was asked while the two met is answered one by one.
    let mut answered = 0;
    while rig.bridge().guard.refusals(Cause::RequestRefused) != answered {
        answered = rig.bridge().guard.refusals(Cause::RequestRefused);
        now_ns += PERIOD_NS;
        rig.bridge().bus_io.port_mut().now_ns = now_ns;
        rig.bridge().act(0, now_ns);
    }
    rig.bridge().bus_io.port_mut().aside = Some((operator, ask(2, OperatorAct::Stop, now_ns)));
    let looks = rig.bridge().bus_io.port_mut().looks;
    rig.bridge().act(BELL, now_ns + PERIOD_NS);
    let looks_before = rig.bridge().bus_io.port_mut().looks_before;
    assert_eq!(looks_before, looks, "the bell alone is nothing on the bus");
    assert_eq!(rig.bridge().guard.applied().state, State::Disarmed as u32, "it came after the step");
    assert_eq!(rig.bridge().guard.deadline_ns(), 0, "and is not waited with");
    rig.bridge().act(0, now_ns + PERIOD_NS);
    assert_eq!(rig.bridge().guard.applied().state, State::EmergencyStop as u32);
}

/// When everything falls silent no frame is there to publish anything. What time does to the values is news all the same,
/// once for each flag.
#[test]
fn sensors_that_all_fall_silent_are_published_as_stale() {
    let mut rig = Rig::new("silent");
    let mut sensors = rig.member(ProcessRole::Monitor).subscribe(&SENSORS).expect("subscribed");
    let good = |value| Sample::good(value, 1, 1);
    let measured = Sensors {
        body_rate: good(0.1),
        battery_voltage: good(12.0),
        propeller_rate: [good(600.0); 2],
        ..Sensors::default()
    };
    let (roles, mut sender) = (rig.roles.clone(), rig.roles.sensor_sender());
    let count = roles.sensor_messages().len();
    let frames = (0..count).filter_map(|index| roles.encode_sensors(&mut sender, index, &measured)).collect();
    rig.bridge().bus_io.port_mut().frames = frames;
    let mut published = Vec::new();
    // Two seconds, a millisecond a turn, with frames in the first alone.
    for _ in 0..2_000 {
        rig.bridge().act(0, 0);
        published.extend(std::iter::from_fn(|| sensors.next_in_order()));
        rig.bridge().bus_io.port_mut().now_ns += 1_000_000;
    }
    let stale = |sensors: &Sensors| {
        let samples = [sensors.body_rate, sensors.propeller_rate[0], sensors.battery_voltage];
        samples.map(|sample| sample.health == Health::STALE)
    };
    let seen: Vec<(u64, [bool; 3])> = published.iter().map(|it| (it.sequence, stale(it))).collect();
    // The hold is 0.1 s, and the battery may be silent for 1 s.
    assert_eq!(seen, [(1, [false; 3]), (2, [true, true, false]), (3, [true; 3])]);
    let ages_ms = published.iter().map(|it| (it.stamp_ns - it.body_rate.stamp_ns) / 1_000_000);
    assert_eq!(ages_ms.collect::<Vec<_>>(), [0, 101, 1_001]);
    assert!(published.iter().all(|it| it.body_rate.value == published[0].body_rate.value));
}

/// Echoes that nobody has listened for yet make no bus late: a healthy one tells no age in whichever period one looks, a
/// dead one tells how long its frames have waited, within the periods between two times of listening.
#[test]
fn a_bus_that_lives_tells_no_age() {
    let mut rig = Rig::new("echo-age");
    let bus_io = &mut rig.bridge().bus_io;
    let mut told_ns = |is_dead: bool| {
        let bus = bus_io.port_mut();
        bus.is_dead = is_dead;
        bus.now_ns += PERIOD_NS;
        bus.echo_age_ns += PERIOD_NS;
        let now_ns = bus.now_ns;
        bus_io.count(now_ns).echo_age_ns
    };
    for period in 0..8 {
        assert_eq!(told_ns(false), 0, "period {period}");
    }
    for period in 1..=20 {
        assert_eq!(told_ns(true), period / 4 * 4 * PERIOD_NS, "period {period}");
    }
}
