//! What `monitor --json` says each second.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::clock;
use crate::report;
use crate::runtime::monitor::{Process, View};
use crate::signal::{BusStatus, Channel, ROTORS};

/// The bench as it stands. Where nobody guards it, `state` is `not running`; numbers are the last that were heard, or zero.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
pub(in crate::cli) struct MonitorLine<'a> {
    /// Name of the bench.
    bench: &'a str,
    /// Whether the guard runs: it has said so within the last second.
    is_guarded: bool,
    /// State of the guard; where it does not run, `not running`.
    state: String,
    /// [s] since the guard said anything; `null` where it never did.
    guard_age_s: Option<f64>,
    /// [-] what the guard let through last, rotor by rotor.
    rotor: [f64; ROTORS],
    /// [rad/s] newest body rate.
    body_rate_rad_s: f64,
    /// [rad] body angle as the controller estimates it.
    body_angle_rad: f64,
    /// [N m] disturbance torque as the controller estimates it.
    disturbance_torque_nm: f64,
    /// [V] newest battery voltage.
    battery_voltage_v: f64,
    /// Processes that are alive.
    processes: Vec<ProcessLine>,
    /// Newest value of each channel that has given one, under its name in a log, in its unit.
    measured: BTreeMap<&'static str, f64>,
    /// What the guard decided or refused last; `null` before anything.
    last_event: Option<String>,
    /// The bus; `null` where there is none.
    bus: Option<BusLine>,
}

/// One process of the bench.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
struct ProcessLine {
    /// `bridge`, `emulate`, `run` or `control`.
    role: &'static str,
    /// Its number in the system.
    process_id: u32,
    /// [Hz] periods it ran in the last second.
    rate_hz: f64,
    /// [µs] greatest release lateness of the last second.
    lateness_us: f64,
    /// [µs] greatest time from due to command out in the last second.
    response_us: f64,
    /// Slots skipped since it began.
    skipped: u64,
    /// Slots whose command was out after the next slot was due.
    overruns: u64,
}

/// Totals of the bus since the bridge began.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Serialize)]
struct BusLine {
    /// Frames of other senders received.
    received: u64,
    /// Frames lost because they were not taken in time.
    lost: u64,
    /// Frames given to the interface.
    sent: u64,
    /// Frames of ours that have been on the bus.
    echoed: u64,
    /// [ms] since a frame of ours was seen on the bus.
    echo_age_ms: f64,
    /// Frames that the interface did not take.
    not_sent: u64,
    /// Error frames.
    error_frames: u64,
    /// Frames with an identifier that no role names.
    unknown_id: u64,
    /// Frames with the identifier of our own command, from another sender.
    foreign_command: u64,
    /// Frames of the wrong length.
    wrong_length: u64,
    /// Frames whose counter repeated, went back or jumped too far.
    counter: u64,
    /// Values that are not a number.
    not_a_number: u64,
    /// Values outside the allowed range.
    out_of_range: u64,
}

impl<'a> MonitorLine<'a> {
    pub(super) fn of(view: &'a View) -> Self {
        let (sensors, command, applied) = &view.newest;
        let now_ns = clock::monotonic_ns();
        let is_guarded = view.is_guarded(now_ns);
        let given = Channel::ALL.into_iter().filter(|channel| channel.of(sensors).stamp_ns != 0);
        Self {
            bench: &view.bench,
            is_guarded,
            state: if is_guarded { view.state().to_string() } else { "not running".to_owned() },
            guard_age_s: (applied.stamp_ns != 0).then(|| view.guard_age_s(now_ns)),
            rotor: applied.rotor,
            body_rate_rad_s: sensors.body_rate.value,
            body_angle_rad: command.estimate.body_angle,
            disturbance_torque_nm: command.estimate.disturbance_torque,
            battery_voltage_v: sensors.battery_voltage.value,
            processes: view
                .processes
                .iter()
                .filter(|process| process.is_alive(now_ns))
                .map(ProcessLine::of)
                .collect(),
            measured: given.map(|channel| (channel.column(), channel.of(sensors).value)).collect(),
            last_event: view.said.front().map(report::guard::event),
            bus: (view.bus.sequence > 0).then(|| BusLine::of(&view.bus)),
        }
    }
}

impl ProcessLine {
    fn of(process: &Process) -> Self {
        Self {
            role: process.role.name(),
            process_id: process.heartbeat.process_id,
            rate_hz: process.rate,
            lateness_us: process.shown_us.0,
            response_us: process.shown_us.1,
            skipped: process.cycle.skipped,
            overruns: process.cycle.overruns,
        }
    }
}

impl BusLine {
    fn of(bus: &BusStatus) -> Self {
        Self {
            received: bus.received,
            lost: bus.lost,
            sent: bus.sent,
            echoed: bus.echoed,
            echo_age_ms: clock::span_s(bus.echo_age_ns) * 1e3,
            not_sent: bus.not_sent,
            error_frames: bus.error_frames,
            unknown_id: bus.unknown_id,
            foreign_command: bus.foreign_command,
            wrong_length: bus.wrong_length,
            counter: bus.counter,
            not_a_number: bus.not_a_number,
            out_of_range: bus.out_of_range,
        }
    }
}
