//! Residuals, comparison, search for the missing effect, extension.

pub mod abreast;
pub mod answer;
mod battery;
mod benches;
mod blocks;
pub mod body;
pub mod compare;
pub mod dependence;
mod expressions;
mod extend;
pub mod logs;
pub mod noise;
pub mod plan;
pub mod prepare;
pub mod problem;
mod refit;
pub mod rotor;
mod run;
mod scan;
pub mod search;
mod settle;
pub mod stage;
pub mod surrogate;
pub mod trial;
mod verdict;
mod warnings;
mod worth;

pub use answer::{Diagnosis, Verdict};
pub use extend::{Extension, extend};
pub use run::{DiagnoseConfig, DiagnoseError, diagnose};
