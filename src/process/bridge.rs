//! `bridge`: owns the bus and the guard. Frames to sensors, commands through the guard to frames.

use super::ProcessError;
use super::control::{end_after, is_before};
use super::wire::{Look, Wire, WireSummary, is_virtual};
use crate::bench::{BenchConfig, Trigger};
use crate::can::{Bus, Port};
use crate::clock;
use crate::gate::Gate;
use crate::guard::{Cause, State};
use crate::rt::{self, Clerk, Granted, LogQueue, Shutdown, Summary, Wake};
use crate::shm::{Bench, Role};

/// Log lines of the cycle that may wait for the thread that writes them.
const LOG_LINES: usize = 256;
/// What the wait says of the bus, and of the bell.
const SOCKET: u32 = 1;
const BELL: u32 = 2;
/// [s] after which a process that is to end does, whatever the guard says.
const LONGEST_END_S: f64 = 1.0;

/// The bridge process before its thread is made real-time.
#[derive(Debug)]
pub struct BridgeLoop<B: Bus = Port> {
    gate: Gate,
    wire: Wire<B>,
    /// Periods without an own frame on the bus after which the bus is dead.
    hold_periods: u32,
    /// Whether the controller waits for the gyro.
    wakes_control: bool,
    /// What came together with the last command's echo: to be acted on without a wait.
    caught: Option<Look>,
    // Last: everything above lives on it.
    _bench: Bench,
}

/// What the bridge ends with.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BridgeSummary {
    /// The bus.
    pub bus: WireSummary,
    /// State of the guard at the end.
    pub state: String,
    /// Cause of its last transition.
    pub cause: String,
    /// Timing of the cycle.
    pub timing: Summary,
    /// What the system granted.
    pub granted: Granted,
}

impl BridgeLoop {
    /// Opens the bus and takes the bench's guard.
    ///
    /// # Errors
    /// A second bridge on the same bench; a bus, DBC file or role that cannot be.
    pub fn open(config: &BenchConfig, log: LogQueue) -> Result<Self, ProcessError> {
        config.check()?;
        let guard = config.guard.build(config.period_s)?;
        let period_ns = clock::span_ns(config.period_s);
        let hold_periods = guard.hold_periods();
        let bench = Bench::join(&config.name, &config.shared_memory, Role::Bridge)?;
        let gate = Gate::open(&bench, guard, period_ns)?;
        // After the guard: a second bridge that is refused must not say a word on the bus, not even a safe one.
        let wire = Wire::open(config, &bench, log)?;
        let wakes_control = config.trigger == Trigger::Imu;
        Ok(Self { gate, wire, hold_periods, wakes_control, caught: None, _bench: bench })
    }

    /// Waits for the socket, the command or the timer, whichever comes first, and does what is to be done.
    pub fn turn(&mut self) {
        if self.answer_caught() {
            return;
        }
        let doors = [self.wire.descriptor(), self.gate.bell().descriptor()];
        let (woken, woken_ns) = rt::wait_and_tell(doors, self.gate.deadline_ns());
        let ready = if let Wake::Ready(bits) = woken { bits } else { 0 };
        self.act(ready, woken_ns);
    }

    /// The guard on its bench.
    pub fn gate_mut(&mut self) -> &mut Gate {
        &mut self.gate
    }

    fn end(&mut self) {
        let now_ns = clock::monotonic_ns();
        self.gate.trip(now_ns, Cause::Shutdown);
        let latest_ns = now_ns.saturating_add(clock::span_ns(LONGEST_END_S));
        self.turn();
        while !self.gate.is_safe() && clock::monotonic_ns() < latest_ns {
            self.turn();
        }
    }
}

impl<B: Bus> BridgeLoop<B> {
    /// What a turn does after its wait, which ended at `woken_ns` because of what is in `ready`: [`SOCKET`], [`BELL`].
    fn act(&mut self, ready: u32, woken_ns: u64) {
        let look = if ready == BELL && !self.wire.must_look() {
            // Only a command or a request came, and nothing stands between it and the rotors.
            Look { at_ns: woken_ns, ..Look::default() }
        } else {
            self.wire.receive(ready & SOCKET != 0, woken_ns)
        };
        self.answer(&look, ready);
    }

