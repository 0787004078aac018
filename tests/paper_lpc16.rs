//! The equations of Lotufo et al., MED 2016, each with the paper's numbers. `print` is what the paper prints.

#[path = "paper_lpc16/alone.rs"]
mod alone;
#[path = "paper_lpc16/bad_logs.rs"]
mod bad_logs;
#[path = "paper_lpc16/bookkeeping.rs"]
mod bookkeeping;
#[path = "paper_lpc16/dead_time.rs"]
mod dead_time;
#[path = "paper_lpc16/gains.rs"]
mod gains;
#[path = "paper_lpc16/identification.rs"]
mod identification;
#[path = "paper_lpc16/logs.rs"]
mod logs;
#[path = "paper_lpc16/one_battery.rs"]
mod one_battery;
#[path = "paper_lpc16/steps.rs"]
mod steps;
#[path = "paper_lpc16/taken.rs"]
mod taken;
#[path = "paper_lpc16/thrust.rs"]
mod thrust;

/// [s] T_c of Table IV.
const T_C: f64 = 0.02;
/// β with which Table II comes out.
const BETA: f64 = 0.276;

fn close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected} within {tolerance}");
}
