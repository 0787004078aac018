//! Many benches: each diagnosed by itself, in any order, on as many machines as there are; then what they have in common, and
//! which of them differ.
//!
//! A [`Plan`] lists benches. [`run`] diagnoses those of one shard; each answer is a file that appears whole or not at all, named
//! after its bench and the hash of its inputs, so that what is there already is not done again. [`merge`] reads the answers,
//! whatever the order in which they came, and makes a [`Fleet`] of them.

mod answer;
mod error;
mod inputs;
mod merge;
mod plan;
mod run;
mod summary;
pub mod thresholds;

pub use answer::{BenchAnswer, DiagnosisExtract, Errors};
pub use error::FleetError;
pub use merge::merge;
pub use plan::{FleetBench, Plan};
pub use run::{AnswerAndPage, Diagnosed, Shard, ShardEvent, Writer, run};
pub use summary::{BenchRow, EffectCount, Fleet, ParameterSpread, VerdictCount};
