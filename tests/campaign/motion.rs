//! The plant in motion: every law at work, integrated by classical Runge-Kutta of a small fixed step.
//!
//! Conventions, checked against the development cases by `verify`: a row's command holds from its stamp to
//! the next one, a row's measurement is taken at its stamp, the reading of the battery is of that instant.

use std::collections::VecDeque;

use crate::laws::Seen;
use crate::plant::{ARM, Base, FULL_BATTERY, HOVER_RATE, Hidden, Outside};

/// Speed at which pivot friction saturates [rad/s]; the development cases settle on this value.
const STICTION_RATE: f64 = 0.01;

const RATE: usize = 0; // two rotors
const LAG: usize = 2;
const TELEMETRY: usize = 4;
const HEAT: usize = 6;
const RING: usize = 8; // two states a rotor
const ANGLE: usize = 12;
const BODY_RATE: usize = 13;
const TORQUE: usize = 14;
const GYRO: usize = 15;
const MEMORY: usize = 16;
const STATES: usize = 17;
type State = [f64; STATES];

/// What acts on the plant over one piece of time.
struct Drive {
    /// After delay, play and the command laws.
    command: [f64; 2],
    /// [V] at the start, and its slope [V/s].
    voltage: [f64; 2],
    /// Value of an outside path.
    path: f64,
    /// Whether the pivot and the body exist.
    body: bool,
    started: f64,
}

/// One row of what the sensors would show without noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    pub rate: [f64; 2],
    pub body_rate: f64,
    pub angle: f64,
    /// The rates themselves, which no sensor law has touched.
    pub true_rate: [f64; 2],
    pub true_body_rate: f64,
}

/// A plant in motion. `advance` takes it one sample on.
pub struct Motion<'a> {
    base: &'a Base,
    hidden: &'a Hidden,
    body: bool,
    substep: f64,
    time: f64,
    state: State,
    /// Steady rate behind the slew limit.
    slewed: [f64; 2],
    play: [f64; 2],
    /// The level of a relay, one or minus one.
    level: f64,
    /// Torque of the rotors over time, for a delayed torque.
    torques: VecDeque<(f64, f64)>,
    /// Commands by sample, for a delayed command.
    commands: Vec<[f64; 2]>,
    period: f64,
}

impl<'a> Motion<'a> {
    /// At rest; an actuator bench turns steadily at its first command, an attitude bench hovers.
    pub fn start(
        base: &'a Base,
        hidden: &'a Hidden,
        body: bool,
        period: f64,
        substep: f64,
        first: ([f64; 2], f64),
    ) -> Self {
        let mut motion = Self {
            base,
            hidden,
            body,
            substep,
            time: 0.0,
            state: [0.0; STATES],
            slewed: [HOVER_RATE; 2],
            play: first.0,
            level: if let Outside::Relay([_, middle, _]) = hidden.outside {
                (if body { 0.0 } else { first.0[0] } - middle).signum()
            } else {
                0.0
            },
            torques: VecDeque::new(),
            commands: Vec::new(),
            period,
        };
        if !body {
            let z = motion.steady_rate(motion.shaped(first.0[0]), (first.1, 0.0), 0.0, 0.0);
            motion.slewed = [z; 2];
        }
        for rotor in 0..2 {
            let settled = if body { HOVER_RATE } else { motion.settled(motion.slewed[rotor]) };
            motion.state[RATE + rotor] = settled;
            motion.state[TELEMETRY + rotor] = settled;
            motion.state[LAG + rotor] = motion.slewed[rotor];
        }
        motion.state[TORQUE] = motion.rotor_torque(&motion.state);
        motion
    }

    /// The rate at which the drag lets a rotor settle for a steady rate `z`.
    fn settled(&self, z: f64) -> f64 {
        let (p, k) = (self.base.pole, self.hidden.quadratic_rotor_drag);
        if k == 0.0 { z } else { (-p + (p * p + 4.0 * k * p * z).sqrt()) / (2.0 * k) }
    }

