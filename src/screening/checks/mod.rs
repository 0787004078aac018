//! The checks of a log, one file each.

pub mod battery_range;
pub mod battery_reading;
pub mod body_held;
pub mod column_names;
pub mod frozen_gyro;
pub mod outliers;
pub mod rate_dropout;
pub mod sample_and_hold;
pub mod saturation;
pub mod transient_behind_hole;
pub mod uncommanded_motion;
