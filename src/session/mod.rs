//! What a person does with logs and models: open, compare, identify, diagnose, extend, step back, save; export and
//! replay recordings; and what a bench file and a machine are good for.
//!
//! Each function takes what it works on and a [`Job`], which hears of progress and may be cancelled, and returns a result,
//! never text: `report` makes text of it, and the command line and every other surface are shells around both.
//!
//! A first result in ten lines stands on the [front page](crate#a-first-result); whole programs are `examples/read_log.rs`,
//! `examples/compare.rs`, `examples/diagnose.rs` and `examples/own_effect.rs`.

mod bench_check;
mod compare;
mod control_loop;
mod diagnose;
mod discover;
mod dronecan_allocate;
mod dronecan_error;
mod dronecan_nodes;
mod dronecan_own_id;
mod dronecan_parameters;
mod dronecan_wire;
mod emulated_run;
mod error;
mod export;
mod extend;
mod guess;
mod identify;
mod job;
mod machine;
mod modelled;
mod models;
mod open;
mod replay;
mod replay_error;
mod rotors;
pub mod thresholds;

pub use bench_check::{BenchCheck, InterfaceLook, SpeedCheckRow};
pub use compare::{compare, compare_extension, compare_runs};
pub use control_loop::{ClosedLoop, ControlDesign, ControlLoop, Eigenvalue, EmcDesign};
pub use diagnose::diagnose;
pub use discover::discover;
pub use dronecan_allocate::{AllocateError, AllocationTask, allocate_node_ids};
pub use dronecan_error::ParameterError;
pub use dronecan_nodes::dronecan_nodes;
pub use dronecan_parameters::{ParameterTask, dronecan_parameters};
pub use emulated_run::run_emulated;
pub use error::{ChoiceError, SessionError};
pub use export::{ExportPart, export};
pub use extend::{Extended, extend, refit};
pub use guess::{GuessedLog, guess_columns};
pub use identify::identify;
pub use job::{Job, Progress};
pub use machine::{Grade, MachineCheck, check_machine};
pub use models::{name_after, open_model, save_model, step_back};
pub(crate) use open::addressed;
pub use open::{
    OpenConfig, Opened, between, open, open_all, open_mapped, require_rotors, rotors, save_log, summarize,
};
pub use replay::{ReplayTask, Replayed, replay};
pub use replay_error::{ReplayError, SetError};
pub use rotors::{diagnose_each, many_rotors};
