//! Where a bench lives on this machine, and who may open it.
//!
//! A bench has one directory in `/dev/shm` and a prefix for its shared-memory segments. The directory is closed
//! to everyone but the owner (mode 0700), or by a setting the group (2770); iceoryx2 makes its segments 0600, and
//! [`BenchPlace::set_access`] closes what it leaves open (its node counter is 0666) and, for a group, opens the rest to it.
//! A directory or segment that somebody else put in our way is refused, not used.

use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IceoryxPath, SemanticString};
use serde::{Deserialize, Serialize};

use super::ShmError;

/// Memory-backed on every Linux, never on a network or on the recorder's disk.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";
/// What everything of a bench begins with there.
pub(super) const STEM: &str = "rotorbench-";
/// What a group's number comes after, in the name of its bench's directory.
const GROUP: &str = "group";

/// The `[shared_memory]` table of the bench file.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SharedMemoryConfig {
    /// Unix group whose members may all open the bench's services. Absent: only the user that runs the bench.
    pub group: Option<String>,
}

/// The directory, the prefix and the access of one bench.
#[derive(Debug, Clone)]
pub struct BenchPlace {
    bench: String,
    directory: PathBuf,
    prefix: String,
    group: Option<u32>,
}

/// Owner's permissions of a segment that iceoryx2 has not finished.
const BEING_MADE: u32 = 0o200;

impl BenchPlace {
    /// The place of the bench called `bench`, made if it is not there.
    ///
    /// # Errors
    /// A name that cannot be a file name, an unknown group, a directory that is not ours.
    pub fn open(bench: &str, config: &SharedMemoryConfig) -> Result<Self, ShmError> {
        let place = Self::of(bench, config)?;
        place.make(&place.directory)?;
        for room in ["services", "nodes", "claims"] {
            place.make(&place.directory.join(room))?;
        }
        Ok(place)
    }

    /// The place of the bench called `bench`, whether it is there or not; nothing is made.
    ///
    /// # Errors
    /// A name that cannot be a file name, an unknown group.
    pub fn of(bench: &str, config: &SharedMemoryConfig) -> Result<Self, ShmError> {
        Self::check_name(bench)?;
        let group = match &config.group {
            Some(name) => Some(group_id(name)?),
            None => None,
        };
        // The owner is part of the name: two users' benches of one name never meet. A group's bench has one name for all.
        let owner = match group {
            Some(group) => format!("{GROUP}{group}"),
            None => effective_user().to_string(),
        };
        Ok(Self::named(&owner, bench, group))
    }

    /// Whether anybody has made it.
    #[must_use]
    pub fn is_there(&self) -> bool {
        self.directory.symlink_metadata().is_ok()
    }

    /// Checks that `bench` can name one: 1 to 32 letters, digits, `-` or `_`.
    ///
    /// # Errors
    /// [`ShmError::Name`].
    pub fn check_name(bench: &str) -> Result<(), ShmError> {
        let valid = |letter: char| letter.is_ascii_alphanumeric() || letter == '-' || letter == '_';
        let is_one = (1..=32).contains(&bench.len()) && bench.chars().all(valid);
        if is_one { Ok(()) } else { Err(ShmError::Name { bench: bench.to_owned() }) }
    }

    fn named(owner: &str, bench: &str, group: Option<u32>) -> Self {
        let stem = format!("{STEM}{owner}-{bench}");
        Self {
            bench: bench.to_owned(),
            directory: Path::new(SHARED_MEMORY).join(&stem),
            prefix: format!("{stem}."),
            group,
        }
    }

    /// The place whose directory has this name in `/dev/shm`, if it is one of this user or of a group.
    pub(super) fn found(name: &str) -> Option<Self> {
        let (owner, bench) = name.strip_prefix(STEM)?.split_once('-')?;
        let group = owner.strip_prefix(GROUP).and_then(|group| group.parse().ok());
        let is_known = group.is_some() || owner == effective_user().to_string();
        // A segment's name goes on with a dot.
        (is_known && !bench.contains('.')).then(|| Self::named(owner, bench, group))
    }