    fn shaped(&self, command: f64) -> f64 {
        let h = self.hidden;
        let mut u = command;
        if h.command_dead_zone > 0.0 {
            u = (u - h.command_dead_zone).max(0.0) / (1.0 - h.command_dead_zone);
        }
        if h.command_quantization > 0.0 {
            u = (u / h.command_quantization).round() * h.command_quantization;
        }
        u.min(h.command_saturation)
    }

    fn steady_rate(&self, u: f64, (voltage, time): (f64, f64), heat: f64, path: f64) -> f64 {
        let h = self.hidden;
        let (motor, drop) = if h.battery_scaling {
            (u * voltage / FULL_BATTERY, 0.0)
        } else {
            (u, (self.base.voltage_gain + h.battery_sag) * (FULL_BATTERY - voltage))
        };
        // Of what the motor gets the whole curve is a function, its cubic part among it.
        let curve = self.base.steady_rate(motor) + h.static_cubic * (motor - self.base.hover_command).powi(3);
        let bent = curve - drop + h.static_offset;
        let extra = match h.outside {
            Outside::RatePath(_) => path,
            Outside::Relay([size, ..]) if !self.body => size * self.level,
            _ => 0.0,
        };
        let seen = Seen { command: u, voltage, time, ..Seen::default() };
        bent * (1.0 - h.motor_heating[0] * heat) + extra + h.outside.at("steady_rate", &seen)
    }

    fn rotor_torque(&self, s: &State) -> f64 {
        let h = self.hidden;
        let c = self.base.thrust;
        let mut torque = 0.0;
        for (rotor, side) in [(0, 1.0), (1, -1.0)] {
            let w = s[RATE + rotor];
            let own_speed = side * ARM * s[BODY_RATE];
            let mut f = c * w * w - h.inflow_damping * c * w * own_speed;
            f *= 1.0 + side * h.actuator_mismatch;
            let height = h.ground_effect[1] + side * ARM * s[ANGLE].sin();
            let near = h.ground_effect[0] / (4.0 * height);
            f /= 1.0 - near * near;
            f += h.outside.at("thrust", &Seen { rate: w, ..Seen::default() });
            torque += side * ARM * f;
        }
        torque
    }

    fn delayed_torque(&mut self, at: f64) -> f64 {
        while self.torques.len() > 1 && self.torques[1].0 <= at {
            self.torques.pop_front();
        }
        let (t0, y0) = self.torques[0];
        match self.torques.get(1) {
            Some(&(t1, y1)) if at > t0 => y0 + (y1 - y0) * (at - t0) / (t1 - t0),
            _ => y0,
        }
    }

    fn pivot_torque(&self, s: &State, path: f64, time: f64) -> (f64, f64) {
        let h = self.hidden;
        let (angle, q) = (s[ANGLE], s[BODY_RATE]);
        let mut torque = h.torque_bias
            - h.pivot_coulomb_friction * (q / STICTION_RATE).tanh()
            - h.pivot_viscous_friction * q
            - h.quadratic_air_drag * q * q.abs()
            - h.gravity_pendulum[0] * (angle + h.gravity_pendulum[1]).sin()
            - h.cable_stiffness * angle;
        torque += h.outside.at("torque", &Seen { angle, body_rate: q, time, ..Seen::default() });
        let mut memory = 0.0;
        match h.outside {
            Outside::TorquePath(_) => torque += path,
            Outside::Relay([size, ..]) => torque += size * self.level,
            Outside::Cogging(size, teeth) => torque += size * (teeth * angle).sin(),
            Outside::StickSlip([level, breakaway, stiffness]) => {
                let limit = level * (1.0 + (breakaway - 1.0) * (-(q / 0.1).powi(2)).exp());
                memory = q - stiffness * q.abs() / limit * s[MEMORY];
                torque -= stiffness * s[MEMORY];
            }
            Outside::Hysteresis([size, width]) => {
                memory = (q - q.abs() * s[MEMORY] * s[MEMORY].abs()) / width;
                torque -= size * s[MEMORY];
            }
            Outside::Stops([at, stiffness]) => {
                torque -= stiffness * (angle.abs() - at).max(0.0) * angle.signum();
            }
            _ => {}
        }
        (torque, memory)
    }

