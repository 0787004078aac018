//! One run in lockstep over a bus in memory: emulated ESCs and IMU, bridge with guard, controller, and one fault.
//! Frames, codec, counters, the bridge's wire and guard and the controller are the program's own.

use rotorbench::bench::BenchConfig;
use rotorbench::can::{BridgeEnd, Frame, Protocol, ReceiverState, Roles, RotorCommands, SenderState};
use rotorbench::emulate::{Emulator, EmulatorConfig, EmulatorState, Impulse, RotorFault, RotorFaultKind};
use rotorbench::guard::{Cause, Guard, GuardState, OperatorAct, State};
use rotorbench::model::Model;
use rotorbench::recording::{RecordSender, Recorder};
use rotorbench::rt::LogQueue;
use rotorbench::runtime::bus_io::BusIo;
use rotorbench::runtime::command_source::{CommandSource, CommandSourceState};
use rotorbench::runtime::controller_plant;
use rotorbench::runtime::lockstep::ORIGIN_NS;
use rotorbench::signal::{Applied, Command, ControlStep, GuardEvent, GuardStep, Request, Sensors};

use crate::bus::MemoryBus;
use crate::fault::{Kind, Row, Who};
use crate::injector::Injector;
use crate::nodes::{self, Nodes};
use crate::outcome::{Outcome, Track};

/// [s] of a run; the fault comes in its second second.
pub const FLIGHT_S: f64 = 3.5;
/// Periods without news of the guard after which a controller takes it as closed, as the control process does.
const SILENT_PERIODS: u64 = 10;

/// The built-in bench as `identify` found it: the head of the file has the commands.
const IDENTIFIED: &str = include_str!("../guard/identified.toml");

/// What a run is made of.
pub struct Parts {
    pub emulator: Emulator,
    pub roles: Roles,
    pub guard: Guard,
    pub source: CommandSource,
    pub period_ns: u64,
    pub hold: u64,
    pub maximum: f64,
    /// Of a bench on DroneCAN, whose roles are then not used.
    spoken: Option<Box<dyn Protocol>>,
    flight_s: f64,
    of_emulator: EmulatorConfig,
}

impl Parts {
    /// The built-in bench at `rate_hz`, with ESCs whose own timeout is the guard's hold, and somebody who strikes it.
    pub fn new(kind: Kind, rate_hz: u32, seed: u64) -> Self {
        let mut config = BenchConfig { period_s: 1.0 / f64::from(rate_hz), ..BenchConfig::default() };
        config.emulator.seed = seed;
        config.emulator.esc_timeout_s = Some(config.guard.hold_s);
        config.emulator.impulse = vec![Impulse { at_s: 1.0, duration_s: 0.05, torque: 0.4 }];
        config.guard.speed_check.on = kind.has_speed_check();
        let model = Model::parse(IDENTIFIED, "identified.toml".as_ref()).expect("a model");
        let guard = config.guard.build_on(config.period_s, &model).expect("the built-in guard");
        let is_dronecan = matches!(kind, Kind::Dronecan(_));
        Self {
            emulator: config.emulator.build().expect("the built-in plant"),
            roles: Roles::build(&config.bus, config.period_s).expect("the built-in bus"),
            source: controller_plant::command_source(&config).expect("the built-in controller"),
            period_ns: 1_000_000_000 / u64::from(rate_hz),
            hold: u64::from(guard.hold_periods()),
            maximum: guard.limits().maximum,
            spoken: kind.of_node().map(|fault| nodes::spoken(config.period_s, fault)),
            flight_s: if is_dronecan { nodes::FLIGHT_S } else { FLIGHT_S },
            guard,
            of_emulator: config.emulator,
        }
    }

    /// Breaks something of the second rotor at the beginning of slot `from`.
    fn break_rotor(&mut self, kind: RotorFaultKind, from: u64) {
        let at_s = (from * self.period_ns) as f64 * 1e-9;
        let fault = RotorFault { rotor: 2, at_s, kind, lost: 0.3, command: 0.2 };
        let broken = EmulatorConfig { fault: vec![fault], ..self.of_emulator.clone() };
        self.emulator = broken.build().expect("a plant that breaks");
    }

    pub fn slots(&self) -> u64 {
        (self.flight_s * 1e9) as u64 / self.period_ns
    }

    fn bridge_end(&self) -> Box<dyn BridgeEnd> {
        self.spoken.as_ref().map_or_else(|| self.roles.clone().into(), |spoken| spoken.bridge_end())
    }
}

/// The bridge's process.
struct Bridge {
    bus_io: BusIo<MemoryBus>,
    guard: GuardState,
    applied: Applied,
    tripped: Option<(u64, u32)>,
}

