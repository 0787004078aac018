//! The truth: rotors, battery and body, integrated by the classical Runge-Kutta method of fourth order, at
//! a step far below the control period. [LPC16] Eqs. (1), (2), with the thrust curve f = c ω².
//!
//! Shares no integrator and no law with `model`, which fits: see [`super::hidden`].

use crate::effect::{Point, Site};
use crate::signal::{Channel, ROTORS};
use crate::unit::STANDARD_GRAVITY;

use super::battery::BatteryConfig;
use super::bench::PlantConfig;
use super::error::EmulateError;
use super::hidden::{HiddenKind, HiddenLaw, Laws};
use super::hidden_config::HiddenConfig;
use super::history::TorqueHistory;
use super::rotor_fault::Damage;
use super::temperature::Temperatures;

/// Number of continuous states.
const STATES: usize = 13;
/// Places in the state vector. Pairs belong to rotor 1, rotor 2.
const PROPELLER: usize = 0;
const SECOND_LAG: usize = 2;
const HEAT: usize = 4;
const TELEMETRY: usize = 6;
const ANGLE: usize = 8;
const RATE: usize = 9;
const TORQUE: usize = 10;
const GYRO: usize = 11;
const USED: usize = 12;

/// What acts on the plant from outside during one integration step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Inputs {
    /// [-] commands at the ESCs, after every delay.
    pub rotor: [f64; ROTORS],
    /// [N m] disturbance torque on the body.
    pub torque: f64,
    /// [s] since the start, at the beginning of the step.
    pub time: f64,
    /// Whether somebody holds the body still.
    pub is_held: bool,
    /// What is broken of the rotors.
    pub damage: [Damage; ROTORS],
}

/// The plant as built: parameters, battery, hidden laws.
#[derive(Debug, Clone)]
pub struct Plant {
    config: PlantConfig,
    battery: BatteryConfig,
    laws: Laws,
}

/// The plant's state.
#[derive(Debug, Clone)]
pub struct PlantState {
    x: [f64; STATES],
    /// [rad/s] steady rate behind the slew-rate limit, at the beginning and at the end of the step.
    slewed: [[f64; 2]; ROTORS],
    /// What the laws that only an expression knows remember, of each rotor.
    memories: [Vec<Option<f64>>; ROTORS],
    history: TorqueHistory,
    temperature: Temperatures,
}

/// What really is, noise-free: for tests and pictures, never for a controller.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truth {
    /// [rad]
    pub body_angle: f64,
    /// [rad/s]
    pub body_rate: f64,
    /// [rad/s]
    pub propeller_rate: [f64; ROTORS],
    /// [N]
    pub thrust: [f64; ROTORS],
    /// [V]
    pub battery_voltage: f64,
    /// [A]
    pub current: [f64; ROTORS],
    /// [N m] scripted disturbance acting now.
    pub disturbance_torque: f64,
    /// [K]
    pub esc_temperature: [f64; ROTORS],
    /// [K]
    pub motor_temperature: [f64; ROTORS],
}

impl Plant {
    pub(super) fn build(
        config: &PlantConfig,
        battery: &BatteryConfig,
        hidden: &[HiddenConfig],
    ) -> Result<Self, EmulateError> {
        config.check()?;
        battery.check(config.full_voltage)?;
        let laws = Laws::build(hidden, config)?;
        Ok(Self { config: config.clone(), battery: battery.clone(), laws })
    }

    /// [s] that commands are late, by hidden laws.
    pub(super) fn command_delay(&self) -> f64 {
        self.laws.number(HiddenKind::TransportDelay).unwrap_or(0.0)
    }

    pub(super) fn start(&self, angle: f64) -> PlantState {
        let mut x = [0.0; STATES];
        x[ANGLE] = angle;
        x[USED] = self.battery.used;
        let delay = self.laws.number(HiddenKind::TorqueDelay).unwrap_or(0.0);
        let temperature = Temperatures::default();
        let history = TorqueHistory::new(delay);
        PlantState { x, slewed: [[0.0; 2]; ROTORS], memories: Default::default(), history, temperature }
    }