    /// Time derivative of the state; `ahead` [s] since the start of the substep.
    fn derivative(&mut self, s: &State, drive: &Drive, z: [f64; 2], time: f64) -> State {
        let h = self.hidden;
        let mut out = [0.0; STATES];
        for rotor in 0..if self.body { 2 } else { 1 } {
            let w = s[RATE + rotor];
            let aim = if h.second_order_lag.is_finite() { s[LAG + rotor] } else { z[rotor] };
            if h.second_order_lag.is_finite() {
                out[LAG + rotor] = h.second_order_lag * (z[rotor] - s[LAG + rotor]);
            }
            let mut p = self.base.pole;
            p *= if aim > w { h.asymmetric_pole } else { 1.0 / h.asymmetric_pole };
            p *= 1.0 + h.speed_dependent_pole * (w - HOVER_RATE) / HOVER_RATE;
            let mut tau = h.motor_heating[1];
            if let Outside::WarmPole([share, time_constant]) = h.outside {
                p *= 1.0 - share * s[HEAT + rotor];
                tau = time_constant;
            }
            let mut pull = p * (aim - w);
            if let Outside::Resonance([natural, damping, share]) = h.outside {
                let (x, v) = (s[RING + 2 * rotor], s[RING + 2 * rotor + 1]);
                out[RING + 2 * rotor] = v;
                out[RING + 2 * rotor + 1] = natural * natural * (aim - w - x) - 2.0 * damping * natural * v;
                pull = p * ((1.0 - share) * (aim - w) + share * x);
            }
            let seen = Seen { rate: w, ..Seen::default() };
            pull += h.outside.at("rotor_acceleration", &seen);
            out[RATE + rotor] = pull - h.quadratic_rotor_drag * w * w.abs();
            out[HEAT + rotor] = ((w / HOVER_RATE).powi(3) - s[HEAT + rotor]) / tau;
            if h.telemetry_lag.is_finite() {
                out[TELEMETRY + rotor] = h.telemetry_lag * (w - s[TELEMETRY + rotor]);
            }
        }
        if drive.body {
            let mut torque = self.rotor_torque(s);
            if h.torque_delay > 0.0 {
                torque = self.delayed_torque(time - h.torque_delay);
            }
            if h.rotor_lag.is_finite() {
                out[TORQUE] = h.rotor_lag * (torque - s[TORQUE]);
                torque = s[TORQUE];
            }
            let (pivot, memory) = self.pivot_torque(s, drive.path, time);
            out[BODY_RATE] = (torque + pivot) / self.base.inertia;
            out[ANGLE] = s[BODY_RATE];
            out[MEMORY] = memory;
            if h.gyro_lag.is_finite() {
                out[GYRO] = h.gyro_lag * (s[BODY_RATE] - s[GYRO]);
            }
        }
        out
    }

    /// The steady rate behind the slew limit, `ahead` [s] after the substep began.
    fn slewing(&self, s: &State, drive: &Drive, ahead: f64) -> [f64; 2] {
        let voltage = drive.voltage[0] + drive.voltage[1] * (self.time + ahead - drive.started);
        std::array::from_fn(|rotor| {
            let at = (voltage, self.time + ahead);
            let z = self.steady_rate(drive.command[rotor], at, s[HEAT + rotor], drive.path);
            let most = self.hidden.slew_rate_limit * ahead;
            if self.hidden.slew_rate_limit.is_finite() {
                self.slewed[rotor] + (z - self.slewed[rotor]).clamp(-most, most)
            } else {
                z
            }
        })
    }

