//! The bench file: it says what the frames of captures mean, which controller flies, and where the live view listens. A session
//! remembers it as it remembers its logs.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::OtherBench;
use super::places::{Places, as_typed};
use crate::bench::BenchConfig;
use crate::log::csv::content_hash;
use crate::report::findings::explained;

/// A bench file, as it was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BenchFile {
    pub path: PathBuf,
    /// SHA-256 of its bytes and of those of the files that it names, in hexadecimal.
    pub sha256: String,
}

impl BenchFile {
    /// The file that says this bench, by the path that a command would have.
    pub fn of(config: &BenchConfig, path: &Path) -> Self {
        let mut bytes = fs::read(path).unwrap_or_default();
        // What is no file is built in.
        for named in config.bus.clone().file_names() {
            bytes.extend(fs::read(named).unwrap_or_default());
        }
        Self { path: as_typed(path), sha256: content_hash(&bytes) }
    }
}

/// The bench that is worked with.
#[derive(Debug, Default)]
pub(super) struct ChosenBench {
    pub config: BenchConfig,
    /// The bench that is built in has none.
    pub file: Option<PathBuf>,
    /// How it differs from that of the session.
    pub differs: Option<OtherBench>,
}

impl ChosenBench {
    /// What the command line names, or else what the session remembers.
    pub fn of(named: (&BenchConfig, Option<&Path>), saved: Option<&BenchFile>, places: &Places) -> Self {
        let name = |path: &Path| path.display().to_string();
        if let (config, Some(file)) = named {
            let now = BenchFile::of(config, file);
            let differs = match saved {
                Some(then) if then.sha256 == now.sha256 => None,
                Some(then) => Some(OtherBench::Other(name(&now.path), name(&then.path))),
                None => Some(OtherBench::Unnamed(name(&now.path))),
            };
            return Self { config: config.clone(), file: Some(file.to_owned()), differs };
        }
        let Some(then) = saved else { return Self { config: named.0.clone(), ..Self::default() } };
        let read = places.file(&then.path).map_err(|error| explained(&error)).and_then(|file| {
            let config = BenchConfig::load(Some(&file)).map_err(|error| explained(&error))?;
            Ok((config, file))
        });
        match read {
            Ok((config, file)) => {
                let is_same = BenchFile::of(&config, &file).sha256 == then.sha256;
                let differs = (!is_same).then(|| OtherBench::Changed(name(&then.path)));
                Self { config, file: Some(file), differs }
            }
            Err(why) => Self { differs: Some(OtherBench::Gone(why)), ..Self::default() },
        }
    }
}
