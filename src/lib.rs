//! A hardware-in-the-loop CAN bench for rotor actuators and single-axis attitude control.
//!
//! It closes the loop (ESC telemetry and IMU from a CAN bus, EMC or PID, ESC commands, a guard that
//! nothing gets past), and it tells its user what the model is missing (compare, diagnose, extend).
//! The science is Lotufo, Perez-Montenegro, Colangelo, Canuto, Novara, "Identification and control of
//! a quadrotor from experimental data", MED 2016, 10.1109/MED.2016.7535956, cited as `[LPC16] Eq. (n)`.
//!
//! # A first result
//!
//! A bench runs on the emulator with something in it that the model does not know; `diagnose` names it:
//!
//! ```
//! use rotorbench::{bench::BenchConfig, cancel::Cancel, diagnose::DiagnoseConfig, emulate::HiddenConfig, model::Model};
//! use rotorbench::{runtime::ExperimentPlan, session, session::Job};
//!
//! let cancel = Cancel::default();
//! let job = Job::unwatched(&cancel);
//! let mut bench = BenchConfig::default();
//! bench.emulator.hidden.push(HiddenConfig::parse("gravity_pendulum:moment=0.4")?);
//! let log = session::run_emulated(&bench, &ExperimentPlan::closed_loop_prbs(0.03, 20.0), "run", &job)?;
//! let found = session::diagnose(&Model::paper(), &[log], &[], &DiagnoseConfig::default(), &job)?;
//! assert_eq!(found.effects, ["gravity_pendulum"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! From here: [`session`] is what a person does with logs and models; [`control::Controller`] is what runs;
//! [`effect`] is what a model can lack; [`report`] makes sentences, tables and pages of results. The programs in
//! `examples/` read a log, compare, diagnose and extend, run a controller of one's own and find an effect of one's own.
//!
//! # Signs
//!
//! This drawing fixes every sign in the crate. The body turns about one axis, seen here end on; the
//! lever arm of each rotor is `d`.
//!
//! ```text
//!                 f1 (thrust, up)              f2 (thrust, up)
//!                  ^                            ^
//!                  |                            |
//!             [rotor 1]----- d ----(o)---- d ---[rotor 2]
//!                                 pivot
//!
//!       positive angle θ, rate ω_b, torque τ: rotor 1 goes up, rotor 2 goes down
//!       torque = d (f1 - f2)
//! ```
//!
//! **Deviation:** [LPC16] Eq. (1) prints `f_p2 - f_p1`, its Eqs. (12)-(16) `f_p1 - f_p2`; the second is used
//! throughout, so that `u_x = g(u1) - g(u2) > 0` drives the angle up.
//!
//! # Units
//!
//! Inside: SI `f64` (rad, rad/s, s, kg m², N, N m, V, A); each public field's doc starts with its unit. Other
//! units exist only at edges and always show in the name (`_deg`, `_rpm`, `_ms`, `_ns`).

// Each place that needs it says so with its reason; `tests/architecture/unsafe_code.rs` lists their files.
#![deny(unsafe_code)]

pub mod bench;
pub mod bus_guard;
pub mod can;
pub mod cancel;
pub mod cells;
pub mod cli;
pub mod clock;
pub mod compare;
pub mod control;
pub mod diagnose;
pub mod discover;
pub mod effect;
pub mod emulate;
pub mod estimation;
pub mod experiment;
pub mod file;
pub mod fleet;
pub mod guard;
pub mod identify;
pub mod log;
pub mod memory;
pub mod model;
pub mod recording;
pub mod report;
pub mod rt;
pub mod runtime;
pub mod screening;
pub mod session;
pub mod shm;
pub mod signal;
pub mod studies;
pub mod threads;
pub mod threshold;
pub mod thresholds_page;
pub mod unit;
pub mod workbench;

/// As the program has it.
#[cfg(test)]
#[global_allocator]
static MEMORY: memory::LongBlocks = memory::LongBlocks;
