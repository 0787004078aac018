//! Tests on a real CAN bus. They need a kernel with `vcan` and the right to make interfaces, and fail without:
//! `tools/test` runs them under `tools/vcan`, and a bare `cargo test` leaves them out (`test = false`).

mod allocation;
mod answers;
mod bus;
#[path = "../processes/counting.rs"]
mod counting;
mod dronecan;
mod dronecan_nodes;
mod ends;
mod faults;
mod flood;
mod foreign;
mod imu;
mod jitter;
#[path = "../json_schema/mod.rs"]
mod json_schema;
mod log;
mod port;
#[path = "../processes/mod.rs"]
mod processes;
mod three_processes;
mod vendors;