    /// Does what came with the last command's echo asks for; whether anything had come.
    fn answer_caught(&mut self) -> bool {
        let Some(look) = self.caught.take() else { return false };
        self.answer(&look, 0);
        true
    }

    /// What a turn does with what is on the bus and in shared memory.
    fn answer(&mut self, look: &Look, ready: u32) {
        let (sensors, is_news) = self.wire.present(look, &self.gate);
        if is_news {
            self.gate.publish_sensors(&sensors, look.gyro && self.wakes_control);
        }
        // Decoding and publishing took a while, and the machine may have been busy elsewhere: the newest command may be younger
        // than the look at the socket, or than the end of the wait. Judged by the older time it would come from the future.
        let is_old = self.gate.look(look.at_ns) && ready != BELL;
        let now_ns = if is_old { self.wire.now_ns() } else { look.at_ns };
        let now_ns = self.gate.time_to_judge(now_ns, || self.wire.now_ns());
        let period_ns = self.gate.cycle().period_ns();
        if let Some(cause) = self.wire.trouble(look, now_ns, self.hold_periods, period_ns) {
            self.gate.trip(now_ns, cause);
        }
        let step = self.gate.step_if_due(now_ns, self.wire.sensors());
        let out_ns = step.map(|(release, applied)| {
            let out_ns = self.wire.send(&applied);
            self.gate.finish(release, out_ns, self.wire.sensors());
            self.wire.publish(out_ns);
            out_ns
        });
        if ready & BELL != 0 {
            // After the command is out, which it would delay; what came meanwhile may have rung the bell that is quiet now.
            self.gate.bell().quiet();
            self.gate.look(now_ns);
        }
        self.caught = out_ns.and_then(|out_ns| self.wire.catch_echo(out_ns));
    }
}

