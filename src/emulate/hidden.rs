//! What the emulator hides from the diagnosis: every law of the catalogue a second time, in a few lines each.
//!
//! Independent on purpose: no law of `effect` or `model` is used, so that one coded wrongly there cannot hide behind the same
//! mistake here. What is shared says nothing of the catalogue's physics: how a user's own expression is read, which effects
//! with which numbers a model file names, and within what bounds the catalogue's cards have them. Ids and parameter names are the catalogue's.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::effect::{Point, Site};

use super::bench::PlantConfig;
use super::error::EmulateError;
use super::hidden_config::HiddenConfig;
use super::own_law::OwnLaw;
use super::thresholds::THRESHOLDS;

impl HiddenConfig {
    /// The same with every parameter of the law: one that is left out takes the middle of its usual range.
    #[must_use]
    pub fn completed(mut self) -> Self {
        let entry = LAWS.iter().find(|entry| self.expression.is_none() && entry.id == self.effect);
        for range in entry.map_or(&[][..], |entry| entry.parameters) {
            self.parameters.entry(range.name.to_owned()).or_insert(range.middle());
        }
        self
    }

    /// An effect and a strength drawn from `seed`, among the laws whose id `admit` lets pass.
    #[must_use]
    pub fn draw(seed: u64, admit: impl Fn(&str) -> bool) -> Option<Self> {
        let entries: Vec<&Entry> = LAWS.iter().filter(|entry| admit(entry.id)).collect();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let entry = entries.get(random.random_range(0..entries.len().max(1)))?;
        let mut parameters = BTreeMap::new();
        for range in entry.parameters {
            let size = range.low + (range.high - range.low) * random.random::<f64>();
            let sign = if range.signed && random.random::<bool>() { -1.0 } else { 1.0 };
            parameters.insert(range.name.to_owned(), sign * size);
        }
        Some(Self { effect: entry.id.to_owned(), parameters, ..Self::default() })
    }
}

/// Ids the emulator can hide, with their parameters' names.
pub fn catalogue() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    LAWS.iter().map(|entry| (entry.id, entry.parameters.iter().map(|range| range.name).collect()))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HiddenKind {
    BatterySag,
    BatteryScaling,
    TransportDelay,
    AsymmetricPole,
    SpeedDependentPole,
    QuadraticRotorDrag,
    SecondOrderLag,
    TelemetryLag,
    CommandDeadZone,
    CommandSaturation,
    CommandQuantization,
    SlewRateLimit,
    MotorHeating,
    StaticOffset,
    StaticCubic,
    PivotCoulombFriction,
    PivotViscousFriction,
    QuadraticAirDrag,
    GravityPendulum,
    TorqueBias,
    CableStiffness,
    InflowDamping,
    ActuatorMismatch,
    GroundEffect,
    RotorLag,
    TorqueDelay,
    GyroBias,
    GyroScale,
    GyroLag,
}

/// A parameter's name and the range a random draw takes its size from.
struct Range {
    name: &'static str,
    low: f64,
    high: f64,
    signed: bool,
}

impl Range {
    fn middle(&self) -> f64 {
        f64::midpoint(self.low, self.high)
    }
}

struct Entry {
    id: &'static str,
    kind: HiddenKind,
    parameters: &'static [Range],
}

const fn size(name: &'static str, low: f64, high: f64) -> Range {
    Range { name, low, high, signed: false }
}

const fn either(name: &'static str, low: f64, high: f64) -> Range {
    Range { name, low, high, signed: true }
}

