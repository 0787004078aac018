//! A live view of a running bench. It only listens.

use std::collections::VecDeque;

use crate::bench::BenchConfig;
use crate::clock;
use crate::guard::State;
use crate::shm::{
    APPLIED, BUS, BenchMember, COMMAND, GUARD_EVENTS, ProcessRole, SENSORS, ShmError, Subscriber,
};
use crate::signal::{Applied, BusStatus, Command, CycleSample, GuardEvent, Heartbeat, Sensors};

/// [ms] between two looks at the bench.
pub const LOOK_PERIOD_MS: u64 = 100;
/// Points of a strip: the last 30 s.
const STRIP: usize = 300;
/// Events that are kept.
pub const EVENTS: usize = 8;
const ROLES: [ProcessRole; 4] =
    [ProcessRole::Bridge, ProcessRole::Emulate, ProcessRole::Run, ProcessRole::Control];

/// One process of the bench, as seen from outside.
#[derive(Debug)]
pub struct Process {
    /// What it is on the bench.
    pub role: ProcessRole,
    heartbeats: Subscriber<Heartbeat>,
    cycles: Subscriber<CycleSample>,
    /// Its last sign of life.
    pub heartbeat: Heartbeat,
    /// [1/s] signs of life, over the last second.
    pub rate: f64,
    /// [µs] greatest release lateness and command-out time since the last second began.
    worst_us: (f64, f64),
    /// [µs] the same, of the whole second before.
    pub shown_us: (f64, f64),
    /// Its newest cycle.
    pub cycle: CycleSample,
    counted: (u64, u64),
}

/// Everything that is known of the bench from outside.
#[derive(Debug)]
pub struct View {
    /// Name of the bench.
    pub bench: String,
    sensors: Subscriber<Sensors>,
    commands: Subscriber<Command>,
    applied: Subscriber<Applied>,
    events: Subscriber<GuardEvent>,
    statuses: Subscriber<BusStatus>,
    /// Who may be there.
    pub processes: Vec<Process>,
    /// The newest of each.
    pub newest: (Sensors, Command, Applied),
    /// The newest state of the bus.
    pub bus: BusStatus,
    /// What the guard did, newest first.
    pub said: VecDeque<GuardEvent>,
    /// Body angle [rad] and both commands that left [-], oldest first.
    pub strips: [VecDeque<f64>; 3],
    _member: BenchMember,
}

impl View {
    /// Joins the bench as a listener.
    ///
    /// # Errors
    /// [`ShmError`] when its shared memory cannot be read.
    pub fn join(config: &BenchConfig) -> Result<Self, ShmError> {
        let member = BenchMember::join(&config.name, &config.shared_memory, ProcessRole::Monitor)?;
        let process = |role: ProcessRole| {
            Ok::<_, ShmError>(Process {
                role,
                heartbeats: member.subscribe(&role.heartbeat())?,
                cycles: member.subscribe(&role.cycle())?,
                heartbeat: Heartbeat::default(),
                rate: 0.0,
                worst_us: (0.0, 0.0),
                shown_us: (0.0, 0.0),
                cycle: CycleSample::default(),
                counted: (0, 0),
            })
        };
        Ok(Self {
            bench: config.name.clone(),
            sensors: member.subscribe(&SENSORS)?,
            commands: member.subscribe(&COMMAND)?,
            applied: member.subscribe(&APPLIED)?,
            events: member.subscribe(&GUARD_EVENTS)?,
            statuses: member.subscribe(&BUS)?,
            processes: ROLES.into_iter().map(process).collect::<Result<_, _>>()?,
            newest: Default::default(),
            bus: BusStatus::default(),
            said: VecDeque::new(),
            strips: Default::default(),
            _member: member,
        })
    }

    /// Takes what has come since the last look.
    pub fn listen(&mut self) {
        let now_ns = clock::monotonic_ns();
        let (sensors, command, applied) = &mut self.newest;
        *sensors = self.sensors.newest().unwrap_or(*sensors);
        *command = self.commands.newest().unwrap_or(*command);
        *applied = self.applied.newest().unwrap_or(*applied);
        self.bus = self.statuses.newest().unwrap_or(self.bus);
        while let Some(event) = self.events.next_in_order() {
            self.said.push_front(event);
            self.said.truncate(EVENTS);
        }
        self.processes.iter_mut().for_each(|process| process.listen(now_ns));
        let angle = if self.newest.0.body_angle.is_good() {
            self.newest.0.body_angle.value
        } else {
            self.newest.1.estimate.body_angle
        };
        let points = [angle, self.newest.2.rotor[0], self.newest.2.rotor[1]];
        for (strip, point) in self.strips.iter_mut().zip(points) {
            strip.push_back(point);
            if strip.len() > STRIP {
                strip.pop_front();
            }
        }
    }

    /// The guard's state.
    #[must_use]
    pub fn state(&self) -> State {
        State::from_code(self.newest.2.state).unwrap_or_default()
    }

    /// [s] since the guard said anything.
    #[must_use]
    pub fn guard_age_s(&self, now_ns: u64) -> f64 {
        clock::span_s(now_ns.saturating_sub(self.newest.2.stamp_ns))
    }

    /// Whether the guard runs: it has said so within the last second.
    #[must_use]
    pub fn is_guarded(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.newest.2.stamp_ns) < clock::NANOSECONDS_PER_SECOND
    }
}

impl Process {
    fn listen(&mut self, now_ns: u64) {
        if let Some(heartbeat) = self.heartbeats.newest() {
            self.heartbeat = heartbeat;
        }
        while let Some(cycle) = self.cycles.next_in_order() {
            let since_due = |end_ns: u64| end_ns.saturating_sub(cycle.due_ns) as f64 * 1e-3;
            self.worst_us.0 = self.worst_us.0.max(since_due(cycle.released_ns));
            self.worst_us.1 = self.worst_us.1.max(since_due(cycle.finished_ns));
            self.cycle = cycle;
        }
        let (count, since_ns) = self.counted;
        let elapsed_ns = now_ns.saturating_sub(since_ns);
        if since_ns == 0 {
            self.counted = (self.heartbeat.count, now_ns);
        } else if elapsed_ns >= clock::NANOSECONDS_PER_SECOND {
            self.rate = self.heartbeat.count.saturating_sub(count) as f64 / clock::span_s(elapsed_ns);
            self.shown_us = std::mem::take(&mut self.worst_us);
            self.counted = (self.heartbeat.count, now_ns);
        }
    }

    /// Whether it gave a sign of life within two seconds.
    #[must_use]
    pub fn is_alive(&self, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.heartbeat.stamp_ns) < 2 * clock::NANOSECONDS_PER_SECOND
    }
}
