//! Recordings, their replay and export, foreign logs, the doctor, and the timing of this machine: one binary, because each links everything.

use std::process::{Command, Output};

mod bench_refused;
mod capture;
mod doctor;
mod foreign;
mod import;
mod jitter;
#[path = "../json_schema/mod.rs"]
mod json_schema;
mod kept;
mod overwritten;
mod recording;
mod refused;
mod replay;
mod sensors;

/// Runs the program to its end.
fn rotorbench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rotorbench")).args(arguments).output().expect("the program starts")
}
