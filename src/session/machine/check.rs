//! What one look at the machine found.

use crate::screening::Finding;
use crate::screening::finding::Evidence;

/// How bad a finding is.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Grade {
    /// As it should be, or nothing that matters.
    Good,
    /// It works, less well than it could.
    Warning,
    /// Something of the program cannot work.
    Bad,
    /// It was bad, and has been mended just now.
    Mended,
}

/// One thing looked at: its name is the finding's subject.
#[derive(Debug, Clone, PartialEq)]
pub struct MachineCheck {
    /// How bad it is.
    pub grade: Grade,
    /// What was found.
    pub finding: Finding,
}

pub(super) fn good(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Good, finding: Finding::new(code, check) }
}

pub(super) fn warning(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Warning, finding: Finding::new(code, check) }
}

pub(super) fn bad(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Bad, finding: Finding::new(code, check) }
}

impl MachineCheck {
    pub(super) fn with(self, name: &'static str, value: impl Into<Evidence>) -> Self {
        Self { finding: self.finding.with(name, value), ..self }
    }

    /// Whether the machine is not as it should be.
    #[must_use]
    pub fn is_wanting(&self) -> bool {
        matches!(self.grade, Grade::Warning | Grade::Bad)
    }
}