#[rustfmt::skip]
const LAWS: &[Entry] = &[
    Entry { id: "battery_sag", kind: HiddenKind::BatterySag, parameters: &[size("gain", 15.0, 60.0)] },
    Entry { id: "battery_scaling", kind: HiddenKind::BatteryScaling, parameters: &[] },
    Entry { id: "transport_delay", kind: HiddenKind::TransportDelay, parameters: &[size("delay", 0.01, 0.04)] },
    Entry { id: "asymmetric_pole", kind: HiddenKind::AsymmetricPole, parameters: &[size("ratio", 1.2, 2.0)] },
    Entry { id: "speed_dependent_pole", kind: HiddenKind::SpeedDependentPole, parameters: &[either("slope", 0.3, 0.9)] },
    Entry { id: "quadratic_rotor_drag", kind: HiddenKind::QuadraticRotorDrag, parameters: &[size("coefficient", 0.002, 0.01)] },
    Entry { id: "second_order_lag", kind: HiddenKind::SecondOrderLag, parameters: &[size("pole", 25.0, 80.0)] },
    Entry { id: "telemetry_lag", kind: HiddenKind::TelemetryLag, parameters: &[size("pole", 20.0, 80.0)] },
    Entry { id: "command_dead_zone", kind: HiddenKind::CommandDeadZone, parameters: &[size("width", 0.02, 0.08)] },
    Entry { id: "command_saturation", kind: HiddenKind::CommandSaturation, parameters: &[size("limit", 0.5, 0.6)] },
    Entry { id: "command_quantization", kind: HiddenKind::CommandQuantization, parameters: &[size("step", 0.01, 0.04)] },
    Entry { id: "slew_rate_limit", kind: HiddenKind::SlewRateLimit, parameters: &[size("rate", 600.0, 2500.0)] },
    Entry { id: "motor_heating", kind: HiddenKind::MotorHeating, parameters: &[size("gain", 0.02, 0.08), size("time_constant", 8.0, 40.0)] },
    Entry { id: "static_offset", kind: HiddenKind::StaticOffset, parameters: &[either("coefficient", 10.0, 50.0)] },
    Entry { id: "static_cubic", kind: HiddenKind::StaticCubic, parameters: &[either("coefficient", 1500.0, 6000.0)] },
    Entry { id: "pivot_coulomb_friction", kind: HiddenKind::PivotCoulombFriction, parameters: &[size("torque", 0.02, 0.08), size("smoothing_rate", 0.02, 0.04)] },
    Entry { id: "pivot_viscous_friction", kind: HiddenKind::PivotViscousFriction, parameters: &[size("coefficient", 0.03, 0.15)] },
    Entry { id: "quadratic_air_drag", kind: HiddenKind::QuadraticAirDrag, parameters: &[size("coefficient", 0.02, 0.1)] },
    Entry { id: "gravity_pendulum", kind: HiddenKind::GravityPendulum, parameters: &[size("moment", 0.2, 0.6), either("angle_offset", 0.0, 0.2)] },
    Entry { id: "torque_bias", kind: HiddenKind::TorqueBias, parameters: &[either("torque", 0.05, 0.2)] },
    Entry { id: "cable_stiffness", kind: HiddenKind::CableStiffness, parameters: &[size("stiffness", 0.15, 0.6)] },
    Entry { id: "inflow_damping", kind: HiddenKind::InflowDamping, parameters: &[size("coefficient", 2.0, 8.0)] },
    Entry { id: "actuator_mismatch", kind: HiddenKind::ActuatorMismatch, parameters: &[either("ratio", 0.02, 0.08)] },
    Entry { id: "ground_effect", kind: HiddenKind::GroundEffect, parameters: &[size("radius", 0.10, 0.15), size("height", 0.2, 0.3)] },
    Entry { id: "rotor_lag", kind: HiddenKind::RotorLag, parameters: &[size("pole", 25.0, 80.0)] },
    Entry { id: "torque_delay", kind: HiddenKind::TorqueDelay, parameters: &[size("delay", 0.01, 0.04)] },
    Entry { id: "gyro_bias", kind: HiddenKind::GyroBias, parameters: &[either("bias", 0.02, 0.1)] },
    Entry { id: "gyro_scale", kind: HiddenKind::GyroScale, parameters: &[size("scale", 1.05, 1.2)] },
    Entry { id: "gyro_lag", kind: HiddenKind::GyroLag, parameters: &[size("pole", 20.0, 80.0)] },
];

/// Parameters that a law may have.
const MOST_PARAMETERS: usize = 2;

// One more would be dropped without a word.
const _: () = {
    let mut index = 0;
    while index < LAWS.len() {
        assert!(LAWS[index].parameters.len() <= MOST_PARAMETERS);
        index += 1;
    }
};

/// A law with its numbers, as the plant's equations use it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HiddenLaw {
    pub kind: HiddenKind,
    /// Parameters in the order of the table; unused ones are zero.
    pub p: [f64; MOST_PARAMETERS],
}

