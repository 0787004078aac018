//! The CAN room through its public face, without a bus.

mod bad_input;
mod bad_input_spoken;
mod fuzz;
mod golden;
mod roles;
