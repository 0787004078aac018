//! What a command says of the files that it read and wrote.

use std::path::Path;

use crate::recording::End;

/// Where and why a recording is cut off; `None` of a whole one.
#[must_use]
pub fn cut_off(end: &End) -> Option<String> {
    match end {
        End::Whole => None,
        End::CutOff { byte, reason } => Some(format!("cut off at byte {byte}: {reason}")),
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_recording_that_is_cut_off_is_called_so() {
        assert_eq!(cut_off(&End::Whole), None);
        let end = End::CutOff { byte: 12, reason: "it ends".to_owned() };
        assert_eq!(cut_off(&end).as_deref(), Some("cut off at byte 12: it ends"));
    }
}
