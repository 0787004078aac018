//! Why a mapping cannot be used.

use std::path::PathBuf;

use super::shipped::SHIPPED;

/// Why a mapping cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MappingError {
    /// Neither a shipped mapping nor a file.
    #[error("no mapping `{name}`: not a file, and not one of {}", shipped_names())]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// The file system said no.
    #[error("{path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not TOML, or not a mapping.
    #[error("{path}: {message}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        message: String,
    },
    /// A signal cannot be mapped so.
    #[error("{path}: signal `{signal}`: {reason}")]
    Signal {
        /// The file.
        path: PathBuf,
        /// Name of the signal.
        signal: String,
        /// What is wrong.
        reason: String,
    },
    /// Something else in the file is wrong.
    #[error("{path}: {reason}")]
    Setting {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

fn shipped_names() -> String {
    SHIPPED.iter().map(|(name, _)| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}
