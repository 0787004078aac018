//! Logs: the table of samples that fitting reads ([`Dataset`]), one file for each format it comes from, and export.

pub mod can_capture;
pub mod candump;
pub mod csv;
pub mod dataset;
pub mod export;
pub mod foreign_error;
pub mod import_notes;
pub mod lines;
pub mod mapped_csv;
pub mod mapping;
pub mod segments;
pub mod thresholds;

pub use dataset::Dataset;
pub use dataset::DatasetError;
pub use dataset::LOG_SIGNALS;
pub use foreign_error::ForeignError;
pub use import_notes::Notes;
pub use mapping::Mapping;
