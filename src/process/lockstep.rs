//! The bench on virtual time: emulator, guard and controller step by step in one thread, bit-identical from
//! run to run and as fast as the machine can.

use crate::clock;
use crate::emulate::Emulator;
use crate::experiment::Experiment;
use crate::signal::Applied;

use super::trace::Trace;

/// [ns] at which virtual time begins; zero would mean "never".
pub const ORIGIN_NS: u64 = clock::NANOSECONDS_PER_SECOND;

/// Drives the emulated rotors with an experiment, open loop and without a guard, and gives the log from the
/// first excited slot on. For what a guard may say to it, see [`Experiment::check`].
#[must_use]
pub fn drive(emulator: &Emulator, experiment: &Experiment) -> Trace {
    let mut state = emulator.start(ORIGIN_NS);
    let mut trace = Trace::default();
    for slot in 0..experiment.slots() {
        let applied = Applied { rotor: experiment.command(slot), ..Applied::default() };
        if let Some(logged) = slot.checked_sub(experiment.lead_in()) {
            let time_ns = slot_ns(experiment.period_s(), logged);
            trace.push(time_ns, state.sensors(), &applied);
        }
        emulator.command(&mut state, applied.rotor);
        emulator.advance(&mut state, slot_ns(experiment.period_s(), slot + 1));
    }
    trace
}

/// [ns] when a slot begins, on the grid of `period_s`.
fn slot_ns(period_s: f64, slot: u64) -> u64 {
    clock::span_ns(period_s).saturating_mul(slot)
}
