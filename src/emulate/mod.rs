//! The plant that stands in for the hardware, behind shared memory or CAN.
//!
//! [`Emulator`] is the whole bench without a bus: rotors, battery, body, hidden effects, scripted torque and
//! sensors. It runs on virtual time in whole nanoseconds and is a function of its settings alone: the same
//! seed gives the same bits, run after run. [`run_behind_guard`] and [`EmulatedBus`] put it behind shared memory or on a CAN bus.
//!
//! A bench with something hidden in it, run by a program: `examples/compare.rs`.

use crate::clock;
use crate::signal::{ROTORS, Sensors};

mod battery;
mod behind_guard;
mod bench;
mod bus;
mod error;
mod hidden;
mod hidden_config;
mod history;
mod own_law;
mod plant;
mod rotor_fault;
mod sensor;
mod settings;
mod temperature;
pub mod thresholds;

pub use battery::BatteryConfig;
pub use behind_guard::{BodyMotion, EmulationOptions, run as run_behind_guard};
pub use bench::PlantConfig;
pub use bus::{BusSummary, EmulatedBus};
pub use error::EmulateError;
pub use hidden::catalogue;
pub use hidden_config::HiddenConfig;
pub use plant::{Plant, PlantState, Truth};
pub use rotor_fault::{RotorFault, RotorFaultKind};
pub use sensor::{SensorConfig, SensorsConfig};
pub use settings::{EmulatorConfig, Impulse};

use history::CommandLine;
use plant::Inputs;
use rotor_fault::{BuiltFault, Damage};
use sensor::{Device, Sampler};

/// The emulated bench as built.
#[derive(Debug, Clone)]
pub struct Emulator {
    plant: Plant,
    devices: Vec<Device>,
    impulses: Vec<(u64, u64, f64)>,
    impulse_period_ns: u64,
    step_ns: u64,
    delay_ns: u64,
    esc_timeout_ns: u64,
    initial_angle: f64,
    hold_until_commanded: bool,
    seed: u64,
    faults: Vec<BuiltFault>,
}

/// The emulated bench at one instant.
#[derive(Debug, Clone)]
pub struct EmulatorState {
    origin_ns: u64,
    now_ns: u64,
    plant: PlantState,
    lines: [CommandLine; ROTORS],
    commanded_ns: [u64; ROTORS],
    is_held: bool,
    damage: [Damage; ROTORS],
    /// [-] what an ESC that obeys no more turns at.
    stuck: [Option<f64>; ROTORS],
    /// Faults that have come.
    broken: usize,
    /// One for each device.
    samplers: Vec<Sampler>,
    sensors: Sensors,
}

impl Emulator {
    /// The bench at rest. Stamps of its sensors count from `origin_ns`, which must not be zero: zero means never.
    #[must_use]
    pub fn start(&self, origin_ns: u64) -> EmulatorState {
        let samplers = (1..).zip(&self.devices).map(|(stream, device)| device.start(self.seed, stream));
        let mut state = EmulatorState {
            origin_ns,
            now_ns: 0,
            plant: self.plant.start(self.initial_angle),
            lines: [CommandLine::new(self.delay_ns), CommandLine::new(self.delay_ns)],
            commanded_ns: [0; ROTORS],
            is_held: self.hold_until_commanded,
            damage: Default::default(),
            stuck: [None; ROTORS],
            broken: 0,
            samplers: samplers.collect(),
            sensors: Sensors::default(),
        };
        self.sample(&mut state);
        state
    }

    /// Commands both rotors, now.
    pub fn command(&self, state: &mut EmulatorState, rotor: [f64; ROTORS]) {
        for (index, command) in rotor.into_iter().enumerate() {
            self.command_rotor(state, index, command);
        }
    }

    /// Commands one rotor, now: what an ESC does with its frame. A command that is not a number stops it.
    pub fn command_rotor(&self, state: &mut EmulatorState, rotor: usize, command: f64) {
        let command = if command.is_finite() { command.clamp(0.0, 1.0) } else { 0.0 };
        if let (Some(line), Some(stamp)) = (state.lines.get_mut(rotor), state.commanded_ns.get_mut(rotor)) {
            line.send(state.now_ns, command);
            *stamp = state.now_ns;
        }
    }

    /// Runs to `until_ns` since the start, and takes every sample that falls due, the last instant included.
    pub fn advance(&self, state: &mut EmulatorState, until_ns: u64) {
        while state.now_ns < until_ns {
            let event_ns = self.next_event_ns(state).min(until_ns);
            self.integrate(state, event_ns);
            for line in &mut state.lines {
                line.arrive(event_ns);
            }
            self.time_out(state);
            self.break_rotors(state);
            self.sample(state);
        }
    }

