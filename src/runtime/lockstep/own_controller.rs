//! The emulated bench under a controller of the caller's own.

use super::{EmulatedBench, Slot};
use crate::bench::BenchConfig;
use crate::control::Controller;
use crate::runtime::ProcessError;
use crate::runtime::emulate::emulator;

/// Runs the emulated bench of `config` behind its guard for `seconds` of virtual time, armed in the first slot, with
/// `controller` in the place of the bench file's. Reference and period are the bench file's; `sequence`, `stamp_ns` and
/// `sensors_sequence` of the controller's commands are filled in.
///
/// See `examples/own_controller.rs`.
///
/// # Errors
/// Settings that cannot be.
pub fn run_controller<C: Controller>(
    config: &BenchConfig,
    controller: &C,
    seconds: f64,
) -> Result<Vec<Slot>, ProcessError> {
    config.check()?;
    let guard = crate::runtime::guard::of_bench(config)?;
    let reference = config.controller.reference.build(config.period_s)?;
    let bench = EmulatedBench::new(emulator(config)?, Some(guard), config.period_s);
    let (mut state, mut of_controller) = (bench.start(), controller.start());
    let mut of_reference = reference.start();
    let slots = (0..bench.slots(seconds)).map(|_| {
        let inputs = bench.ask(&state, &mut ());
        let wanted = reference.next(&mut of_reference, &inputs.applied);
        let mut command = controller.step(&mut of_controller, &inputs.sensors, &wanted, &inputs.applied);
        command.sequence = inputs.slot + 1;
        command.stamp_ns = inputs.now_ns;
        command.sensors_sequence = inputs.sensors.sequence;
        bench.take(&mut state, &inputs, Some(command), &mut ())
    });
    Ok(slots.collect())
}
