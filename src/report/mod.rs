//! Tables and plots for people: one self-contained page that works offline, pictures, terminal tables.
//!
//! A [`Page`] is a list of blocks. It is saved as a single HTML file with everything inside (no network, no
//! second file): plots zoom, show values under the cursor and hide a curve by a click on its name.
//!
//! ```
//! use rotorbench::report::{Axis, Bars, Mark, Page, Plot, Series, TextTable, Tone, number};
//!
//! let time: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.02).collect();
//! let measured: Vec<f64> = time.iter().map(|t| (t * 2.0).sin() * 600.0).collect();
//! let modelled: Vec<f64> = time.iter().map(|t| (t * 2.0 - 0.05).sin() * 590.0).collect();
//! let residual: Vec<f64> = measured.iter().zip(&modelled).map(|(a, b)| a - b).collect();
//!
//! let mut page = Page::new("Where the model fails");
//! page.verdict(Mark::Bad, "The actuator model misses 58 rad/s of the rotor's rate.")
//!     .heading("Rotor 1")
//!     .paragraph("Free run on `step.csv`, driven by the measured command.")
//!     .table(
//!         TextTable::new(["quantity", "value", "standard error", "unit"])
//!             .caption("Fitted parameters")
//!             .row(["pole p".to_owned(), number(16.012, 4), number(0.02, 2), "rad/s".to_owned()]),
//!     )
//!     .plot(
//!         Plot::new("Rotor rate", Axis::new("time", "s"), Axis::new("ω_p", "rad/s"))
//!             .group("rotor 1") // plots of one group zoom together
//!             .series(Series::line("measured", &time, &measured).tone(Tone::Measured))
//!             .series(Series::line("model", &time, &modelled).tone(Tone::Model))
//!             .span("hole in the log", 3.1, 3.4),
//!     )
//!     .plot(
//!         Plot::new("Residual", Axis::new("time", "s"), Axis::new("error", "rad/s"))
//!             .group("rotor 1")
//!             .height(160)
//!             .series(Series::line("measured - model", &time, &residual).tone(Tone::Residual))
//!             .level("noise floor", 1.5),
//!     )
//!     .bars(
//!         Bars::new("Held-out error of every candidate", "rad/s")
//!             .bar("without delay", 24.0, Mark::Good)
//!             .bar("without heating", 46.8, Mark::Plain)
//!             .level("noise floor", 20.1)
//!             .level("best by chance", 44.9),
//!     );
//! let html = page.emit();
//! assert!(html.contains("Where the model fails"));
//! ```
//!
//! The same [`Plot`] becomes a picture with [`Plot::svg`], the same [`TextTable`] terminal text with
//! [`TextTable::text`]; [`sparkline`] draws a signal in one line of text.

mod bars;
mod card_sentence;
pub mod check;
pub mod comparison;
mod decimate;
pub mod demo;
pub mod design;
pub mod deviations;
pub mod diagnosis;
pub mod discovery;
pub mod doctor;
pub mod dronecan;
pub mod effects;
pub mod export;
pub mod files;
pub mod findings;
pub mod fleet;
mod found_parameters;
pub mod guard;
pub mod guess;
pub mod histogram;
mod identification;
pub mod import;
pub mod jitter;
pub mod json;
mod markup;
pub mod measure;
pub mod monitor;
pub mod next_steps;
pub mod not_named;
pub mod notes;
mod page;
pub mod paper;
mod picture;
mod plot;
pub mod replay;
pub mod rotors;
pub mod run_summary;
mod runs;
pub mod shell;
pub mod story;
mod table;
pub mod thresholds;
pub mod usage_tip;
pub mod verdict;
pub mod workbench;
mod wrapped;

pub use bars::Bars;
pub use page::{PALETTE, Page, UPLOT_SCRIPT, UPLOT_STYLE};
pub use plot::{Axis, Plot, Series, Tone};
pub use table::{Mark, TextTable, number, sparkline};

/// A report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file could not be written; what was there before is untouched.
    #[error("cannot write report {path}")]
    Write {
        /// File it was for.
        path: String,
        /// The operating system's answer.
        source: std::io::Error,
    },
}

/// Writes `text` to `path`: a failure leaves the old file as it was.
fn write_atomically(path: &std::path::Path, text: &str) -> Result<(), ReportError> {
    crate::file::write_atomically(path, text.as_bytes())
        .map_err(|source| ReportError::Write { path: path.display().to_string(), source })
}