impl HiddenLaw {
    pub fn build(config: &HiddenConfig) -> Result<Self, EmulateError> {
        let fault = |reason: String| EmulateError::Hidden { effect: config.effect.clone(), reason };
        let entry = LAWS.iter().find(|entry| entry.id == config.effect).ok_or_else(|| {
            let words: Vec<&str> = config.effect.split('_').filter(|word| word.len() > 2).collect();
            let is_like = |id: &&str| words.iter().any(|word| id.contains(word));
            let like: Vec<&str> = LAWS.iter().map(|entry| entry.id).filter(is_like).collect();
            let like =
                if like.is_empty() { String::new() } else { format!(" (like it: {})", like.join(", ")) };
            fault(format!("the emulator knows no such effect{like}; `rotorbench effects` lists all"))
        })?;
        if let Some(name) =
            config.parameters.keys().find(|name| !entry.parameters.iter().any(|range| range.name == **name))
        {
            let names: Vec<&str> = entry.parameters.iter().map(|range| range.name).collect();
            return Err(fault(format!("it has no parameter `{name}`, only [{}]", names.join(", "))));
        }
        let mut p = [0.0; MOST_PARAMETERS];
        for (slot, range) in p.iter_mut().zip(entry.parameters) {
            *slot = config.parameters.get(range.name).copied().unwrap_or(range.middle());
            // The sign of a size is part of the law: a negative delay or pole has no meaning.
            if !slot.is_finite() || (!range.signed && *slot < 0.0) {
                return Err(fault(format!("`{}` = {slot} cannot be", range.name)));
            }
        }
        config.check_ranges()?;
        if entry.kind == HiddenKind::GroundEffect && p[0] >= THRESHOLDS.largest_radius * p[1] {
            return Err(fault(format!("radius {} m is too large for a height of {} m", p[0], p[1])));
        }
        let divisor = match entry.kind {
            HiddenKind::AsymmetricPole | HiddenKind::CommandQuantization => p[0],
            HiddenKind::MotorHeating | HiddenKind::PivotCoulombFriction => p[1],
            _ => 1.0,
        };
        if divisor <= 0.0 {
            return Err(fault("ratio, step, time_constant and smoothing_rate must be above zero".to_owned()));
        }
        Ok(Self { kind: entry.kind, p })
    }
}

/// The hidden laws of one plant, each applied where it acts.
#[derive(Debug, Clone, Default)]
pub(super) struct Laws {
    known: Vec<HiddenLaw>,
    own: Vec<OwnLaw>,
    hover_command: f64,
}

impl Laws {
    pub fn build(hidden: &[HiddenConfig], plant: &PlantConfig) -> Result<Self, EmulateError> {
        let mut laws = Self { hover_command: plant.hover_command(), ..Self::default() };
        for config in hidden {
            match &config.expression {
                Some(text) => laws.own.push(OwnLaw::build(config, text)?),
                None => laws.known.push(HiddenLaw::build(config)?),
            }
        }
        Ok(laws)
    }

    /// First number of the law of this kind, where the plant hides one.
    pub fn number(&self, kind: HiddenKind) -> Option<f64> {
        self.known.iter().find(|law| law.kind == kind).map(|law| law.p[0])
    }

    pub fn known(&self) -> &[HiddenLaw] {
        &self.known
    }

    /// Whether there is any expression, for which a point has to be filled.
    pub fn has_own(&self) -> bool {
        !self.own.is_empty()
    }

    /// What the expressions add at `site`; one without a value adds nothing. `memories` are what they remember.
    pub fn own(&self, site: Site, point: &Point, memories: &[Option<f64>]) -> f64 {
        let here = self.own.iter().enumerate().filter(|(_, law)| law.site == site);
        let value = |(index, law): (usize, &OwnLaw)| {
            law.value(&Point { memory: memories.get(index).copied().flatten(), ..*point })
        };
        here.filter_map(value).sum()
    }

    /// What the expressions remember `span` [s] later, the point held.
    pub fn remember(&self, point: &Point, span: f64, memories: &mut Vec<Option<f64>>) {
        memories.resize(self.own.len(), None);
        for (law, memory) in self.own.iter().zip(memories) {
            *memory = law.remembered(*memory, point, span);
        }
    }

    /// What the ESC makes of a command.
    pub fn command(&self, mut u: f64) -> f64 {
        for HiddenLaw { kind, p } in &self.known {
            match kind {
                HiddenKind::CommandDeadZone => {
                    u = (u - p[0]).max(0.0) / (1.0 - p[0]).max(THRESHOLDS.least_command_span)
                }
                HiddenKind::CommandQuantization => u = (u / p[0]).round() * p[0],
                _ => {}
            }
        }
        // Where the speed controller ends, whatever it made of the command before.
        let limits = self.known.iter().filter(|law| law.kind == HiddenKind::CommandSaturation);
        limits.fold(u, |u, limit| u.min(limit.p[0]))
    }