    /// Name of the bench.
    #[must_use]
    pub fn bench(&self) -> &str {
        &self.bench
    }

    /// The bench's directory.
    #[must_use]
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// What every shared-memory segment of the bench begins with, in `/dev/shm`.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// Mode of the files of the bench.
    pub(super) fn file_mode(&self) -> u32 {
        if self.group.is_some() { 0o660 } else { 0o600 }
    }

    fn directory_mode(&self) -> u32 {
        if self.group.is_some() { 0o2770 } else { 0o700 }
    }

    /// iceoryx2's settings for this bench; never the ones it would read from `$PWD/config`.
    pub(super) fn iceoryx(&self) -> Result<Config, ShmError> {
        let refused = || ShmError::Name { bench: self.bench.clone() };
        let mut config = Config::default();
        let root = self.directory.to_str().ok_or_else(refused)?;
        config.global.set_root_path(&IceoryxPath::new(root.as_bytes()).map_err(|_| refused())?);
        config.global.prefix = FileName::new(self.prefix.as_bytes()).map_err(|_| refused())?;
        Ok(config)
    }

    fn make(&self, directory: &Path) -> Result<(), ShmError> {
        let at = |error| ShmError::Place { path: directory.to_owned(), error };
        match fs::DirBuilder::new().mode(0o700).create(directory) {
            Ok(()) => self.give(directory, self.directory_mode()).map_err(at)?,
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(at(error)),
        }
        let found = fs::symlink_metadata(directory).map_err(at)?;
        // A member of the group may meet the directory between its creation and its opening to the group; it tries again.
        if !found.is_dir() || !self.is_ours(&found) || found.mode() & 0o007 != 0 {
            return Err(ShmError::NotOurs {
                path: directory.to_owned(),
                user: found.uid(),
                mode: found.mode() & 0o7777,
            });
        }
        Ok(())
    }

    pub(super) fn is_ours(&self, found: &fs::Metadata) -> bool {
        match self.group {
            Some(group) => found.gid() == group,
            None => found.uid() == effective_user(),
        }
    }

    /// Whether a segment's owner is in the bench's group: its segment is of that group only once the member has set its access.
    fn is_of_a_member(&self, found: &fs::Metadata) -> bool {
        self.group.is_some_and(|group| groups_of(found.uid()).contains(&group))
    }

    /// Removes everything the bench left on this machine: its directory and its segments. For a bench that nobody
    /// is on any more; who still is keeps what it has open, and meets nobody.
    ///
    /// # Errors
    /// The operating system's, with the path.
    pub fn remove(&self) -> Result<usize, ShmError> {
        let shared = Path::new(SHARED_MEMORY);
        let mut removed = 0;
        for entry in fs::read_dir(shared).into_iter().flatten().flatten() {
            if entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                let at = |error| ShmError::Place { path: entry.path(), error };
                fs::remove_file(entry.path()).map_err(at)?;
                removed += 1;
            }
        }
        let at = |error| ShmError::Place { path: self.directory.clone(), error };
        fs::remove_dir_all(&self.directory).map_err(at)?;
        Ok(removed + 1)
    }

    fn give(&self, path: &Path, mode: u32) -> io::Result<()> {
        if let Some(group) = self.group {
            std::os::unix::fs::lchown(path, None, Some(group))?;
        }
        fs::set_permissions(path, fs::Permissions::from_mode(mode))
    }

    /// Brings the access of everything this process made to what the place says. To be called after each creation
    /// and before anybody can know of it.
    ///
    /// # Errors
    /// A segment with the bench's prefix that belongs to somebody else.
    pub(super) fn set_access(&self) -> Result<(), ShmError> {
        let shared = Path::new(SHARED_MEMORY);
        for entry in
            fs::read_dir(shared).map_err(|error| ShmError::Place { path: shared.to_owned(), error })?
        {
            let Ok(entry) = entry else { continue };
            if !entry.file_name().to_string_lossy().starts_with(&self.prefix) {
                continue;
            }
            // A segment may vanish between the listing and the look at it: its owner left.
            let Ok(found) = entry.metadata() else { continue };
            if found.uid() == effective_user() {
                self.set_file_access(&entry.path(), &found);
            } else if !self.is_ours(&found) && !self.is_of_a_member(&found) {
                return Err(ShmError::NotOurs {
                    path: entry.path(),
                    user: found.uid(),
                    mode: found.mode() & 0o7777,
                });
            }
        }
        if self.group.is_some() {
            self.set_access_below(&self.directory);
        }
        Ok(())
    }

    fn set_file_access(&self, path: &Path, found: &fs::Metadata) {
        // Bits of the owner say how far iceoryx2 is with a segment. One that is being made (write only) is some process's
        // that will set its access: between our look and our change it may be finished, and we would undo that for ever.
        let owner = found.mode() & 0o600;
        let mode = if self.group.is_some() { owner | owner >> 3 } else { owner };
        let is_settled = found.mode() & 0o777 == mode && self.group.is_none_or(|group| found.gid() == group);
        if owner == BEING_MADE || is_settled {
            return;
        }
        // Failing means that the file is gone.
        let _ = self.give(path, mode);
    }

    fn set_access_below(&self, directory: &Path) {
        for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
            let Ok(found) = entry.metadata() else { continue };
            if found.is_dir() {
                if found.uid() == effective_user() {
                    let _ = self.give(&entry.path(), self.directory_mode());
                }
                self.set_access_below(&entry.path());
            } else if found.uid() == effective_user() {
                self.set_file_access(&entry.path(), &found);
            }
        }
    }
}

