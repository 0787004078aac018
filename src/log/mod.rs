//! Logs: the table of samples that fitting reads ([`Dataset`]), one file for each format it comes from, and export.

pub mod can_capture;
pub mod candump;
pub mod csv;
pub mod dataset;
pub mod export;
pub mod lines;
pub mod mapped_csv;
pub mod mapping;
pub mod segments;

pub use dataset::Dataset;
pub use dataset::DatasetError;
pub use dataset::LOG_SIGNALS;
pub use mapped_csv::ForeignError;
pub use mapped_csv::Notes;
pub use mapping::Mapping;
