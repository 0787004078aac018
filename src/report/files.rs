//! What a command says of the files that it wrote.

use std::path::Path;

/// A model and the steps on its ladder.
#[must_use]
pub fn model_with_steps(path: &Path, steps: usize) -> String {
    format!("{}: {steps} steps on the ladder", path.display())
}

/// A folder of manual pages.
#[must_use]
pub fn manual_pages(folder: &Path) -> String {
    format!(
        "{}: manual pages; read them with `man -l {}`",
        folder.display(),
        folder.join("rotorbench.1").display()
    )
}
