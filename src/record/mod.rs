//! Recordings and logs: write, read, import, `Dataset`.

pub mod dataset;
pub mod log;

pub use dataset::{Dataset, DatasetError};