/// Runs the bridge until `shutdown`, for `seconds` at most; the last frames are the safe command.
///
/// # Errors
/// [`ProcessError`] before the first cycle.
pub fn bridge(
    config: &BenchConfig,
    arm: bool,
    seconds: Option<f64>,
    shutdown: &Shutdown,
) -> Result<BridgeSummary, ProcessError> {
    if arm && !is_virtual(&config.bus.interface) {
        return Err(ProcessError::ArmOnHardware { interface: config.bus.interface.clone() });
    }
    let clerk = Clerk::start(LOG_LINES)?;
    let mut bridge = BridgeLoop::open(config, clerk.queue())?;
    if arm {
        bridge.gate.arm_by_itself();
    }
    let granted = config.real_time.apply()?;
    bridge.gate.start_at(clock::monotonic_ns());
    tracing::info!(bench = config.name, interface = config.bus.interface, "bridge: {granted}");
    let end_ns = end_after(seconds);
    while !shutdown.is_requested() && is_before(end_ns) {
        bridge.turn();
    }
    shutdown.request();
    tracing::info!("bridge ends: {}", shutdown.reason());
    bridge.end();
    let applied = bridge.gate.applied();
    Ok(BridgeSummary {
        bus: bridge.wire.summary(),
        state: State::from_code(applied.state).unwrap_or_default().to_string(),
        cause: Cause::from_code(applied.cause).unwrap_or_default().to_string(),
        timing: bridge.gate.cycle().statistics().summary(),
        granted,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::{Arrival, Fault, Frame, PortCounts, Roles};
    use crate::guard::OperatorAct;
    use crate::shm::{COMMAND, Place, Publisher, REQUEST, SENSORS};
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
        /// What is there when a command has gone out.
        with_echo: Vec<Frame>,
        /// Said while a command goes out.
        aside: Option<(Publisher<Request>, Request)>,
    }

    impl Bus for HandBus {
        fn receive(&mut self, mut take: impl FnMut(Arrival)) -> Result<usize, Fault> {
            self.looks += 1;
            self.looked_ns = self.now_ns;
            self.now_ns += self.takes_ns;
            for frame in self.frames.drain(..) {
                take(Arrival::Frame { frame, stamp_ns: self.looked_ns, hardware_ns: None });
            }
            Ok(0)
        }

        fn send(&mut self, _: &Frame) -> Result<(), Fault> {
            self.looks_before = self.looks;
            self.frames.append(&mut self.with_echo);
            if let Some((operator, request)) = &mut self.aside {
                operator.send(request);
            }
            Ok(())
        }

        fn echo_age_ns(&self, _: u64) -> u64 {
            0
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
            let bench = Bench::join(&config.name, &config.shared_memory, Role::Bridge).expect("joined");
            let guard = config.guard.build(config.period_s).expect("valid");
            let gate = Gate::open(&bench, guard, PERIOD_NS).expect("the only guard");
            let roles = Roles::build(&config.bus, config.period_s).expect("valid");
            let bus = HandBus { now_ns: clock::monotonic_ns() + PERIOD_NS, ..HandBus::default() };
            let wire = Wire::on(bus, roles.clone(), LogQueue::new(16));
            let bridge =
                BridgeLoop { gate, wire, hold_periods: 5, wakes_control: false, caught: None, _bench: bench };
            Self { bridge: Some(bridge), roles, config }
        }

        fn bridge(&mut self) -> &mut BridgeLoop<HandBus> {
            self.bridge.as_mut().expect("until the end")
        }

        /// The commands of a controller that the bridge has met: the first of them is judged.
        fn controller(&mut self) -> Publisher<Command> {
            let mut commands = self.member(Role::Control).publish(&COMMAND).expect("the only controller");
            let stamp_ns = self.bridge().wire.now_ns();
            // Another thread of the bridge has to meet it.
            while self.bridge().gate.judged().0 != stamp_ns {
                commands.send(&Command { sequence: 1, stamp_ns, ..Command::default() });
                self.bridge().wire.port_mut().now_ns += PERIOD_NS;
                self.bridge().act(0, stamp_ns);
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            commands
        }

        fn member(&self, role: Role) -> Bench {
            Bench::join(&self.config.name, &self.config.shared_memory, role).expect("joined")
        }
    }

    impl Drop for Rig {
        fn drop(&mut self) {
            self.bridge = None;
            if let Ok(place) = Place::open(&self.config.name, &self.config.shared_memory) {
                let _ = place.remove();
            }
        }
    }

    /// A command that was made while the bridge was busy with the bus is younger than the bridge's look at it. It is not
    /// from the future.
    #[test]
    fn a_command_made_while_the_bridge_decoded_is_judged_by_a_later_clock() {
        let mut rig = Rig::new("slow");
        let mut commands = rig.controller();
        let bus = rig.bridge().wire.port_mut();
        bus.takes_ns = 3 * PERIOD_NS;
        // Two periods after the look: more than the one of grace.
        let stamp_ns = bus.now_ns + 2 * PERIOD_NS;
        commands.send(&Command { sequence: 2, stamp_ns, ..Command::default() });
        rig.bridge().act(0, 0);
        assert_eq!(rig.bridge().gate.judged(), (stamp_ns, 0));
    }

    /// The same where the bridge was woken by the bell alone, and kept from its processor before it could look who rang.
    #[test]
    fn a_command_made_while_the_bridge_was_held_up_after_its_wait_is_judged_by_a_later_clock() {
        let mut rig = Rig::new("held");
        let mut commands = rig.controller();
        let bus = rig.bridge().wire.port_mut();
        let woken_ns = bus.now_ns;
        bus.now_ns += 3 * PERIOD_NS;
        let stamp_ns = woken_ns + 2 * PERIOD_NS;
        commands.send(&Command { sequence: 2, stamp_ns, ..Command::default() });
        rig.bridge().act(BELL, woken_ns);
        assert_eq!(rig.bridge().gate.judged(), (stamp_ns, 0));
        // Who stamps his commands with a time to come is found out all the same.
        let bus = rig.bridge().wire.port_mut();
        let woken_ns = bus.now_ns;
        bus.now_ns += PERIOD_NS / 2;
        let stamp_ns = woken_ns + 2 * PERIOD_NS;
        commands.send(&Command { sequence: 3, stamp_ns, ..Command::default() });
        rig.bridge().act(BELL, woken_ns);
        assert_eq!(rig.bridge().gate.judged(), (stamp_ns, 1));
    }

    /// A frame that came before the echo of the last command was looked for is acted on in the next turn, without a wait; the
    /// echo itself is nothing to act on.
    #[test]
    fn what_comes_with_the_echo_is_acted_on_without_a_wait() {
        let mut rig = Rig::new("caught");
        let (roles, mut sender) = (rig.roles.clone(), rig.roles.sensor_sender());
        let told = Sensors { body_rate: Sample::good(0.1, 1, 1), ..Sensors::default() };
        let frames: Vec<Frame> = (0..roles.sensor_messages().len())
            .filter_map(|index| roles.encode_sensors(&mut sender, index, &told))
            .collect();
        let now_ns = rig.bridge().wire.now_ns();
        rig.bridge().act(0, now_ns);
        assert!(rig.bridge().gate.applied().sequence > 0, "a command went out");
        assert_eq!(rig.bridge().caught, None);
        let bus = rig.bridge().wire.port_mut();
        bus.now_ns += PERIOD_NS;
        bus.with_echo = frames;
        let now_ns = bus.now_ns;
        rig.bridge().act(0, now_ns);
        assert!(rig.bridge().caught.is_some_and(|look| look.updated && look.at_ns == now_ns));
        let sequence = rig.bridge().gate.applied().sequence;
        assert!(rig.bridge().answer_caught());
        assert_eq!(rig.bridge().wire.sensors().sequence, 1);
        assert_eq!(rig.bridge().gate.applied().sequence, sequence, "not yet due again");
        assert!(!rig.bridge().answer_caught());
    }

    /// The bell is quieted when the command is out. What rang it since the bridge looked last must not be forgotten with it:
    /// nobody would wake the bridge for an emergency stop before the next slot.
    #[test]
    fn a_stop_that_comes_while_a_command_goes_out_is_obeyed_at_once() {
        let mut rig = Rig::new("aside");
        let mut operator = rig.member(Role::Operator).publish(&REQUEST).expect("the only operator");
        let ask = |sequence, act, stamp_ns| Request { sequence, stamp_ns, act: act as u32, reserved: 0 };
        // Until the bridge hears the operator, whom another thread of it has to meet.
        let mut now_ns = rig.bridge().wire.now_ns();
        while rig.bridge().gate.refusals(Cause::RequestRefused) == 0 {
            now_ns += PERIOD_NS;
            rig.bridge().wire.port_mut().now_ns = now_ns;
            operator.send(&ask(1, OperatorAct::Disarm, now_ns));
            rig.bridge().act(0, now_ns);
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        rig.bridge().wire.port_mut().aside = Some((operator, ask(2, OperatorAct::Stop, now_ns)));
        let looks = rig.bridge().wire.port_mut().looks;
        rig.bridge().act(BELL, now_ns + PERIOD_NS);
        let looks_before = rig.bridge().wire.port_mut().looks_before;
        assert_eq!(looks_before, looks, "the bell alone is nothing on the bus");
        assert_eq!(rig.bridge().gate.applied().state, State::Disarmed as u32, "it came after the step");
        assert_eq!(rig.bridge().gate.deadline_ns(), 0, "and is not waited with");
        rig.bridge().act(0, now_ns + PERIOD_NS);
        assert_eq!(rig.bridge().gate.applied().state, State::EmergencyStop as u32);
    }

    /// When everything falls silent no frame is there to publish anything. What time does to the values is news all the same,
    /// once for each flag.
    #[test]
    fn sensors_that_all_fall_silent_are_published_as_stale() {
        let mut rig = Rig::new("silent");
        let mut sensors = rig.member(Role::Monitor).subscribe(&SENSORS).expect("subscribed");
        let good = |value| Sample::good(value, 1, 1);
        let told = Sensors {
            body_rate: good(0.1),
            battery_voltage: good(12.0),
            propeller_rate: [good(600.0); 2],
            ..Sensors::default()
        };
        let (roles, mut sender) = (rig.roles.clone(), rig.roles.sensor_sender());
        let count = roles.sensor_messages().len();
        let frames = (0..count).filter_map(|index| roles.encode_sensors(&mut sender, index, &told)).collect();
        rig.bridge().wire.port_mut().frames = frames;
        let mut published = Vec::new();
        // Two seconds, a millisecond a turn, with frames in the first alone.
        for _ in 0..2_000 {
            rig.bridge().act(0, 0);
            published.extend(std::iter::from_fn(|| sensors.next_in_order()));
            rig.bridge().wire.port_mut().now_ns += 1_000_000;
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
}
