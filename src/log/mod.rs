//! Logs: the table of samples that fitting reads ([`Dataset`]), one file for each format it comes from, and export.
//!
//! A program that reads one, of whatever format: `examples/read_log.rs`.

pub mod asc;
pub mod betaflight;
pub mod blf;
pub(crate) mod bytes;
pub mod can_capture;
pub mod candump;
pub mod csv;
mod csv_blocks;
mod csv_header;
mod csv_parts;
mod csv_table;
pub mod dataflash;
pub mod dataset;
pub mod export;
pub mod foreign_error;
pub mod format;
pub mod formats;
pub mod guess;
pub mod import_notes;
mod limited;
pub mod limits;
pub mod lines;
pub mod mapped;
pub mod mapping;
pub mod mended;
pub mod narrow_range;
mod number;
pub mod parquet;
mod row_clock;
mod row_filter;
pub mod segments;
pub mod signals;
pub mod sniff;
mod table_clock;
pub mod tables;
mod text_tail;
pub mod thresholds;
pub mod ulog;
pub mod unreadable;

pub use crate::cells::Cells;
pub use dataset::Dataset;
pub use dataset::DatasetError;
pub use foreign_error::ForeignError;
pub use import_notes::Notes;
pub use mapping::Mapping;
pub use signals::LOG_SIGNALS;
