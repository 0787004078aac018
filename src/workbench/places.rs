//! The files that may be opened: those below folders that were named on the command line, wherever links lead.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf, absolute};
use std::time::SystemTime;

use serde::Serialize;

use super::thresholds::THRESHOLDS;

/// Why a file is not opened.
#[derive(Debug, thiserror::Error)]
pub enum PlaceError {
    /// It is not there, or not to be read.
    #[error("{path}")]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A folder, or a pipe or a device: to read that may never end.
    #[error("{path} is no file with content of its own: a folder, a pipe, a socket or a device")]
    NoFile {
        /// What was named.
        path: PathBuf,
    },
    /// It lies elsewhere.
    #[error("{path} is not below a folder that was named when the workbench was opened")]
    Outside {
        /// The file.
        path: PathBuf,
    },
}

/// The folders that were named.
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    folders: Vec<PathBuf>,
    files: BTreeSet<PathBuf>,
}

/// What lies in a folder.
#[derive(Debug, Serialize)]
pub(super) struct Listing {
    /// The folder; empty where it is the list of those that were named.
    pub folder: String,
    /// The folder above it, if that may be looked into.
    pub above: Option<String>,
    /// Folders in it, by their whole path.
    pub folders: Vec<String>,
    /// Files in it, by their whole path.
    pub files: Vec<Entry>,
    /// Whether there are more than are listed.
    pub has_more: bool,
}

/// A file.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    /// Its whole path.
    pub path: String,
    /// [byte]
    pub bytes: u64,
}

impl Places {
    /// The folders of these files, and these folders. A model that is built in is no file.
    pub fn of<'a>(named: impl IntoIterator<Item = &'a PathBuf>) -> Result<Self, PlaceError> {
        let mut places = Self::default();
        for path in named.into_iter().filter(|path| path.as_os_str() != "paper") {
            let whole = canonical(path)?.0;
            let folder = if whole.is_dir() { Some(whole.as_path()) } else { whole.parent() };
            if let Some(folder) = folder.filter(|folder| !places.folders.iter().any(|it| it == folder)) {
                places.folders.push(folder.to_owned());
            }
        }
        Ok(places)
    }

    /// Single files of a session that was named; one that has gone is an error when it is opened.
    pub fn admit(&mut self, files: impl Iterator<Item = PathBuf>) -> Result<(), PlaceError> {
        self.files.extend(files.filter_map(|file| canonical(&file).ok()).map(|(file, _)| file));
        Ok(())
    }

    /// The true path of a file that may be opened; of `FILE#N` with its `#N`. Asked again before each reading: a link may lead
    /// elsewhere by then.
    pub fn file(&self, path: &Path) -> Result<PathBuf, PlaceError> {
        let (whole, part) = self.inside(path)?;
        if !fs::metadata(&whole).is_ok_and(|found| found.is_file()) {
            return Err(PlaceError::NoFile { path: path.to_owned() });
        }
        let mut named = whole.into_os_string();
        named.push(part);
        Ok(named.into())
    }

    /// The true path of what lies inside, and the `#N` behind it.
    fn inside(&self, path: &Path) -> Result<(PathBuf, String), PlaceError> {
        let (whole, part) = canonical(path)?;
        if !self.files.contains(&whole) && !self.holds(&whole) {
            return Err(PlaceError::Outside { path: path.to_owned() });
        }
        Ok((whole, part))
    }

    fn holds(&self, whole: &Path) -> bool {
        self.folders.iter().any(|folder| whole.starts_with(folder))
    }

    /// What lies in a folder; without one, the folders that were named.
    pub fn list(&self, folder: Option<&Path>) -> Result<Listing, PlaceError> {
        let text = |path: &Path| path.display().to_string();
        let Some(folder) = folder else {
            let folders = self.folders.iter().map(|folder| text(folder)).collect();
            let files = self.files.iter().filter_map(|file| entry(file)).collect();
            return Ok(Listing { folder: String::new(), above: None, folders, files, has_more: false });
        };
        let whole = self.inside(folder)?.0;
        let read = fs::read_dir(&whole).map_err(|source| PlaceError::File { path: whole.clone(), source })?;
        let mut found: Vec<PathBuf> = read.filter_map(|entry| Some(entry.ok()?.path())).collect();
        found.sort();
        // A link that leads out is not shown: it could not be opened.
        found.retain(|path| !is_hidden(path) && path.canonicalize().is_ok_and(|whole| self.holds(&whole)));
        let has_more = found.len() > THRESHOLDS.most_listed;
        found.truncate(THRESHOLDS.most_listed);
        let (folders, files): (Vec<_>, Vec<_>) = found.into_iter().partition(|path| path.is_dir());
        let above = whole.parent().filter(|above| self.holds(above)).map(text);
        Ok(Listing {
            folder: text(&whole),
            above,
            folders: folders.iter().map(|path| text(path)).collect(),
            files: files.iter().filter_map(|file| entry(file)).collect(),
            has_more,
        })
    }
}

fn is_hidden(path: &Path) -> bool {
    path.file_name().is_none_or(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn entry(path: &Path) -> Option<Entry> {
    let found = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some(Entry { path: path.display().to_string(), bytes: found.len() })
}

/// The true path, and the `#N` that was behind it where the file has none of its own.
fn canonical(path: &Path) -> Result<(PathBuf, String), PlaceError> {
    let source = match path.canonicalize() {
        Ok(whole) => return Ok((whole, String::new())),
        Err(source) => source,
    };
    let parts = path.to_str().and_then(|text| text.rsplit_once('#'));
    if let Some((file, number)) = parts.filter(|(_, number)| number.parse::<usize>().is_ok())
        && let Ok(whole) = Path::new(file).canonicalize()
    {
        return Ok((whole, format!("#{number}")));
    }
    Err(PlaceError::File { path: path.to_owned(), source })
}

/// How long a file is and when it was written last: by which one sees that it has grown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    bytes: u64,
    written: Option<SystemTime>,
}

impl Stamp {
    /// Of a file as it is now; of `FILE#N` that of the file.
    pub fn of(path: &Path) -> Option<Self> {
        let file = canonical(path).ok()?.0;
        let found = fs::metadata(file).ok()?;
        Some(Self { bytes: found.len(), written: found.modified().ok() })
    }
}

/// A path as one would type it here: relative where it lies below the current folder.
pub(super) fn as_typed(path: &Path) -> PathBuf {
    let here = std::env::current_dir().ok().and_then(|here| here.canonicalize().ok());
    let below = here.and_then(|here| path.strip_prefix(here).ok().map(Path::to_owned));
    below.unwrap_or_else(|| path.to_owned())
}

/// A path that leads there from any folder; the name of a model that is built in stays one.
pub(super) fn whole(path: &Path) -> PathBuf {
    let is_built_in = path.as_os_str() == "paper";
    let absolute = (!is_built_in).then(|| absolute(path).ok()).flatten();
    absolute.unwrap_or_else(|| path.to_owned())
}

/// A name that a browser takes as it is, and no folder.
pub(super) fn plain(name: &str) -> String {
    let letter = |it: char| if it.is_ascii_alphanumeric() || "-_.".contains(it) { it } else { '_' };
    let name: String = name.chars().map(letter).take(100).collect();
    let name = name.trim_start_matches('.');
    if name.is_empty() { "export".to_owned() } else { name.to_owned() }
}