impl Bridge {
    fn new(parts: &Parts, bus: &MemoryBus) -> Self {
        Self {
            bus_io: BusIo::on(bus.clone(), parts.bridge_end(), LogQueue::new(16)),
            guard: GuardState::new(),
            applied: Applied::default(),
            tripped: None,
        }
    }
}

/// Everything that changes.
struct World<'a> {
    parts: &'a Parts,
    bus: MemoryBus,
    bench: EmulatorState,
    sender: SenderState,
    receiver: ReceiverState,
    commands: RotorCommands,
    nodes: Option<Nodes<'a>>,
    /// Frames on their way to the ESCs, with the slot in which they arrive.
    under_way: Vec<(u64, Frame)>,
    bridge: Bridge,
    /// What shared memory holds.
    sensors: Sensors,
    passed: Applied,
    newest: Option<Command>,
    source: CommandSourceState,
    recorder: RecordSender,
}

/// Flies `row`, drawn from `seed`, at `rate_hz`.
pub fn run_row(row: &Row, rate_hz: u32, seed: u64) -> Outcome {
    let recorder = (row.kind == Kind::RecorderStuck).then(crate::disk::full);
    fly_recorded(row, rate_hz, seed, recorder)
}

fn fly_recorded(row: &Row, rate_hz: u32, seed: u64, recorder: Option<Recorder>) -> Outcome {
    let mut parts = Parts::new(row.kind, rate_hz, seed);
    let mut injector = Injector::new(row, &parts, seed);
    if let Kind::Rotor(Some(kind)) = row.kind {
        parts.break_rotor(kind, injector.from);
    }
    let mut track = Track::new(row, &parts, injector.from);
    let bus = MemoryBus::new();
    let mut world = World {
        bench: parts.emulator.start(ORIGIN_NS),
        sender: parts.roles.sensor_sender(),
        receiver: parts.roles.command_receiver(),
        commands: RotorCommands::default(),
        nodes: parts
            .spoken
            .as_deref()
            .zip(row.kind.of_node())
            .map(|(spoken, fault)| Nodes::new(spoken, fault, injector.from, parts.period_ns, ORIGIN_NS)),
        under_way: Vec::new(),
        bridge: Bridge::new(&parts, &bus),
        sensors: Sensors::default(),
        passed: Applied::default(),
        newest: None,
        source: parts.source.start(),
        recorder: recorder.as_ref().map_or_else(RecordSender::off, Recorder::sender),
        parts: &parts,
        bus,
    };
    for slot in 0..parts.slots() {
        world.slot(slot, &mut injector, &mut track);
    }
    if let Some(recorder) = recorder {
        track.recorder_refused = world.recorder.dropped();
        // It says that the disk is full: that is the row.
        let _ = recorder.finish();
    }
    track.outcome(&world.bridge.bus_io.summary().decoded)
}

