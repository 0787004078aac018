//! The bench file: it says what the frames of captures mean, which controller flies, and where the live view listens. A session
//! names it, and remembers what it said of each capture.

use std::fs;
use std::path::{Path, PathBuf};

use super::error::LostBench;
use super::places::Places;
use crate::bench::BenchConfig;
use crate::file::{read_settings, read_settings_text};
use crate::log::csv::content_hash;
use crate::report::findings::explained;

/// The bench that is worked with.
#[derive(Debug, Default)]
pub(super) struct ChosenBench {
    pub config: BenchConfig,
    /// The bench that is built in has none.
    pub file: Option<PathBuf>,
    /// Why it is not that of the session.
    pub lost: Option<LostBench>,
}

impl ChosenBench {
    /// What the command line names, or else what the session does.
    pub fn of(named: (&BenchConfig, Option<&Path>), saved: Option<&Path>, places: &Places) -> Self {
        let (config, file) = (named.0.clone(), named.1.map(Path::to_owned));
        let Some(saved) = saved.filter(|_| file.is_none()) else { return Self { config, file, lost: None } };
        let read = places.file(saved).map_err(|error| explained(&error)).and_then(|file| {
            let config = BenchConfig::load(Some(&file)).map_err(|error| explained(&error))?;
            Ok(Self { config, file: Some(file), lost: None })
        });
        read.unwrap_or_else(|why| Self {
            config,
            file,
            lost: Some(LostBench { file: saved.to_owned(), why }),
        })
    }
}

/// SHA-256 of what a bench file says of the frames of a capture, and of the files that it names for that; of the bench that is built in
/// without one.
pub(super) fn hash_of(file: Option<&Path>) -> String {
    let text = file.and_then(|file| read_settings_text(file).ok()).unwrap_or_default();
    let parsed = file.and_then(|file| BenchConfig::parse(&text, file).ok()).unwrap_or_default();
    let mut said = toml::to_string(&parsed.bus).unwrap_or_default().into_bytes();
    said.extend(parsed.period_s.to_le_bytes());
    // By the whole paths of the files that it names; a name without an ending is built in.
    let mut found = BenchConfig::load(file).unwrap_or_default();
    for named in found.bus.file_names().filter(|name| Path::new(name).extension().is_some()) {
        // A pipe says nothing, and may never end.
        let is_file = fs::metadata(&*named).is_ok_and(|it| it.is_file());
        said.extend(is_file.then(|| read_settings(Path::new(&*named)).ok()).flatten().unwrap_or_default());
    }
    content_hash(&said)
}
