//! Is a log fit to be believed? Checks that need no fit: outliers, dropouts, sample-and-hold, frozen and saturated sensors,
//! units, copies of a log, excitation.

pub mod attitude_units;
pub mod battery_range;
pub mod duplicate_logs;
pub mod excitation;
pub mod finding;
pub mod frozen_gyro;
pub mod missing_commands;
pub mod outliers;
pub mod plausibility;
pub mod rate_dropouts;
pub mod readings;
pub mod requirements;
pub mod rotor_data;
pub mod sample_and_hold;
pub mod saturation;
pub mod summary;
pub mod uncommanded_motion;

pub use finding::{Evidence, Finding};
