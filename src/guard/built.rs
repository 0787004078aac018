//! A built guard: what it holds the bench to.

use super::signals::SignalLimit;
use super::speed_model::{Lacks, SpeedCheck, SpeedModel};
use crate::model::Model;
use crate::signal::Channel;

/// What an experiment must fit into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// [-] highest command that leaves.
    pub maximum: f64,
    /// [1/s] fastest change of a command.
    pub slew_per_s: f64,
}

/// A built guard.
#[derive(Debug, Clone, PartialEq)]
pub struct Guard {
    pub(super) limits: Limits,
    pub(super) period_ns: u64,
    pub(super) hold_ns: u64,
    /// By which what is due in a period may be late.
    pub(super) lateness_ns: u64,
    /// After which the command in force counts as held.
    pub(super) held_ns: u64,
    /// For which a controller may leave newer sensors unanswered before that degrades.
    pub(super) unanswered_ns: u64,
    pub(super) hold_periods: u32,
    pub(super) ramp_periods: u32,
    pub(super) time_to_live_ns: u64,
    pub(super) spin_up_ns: u64,
    pub(super) bucket_limit: f64,
    pub(super) bucket_leak: f64,
    pub(super) swing_limit: f64,
    pub(super) arm_checks_ns: u64,
    pub(super) arm_timeout_ns: u64,
    pub(super) request_time_to_live_ns: u64,
    pub(super) speed: Option<SpeedModel>,
    pub(super) signals: [SignalLimit; Channel::WATCHED.len()],
}

impl Guard {
    /// What an experiment must fit into.
    #[must_use]
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Signals without which the bench is neither armed nor kept running, each with the age [ns] at which it is
    /// stale.
    pub fn requirements(&self) -> impl Iterator<Item = (Channel, u64)> + '_ {
        let signals = Channel::WATCHED.into_iter().zip(&self.signals);
        signals.filter(|(_, limit)| limit.required).map(|(channel, limit)| (channel, limit.stale_after_ns))
    }

    /// N: periods that a command is held.
    #[must_use]
    pub fn hold_periods(&self) -> u32 {
        self.hold_periods
    }

    /// Periods from the end of the hold to zero.
    #[must_use]
    pub fn ramp_periods(&self) -> u32 {
        self.ramp_periods
    }

    /// [ns] age at which a command may no longer leave.
    #[must_use]
    pub fn time_to_live_ns(&self) -> u64 {
        self.time_to_live_ns
    }

    /// What is seen of rotors that do not turn as commanded; `None` = the speeds are not held against the commands.
    #[must_use]
    pub fn speed_check(&self) -> Option<SpeedCheck> {
        self.speed.as_ref().map(SpeedModel::looks)
    }

    /// What of `model` keeps rotors from being held against it; `None` = nothing.
    #[must_use]
    pub fn lacks_for_speed_check(model: &Model) -> Option<Lacks> {
        SpeedModel::lacks(model)
    }
}