impl World<'_> {
    fn slot(&mut self, slot: u64, injector: &mut Injector, track: &mut Track) {
        let now_ns = ORIGIN_NS + slot * self.parts.period_ns;
        self.bus.advance(now_ns);
        injector.begin(slot, &self.bus);
        if injector.dies(Who::Bridge, slot) || injector.restarts(Who::Bridge, slot) {
            self.bridge = Bridge::new(self.parts, &self.bus);
            // What its end would still say is not said by a process that was killed, and its socket is gone.
            self.bus.forget();
        }
        if injector.restarts(Who::Control, slot) {
            self.source = self.parts.source.start();
        }
        let is_powered = injector.is_awake(Who::Bench, slot);
        if is_powered {
            self.measure(slot, now_ns, injector);
        }
        let bridge_runs = injector.is_awake(Who::Bridge, slot);
        if bridge_runs {
            self.receive(now_ns);
        }
        if injector.is_awake(Who::Control, slot) && self.sensors.sequence > 0 {
            self.control(slot, now_ns, injector);
        }
        if bridge_runs {
            self.guard(slot, now_ns, track);
        }
        self.obey(slot, is_powered, injector);
        let applied = injector.is_alive(Who::Bridge, slot).then_some(self.bridge.applied);
        let truth = self.parts.emulator.truth(&self.bench);
        track.see(slot, applied, self.bench.rotor_commands(), &truth);
        self.parts.emulator.advance(&mut self.bench, (slot + 1) * self.parts.period_ns);
    }

    /// ESCs and IMU send what they measured.
    fn measure(&mut self, slot: u64, now_ns: u64, injector: &mut Injector) {
        let seen = injector.seen(slot, *self.bench.sensors());
        if let Some(nodes) = &mut self.nodes {
            for frame in nodes.measure(slot, now_ns, &seen) {
                self.bus.carry(now_ns, frame);
            }
            return;
        }
        let messages = self.parts.roles.sensor_messages();
        for (index, message) in messages.iter().enumerate() {
            let Some(frame) = self.parts.roles.encode_sensors(&mut self.sender, index, &seen) else {
                continue;
            };
            for (late, frame) in injector.sensor_frame(slot, index, &message.name, frame) {
                self.bus.carry(now_ns + late * self.parts.period_ns, frame);
            }
        }
        for frame in injector.foreign_sensors(slot, &self.parts.roles, &seen) {
            self.bus.carry(now_ns, frame);
        }
    }

    /// The first half of the bridge's turn.
    fn receive(&mut self, now_ns: u64) {
        let Parts { guard, hold, period_ns, .. } = self.parts;
        let Bridge { bus_io, guard: state, tripped, .. } = &mut self.bridge;
        let look = bus_io.receive(true, now_ns);
        if look.updated {
            self.sensors = *bus_io.sensors();
        }
        if let Some(cause) =
            bus_io.trouble(&look, now_ns, *hold as u32, *period_ns).filter(|_| tripped.is_none())
        {
            guard.trip(state, now_ns, cause);
            *tripped = Some((now_ns, cause as u32));
        }
    }

    fn control(&mut self, slot: u64, now_ns: u64, injector: &mut Injector) {
        let silent_ns = SILENT_PERIODS * self.parts.period_ns;
        if now_ns.saturating_sub(self.passed.stamp_ns) > silent_ns {
            self.passed = Applied::default();
        }
        let (sensors, applied) = (self.sensors, self.passed);
        let mut command = self.parts.source.step(&mut self.source, &sensors, &applied);
        command.stamp_ns = now_ns;
        self.recorder.send(ControlStep { sensors, applied, command });
        self.newest = Some(injector.command(slot, command));
    }

    /// The second half of the bridge's turn.
    fn guard(&mut self, slot: u64, now_ns: u64, track: &mut Track) {
        let request = (slot == 0).then_some(Request {
            sequence: 1,
            stamp_ns: now_ns,
            act: OperatorAct::Arm as u32,
            reserved: 0,
        });
        let Bridge { bus_io, guard: state, applied, tripped } = &mut self.bridge;
        let sensors = *bus_io.sensors();
        let newest = self.newest.as_ref();
        *applied = self.parts.guard.step(state, now_ns, &sensors, newest, request.as_ref());
        let step = GuardStep::new(now_ns, &sensors, newest, request.as_ref(), applied);
        self.recorder.send(step.tripped(tripped.take()));
        for event in state.take_events() {
            self.recorder.send(event);
            track.event(slot, &event);
        }
        bus_io.send(applied);
        self.passed = *applied;
    }

    /// The ESCs do what they are commanded, by whomever.
    fn obey(&mut self, slot: u64, is_powered: bool, injector: &mut Injector) {
        let foreign = injector.foreign_commands(slot, &self.parts.roles);
        let (before, after) = foreign.split_at(foreign.len() / 2);
        let ours = self.bus.take_sent();
        self.under_way.extend(before.iter().map(|frame| (slot, *frame)));
        for frame in ours {
            for (late, frame) in injector.command_frame(slot, frame) {
                self.under_way.push((slot + late, frame));
            }
        }
        self.under_way.extend(after.iter().map(|frame| (slot, *frame)));
        for frame in foreign {
            self.bus.carry(self.parts.period_ns * slot + ORIGIN_NS, frame);
        }
        let (due, later): (Vec<_>, Vec<_>) =
            std::mem::take(&mut self.under_way).into_iter().partition(|(at, _)| *at <= slot);
        self.under_way = later;
        if !is_powered {
            self.parts.emulator.command(&mut self.bench, [0.0; 2]);
            return;
        }
        let Self { parts, receiver, commands, bench, nodes, .. } = self;
        let stamp_ns = ORIGIN_NS + bench.now_ns();
        let said = nodes.as_ref().and_then(|nodes| nodes.said_to_escs(slot));
        for frame in due.into_iter().map(|(_, frame)| frame).chain(said) {
            let updated = match nodes {
                Some(nodes) => nodes.obey(slot, stamp_ns, &frame, commands),
                None => parts.roles.decode_commands(receiver, &frame, stamp_ns, commands).updated,
            };
            for rotor in (0..2).filter(|rotor| updated & (1 << rotor) != 0) {
                parts.emulator.command_rotor(bench, rotor, commands.rotor[rotor]);
            }
        }
        if nodes.as_ref().is_some_and(|nodes| !nodes.may_turn(stamp_ns)) {
            parts.emulator.command(bench, [0.0; 2]);
        }
    }
}

/// The state with this code, and the cause in words.
pub fn cause_of(event: &GuardEvent) -> (State, State, Cause) {
    let state = |code| State::from_code(code).unwrap_or_default();
    (state(event.from), state(event.to), Cause::from_code(event.cause).unwrap_or_default())
}
