//! What the adversary may hide, on which bench it shows there, and how strong it is drawn.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::plant::Hidden;

/// Which log an effect shows in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Actuator,
    Attitude,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Actuator => "actuator",
            Self::Attitude => "attitude",
        }
    }
}

/// How a parameter is drawn.
#[derive(Debug, Clone, Copy)]
pub enum Draw {
    /// Log-uniform size.
    Size(f64, f64),
    /// Log-uniform size of either sign.
    Signed(f64, f64),
    /// A factor whose distance from one is log-uniform, above or below one.
    Factor(f64, f64),
    /// Uniform, either sign included.
    Uniform(f64, f64),
}

impl Draw {
    pub fn take(self, rng: &mut ChaCha8Rng) -> f64 {
        let mut size = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
        match self {
            Self::Size(low, high) => size(low, high),
            Self::Signed(low, high) => {
                let value = size(low, high);
                if rng.random_bool(0.5) { value } else { -value }
            }
            Self::Factor(low, high) => {
                let factor = 1.0 + size(low, high);
                if rng.random_bool(0.5) { factor } else { 1.0 / factor }
            }
            Self::Uniform(low, high) => low + (high - low) * rng.random::<f64>(),
        }
    }

    /// The same near the end at which it does next to nothing: three times that at the most. A pole, and a limit of a rate, do
    /// so where they are large.
    pub fn weak(self, name: &str, rng: &mut ChaCha8Rng) -> f64 {
        let factor = 3.0_f64.powf(rng.random::<f64>());
        match self {
            Self::Size(_, high) if ["pole", "rate"].contains(&name) => high / factor,
            Self::Size(low, high) if name == "time_constant" => Self::Size(low, high).take(rng),
            Self::Size(low, _) => Self::Size(low, 1.0001 * low).take(rng) * factor,
            Self::Signed(low, _) => Self::Signed(low, 1.0001 * low).take(rng) * factor,
            Self::Factor(low, _) => Self::Factor(factor * low, 1.0001 * factor * low).take(rng),
            Self::Uniform(..) => self.take(rng),
        }
    }
}

/// An effect the adversary can hide: from barely visible to strong.
pub struct Entry {
    pub id: &'static str,
    pub actuator: bool,
    pub attitude: bool,
    pub parameters: &'static [(&'static str, Draw)],
    pub hide: fn(&mut Hidden, &[f64]),
}

impl Entry {
    /// Whether it has an end at which it does next to nothing.
    pub fn weakens(&self) -> bool {
        !["battery_scaling", "command_saturation", "ground_effect"].contains(&self.id)
    }
}

use Draw::{Factor, Signed, Size, Uniform};

/// What the paper's model has already: asked about with a model that lacks it, and not in pairs.
pub const SAG: Entry = Entry {
    id: "battery_sag",
    actuator: true,
    attitude: true,
    parameters: &[("gain", Size(4.0, 80.0))],
    hide: |h, p| h.battery_sag = p[0],
};

