//! Real-time thread set-up, the periodic cycle, its statistics.

mod cycle;
mod log;
mod machine;
mod shutdown;
mod statistics;
mod thread;
mod usage;
mod wait;

pub use cycle::{Cycle, Release};
pub use log::{LogLine, LogQueue, LogWriter, Severity};
pub use machine::Machine;
pub use shutdown::{Shutdown, cancel_on_signals};
pub use statistics::{Percentiles, Statistics, Summary, histogram, record};
pub use thread::{Granted, RealTimeConfig, RealTimeError};
pub use usage::Usage;
pub use wait::{Wake, wait, wait_from, wait_timed};
