//! What the processes of a bench say at their end.

use std::fmt::Write;

use crate::clock::span_s;
use crate::emulate::{BodyMotion, BusSummary};
use crate::recording::RecorderSummary;
use crate::rt::{Percentiles, Summary};
use crate::runtime::bridge::BridgeSummary;
use crate::runtime::bus_io::BusIoSummary;
use crate::runtime::control::ControlSummary;
use crate::runtime::control_output::AngleError;
use crate::runtime::emulate::GuardedSummary;
use crate::runtime::lockstep::run::LockstepSummary;
use crate::runtime::lockstep::two_process::AnswerSummary;
use crate::runtime::run::{EventLine, RunSummary};

/// A run on virtual time of a bench file that speaks of a bus.
pub const NO_BUS: &str = "virtual time: `[bus]` is not used; `rotorbench check` looks at it";

/// How well the angle was held, on one line.
#[must_use]
pub fn angle(angle: &AngleError) -> String {
    if angle.count == 0 {
        return "angle error: the guard was never open".to_owned();
    }
    format!(
        "angle error: rms {:.4} rad, greatest {:.4} rad, last {:+.4} rad ({}, {} periods)",
        angle.rms,
        angle.greatest,
        angle.last,
        if angle.measured { "measured" } else { "estimated from the gyro" },
        angle.count,
    )
}

/// Timing of a cycle, one line each.
#[must_use]
pub fn timing(timing: &Summary) -> String {
    let Summary { slots, run, skipped, overruns, longest_overrun, .. } = timing;
    let mut text = format!(
        "slots {slots} = run {run} + skipped {skipped}; overruns {overruns}, at most {longest_overrun} in a row\n"
    );
    let lines = [
        ("release lateness", &timing.lateness),
        ("execution", &timing.execution),
        ("command out, after due", &timing.response),
        ("sensor age", &timing.sensor_age),
        ("sensor to command", &timing.sensor_to_command),
    ];
    let numbers = |it: &Percentiles| {
        [it.p50_us, it.p99_us, it.p99_9_us, it.p99_99_us, it.max_us].map(|it| format!("{it:.1}"))
    };
    let head = ["p50", "p99", "p99.9", "p99.99", "max"].map(str::to_owned);
    let rows: Vec<(&str, [String; 5])> = std::iter::once(("[µs]", head))
        .chain(lines.iter().map(|(name, percentiles)| (*name, numbers(percentiles))))
        .collect();
    // Sensors that have stopped are as old as the run is long: such numbers make a column wider, and touch no other.
    let width = |column: usize| rows.iter().map(|(_, cells)| cells[column].len()).max().unwrap_or(0).max(9);
    let widths: [usize; 5] = std::array::from_fn(width);
    for (name, cells) in &rows {
        let _ = write!(text, "{name:24}");
        for (cell, width) in cells.iter().zip(widths) {
            let _ = write!(text, " {cell:>width$}");
        }
        text.push('\n');
    }
    text
}

/// What the bus did, and what was refused of it by cause.
#[must_use]
pub fn bus(bus: &BusIoSummary) -> String {
    let (port, decoded) = (&bus.port, &bus.decoded);
    let mut text = format!(
        "frames received {}, lost {}, sent {}, seen on the bus {}, refused by the interface {}, error frames {}\n",
        port.received,
        port.dropped,
        port.sent,
        port.echoed,
        port.full + port.down + port.failed,
        port.errors,
    );
    if port.malformed > 0 {
        let _ = writeln!(text, "datagrams that carried no frame of this bus: {}", port.malformed);
    }
    let refused: Vec<String> = decoded
        .refused()
        .iter()
        .filter(|(_, count)| *count > 0)
        .map(|(refusal, count)| format!("{count} {refusal}"))
        .collect();
    if !refused.is_empty() {
        let _ = writeln!(text, "not taken: {}", refused.join(", "));
    }
    text
}

/// What a bridge ended with.
#[must_use]
pub fn bridge(summary: &BridgeSummary) -> String {
    let guard = guard_at_end(&summary.state, &summary.cause);
    format!("{guard}\n{}{}", bus(&summary.bus), timing(&summary.timing))
}

