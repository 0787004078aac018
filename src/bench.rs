//! The bench file: one TOML that every process of a bench reads. Each table belongs to the room that
//! uses it; this room only puts them together and checks what spans several.

use serde::{Deserialize, Serialize};

use crate::can::BusConfig;
use crate::control::ControllerConfig;
use crate::emulate::EmulatorConfig;
use crate::guard::GuardConfig;
use crate::rt::RealTimeConfig;
use crate::shm::SharedMemoryConfig;

/// What starts a control step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Trigger {
    /// The paper's fixed T_c: an absolute-time grid.
    #[default]
    Timer,
    /// The arrival of the IMU frame.
    Imu,
}

/// The bench file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BenchConfig {
    /// Name of the bench: prefix of its shared-memory services, so that two benches never meet.
    pub name: String,
    /// [s] control period T_c. [LPC16] Table IV.
    pub period_s: f64,
    /// What starts a control step.
    pub trigger: Trigger,
    /// Model file, or `paper` for the built-in Tables I and IV.
    pub model: String,
    /// Real-time settings.
    pub real_time: RealTimeConfig,
    /// Who may open the bench's services.
    pub shared_memory: SharedMemoryConfig,
    /// Controller, its gains and its reference.
    pub controller: ControllerConfig,
    /// Guard limits.
    pub guard: GuardConfig,
    /// CAN bus, DBC files and roles of signals.
    pub bus: BusConfig,
    /// The plant emulator.
    pub emulator: EmulatorConfig,
}

impl Default for BenchConfig {
    fn default() -> Self {
        Self {
            name: "bench".to_owned(),
            period_s: 0.02,
            trigger: Trigger::default(),
            model: "paper".to_owned(),
            real_time: RealTimeConfig::default(),
            shared_memory: SharedMemoryConfig::default(),
            controller: ControllerConfig::default(),
            guard: GuardConfig::default(),
            bus: BusConfig::default(),
            emulator: EmulatorConfig::default(),
        }
    }
}
