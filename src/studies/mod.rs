//! Experiments on the system itself: the paper's figures, jitter, controllers beside each other on one recording.

pub mod controller_comparison;
pub mod impulse_response;
pub mod jitter;
pub mod paper;
mod strike;
pub mod thresholds;
