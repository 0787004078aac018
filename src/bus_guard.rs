//! The guard on a running bench: commands and operator's acts in, what the rotors get out, everything published.
//!
//! Bridge and emulator both own one, and it is the same in both. It steps when a command comes. When none
//! comes it steps half a period late, and counts a miss: the command of a healthy controller may be that unpunctual.
//! Commands that come faster than twice a period wait, so that a controller that runs away cannot buy itself a higher
//! slew rate. An emergency stop waits for nothing.

use crate::clock;
use crate::guard::thresholds::THRESHOLDS;
use crate::guard::{Cause, Guard, GuardState, OperatorAct, State};
use crate::rt::{Cycle, Release};
use crate::shm::{
    APPLIED, Bell, BenchMember, COMMAND, GUARD_EVENTS, GUARD_STEPS, Publisher, REQUEST, SENSORS, STOPS,
    ShmError, Subscriber, Waiter,
};
use crate::signal::{
    Applied, AppliedFlags, Command, CycleSample, GuardEvent, GuardStep, Heartbeat, ROTORS, Request, Sensors,
};

/// The guard, its cycle and its topics.
#[derive(Debug)]
pub struct BusGuard {
    guard: Guard,
    state: GuardState,
    cycle: Cycle,
    /// [ns] when the guard stepped last.
    stepped_ns: u64,
    newest: Option<Command>,
    is_pending: bool,
    request: Option<Request>,
    arming: Option<Arming>,
    /// Time and cause of the first trip since the last step: the recorder must know it.
    tripped: Option<(u64, u32)>,
    applied: Applied,
    /// The last step, until it is published.
    step: Option<GuardStep>,
    topics: Topics,
}

#[derive(Debug)]
struct Topics {
    role: u32,
    sensors: Publisher<Sensors>,
    applied: Publisher<Applied>,
    events: Publisher<GuardEvent>,
    steps: Publisher<GuardStep>,
    cycles: Publisher<CycleSample>,
    heartbeats: Publisher<Heartbeat>,
    commands: Subscriber<Command>,
    requests: Subscriber<Request>,
    stops: Vec<Subscriber<Request>>,
    control_bell: Bell,
    bell: Bell,
    heartbeat: Heartbeat,
}

impl BusGuard {
    /// Takes the bench's guard over: from now on nobody else can.
    ///
    /// # Errors
    /// [`ShmError::Claimed`] when the bench has a bridge or emulator.
    pub fn open(bench: &BenchMember, guard: Guard, period_ns: u64) -> Result<Self, ShmError> {
        let now_ns = clock::monotonic_ns();
        Ok(Self {
            guard,
            state: GuardState::new(),
            cycle: Cycle::new(period_ns, now_ns.saturating_add(period_ns)),
            stepped_ns: now_ns,
            newest: None,
            is_pending: false,
            request: None,
            arming: None,
            tripped: None,
            applied: Applied::default(),
            step: None,
            topics: Topics::open(bench, now_ns)?,
        })
    }

    /// Begins with the first slot a period after `now_ns`: for after the real-time set-up.
    pub fn start_at(&mut self, now_ns: u64) {
        self.cycle.start_at(now_ns.saturating_add(self.cycle.period_ns()));
        self.stepped_ns = now_ns;
    }

    /// Lets the bench ask its guard to arm, again and again until it is armed once: for scripted runs on the emulator.
    pub fn arm_by_itself(&mut self) {
        self.arming = Some(Arming { sequence: 0, next_ns: 0 });
    }

    /// Rung when there may be something to do: for the wait.
    #[must_use]
    pub fn bell(&self) -> &Bell {
        &self.topics.bell
    }

    /// [ns] when to call [`BusGuard::poll`] at the latest.
    #[must_use]
    pub fn deadline_ns(&self) -> u64 {
        if self.is_stop() {
            return 0;
        }
        let is_soon = self.is_pending || self.is_in_trouble();
        if is_soon { self.cycle.due_ns().min(self.earliest_ns()) } else { self.cycle.due_ns() }
    }

    /// Whether the guard is on its ladder: then it steps twice a period, so that its times end when they end.
    fn is_in_trouble(&self) -> bool {
        self.applied.state == State::Degraded as u32 || self.applied.flags & AppliedFlags::RAMPING != 0
    }

    /// [ns] before which no command makes the guard step.
    fn earliest_ns(&self) -> u64 {
        self.stepped_ns.saturating_add(self.cycle.period_ns() / 2)
    }

