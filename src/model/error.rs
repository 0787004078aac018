//! Why a model cannot be read, written or used.

use std::collections::BTreeSet;
use std::io;
use std::path::PathBuf;

use crate::effect::{CATALOGUE, ExpressionError};
use crate::file::MappingPlace;

use super::thresholds::THRESHOLDS;

/// Why a model cannot be read, written or used.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file system said no.
    #[error("model file {path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Not the TOML of a model.
    #[error("{path}: {reason}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        reason: String,
    },
    /// The other kind of file.
    #[error(
        "{path} is a bench file, and a model is wanted here: `paper`, or what `identify -o` wrote; bench files go to `--config`"
    )]
    IsBench {
        /// The file.
        path: PathBuf,
    },
    /// What the columns of a log mean.
    #[error(
        "{path} is a mapping, and a model is wanted here: `paper`, or what `identify -o` wrote; mappings go to {place}"
    )]
    IsMapping {
        /// The file.
        path: PathBuf,
        /// Where mappings go.
        place: MappingPlace,
    },
    /// No model at all.
    #[error(
        "{path} is a log, and a model is wanted here: `paper`, or what `identify -o` wrote; logs go to `--log` and `--validate`"
    )]
    IsLog {
        /// The file.
        path: PathBuf,
    },
    /// It names an effect that does not exist.
    #[error("unknown effect `{id}`{}", nearest.as_ref().map_or_else(|| "; `rotorbench effects` lists those there are".to_owned(), |id| format!("; did you mean `{id}`?")))]
    UnknownEffect {
        /// What was written.
        id: String,
        /// The id that looks most like it.
        nearest: Option<String>,
    },
    /// The expression of a user's effect does not parse.
    #[error("effect `{effect}`: {error}")]
    Expression {
        /// Id of the effect.
        effect: String,
        /// What is wrong with it.
        error: ExpressionError,
    },
    /// A value is missing, superfluous or out of range.
    #[error("{what}")]
    Value {
        /// A sentence that names the value.
        what: String,
    },
}

/// The known id that shares the longest run of letters pairs with `id`.
pub(super) fn nearest_id<'a>(id: &str, own: impl Iterator<Item = &'a str>) -> Option<String> {
    let pairs = |text: &str| text.as_bytes().windows(2).map(<[u8]>::to_vec).collect::<BTreeSet<_>>();
    let wanted = pairs(id);
    let similarity = |other: &str| {
        let other = pairs(other);
        let shared = wanted.intersection(&other).count();
        (200 * shared).checked_div(wanted.len() + other.len()).unwrap_or(0)
    };
    let known: Vec<&str> = CATALOGUE.iter().map(|card| card.id).chain(own).collect();
    // A word of several ids means any of them.
    let of_word: Vec<&str> =
        known.iter().copied().filter(|known| known.split('_').any(|word| word == id)).collect();
    if !of_word.is_empty() {
        return Some(of_word.join("`, `"));
    }
    let (best, share) =
        known.into_iter().map(|known| (known, similarity(known))).max_by_key(|(_, share)| *share)?;
    (share > THRESHOLDS.nearest_name_percent).then(|| best.to_owned())
}
