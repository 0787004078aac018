//! Where results go: never over what the command reads, and never two to one place.

use std::path::{Path, PathBuf};

use super::CliError;

/// Refuses, before the work whose results they are for, files that could not be written, that the command reads, or that
/// are one and the same.
pub(super) fn writable<'a>(
    results: impl IntoIterator<Item = &'a PathBuf>,
    inputs: impl IntoIterator<Item = &'a PathBuf>,
) -> Result<(), CliError> {
    let inputs: Vec<PathBuf> = inputs.into_iter().map(|path| place(path)).collect();
    let mut taken = Vec::new();
    for path in results {
        let refuse = |reason: &str| Err(CliError::new(format!("{}: {reason}", path.display())));
        let place = place(path);
        if inputs.contains(&place) {
            return refuse("this command reads that file; its result has to go elsewhere");
        }
        if taken.contains(&place) {
            return refuse("two results of this command would go there");
        }
        if let Err(reason) = crate::file::check_place(path) {
            return refuse(&reason.to_string());
        }
        taken.push(place);
    }
    Ok(())
}

/// Refuses what is there already.
pub(super) fn absent<'a>(results: impl IntoIterator<Item = &'a PathBuf>) -> Result<(), CliError> {
    // A link that leads nowhere is there, too.
    let there = results.into_iter().find(|path| path.symlink_metadata().is_ok());
    there.map_or(Ok(()), |path| {
        Err(CliError::new(format!(
            "{}: no experiment is overwritten, and this file is there already; give another -o, or move it away",
            path.display()
        )))
    })
}

/// One name for each file, however its path is written.
fn place(path: &Path) -> PathBuf {
    let in_folder = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        Some(folder.unwrap_or(Path::new(".")).canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(in_folder).unwrap_or_else(|| path.to_owned())
}
