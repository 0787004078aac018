//! Residuals, comparison, search for the missing effect, extension.

pub mod compare;
