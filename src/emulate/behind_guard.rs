//! The emulator behind shared memory: in the place of bridge and hardware.

use crate::bus_guard::BusGuard;
use crate::clock;
use crate::guard::Cause;
use crate::rt::{self, Shutdown, Wake};

use super::{Emulator, Truth};

/// How an emulation runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EmulationOptions {
    /// [s] after which it ends by itself; not a number or infinite = never.
    pub duration_s: f64,
    /// Wake the controller with each new gyro sample.
    pub wakes_control: bool,
}

/// What an emulation saw of the body.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct BodyMotion {
    /// [s] it ran.
    pub duration_s: f64,
    /// [rad] root mean square of the true angle while the rotors were commanded.
    pub angle_rms_rad: f64,
    /// [rad] largest true angle while the rotors were commanded.
    pub angle_peak_rad: f64,
    /// [V] at the end.
    pub battery_voltage_v: f64,
    #[serde(skip)]
    square_sum: f64,
    #[serde(skip)]
    count: u64,
}

impl BodyMotion {
    pub(super) fn add(&mut self, truth: &Truth, is_turning: bool, time_s: f64) {
        self.duration_s = time_s;
        self.battery_voltage_v = truth.battery_voltage;
        if is_turning {
            self.square_sum += truth.body_angle * truth.body_angle;
            self.count += 1;
            self.angle_rms_rad = (self.square_sum / self.count as f64).sqrt();
            self.angle_peak_rad = self.angle_peak_rad.max(truth.body_angle.abs());
        }
    }
}

/// Runs the emulated bench in real time behind `guard`, until `shutdown`. The last thing it does is what a
/// bridge does: the ramp to zero.
pub fn run(
    emulator: &Emulator,
    guard: &mut BusGuard,
    options: EmulationOptions,
    shutdown: &Shutdown,
) -> BodyMotion {
    let start_ns = clock::monotonic_ns();
    let end_ns = end_ns(start_ns, options.duration_s);
    let mut state = emulator.start(start_ns);
    let mut summary = BodyMotion::default();
    let (mut published, mut woken_by, mut is_ending) = (0, 0, false);
    loop {
        let now_ns = clock::monotonic_ns();
        if !is_ending && (shutdown.is_requested() || now_ns >= end_ns) {
            is_ending = true;
            guard.trip(now_ns, Cause::Shutdown);
        } else if is_ending && guard.is_safe() {
            return summary;
        }
        emulator.advance(&mut state, now_ns - start_ns);
        let sensors = *state.sensors();
        if sensors.sequence != published {
            let is_new_gyro = sensors.body_rate.count != woken_by;
            guard.publish_sensors(
                &guard.marked(sensors.stamp_ns, &sensors),
                options.wakes_control && is_new_gyro,
            );
            (published, woken_by) = (sensors.sequence, sensors.body_rate.count);
        }
        guard.look(now_ns);
        let now_ns = guard.time_to_judge(now_ns, clock::monotonic_ns);
        if let Some((release, applied)) = guard.step_if_due(now_ns, &sensors) {
            emulator.command(&mut state, applied.rotor);
            guard.finish(release, clock::monotonic_ns(), &sensors);
            summary.add(&emulator.truth(&state), !guard.is_safe(), clock::span_s(now_ns - start_ns));
        }
        let due_ns = guard.deadline_ns().min(start_ns.saturating_add(emulator.next_sample_ns(&state)));
        if matches!(rt::wait([guard.bell().descriptor()], due_ns), Wake::Ready(_)) {
            guard.bell().quiet();
        }
    }
}

/// [ns] when an emulation that runs for `duration_s` ends.
pub(super) fn end_ns(start_ns: u64, duration_s: f64) -> u64 {
    if duration_s.is_finite() { start_ns.saturating_add(clock::span_ns(duration_s)) } else { u64::MAX }
}