    /// Advances by `span` [s] with constant inputs.
    pub(super) fn step(&self, state: &mut PlantState, inputs: &Inputs, span: f64) {
        self.remember(state, inputs, span);
        self.prepare_slew(state, inputs, span);
        let at = |x: &[f64; STATES], k: &[f64; STATES], h: f64| {
            let mut y = *x;
            for (y, k) in y.iter_mut().zip(k) {
                *y += h * k;
            }
            y
        };
        let x = state.x;
        let k1 = self.derivative(state, &x, inputs, 0.0, span);
        let k2 = self.derivative(state, &at(&x, &k1, 0.5 * span), inputs, 0.5, span);
        let k3 = self.derivative(state, &at(&x, &k2, 0.5 * span), inputs, 0.5, span);
        let k4 = self.derivative(state, &at(&x, &k3, span), inputs, 1.0, span);
        for (index, x) in state.x.iter_mut().enumerate() {
            *x += span / 6.0 * (k1[index] + 2.0 * (k2[index] + k3[index]) + k4[index]);
        }
        self.meet_stops(&mut state.x);
        let ratio = |rotor| state.x[PROPELLER + rotor] / self.config.hover_rate;
        state.temperature.advance([ratio(0), ratio(1)], span);
        for slew in &mut state.slewed {
            slew[0] = slew[1];
        }
        if self.laws.number(HiddenKind::TorqueDelay).is_some() {
            let torque = self.rotor_torque(&state.x, inputs);
            state.history.push(inputs.time + span, torque);
        }
    }

    /// Memories of expressions move once a step, with the command that holds over it.
    fn remember(&self, state: &mut PlantState, inputs: &Inputs, span: f64) {
        if !self.laws.has_own() {
            return;
        }
        for (rotor, memories) in state.memories.iter_mut().enumerate() {
            let command = self.laws.command(inputs.rotor[rotor].clamp(0.0, 1.0));
            let point = Point { command, ..self.point(&state.x, rotor, inputs) };
            self.laws.remember(&point, span, memories);
        }
    }

    /// The limiter has no derivative where it switches, so it moves once a step and is straight inside it.
    fn prepare_slew(&self, state: &mut PlantState, inputs: &Inputs, span: f64) {
        let Some(rate) = self.laws.number(HiddenKind::SlewRateLimit) else { return };
        let voltage = self.voltage(&state.x);
        for rotor in 0..ROTORS {
            let target = self.steady_rate((&state.x, &state.memories), rotor, inputs, voltage);
            let [from, to] = &mut state.slewed[rotor];
            *to = *from + (target - *from).clamp(-rate * span, rate * span);
        }
    }

    /// A body at its stop stays there until something drives it back: a plastic impact.
    fn meet_stops(&self, x: &mut [f64; STATES]) {
        let stop = self.config.angle_stop;
        if stop > 0.0 && x[ANGLE].abs() >= stop {
            x[ANGLE] = x[ANGLE].clamp(-stop, stop);
            if x[RATE] * x[ANGLE] > 0.0 {
                x[RATE] = 0.0;
            }
        }
    }

    fn derivative(
        &self,
        state: &PlantState,
        x: &[f64; STATES],
        inputs: &Inputs,
        part: f64,
        span: f64,
    ) -> [f64; STATES] {
        let mut slope = [0.0; STATES];
        let voltage = self.voltage(x);
        for rotor in 0..ROTORS {
            let [from, to] = state.slewed[rotor];
            let z = match self.laws.number(HiddenKind::SlewRateLimit) {
                Some(_) => from + part * (to - from),
                None => self.steady_rate((x, &state.memories), rotor, inputs, voltage),
            };
            self.rotor_derivative(x, rotor, z, inputs, &mut slope);
        }
        let rotor_torque = match self.laws.number(HiddenKind::TorqueDelay) {
            Some(delay) => state.history.at(inputs.time + part * span - delay),
            None => self.rotor_torque(x, inputs),
        };
        let torque = match self.laws.number(HiddenKind::RotorLag) {
            Some(pole) => {
                slope[TORQUE] = pole * (rotor_torque - x[TORQUE]);
                x[TORQUE]
            }
            None => rotor_torque,
        };
        if !self.config.clamped && !inputs.is_held {
            slope[ANGLE] = x[RATE];
            slope[RATE] = (inputs.torque + self.body_torque((x, &state.memories[0]), inputs, torque))
                / self.config.inertia;
        }
        if let Some(pole) = self.laws.number(HiddenKind::GyroLag) {
            slope[GYRO] = pole * (x[RATE] - x[GYRO]);
        }
        slope[USED] = self.battery.drain(self.total_current(x));
        slope
    }

