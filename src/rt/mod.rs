//! Real-time thread set-up, the periodic cycle, its statistics.

use serde::{Deserialize, Serialize};

/// The `[real_time]` table of the bench file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RealTimeConfig {}