    /// `sensors`, with what the guard's limits say of them at `now_ns`: stale, frozen. For the controller and for everybody
    /// else; the guard itself is given them as they came.
    #[must_use]
    pub fn marked(&self, now_ns: u64, sensors: &Sensors) -> Sensors {
        let mut marked = *sensors;
        self.guard.mark(&self.state, now_ns, &mut marked);
        marked
    }

    /// Publishes what was measured, [`BusGuard::marked`], and wakes the controller when `wake` says so.
    pub fn publish_sensors(&mut self, sensors: &Sensors, wake: bool) {
        self.topics.sensors.send(sensors);
        if wake {
            self.topics.control_bell.ring();
        }
    }

    /// Takes in what came through shared memory. Returns whether the operator wants an emergency stop.
    fn take_in(&mut self, now_ns: u64) -> bool {
        if let Some(command) = self.topics.commands.newest() {
            self.newest = Some(command);
            self.is_pending = true;
        }
        self.take_request(now_ns)
    }

    /// Takes in what an operator asks for, for the next step. Returns whether that is an emergency stop.
    pub fn take_request(&mut self, now_ns: u64) -> bool {
        let mut asked = self.topics.stops.iter_mut().find_map(Subscriber::newest);
        if asked.is_none() && self.request.is_none() {
            asked = self.topics.requests.next_in_order();
        }
        if asked.is_some() {
            // A stop overtakes whatever was asked before. And an operator has spoken: from now on a bench that arms by
            // itself does not.
            self.request = asked;
            self.arming = None;
        } else if self.request.is_none() {
            self.request = self.own_request(now_ns);
        }
        self.is_stop()
    }

    /// Whether the operator wants an emergency stop, as far as it was taken in; the next step makes it.
    #[must_use]
    pub fn is_stop(&self) -> bool {
        self.request.is_some_and(|request| request.act == OperatorAct::Stop as u32)
    }

    /// Takes in what came through shared memory, for the next step. Returns whether a command or a request waits.
    pub fn look(&mut self, now_ns: u64) -> bool {
        self.take_in(now_ns) || self.is_pending || self.request.is_some()
    }

    /// The time at which to judge what [`BusGuard::look`] took in: `now_ns`, or, where that is younger, what `clock` says then.
    /// Whoever was held up between his reading of the clock and his look would else find a good command to be from the future.
    pub fn time_to_judge(&self, now_ns: u64, clock: impl FnOnce() -> u64) -> u64 {
        let command_ns = self.newest.filter(|_| self.is_pending).map_or(0, |command| command.stamp_ns);
        let request_ns = self.request.map_or(0, |request| request.stamp_ns);
        if command_ns.max(request_ns) > now_ns { clock().max(now_ns) } else { now_ns }
    }

    /// Steps the guard if it is time to, with what was taken in before. What it lets through is to be sent at once, then
    /// [`BusGuard::finish`] called.
    pub fn step_if_due(&mut self, now_ns: u64, sensors: &Sensors) -> Option<(Release, Applied)> {
        let stop = self.is_stop();
        let is_early = now_ns < self.earliest_ns();
        let release = if stop || (!is_early && (self.is_pending || self.is_in_trouble())) {
            self.cycle.begin_at_arrival(now_ns, self.cycle.period_ns() / 2)
        } else {
            self.cycle.begin(now_ns)?
        };
        Some((release, self.step(now_ns, sensors)))
    }

    /// Steps the guard with a command of this very thread: for the process that is bridge and control in one. Such a
    /// process begins the slots itself, see [`BusGuard::cycle_mut`], and listens to the operator, see [`BusGuard::take_request`]. Without a
    /// command it is a miss.
    pub fn step_with(&mut self, now_ns: u64, sensors: &Sensors, command: Option<&Command>) -> Applied {
        if let Some(command) = command {
            self.newest = Some(*command);
        }
        self.step(now_ns, sensors)
    }

    fn step(&mut self, now_ns: u64, sensors: &Sensors) -> Applied {
        self.publish_step();
        let request = self.request.take();
        let applied =
            self.guard.step(&mut self.state, now_ns, sensors, self.newest.as_ref(), request.as_ref());
        let consumed = GuardStep::new(now_ns, sensors, self.newest.as_ref(), request.as_ref(), &applied);
        self.step = Some(consumed.tripped(self.tripped.take()));
        self.stepped_ns = now_ns;
        self.is_pending = false;
        self.applied = applied;
        applied
    }