    fn rotor_derivative(
        &self,
        x: &[f64; STATES],
        rotor: usize,
        z: f64,
        inputs: &Inputs,
        slope: &mut [f64; STATES],
    ) {
        let w = x[PROPELLER + rotor];
        let mut driven = z;
        for HiddenLaw { kind, p } in self.laws.known() {
            match kind {
                HiddenKind::SecondOrderLag => {
                    slope[SECOND_LAG + rotor] = p[0] * (z - x[SECOND_LAG + rotor]);
                    driven = x[SECOND_LAG + rotor];
                }
                HiddenKind::MotorHeating => {
                    let ratio = w / self.config.hover_rate;
                    slope[HEAT + rotor] = (ratio * ratio * ratio - x[HEAT + rotor]) / p[1];
                }
                HiddenKind::TelemetryLag => {
                    slope[TELEMETRY + rotor] = p[0] * (w - x[TELEMETRY + rotor]);
                }
                _ => {}
            }
        }
        slope[PROPELLER + rotor] = self.laws.rotor_acceleration(&self.config, driven, w);
        if self.laws.has_own() {
            let point = Point { steady_rate: driven, ..self.point(x, rotor, inputs) };
            slope[PROPELLER + rotor] += self.laws.own(Site::RotorAcceleration, &point, &[]);
        }
    }

    /// [rad/s] A standing motor is not driven backwards by a weak battery.
    fn steady_rate(
        &self,
        (x, memories): (&[f64; STATES], &[Vec<Option<f64>>; ROTORS]),
        rotor: usize,
        inputs: &Inputs,
        voltage: f64,
    ) -> f64 {
        let mut u = self.laws.command(inputs.rotor[rotor].clamp(0.0, 1.0));
        let rate = |u| self.laws.steady_rate(&self.config, u, voltage, x[HEAT + rotor]);
        let broken = |rate: f64| inputs.damage[rotor].steady_rate(rate.max(0.0), self.config.hover_rate);
        if !self.laws.has_own() {
            return broken(rate(u));
        }
        let mut point = Point { command: u, ..self.point(x, rotor, inputs) };
        u += self.laws.own(Site::Command, &point, &memories[rotor]);
        point.command = u;
        point.steady_rate = rate(u);
        broken(point.steady_rate + self.laws.own(Site::SteadyRate, &point, &memories[rotor]))
    }

    /// What an expression may look at, of one rotor.
    fn point(&self, x: &[f64; STATES], rotor: usize, inputs: &Inputs) -> Point {
        Point {
            time: inputs.time,
            command: inputs.rotor[rotor],
            battery_voltage: self.voltage(x),
            full_voltage: self.config.full_voltage,
            propeller_rate: x[PROPELLER + rotor],
            pole: self.config.pole,
            hover_rate: self.config.hover_rate,
            side: if rotor == 0 { 1.0 } else { -1.0 },
            arm: self.config.arm,
            thrust_coefficient: self.config.thrust_coefficient,
            propeller_rate_1: x[PROPELLER],
            propeller_rate_2: x[PROPELLER + 1],
            body_angle: x[ANGLE],
            body_rate: x[RATE],
            ..Point::default()
        }
    }

    /// [N m] [LPC16] Eq. (1).
    ///
    /// **Deviation:** (1) prints f_p2 - f_p1; the sign is that of its Eqs. (12)-(16).
    fn rotor_torque(&self, x: &[f64; STATES], inputs: &Inputs) -> f64 {
        let [f1, f2] = self.thrust(x, inputs);
        self.config.arm * (f1 - f2)
    }

    fn thrust(&self, x: &[f64; STATES], inputs: &Inputs) -> [f64; ROTORS] {
        let of = |side: f64, rotor: usize| {
            let thrust = self.laws.thrust(&self.config, side, x[PROPELLER + rotor], x[ANGLE], x[RATE]);
            let left = inputs.damage[rotor].propeller;
            if !self.laws.has_own() {
                return left * thrust;
            }
            left * thrust
                + self.laws.own(Site::Thrust, &Point { thrust, ..self.point(x, rotor, inputs) }, &[])
        };
        [of(1.0, 0), of(-1.0, 1)]
    }

