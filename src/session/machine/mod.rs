//! What this machine can and cannot do for a bench, and what dead benches left on it.

mod bus;
mod check;
mod host;

use crate::bench::BenchConfig;
use crate::shm::{self, Leftover};
use check::{bad, good, warning};

pub use check::{Grade, MachineCheck};

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
