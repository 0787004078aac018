//! A guard with everything around it healthy, to be broken by the tests.

use rotorbench::guard::{Cause, Guard, GuardConfig, GuardState, OperatorAct, State};
use rotorbench::signal::{Applied, Channel, Command, GuardEvent, Request, Sample, Sensors};

/// [ns] 50 Hz.
pub const T: u64 = 20_000_000;

/// N of the default at 50 Hz: 0.1 s.
pub const N: u32 = 5;

/// A guard with live, ever changing sensors and a controller that answers them.
pub struct Rig {
    pub guard: Guard,
    pub state: GuardState,
    pub now: u64,
    pub sensors: Sensors,
    pub command: Command,
    pub request: Request,
    pub last: Applied,
}

impl Rig {
    pub fn new(config: &GuardConfig) -> Self {
        Self {
            guard: config.build(0.02).expect("valid"),
            state: GuardState::new(),
            now: 1_000_000_000,
            sensors: Sensors::default(),
            command: Command { rotor: [0.46, 0.47], ..Command::default() },
            request: Request::default(),
            last: Applied::default(),
        }
    }

    /// A rig that is armed and spun up.
    pub fn armed(config: &GuardConfig) -> Self {
        let mut rig = Self::new(config);
        rig.run(3);
        rig.ask(OperatorAct::Arm);
        rig.run(60);
        assert_eq!(rig.state.state(), State::Armed, "{:?}", rig.state.cause());
        assert_eq!(rig.last.rotor, rig.command.rotor);
        rig.state.take_events().for_each(drop);
        rig
    }

    /// What an operator does after a latch: `disarm`, then `arm`; it must be armed then.
    pub fn rearm(&mut self) {
        self.ask(OperatorAct::Disarm);
        self.period();
        self.ask(OperatorAct::Arm);
        self.run(60);
        assert_eq!(self.state.state(), State::Armed, "{:?}", self.state.cause());
    }

    /// New values of every signal, now.
    pub fn sense(&mut self) {
        let count = self.sensors.body_rate.count.wrapping_add(1);
        let good = |value: f64| Sample::good(value + 1e-3 * f64::from(count % 97), self.now, count);
        let mut all = Sensors::default();
        for channel in Channel::WATCHED {
            let (low, high) = channel.sensor().guard().expect("watched").range;
            *channel.of_mut(&mut all) = good(f64::midpoint(low, high));
        }
        self.sensors = Sensors {
            sequence: self.sensors.sequence + 1,
            stamp_ns: self.now,
            body_rate: good(0.0),
            body_angle: good(0.0),
            battery_voltage: good(12.0),
            propeller_rate: [good(600.0), good(610.0)],
            current: [good(5.0); 2],
            thrust: [good(6.0); 2],
            ..all
        };
    }

    /// A new command that answers them.
    pub fn answer(&mut self) {
        self.command.sequence += 1;
        self.command.stamp_ns = self.now;
        self.command.sensors_sequence = self.sensors.sequence;
    }

    pub fn step(&mut self, command: bool) -> Applied {
        let newest = command.then_some(&self.command);
        let request = (self.request.sequence > 0).then_some(&self.request);
        self.last = self.guard.step(&mut self.state, self.now, &self.sensors, newest, request);
        self.last
    }

    /// One healthy period.
    pub fn period(&mut self) -> Applied {
        self.now += T;
        self.sense();
        self.answer();
        self.step(true)
    }

    pub fn run(&mut self, periods: u32) {
        for _ in 0..periods {
            self.period();
        }
    }

    /// A request made now, seen with the next step.
    pub fn ask(&mut self, act: OperatorAct) {
        self.ask_code(act as u32, self.now);
    }

    pub fn ask_code(&mut self, act: u32, stamp_ns: u64) {
        self.request = Request { sequence: self.request.sequence + 1, stamp_ns, act, reserved: 0 };
    }

    /// Periods of `fault` until both rotors get zero, at most 200.
    pub fn periods_to_zero(&mut self, mut fault: impl FnMut(&mut Self)) -> u32 {
        for periods in 1..200 {
            self.now += T;
            self.sense();
            self.answer();
            fault(self);
            if self.step(true).rotor == [0.0, 0.0] {
                return periods;
            }
        }
        panic!("the rotors go on turning");
    }

    pub fn events(&mut self) -> Vec<(State, State, Cause, u32)> {
        let read = |event: GuardEvent| {
            let state = |code| State::from_code(code).expect("a state");
            (
                state(event.from),
                state(event.to),
                Cause::from_code(event.cause).expect("a cause"),
                event.subject,
            )
        };
        self.state.take_events().map(read).collect()
    }
}

pub fn defaults() -> GuardConfig {
    GuardConfig::default()
}
