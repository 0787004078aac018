//! The bodies of the processes: bridge, control, run, record.
