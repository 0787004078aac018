//! Residuals, comparison, search for the missing effect, extension.

mod battery_permutation;
pub mod block_builder;
pub mod block_data;
mod blocks;
pub mod body_block;
pub mod candidate;
pub mod candidate_fit;
mod caveats;
pub mod data_split;
pub mod diagnosis;
pub mod driver_inference;
mod extend;
mod grid_search;
mod model_selection;
pub mod multistart;
pub mod parallel;
mod parameter_selection;
mod pooled_logs;
pub mod problem;
mod refit;
pub mod rotor_block;
mod run;
pub mod search;
pub mod surrogate_test;
mod verdict;

pub use diagnosis::{Diagnosis, Verdict};
pub use extend::{Extension, extend};
pub use run::{DiagnoseConfig, DiagnoseError, diagnose};
