//! The bench file: it says what the frames of captures mean, which controller flies, and where the live view listens. A session
//! names it, and remembers what it said of each capture.

use std::path::{Path, PathBuf};

use super::error::LostBench;
use super::places::Places;
use crate::bench::BenchConfig;
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
    let BenchConfig { mut bus, period_s, .. } = BenchConfig::load(file).unwrap_or_default();
    let files = bus.files().unwrap_or_default();
    // Wherever its folder lies.
    for name in bus.file_names() {
        *name = own_name(name);
    }
    let mut said = toml::to_string(&bus).unwrap_or_default().into_bytes();
    said.extend(period_s.to_le_bytes());
    files.values().for_each(|text| said.extend(text.as_bytes()));
    content_hash(&said)
}

/// The name of a file in its folder.
fn own_name(path: &str) -> String {
    let name = Path::new(path).file_name();
    name.map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}
