//! What a free run of the body takes and gives.

use crate::cells::Cells;

/// Inputs of the body over a stretch without holes. Means are over the interval after each sample.
#[derive(Debug, Clone, Default)]
pub struct BodyInput {
    /// [s] rising.
    pub time: Cells,
    /// [N m] mean torque of the actuators, delayed and lagged as the model says.
    pub torque: Vec<f64>,
    /// [rad/s] mean rate of each rotor; empty when the log has none.
    pub propeller_rate: [Vec<f64>; 2],
}

/// Where a free run starts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyStart {
    /// [rad] θ.
    pub angle: f64,
    /// [rad/s] ω_b.
    pub rate: f64,
    /// [rad/s] by how much a sensor with memory reads beside the true rate.
    pub sensor: f64,
}

/// What a free run gives, at the samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyTrace {
    /// [rad/s] what the gyroscope would read.
    pub rate: Vec<f64>,
    /// [rad] θ.
    pub angle: Vec<f64>,
}