/// Number of the user whose rights this process has.
#[allow(unsafe_code, reason = "std does not say who runs the process")]
#[must_use]
pub fn effective_user() -> u32 {
    // SAFETY: geteuid has no arguments and cannot fail.
    unsafe { libc::geteuid() }
}

/// Numbers of the groups that a user is in, from the user and group files; none for a user who is not there.
#[allow(unsafe_code, reason = "std does not know a user's groups")]
fn groups_of(user: u32) -> Vec<u32> {
    // SAFETY: plain data for which zero is valid; getpwuid_r writes it, and what it points to is in `text`.
    let mut entry: libc::passwd = unsafe { std::mem::zeroed() };
    let mut text = vec![0; 1 << 16];
    let mut found = std::ptr::null_mut();
    // SAFETY: all pointers are valid for the call, and `text` is as long as said.
    let code =
        unsafe { libc::getpwuid_r(user, &raw mut entry, text.as_mut_ptr(), text.len(), &raw mut found) };
    if code != 0 || found.is_null() {
        return Vec::new();
    }
    let mut groups = vec![0; 1024];
    let mut count = libc::c_int::try_from(groups.len()).unwrap_or(libc::c_int::MAX);
    // SAFETY: the name is in `text`, which is still there, and ends with a zero; `groups` is as long as said.
    unsafe { libc::getgrouplist(entry.pw_name, entry.pw_gid, groups.as_mut_ptr(), &raw mut count) };
    groups.truncate(usize::try_from(count).unwrap_or(0));
    groups
}

/// Number of a Unix group, from the group file.
#[allow(unsafe_code, reason = "std does not know groups by name")]
fn group_id(name: &str) -> Result<u32, ShmError> {
    let unknown = || ShmError::Group { name: name.to_owned() };
    let asked = std::ffi::CString::new(name).map_err(|_| unknown())?;
    // SAFETY: `group` is plain data for which zero is valid; getgrnam_r writes it, and what it points to is in `text`.
    let mut group: libc::group = unsafe { std::mem::zeroed() };
    let mut text = vec![0; 1 << 16];
    let mut found = std::ptr::null_mut();
    // SAFETY: all pointers are valid for the call, `text` is as long as said, and only a number is read after it.
    let code = unsafe {
        libc::getgrnam_r(asked.as_ptr(), &raw mut group, text.as_mut_ptr(), text.len(), &raw mut found)
    };
    if code == 0 && !found.is_null() { Ok(group.gr_gid) } else { Err(unknown()) }
}