    /// One classical Runge-Kutta step of `h` [s].
    fn substep(&mut self, drive: &Drive, h: f64) {
        let at = |s: &State, k: &State, a: f64| -> State { std::array::from_fn(|i| s[i] + a * k[i]) };
        let s0 = self.state;
        if self.hidden.torque_delay > 0.0 {
            let now = (self.time, self.rotor_torque(&s0));
            self.torques.push_back(now);
        }
        let z = self.slewing(&s0, drive, 0.0);
        let k1 = self.derivative(&s0, drive, z, self.time);
        let s1 = at(&s0, &k1, h / 2.0);
        let z = self.slewing(&s1, drive, h / 2.0);
        let k2 = self.derivative(&s1, drive, z, self.time + h / 2.0);
        let s2 = at(&s0, &k2, h / 2.0);
        let z = self.slewing(&s2, drive, h / 2.0);
        let k3 = self.derivative(&s2, drive, z, self.time + h / 2.0);
        let s3 = at(&s0, &k3, h);
        let z = self.slewing(&s3, drive, h);
        let k4 = self.derivative(&s3, drive, z, self.time + h);
        for i in 0..STATES {
            self.state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
        self.slewed = z;
        self.time += h;
        if self.body {
            self.switch(self.state[ANGLE]);
        }
    }

    /// The relay's level after it has seen `value`.
    fn switch(&mut self, value: f64) {
        let Outside::Relay([_, middle, half]) = self.hidden.outside else { return };
        if (value - middle).abs() > half {
            self.level = (value - middle).signum();
        }
    }

    /// What the sensors would show now.
    pub fn row(&self) -> Row {
        let (h, s) = (self.hidden, &self.state);
        let seen = if h.telemetry_lag.is_finite() { TELEMETRY } else { RATE };
        let gyro = if h.gyro_lag.is_finite() { s[GYRO] } else { s[BODY_RATE] };
        let tachometer =
            |rate: f64| rate + h.outside.at("rotor_rate_sensor", &Seen { rate, ..Seen::default() });
        let tilted = Seen { angle: s[ANGLE], body_rate: s[BODY_RATE], ..Seen::default() };
        Row {
            rate: [s[seen], s[seen + 1]].map(tachometer),
            body_rate: h.gyro_scale * gyro + h.gyro_bias + h.outside.at("body_rate_sensor", &tilted),
            angle: s[ANGLE],
            true_rate: [s[RATE], s[RATE + 1]],
            true_body_rate: s[BODY_RATE],
        }
    }

    /// Puts the body where the truth was, to try a plant over a short horizon.
    pub fn place_body(&mut self, truth: &Row) {
        self.state[ANGLE] = truth.angle;
        self.state[BODY_RATE] = truth.true_body_rate;
        self.state[GYRO] = truth.true_body_rate;
    }

    /// Holds `command` over one sample, while the battery goes from one voltage to another [V].
    pub fn advance(&mut self, command: [f64; 2], voltage: [f64; 2]) {
        let sample = self.commands.len();
        let started = self.time;
        if let Outside::Backlash(half) = self.hidden.outside {
            for (at, wanted) in self.play.iter_mut().zip(command) {
                *at = at.clamp(wanted - half, wanted + half);
            }
        } else {
            self.play = command;
        }
        self.commands.push(self.play);
        if !self.body {
            self.switch(command[0]);
        }
        // The delayed command changes once inside the sample: integrate up to there and on from there.
        let behind = self.hidden.transport_delay / self.period;
        let whole = behind.floor() as usize;
        let change = (behind - behind.floor()) * self.period;
        let path = match &self.hidden.outside {
            Outside::TorquePath(path) | Outside::RatePath(path) => path.get(sample).copied().unwrap_or(0.0),
            _ => 0.0,
        };
        for (length, back) in [(change, whole + 1), (self.period - change, whole)] {
            if length < 1e-12 {
                continue;
            }
            let delayed = self.commands[sample.saturating_sub(back)];
            let drive = Drive {
                command: [self.shaped(delayed[0]), self.shaped(delayed[1])],
                voltage: [voltage[0], (voltage[1] - voltage[0]) / self.period],
                path,
                body: self.body,
                started,
            };
            let steps = (length / self.substep).ceil();
            for _ in 0..steps as usize {
                self.substep(&drive, length / steps);
            }
        }
    }
}