/// What a controller ended with.
#[must_use]
pub fn controlled(summary: &ControlSummary) -> String {
    format!("{}\n{}", angle(&summary.angle), timing(&summary.timing))
}

/// What a controller that answered an emulator on virtual time ended with.
#[must_use]
pub fn answered(summary: &AnswerSummary) -> String {
    format!("steps answered: {}\n{}\n", summary.answered, angle(&summary.angle))
}

/// What an emulator behind its guard ended with.
#[must_use]
pub fn emulated_behind_guard(summary: &GuardedSummary) -> String {
    let guard = guard_at_end(&summary.state, &summary.cause);
    format!("{}\n{guard}\n{}", body(&summary.body), timing(&summary.timing))
}

/// What a run on virtual time ended with.
#[must_use]
pub fn lockstep(summary: &LockstepSummary) -> String {
    let LockstepSummary { slots, answered, duration_s, wall_s, state, cause, digest, .. } = summary;
    format!(
        "{duration_s:.1} s of virtual time in {wall_s:.3} s; {slots} slots, {answered} answered\n{}\nguard: {state} ({cause})\n\
         {}digest of all outputs: {digest}",
        angle(&summary.angle),
        guard_events(&summary.guard_events)
    )
}

/// What bridge and control in one process ended with.
#[must_use]
pub fn run(summary: &RunSummary) -> String {
    let earlier = match summary.guard_events_lost {
        0 => String::new(),
        lost => format!("  ({lost} earlier events are not shown: a recording holds them)\n"),
    };
    format!(
        "{}\nguard: {}\n{earlier}{}{}{}",
        angle(&summary.angle),
        summary.state,
        guard_events(&summary.guard_events),
        bus(&summary.bus),
        timing(&summary.timing)
    )
}

/// The guard's last state, and why.
fn guard_at_end(state: &str, cause: &str) -> String {
    format!("guard at the end: {state} ({cause})")
}

/// What the guard did, one line each.
fn guard_events(events: &[EventLine]) -> String {
    let line = |event: &EventLine| {
        format!("  {:9.3} s  {} -> {}: {}\n", event.time_s, event.from, event.to, event.cause)
    };
    events.iter().map(line).collect()
}

/// How an emulated body moved.
#[must_use]
pub fn body(body: &BodyMotion) -> String {
    format!(
        "ran {:.1} s; true angle while the rotors turned: rms {:.4} rad, greatest {:.4} rad; battery {:.2} V",
        body.duration_s, body.angle_rms_rad, body.angle_peak_rad, body.battery_voltage_v
    )
}

/// What an emulated bench on a bus ended with.
#[must_use]
pub fn emulated_on_bus(summary: &BusSummary) -> String {
    format!(
        "{}\nframes sent {}, not sent {}\ncommand frames received {}, accepted {}",
        body(&summary.body),
        summary.sent,
        summary.not_sent,
        summary.commands.frames,
        summary.commands.accepted
    )
}

/// What a recording amounted to.
#[must_use]
pub fn recorder(summary: RecorderSummary) -> String {
    let mut words = format!("{} records", summary.written);
    if summary.dropped > 0 {
        words += &format!(", {} LOST", summary.dropped);
    }
    if summary.disk_full_ns > 0 {
        words += &format!(", disk full for {:.1} s", span_s(summary.disk_full_ns));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::Cycle;

    #[test]
    fn columns_of_long_times_do_not_run_together() {
        let mut summary = Cycle::new(1_000_000, 1).statistics().summary();
        let age = &mut summary.sensor_age;
        (age.p50_us, age.p99_us, age.p99_9_us) = (1.0, 12_345_678.9, 312_345_678.9);
        let text = timing(&summary);
        let rows: Vec<&str> = text.lines().skip(1).collect();
        let lengths: Vec<usize> = rows.iter().map(|row| row.chars().count()).collect();
        assert!(lengths.iter().all(|length| *length == lengths[0]), "{text}");
        let row = rows.iter().find(|row| row.starts_with("sensor age")).expect("its row");
        let cells: Vec<&str> = row.split_whitespace().skip(2).collect();
        assert_eq!(cells, ["1.0", "12345678.9", "312345678.9", "0.0", "0.0"]);
    }
}
