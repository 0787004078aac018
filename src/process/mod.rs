//! The bodies of the processes: bridge, control, run, record.

pub mod lockstep;
pub mod pilot;
pub mod trace;