    /// The next instant at which an input changes or a sensor samples.
    fn next_event_ns(&self, state: &EmulatorState) -> u64 {
        let now = state.now_ns;
        let sample = self.next_sample_ns(state);
        let line = state.lines.iter().map(CommandLine::next_ns).min().unwrap_or(u64::MAX);
        let (phase, cycle) = self.script_phase(now);
        let edge = self
            .impulses
            .iter()
            .flat_map(|&(start, end, _)| [start, end])
            .filter(|&edge| edge > phase)
            .min()
            .map_or(u64::MAX, |edge| edge.saturating_add(cycle));
        let again = if self.impulse_period_ns > 0 { cycle + self.impulse_period_ns } else { u64::MAX };
        let timeout = state.commanded_ns.iter().map(|stamp| stamp + self.esc_timeout_ns);
        let timeout = timeout.filter(|&at| at > now).min().unwrap_or(u64::MAX);
        let fault =
            self.faults.iter().map(|fault| fault.at_ns).filter(|&at| at > now).min().unwrap_or(u64::MAX);
        sample.min(line).min(edge).min(again).min(timeout).min(fault).max(now + 1)
    }

    /// [ns] into the script of impulses, and when this round of it began.
    fn script_phase(&self, now_ns: u64) -> (u64, u64) {
        if self.impulse_period_ns == 0 {
            return (now_ns, 0);
        }
        let phase = now_ns % self.impulse_period_ns;
        (phase, now_ns - phase)
    }

    fn disturbance(&self, now_ns: u64) -> f64 {
        let (phase, _) = self.script_phase(now_ns);
        let acting = |&&(start, end, _): &&(u64, u64, f64)| start <= phase && phase < end;
        self.impulses.iter().filter(acting).map(|&(_, _, torque)| torque).sum()
    }

    /// What acts on the plant now.
    fn inputs(&self, state: &EmulatorState) -> Inputs {
        Inputs {
            rotor: std::array::from_fn(|rotor| state.stuck[rotor].unwrap_or(state.lines[rotor].arrived())),
            torque: self.disturbance(state.now_ns),
            time: clock::span_s(state.now_ns),
            is_held: state.is_held,
            damage: state.damage,
        }
    }

    fn integrate(&self, state: &mut EmulatorState, until_ns: u64) {
        let span_ns = until_ns - state.now_ns;
        let steps = span_ns.div_ceil(self.step_ns);
        let step = clock::span_s(span_ns) / steps as f64;
        state.is_held &= state.lines.iter().all(|line| line.arrived() == 0.0);
        let start = self.inputs(state);
        for index in 0..steps {
            let inputs = Inputs { time: start.time + step * index as f64, ..start };
            self.plant.step(&mut state.plant, &inputs, step);
        }
        state.now_ns = until_ns;
    }

    /// An ESC that has heard nothing for its timeout stops its rotor, whatever was said last.
    fn time_out(&self, state: &mut EmulatorState) {
        for (line, stamp) in state.lines.iter_mut().zip(state.commanded_ns) {
            if state.now_ns >= stamp + self.esc_timeout_ns && line.arrived() > 0.0 {
                line.stop();
            }
        }
    }

    /// What has broken by now; nothing mends itself.
    fn break_rotors(&self, state: &mut EmulatorState) {
        for fault in self.faults.iter().skip(state.broken).take_while(|fault| fault.at_ns <= state.now_ns) {
            state.broken += 1;
            fault.damage(&mut state.damage[fault.rotor]);
            let is_stuck = &mut state.stuck[fault.rotor];
            match fault.kind {
                RotorFaultKind::Deaf => *is_stuck = Some(state.lines[fault.rotor].arrived()),
                RotorFaultKind::TurnsByItself => *is_stuck = Some(fault.command),
                RotorFaultKind::BrokenPropeller | RotorFaultKind::Desync => {}
            }
        }
    }

    fn sample(&self, state: &mut EmulatorState) {
        let now = state.now_ns;
        if self.next_sample_ns(state) > now {
            return;
        }
        let stamp = state.origin_ns + now;
        let inputs = self.inputs(state);
        let truth = self.plant.truth(&state.plant, &inputs);
        let EmulatorState { plant, samplers, sensors, .. } = state;
        for (sampler, device) in samplers.iter_mut().zip(&self.devices) {
            if sampler.next_ns > now {
                continue;
            }
            sampler.advance(device);
            for channel in device.channels {
                let value = self.plant.sensed(plant, &inputs, &truth, *channel);
                *channel.of_mut(sensors) = sampler.sample(device, value, stamp);
            }
        }
        sensors.sequence += 1;
        sensors.stamp_ns = stamp;
    }

    /// [ns] since the start when sensors are sampled next; `u64::MAX` = never again.
    #[must_use]
    pub fn next_sample_ns(&self, state: &EmulatorState) -> u64 {
        let drivers = state.samplers.iter().zip(&self.devices).filter(|(_, device)| !device.is_passenger);
        drivers.map(|(sampler, _)| sampler.next_ns).min().unwrap_or(u64::MAX)
    }

    /// What really is, now.
    #[must_use]
    pub fn truth(&self, state: &EmulatorState) -> Truth {
        self.plant.truth(&state.plant, &self.inputs(state))
    }
}

impl EmulatorState {
    /// [-] what each ESC obeys now: its last command, or 0 when it has heard none for its timeout.
    #[must_use]
    pub fn rotor_commands(&self) -> [f64; ROTORS] {
        [self.lines[0].arrived(), self.lines[1].arrived()]
    }

    /// Newest value of each sensor.
    #[must_use]
    pub fn sensors(&self) -> &Sensors {
        &self.sensors
    }

    /// [ns] of virtual time since the start.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.now_ns
    }
}

#[cfg(test)]
mod tests;
