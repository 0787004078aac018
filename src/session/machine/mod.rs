//! What this machine can and cannot do for a bench, and what dead benches left on it.

mod bus;
mod host;

use crate::bench::BenchConfig;
use crate::screening::Finding;
use crate::shm::{self, Leftover};

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

fn good(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Good, finding: Finding::new(code, check) }
}

fn warning(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Warning, finding: Finding::new(code, check) }
}

fn bad(check: &str, code: &'static str) -> MachineCheck {
    MachineCheck { grade: Grade::Bad, finding: Finding::new(code, check) }
}

impl MachineCheck {
    fn with(self, name: &'static str, value: impl Into<crate::screening::finding::Evidence>) -> Self {
        Self { finding: self.finding.with(name, value), ..self }
    }

    /// Whether the machine is not as it should be.
    #[must_use]
    pub fn is_wanting(&self) -> bool {
        matches!(self.grade, Grade::Warning | Grade::Bad)
    }
}

/// Looks at versions, the bus of `config`, the machine, and what benches without a process left in shared memory: all of them,
/// or the one called `only`; with `fix` what they left is removed.
#[must_use]
pub fn check_machine(config: &BenchConfig, only: Option<&str>, fix: bool) -> Vec<MachineCheck> {
    let mut findings = vec![host::versions()];
    findings.extend(bus::look(&config.bus));
    findings.extend(host::look(config));
    findings.extend(leftovers(only, fix));
    findings
}

/// Benches that nobody is on any more.
fn leftovers(only: Option<&str>, fix: bool) -> Vec<MachineCheck> {
    const CHECK: &str = "dead benches";
    let mut left = shm::leftovers();
    left.retain(|it| only.is_none_or(|only| it.bench == only));
    if left.is_empty() {
        return vec![good(CHECK, "no_dead_bench")];
    }
    let look = |it: &Leftover| {
        let looked = match fix.then(|| it.remove()) {
            None => warning(CHECK, "dead_bench"),
            Some(Ok(_)) => MachineCheck { grade: Grade::Mended, ..good(CHECK, "dead_bench_removed") },
            Some(Err(error)) => bad(CHECK, "dead_bench_stays").with("error", error.to_string()),
        };
        looked.with("bench", it.bench.as_str()).with("files", it.files).with("bytes", it.bytes as usize)
    };
    left.iter().map(look).collect()
}
