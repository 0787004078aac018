//! The CAN room through its public face, without a bus.

mod bad_input;
mod fuzz;
mod golden;
mod roles;