    /// [N m] on the body, with `torque` of it from the rotors.
    fn body_torque(
        &self,
        (x, memories): (&[f64; STATES], &[Option<f64>]),
        inputs: &Inputs,
        torque: f64,
    ) -> f64 {
        let known = torque + self.laws.body_torque(x[ANGLE], x[RATE]);
        if !self.laws.has_own() {
            return known;
        }
        known + self.laws.own(Site::Torque, &Point { torque, ..self.point(x, 0, inputs) }, memories)
    }

    fn rotor_current(&self, x: &[f64; STATES], rotor: usize) -> f64 {
        self.battery.rotor_current(x[PROPELLER + rotor] / self.config.hover_rate)
    }

    fn total_current(&self, x: &[f64; STATES]) -> f64 {
        self.battery.idle_current + self.rotor_current(x, 0) + self.rotor_current(x, 1)
    }

    fn voltage(&self, x: &[f64; STATES]) -> f64 {
        self.battery.voltage(self.config.full_voltage, x[USED], self.total_current(x))
    }

    /// What is true now, for a sensor to spoil.
    pub(super) fn truth(&self, state: &PlantState, inputs: &Inputs) -> Truth {
        let x = &state.x;
        Truth {
            body_angle: x[ANGLE],
            body_rate: x[RATE],
            propeller_rate: [x[PROPELLER], x[PROPELLER + 1]],
            thrust: self.thrust(x, inputs),
            battery_voltage: self.voltage(x),
            current: [self.rotor_current(x, 0), self.rotor_current(x, 1)],
            disturbance_torque: inputs.torque,
            esc_temperature: state.temperature.esc,
            motor_temperature: state.temperature.motor,
        }
    }

    /// What a noise-free sensor would give, in its unit.
    pub(super) fn sensed(&self, state: &PlantState, inputs: &Inputs, truth: &Truth, channel: Channel) -> f64 {
        match channel {
            Channel::BodyRate => self.sensed_body_rate(state, inputs),
            Channel::BodyAngle => truth.body_angle,
            Channel::AccelerationX => 0.0,
            Channel::AccelerationY => STANDARD_GRAVITY * truth.body_angle.sin(),
            Channel::AccelerationZ => STANDARD_GRAVITY * truth.body_angle.cos(),
            Channel::BatteryVoltage => truth.battery_voltage,
            Channel::PropellerRate1 => self.sensed_propeller_rate(state, inputs, 0),
            Channel::PropellerRate2 => self.sensed_propeller_rate(state, inputs, 1),
            Channel::Current1 => truth.current[0],
            Channel::Current2 => truth.current[1],
            Channel::Thrust1 => truth.thrust[0],
            Channel::Thrust2 => truth.thrust[1],
            Channel::EscTemperature1 => truth.esc_temperature[0],
            Channel::EscTemperature2 => truth.esc_temperature[1],
            Channel::MotorTemperature1 => truth.motor_temperature[0],
            Channel::MotorTemperature2 => truth.motor_temperature[1],
        }
    }

    /// [rad/s] what a noise-free ESC would report of a rotor.
    fn sensed_propeller_rate(&self, state: &PlantState, inputs: &Inputs, rotor: usize) -> f64 {
        let lagged = self.laws.number(HiddenKind::TelemetryLag).is_some();
        let rate = state.x[if lagged { TELEMETRY } else { PROPELLER } + rotor];
        if !self.laws.has_own() {
            return rate;
        }
        rate + self.laws.own(Site::RotorRateSensor, &self.point(&state.x, rotor, inputs), &[])
    }

    /// [rad/s] what a noise-free gyro would give.
    fn sensed_body_rate(&self, state: &PlantState, inputs: &Inputs) -> f64 {
        let lagged = self.laws.number(HiddenKind::GyroLag).is_some();
        let rate = self.laws.gyro(state.x[if lagged { GYRO } else { RATE }]);
        if !self.laws.has_own() {
            return rate;
        }
        rate + self.laws.own(Site::BodyRateSensor, &self.point(&state.x, 0, inputs), &[])
    }
}