    /// Publishes the last step, what went into it and what came of it; once. For when the command is out, which it would
    /// delay.
    pub fn publish_step(&mut self) {
        let Some(step) = self.step.take() else { return };
        self.topics.applied.send(&self.applied);
        self.topics.steps.send(&step);
        for event in self.state.take_events() {
            self.topics.events.send(&event);
        }
    }

    /// Ends the period: what the guard let through was out at `finished_ns`.
    pub fn finish(&mut self, release: Release, finished_ns: u64, sensors: &Sensors) {
        self.publish_step();
        let sample = self.cycle.finish(release, finished_ns, sensors.body_rate.stamp_ns);
        let topics = &mut self.topics;
        topics.cycles.send(&CycleSample { role: topics.role, ..sample });
        topics.heartbeat.count += 1;
        topics.heartbeat.stamp_ns = finished_ns;
        topics.heartbeats.send(&topics.heartbeat);
    }

    /// Latches from outside: the bus died or has another master, the process is ending. The next step begins the ramp
    /// to zero.
    pub fn trip(&mut self, now_ns: u64, cause: Cause) {
        if self.tripped.is_none() {
            self.guard.trip(&mut self.state, now_ns, cause);
            self.tripped = Some((now_ns, cause as u32));
        }
    }

    /// Whether the rotors are commanded to stand still.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.applied.rotor == [0.0; ROTORS]
    }

    /// How many commands and requests the guard refused for `cause`.
    #[must_use]
    pub fn refusals(&self, cause: Cause) -> u64 {
        self.state.refusals(cause)
    }

    /// [ns] stamp of the newest command that came, and how many were refused as from the future.
    #[cfg(test)]
    pub(crate) fn examined(&self) -> (u64, u64) {
        let stamp_ns = self.newest.filter(|_| !self.is_pending).map_or(0, |command| command.stamp_ns);
        (stamp_ns, self.refusals(Cause::CommandFromFuture))
    }

    /// What the guard let through last.
    #[must_use]
    pub fn applied(&self) -> &Applied {
        &self.applied
    }

    /// The slots of the guard and their timing.
    #[must_use]
    pub fn cycle(&self) -> &Cycle {
        &self.cycle
    }

    /// The slots, for the process that begins them itself.
    pub fn cycle_mut(&mut self) -> &mut Cycle {
        &mut self.cycle
    }

    /// The next wish to arm of a bench that arms by itself. Only a bench that was never armed is: what ended in a
    /// failsafe, or was disarmed, waits for a person.
    fn own_request(&mut self, now_ns: u64) -> Option<Request> {
        let arming = self.arming.as_mut()?;
        if self.applied.state != State::Disarmed as u32 && self.applied.state != State::PreArm as u32 {
            self.arming = None;
            return None;
        }
        // Asked before its first step the guard would find the wish older than itself; during its checks, out of place.
        let is_time = self.applied.sequence > 0 && self.applied.state == State::Disarmed as u32;
        if !is_time || now_ns < arming.next_ns {
            return None;
        }
        arming.next_ns = now_ns.saturating_add(THRESHOLDS.arming_period_ns);
        arming.sequence += 1;
        Some(Request {
            sequence: arming.sequence,
            stamp_ns: now_ns,
            act: OperatorAct::Arm as u32,
            reserved: 0,
        })
    }
}

/// A bench that asks its guard to arm.
#[derive(Debug, Clone, Copy)]
struct Arming {
    sequence: u64,
    next_ns: u64,
}

impl Topics {
    fn open(bench: &BenchMember, now_ns: u64) -> Result<Self, ShmError> {
        let role = bench.role();
        Ok(Self {
            role: role as u32,
            sensors: bench.publish(&SENSORS)?,
            applied: bench.publish(&APPLIED)?,
            events: bench.publish(&GUARD_EVENTS)?,
            steps: bench.publish(&GUARD_STEPS)?,
            cycles: bench.publish(&role.cycle())?,
            heartbeats: bench.publish(&role.heartbeat())?,
            commands: bench.subscribe(&COMMAND)?,
            requests: bench.subscribe(&REQUEST)?,
            stops: STOPS.iter().map(|topic| bench.subscribe(topic)).collect::<Result<_, _>>()?,
            control_bell: bench.bell(Waiter::Control)?,
            bell: bench.bell(Waiter::Guard)?,
            heartbeat: Heartbeat {
                count: 0,
                stamp_ns: now_ns,
                born_ns: now_ns,
                role: role as u32,
                process_id: std::process::id(),
            },
        })
    }
}
