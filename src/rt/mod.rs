//! Real-time thread set-up, the periodic cycle, its statistics.

mod cycle;
mod log;
mod shutdown;
mod thread;
mod wait;

pub use cycle::{Cycle, Percentiles, Release, Statistics, Summary};
pub use log::{Clerk, LogLine, LogQueue, Severity};
pub use shutdown::Shutdown;
pub use thread::{Granted, RealTimeConfig, RealTimeError};
pub use wait::{Wake, wait};