/// Every effect of the catalogue but `battery_sag`.
/// Rate laws show on both benches, but for the ones whose cause an attitude bench hardly visits.
#[rustfmt::skip]
pub const ENTRIES: &[Entry] = &[
    Entry { id: "battery_scaling", actuator: true, attitude: true, parameters: &[],
            hide: |h, _| h.battery_scaling = true },
    Entry { id: "transport_delay", actuator: true, attitude: true, parameters: &[("delay", Size(0.002, 0.05))],
            hide: |h, p| h.transport_delay = p[0] },
    Entry { id: "asymmetric_pole", actuator: true, attitude: true, parameters: &[("ratio", Factor(0.02, 0.6))],
            hide: |h, p| h.asymmetric_pole = p[0] },
    Entry { id: "speed_dependent_pole", actuator: true, attitude: false, parameters: &[("slope", Signed(0.04, 0.7))],
            hide: |h, p| h.speed_dependent_pole = p[0] },
    Entry { id: "quadratic_rotor_drag", actuator: true, attitude: false, parameters: &[("coefficient", Size(4e-4, 1e-2))],
            hide: |h, p| h.quadratic_rotor_drag = p[0] },
    Entry { id: "second_order_lag", actuator: true, attitude: true, parameters: &[("pole", Size(25.0, 400.0))],
            hide: |h, p| h.second_order_lag = p[0] },
    Entry { id: "telemetry_lag", actuator: true, attitude: true, parameters: &[("pole", Size(25.0, 400.0))],
            hide: |h, p| h.telemetry_lag = p[0] },
    Entry { id: "command_dead_zone", actuator: true, attitude: false, parameters: &[("width", Size(0.004, 0.1))],
            hide: |h, p| h.command_dead_zone = p[0] },
    Entry { id: "command_saturation", actuator: true, attitude: false, parameters: &[("limit", Uniform(0.49, 0.64))],
            hide: |h, p| h.command_saturation = p[0] },
    Entry { id: "command_quantization", actuator: true, attitude: true, parameters: &[("step", Size(0.003, 0.03))],
            hide: |h, p| h.command_quantization = p[0] },
    Entry { id: "slew_rate_limit", actuator: true, attitude: true, parameters: &[("rate", Size(1_000.0, 15_000.0))],
            hide: |h, p| h.slew_rate_limit = p[0] },
    Entry { id: "motor_heating", actuator: true, attitude: false,
            parameters: &[("gain", Size(0.004, 0.1)), ("time_constant", Size(5.0, 40.0))],
            hide: |h, p| h.motor_heating = [p[0], p[1]] },
    Entry { id: "static_offset", actuator: true, attitude: false, parameters: &[("coefficient", Signed(3.0, 80.0))],
            hide: |h, p| h.static_offset = p[0] },
    Entry { id: "static_cubic", actuator: true, attitude: false, parameters: &[("coefficient", Signed(300.0, 8_000.0))],
            hide: |h, p| h.static_cubic = p[0] },
    Entry { id: "pivot_coulomb_friction", actuator: false, attitude: true, parameters: &[("torque", Size(0.0015, 0.09))],
            hide: |h, p| h.pivot_coulomb_friction = p[0] },
    Entry { id: "pivot_viscous_friction", actuator: false, attitude: true, parameters: &[("coefficient", Size(0.001, 0.1))],
            hide: |h, p| h.pivot_viscous_friction = p[0] },
    Entry { id: "quadratic_air_drag", actuator: false, attitude: true, parameters: &[("coefficient", Size(0.001, 0.06))],
            hide: |h, p| h.quadratic_air_drag = p[0] },
    Entry { id: "gravity_pendulum", actuator: false, attitude: true,
            parameters: &[("moment", Size(0.01, 0.7)), ("angle_offset", Uniform(-0.25, 0.25))],
            hide: |h, p| h.gravity_pendulum = [p[0], p[1]] },
    Entry { id: "torque_bias", actuator: false, attitude: true, parameters: &[("torque", Signed(0.001, 0.15))],
            hide: |h, p| h.torque_bias = p[0] },
    Entry { id: "cable_stiffness", actuator: false, attitude: true, parameters: &[("stiffness", Size(0.005, 0.8))],
            hide: |h, p| h.cable_stiffness = p[0] },
    Entry { id: "inflow_damping", actuator: false, attitude: true, parameters: &[("coefficient", Size(1.0, 60.0))],
            hide: |h, p| h.inflow_damping = p[0] },
    Entry { id: "actuator_mismatch", actuator: false, attitude: true, parameters: &[("ratio", Signed(0.0005, 0.08))],
            hide: |h, p| h.actuator_mismatch = p[0] },
    Entry { id: "ground_effect", actuator: false, attitude: true,
            parameters: &[("radius", Uniform(0.1, 0.15)), ("height", Size(0.18, 0.5))],
            hide: |h, p| h.ground_effect = [p[0], p[1]] },
    Entry { id: "rotor_lag", actuator: false, attitude: true, parameters: &[("pole", Size(15.0, 300.0))],
            hide: |h, p| h.rotor_lag = p[0] },
    Entry { id: "torque_delay", actuator: false, attitude: true, parameters: &[("delay", Size(0.002, 0.04))],
            hide: |h, p| h.torque_delay = p[0] },
    Entry { id: "gyro_bias", actuator: false, attitude: true, parameters: &[("bias", Signed(0.001, 0.12))],
            hide: |h, p| h.gyro_bias = p[0] },
    Entry { id: "gyro_scale", actuator: false, attitude: true, parameters: &[("scale", Factor(0.002, 0.15))],
            hide: |h, p| h.gyro_scale = p[0] },
    Entry { id: "gyro_lag", actuator: false, attitude: true, parameters: &[("pole", Size(20.0, 400.0))],
            hide: |h, p| h.gyro_lag = p[0] },
];

impl Entry {
    pub fn shows_on(&self, kind: Kind) -> bool {
        match kind {
            Kind::Actuator => self.actuator,
            Kind::Attitude => self.attitude,
        }
    }
}
