//! The ends of the summaries of bridge, control and run, as text.

use std::fmt::Write;

use super::{CliResult, Outcome};
use crate::rt::{Percentiles, Summary};
use crate::runtime::bus_io::BusIoSummary;
use crate::runtime::control_output::AngleError;
use crate::runtime::lockstep::run::LockstepSummary;

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
pub fn table(timing: &Summary) -> String {
    let Summary { slots, run, skipped, overruns, longest_overrun, .. } = timing;
    let mut text = format!(
        "slots {slots} = run {run} + skipped {skipped}; overruns {overruns}, at most {longest_overrun} in a row\n"
    );
    let _ =
        writeln!(text, "{:24}{:>10}{:>10}{:>10}{:>10}{:>10}", "[µs]", "p50", "p99", "p99.9", "p99.99", "max");
    let lines = [
        ("release lateness", &timing.lateness),
        ("execution", &timing.execution),
        ("command out, after due", &timing.response),
        ("sensor age", &timing.sensor_age),
        ("sensor to command", &timing.sensor_to_command),
    ];
    for (name, Percentiles { p50_us, p99_us, p99_9_us, p99_99_us, max_us, .. }) in lines {
        let _ =
            writeln!(text, "{name:24}{p50_us:10.1}{p99_us:10.1}{p99_9_us:10.1}{p99_99_us:10.1}{max_us:10.1}");
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

/// Prints what a run on virtual time ended with.
///
/// # Errors
/// None: every number has a form in JSON.
pub fn say_lockstep(summary: &LockstepSummary, json: bool) -> CliResult {
    // A slot without an answer: the controller has vanished.
    let outcome = if summary.answered == summary.slots { Outcome::Done } else { Outcome::FoundWanting };
    if json {
        println!("{}", crate::report::json::answer(summary)?);
        return Ok(outcome);
    }
    let LockstepSummary { slots, answered, duration_s, wall_s, state, cause, .. } = summary;
    println!("{duration_s:.1} s of virtual time in {wall_s:.3} s; {slots} slots, {answered} answered");
    println!("{}", angle(&summary.angle));
    println!("guard: {state} ({cause})");
    for event in &summary.guard_events {
        println!("  {:9.3} s  {} -> {}: {}", event.time_s, event.from, event.to, event.cause);
    }
    println!("digest of all outputs: {}", summary.digest);
    Ok(outcome)
}
