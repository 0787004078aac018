//! Real-time thread set-up, the periodic cycle, its statistics.

mod cycle;
mod fault;
mod log;
mod machine;
mod rights;
mod shutdown;
mod statistics;
mod thread;
mod usage;
mod wait;

pub use cycle::{Cycle, Release};
pub use fault::{memory_is_lost, survive_lost_memory};
pub use log::{LogLine, LogQueue, LogWriter, Severity};
pub use machine::Machine;
pub use rights::{Rights, priority_limit};
pub use shutdown::{Shutdown, cancel_on_signals, end_alone, report_file_limits_as_errors};
pub use statistics::{Percentiles, Statistics, Summary, histogram, record};
pub use thread::{Granted, RealTimeConfig, RealTimeError};
pub use usage::Usage;
pub use wait::{Wake, wait, wait_from, wait_timed};
