//! The CAN room through its public face, without a bus and without the program: `tools/mutants` makes a crate of the room and
//! these tests alone.

mod bad_input;
mod dronecan;
mod dronecan_allocation;
mod dronecan_bench;
mod dronecan_fd;
mod dronecan_others;
mod dronecan_param;
mod dronecan_random;
mod dronecan_refused;
mod fuzz;
mod golden;
mod roles;