    /// [rad/s] Steady rate z of the effective command `u` at `voltage`, with the heat state `heat`.
    pub fn steady_rate(&self, plant: &PlantConfig, u: f64, voltage: f64, heat: f64) -> f64 {
        // What the motor gets is what its whole curve is a function of, whichever law of the bench was named first.
        let scales = self.known.iter().any(|law| law.kind == HiddenKind::BatteryScaling);
        let u_motor = if scales { u * voltage / plant.full_voltage } else { u };
        let sag = if scales { 0.0 } else { plant.voltage_gain };
        let mut added = 0.0;
        let mut factor = 1.0;
        for HiddenLaw { kind, p } in &self.known {
            match kind {
                HiddenKind::BatterySag => added -= p[0] * (plant.full_voltage - voltage),
                HiddenKind::StaticOffset => added += p[0],
                HiddenKind::StaticCubic => {
                    let du = u_motor - self.hover_command;
                    added += p[0] * du * du * du;
                }
                HiddenKind::MotorHeating => factor -= p[0] * heat,
                _ => {}
            }
        }
        factor * (plant.steady_rate(u_motor) - sag * (plant.full_voltage - voltage) + added)
    }

    /// [rad/s²] Acceleration of a rotor at rate `w` towards `z`.
    pub fn rotor_acceleration(&self, plant: &PlantConfig, z: f64, w: f64) -> f64 {
        let mut pole = plant.pole;
        let mut drag = 0.0;
        for HiddenLaw { kind, p } in &self.known {
            match kind {
                HiddenKind::AsymmetricPole => pole *= if z > w { p[0] } else { 1.0 / p[0] },
                HiddenKind::SpeedDependentPole => {
                    pole *= (1.0 + p[0] * (w - plant.hover_rate) / plant.hover_rate)
                        .max(THRESHOLDS.smallest_pole_factor);
                }
                HiddenKind::QuadraticRotorDrag => drag += p[0] * w * w.abs(),
                _ => {}
            }
        }
        pole * (z - w) - drag
    }

    /// [N] Thrust of the rotor on `side` (+1 rotor 1, -1 rotor 2) turning at `w`.
    pub fn thrust(&self, plant: &PlantConfig, side: f64, w: f64, angle: f64, body_rate: f64) -> f64 {
        let mut thrust = plant.thrust_coefficient * w * w;
        for HiddenLaw { kind, p } in &self.known {
            match kind {
                // The rotor's own speed upwards thins its inflow.
                HiddenKind::InflowDamping => {
                    thrust -= p[0] * plant.thrust_coefficient * w * (side * plant.arm * body_rate);
                }
                HiddenKind::ActuatorMismatch => thrust *= 1.0 + side * p[0],
                HiddenKind::GroundEffect => {
                    let height =
                        (p[1] + side * plant.arm * angle.sin()).max(THRESHOLDS.closest_ground * p[0]);
                    let q = p[0] / (4.0 * height);
                    thrust /= 1.0 - q * q;
                }
                _ => {}
            }
        }
        thrust
    }

    /// [N m] Torque on the body besides the rotors'.
    pub fn body_torque(&self, angle: f64, rate: f64) -> f64 {
        let mut torque = 0.0;
        for HiddenLaw { kind, p } in &self.known {
            torque += match kind {
                HiddenKind::PivotCoulombFriction => -p[0] * (rate / p[1]).tanh(),
                HiddenKind::PivotViscousFriction => -p[0] * rate,
                HiddenKind::QuadraticAirDrag => -p[0] * rate * rate.abs(),
                HiddenKind::GravityPendulum => -p[0] * (angle + p[1]).sin(),
                HiddenKind::TorqueBias => p[0],
                HiddenKind::CableStiffness => -p[0] * angle,
                _ => 0.0,
            };
        }
        torque
    }

    /// [rad/s] What the gyro makes of the (perhaps filtered) body rate, before its noise.
    pub fn gyro(&self, mut rate: f64) -> f64 {
        for HiddenLaw { kind, p } in &self.known {
            match kind {
                HiddenKind::GyroBias => rate += p[0],
                HiddenKind::GyroScale => rate *= p[0],
                _ => {}
            }
        }
        rate
    }
}
