//! Numbers in prose that the program decides by are the program's: each phrase is made from the threshold or the default, and stands on
//! its page.

use std::collections::BTreeSet;
use std::fs;

use rotorbench::estimation::quantile::MEDIAN_OF_NORMAL;
use rotorbench::guard::GuardConfig;
use rotorbench::log::LOG_SIGNALS;
use rotorbench::signal::{After, Channel, Multiplicity, Sensor};
use rotorbench::unit::UNITS;
use rotorbench::{can, control, diagnose, fleet, identify, screening, session, studies};

use super::{pages, root};

const DIAGNOSE: diagnose::thresholds::Thresholds = diagnose::thresholds::THRESHOLDS;
const IDENTIFY: identify::thresholds::Thresholds = identify::thresholds::THRESHOLDS;
const SCREENING: screening::thresholds::Thresholds = screening::thresholds::THRESHOLDS;
const FLEET: fleet::thresholds::Thresholds = fleet::thresholds::THRESHOLDS;

/// A share in percent, as it is written: 3, 0.5.
fn percent(share: f64) -> String {
    format!("{}", (1e6 * share).round() / 1e4)
}

/// What lies above a factor, in percent.
fn above(factor: f64) -> String {
    percent(factor - 1.0)
}

/// A whole number in words.
fn word(number: f64) -> &'static str {
    let words = ["none", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten"];
    assert_eq!(number.fract(), 0.0, "a whole number");
    words[number as usize]
}

/// 60000 as 60,000.
fn thousands(count: usize) -> String {
    if count < 1000 { count.to_string() } else { format!("{},{:03}", count / 1000, count % 1000) }
}

/// Words with single blanks between them, without emphasis.
pub fn words(text: &str) -> String {
    text.replace('*', "").split_whitespace().collect::<Vec<_>>().join(" ")
}

fn holds(page: &str, phrases: &[String]) {
    let (_, text) =
        pages().into_iter().find(|(name, _)| name == page).unwrap_or_else(|| panic!("no page {page}"));
    let text = words(&text);
    for phrase in phrases {
        assert!(text.contains(&words(phrase)), "{page} does not say: {phrase}");
    }
}

#[test]
fn what_diagnose_decides_by_is_what_its_pages_say() {
    let it = DIAGNOSE;
    let joins = format!("{} % (1 % where the fall is very steady)", percent(it.least_gain));
    assert_eq!(percent(it.little_gain), "1");
    let verdict = |over: &str| {
        format!(
            "within {} %{over}{} % for a body driven by measured rotors",
            above(it.at_floor),
            above(it.at_floor_driven)
        )
    };
    let blurred = it.same_error + it.indistinguishable_share;
    holds(
        "docs/guide/diagnose.md",
        &[
            joins.replace("% (", "% off the squared error ("),
            format!("falls by {} standard errors from stretch to stretch", word(it.consistent)),
            format!(
                "differs by {} standard errors from the value that stands for no effect",
                word(it.identifiable)
            ),
            format!("in fewer than 1 of {} tries", (1.0 / it.significance_level).round()),
            format!("with a large p-value (above {})", it.significance_level),
            format!("is shifted, {} times, and each time everything is fitted again", it.battery_surrogates),
            format!("further apart than {} time constants", SCREENING.seldom_readings),
            verdict("; "),
            format!("explain {} % of what the refitted model leaves", percent(it.explained)),
            format!("leave at most {} times the noise", it.near_floor),
            format!("more than {} rows together", thousands(2 * it.searched_rows)),
            format!("{} rows in all", thousands(it.searched_rows)),
            format!(
                "one row in {} of a very long log, up to {}",
                it.searched_share,
                thousands(it.most_searched_rows)
            ),
            format!("within {} % of the named one's", percent(it.same_error)),
            format!("within {} in log-likelihood", word(it.same_likelihood)),
            format!("wider that is: up to {} %", percent(blurred)),
            format!("is asked for {} standard errors of each", word(it.identifiable_slow)),
            format!("off the held-out squared error, {} % are needed", percent(it.least_gain)),
        ],
    );
    holds(
        "docs/theory.md",
        &[
            format!("by at least {joins}"),
            format!("larger than {} standard errors over stretches", word(it.consistent)),
            format!("differ from neutral by {} standard errors", word(it.identifiable)),
            format!("with a free start by {};", word(it.identifiable_slow)),
            format!("it has to be below {}", it.significance_level),
            format!("plus {} of the share that stays unexplained", it.indistinguishable_share),
            verdict(", "),
            format!("or {} % of the refitted model's squared error", percent(it.explained)),
            format!("at most {} times the floor left", it.near_floor),
        ],
    );
    assert_eq!(it.same_error, 0.005, "half a percent, on both pages");
}

#[test]
fn what_identify_and_the_screening_decide_by_is_what_their_pages_say() {
    let (it, seen) = (IDENTIFY, SCREENING);
    let shares = [
        it.mismatch_rate_share,
        it.mismatch_pole_share,
        it.log_mismatch_rate_share,
        it.log_mismatch_pole_share,
    ];
    let [rate, pole, of_logs, pole_of_logs] = shares.map(percent);
    holds(
        "docs/guide/identify.md",
        &[
            format!(
                "above {} standard errors and {rate} % of the rate, or {pole} % of the pole (two logs: {of_logs} % and {pole_of_logs} %)",
                word(it.mismatch_errors)
            ),
            format!("further apart than {} time constants", seen.seldom_readings),
            format!("{} Hz are needed for p = 16 rad/s", 16.0 / seen.seldom_readings),
            format!("a pole below {} rad/s", it.slowest_pole),
            format!("not known to {} % counts as not found", percent(it.insignificant_share)),
        ],
    );
    holds(
        "docs/guide/screening.md",
        &[
            format!("no rows for longer than {} median intervals", seen.gap_factor),
            format!("none for more than {} s", seen.battery_gap),
            format!("command below {}, and {} s after", seen.least_command, seen.starting),
            format!("({} usual intervals)", seen.bridged),
            format!("below {} V, or", seen.least_battery),
            format!("Rows {} s apart or more", seen.hold_too_slow),
        ],
    );
    holds("docs/limits.md", &[format!("rows {} s apart or more", seen.hold_too_slow)]);
    holds(
        "docs/guide/compare.md",
        &[format!("judged for {} s behind each impulse", studies::thresholds::THRESHOLDS.answer_window_s)],
    );
}

#[test]
fn what_a_fleet_and_a_bus_are_judged_by_is_what_their_pages_say() {
    let it = FLEET;
    holds(
        "docs/guide/fleet.md",
        &[
            format!("from {} benches on", it.fewest_benches),
            format!("an effect that {} in ten have", word(10.0 * it.usual_share)),
            format!("more than {} robust standard deviations", word(it.unlike_deviations)),
            format!("more than {} % away from the median", percent(it.least_deviation_share)),
        ],
    );
    let deviation = (100.0 / MEDIAN_OF_NORMAL).round() / 100.0;
    holds("docs/guide/fleet.md", &[format!("({deviation} × the median deviation)")]);
    let design = control::thresholds::THRESHOLDS;
    let (nervous, calm) = (design.nervous_peak, design.calm_peak);
    holds(
        "docs/guide/design.md",
        &[format!(
            "below a sensitivity peak of {nervous} first, then bandwidth while the peak stays below {calm}"
        )],
    );
    let bus = can::thresholds::THRESHOLDS;
    let (warned, refused) = (bus.warning_percent, bus.maximum_percent);
    holds(
        "docs/guide/can.md",
        &[format!("over {warned} % bus load it warns"), format!("a bus over {refused} %")],
    );
    holds("docs/guide/bench-file.md", &[format!("above {warned} % bus load with a warning")]);
    let silent = bus.node_silent_ns as f64 / 1e9;
    let asked = session::thresholds::THRESHOLDS;
    holds(
        "docs/guide/dronecan.md",
        &[
            format!("silent for {silent} s"),
            format!("After {silent} s of silence"),
            format!("for {} s nobody on the bus has said", asked.disarmed_for_ns as f64 / 1e9),
            format!("after {} s without an answer", bus.allocation_patience_ns as f64 / 1e9),
            format!("It listens for {} s", asked.allocator_listens_ns as f64 / 1e9),
        ],
    );
}

/// Of each unit that a column may have, its spelling.
#[test]
fn every_unit_of_a_column_is_on_the_page_of_mappings() {
    let text = fs::read_to_string(root().join("docs/guide/import.md")).expect("UTF-8");
    let table =
        text.split("| for | units |").nth(1).expect("the table").split("\n\n").next().expect("its rows");
    let shown: BTreeSet<&str> = table.split('`').skip(1).step_by(2).collect();
    let measured: BTreeSet<&str> = LOG_SIGNALS.iter().map(|signal| signal.unit).collect();
    let units = UNITS.iter().filter(|unit| measured.contains(unit.si) && !unit.name.is_empty());
    assert_eq!(shown, units.map(|unit| unit.name).collect::<BTreeSet<&str>>());
}

/// A range as the table of the guard has it.
fn range((low, high): (f64, f64), unit: &str) -> String {
    if low == -high { format!("±{high} {unit}") } else { format!("{low} to {high} {unit}") }
}

fn time(after: After) -> String {
    match after {
        After::Hold => "hold".to_owned(),
        After::Seconds(seconds) => format!("{seconds} s"),
        After::Never => "never".to_owned(),
    }
}

/// The rows of the guard's table of sensors: those that it watches in the same way share one, in the order of their table.
fn watched_sensors() -> Vec<String> {
    let mut rows: Vec<(String, Vec<&str>, Vec<String>)> = Vec::new();
    for sensor in Sensor::ALL {
        let Some(row) = sensor.guard() else { continue };
        let each = if sensor.row().multiplicity == Multiplicity::Single { "" } else { " (each)" };
        let required = if row.required { "yes" } else { "no" };
        let (stale, frozen) = (time(row.stale_after), time(row.frozen_after));
        let cells = format!("NAMES{each} | {required} | RANGES | {stale} | {frozen}");
        let range = range(row.range, sensor.unit());
        match rows.iter_mut().find(|(known, ..)| *known == cells) {
            Some((_, names, ranges)) => {
                names.push(sensor.name());
                if !ranges.contains(&range) {
                    ranges.push(range);
                }
            }
            None => rows.push((cells, vec![sensor.name()], vec![range])),
        }
    }
    let written = |(cells, names, ranges): (String, Vec<&str>, Vec<String>)| {
        format!("| {} |", cells.replace("NAMES", &names.join(", ")).replace("RANGES", &ranges.join(", ")))
    };
    rows.into_iter().map(written).collect()
}

#[test]
fn the_guards_defaults_are_those_of_its_page() {
    let it = GuardConfig::default();
    let mut phrases = vec![
        format!("(`hold_s` {} s: {} at 50 Hz, {} at 1 kHz)", it.hold_s, 50.0 * it.hold_s, 1000.0 * it.hold_s),
        format!("`ramp_periods` ({})", it.ramp_periods),
        format!("`hold_s`, `ramp_periods` | {}, {} |", it.hold_s, it.ramp_periods),
        format!("`rotor_maximum` | {} |", it.rotor_maximum),
        format!("`slew_per_s` | {} |", it.slew_per_s),
        format!("`spin_up_s` | {} |", it.spin_up_s),
        format!("`swing_limit` | {} |", it.swing_limit),
        format!("`bucket_limit`, `bucket_leak` | 3 N, {} |", it.bucket_leak),
        format!("`arm_checks_s`, `arm_timeout_s` | {}, {} |", it.arm_checks_s, it.arm_timeout_s),
        format!("`arm_checks_s` ({} s)", it.arm_checks_s),
        format!("`arm_timeout_s` ({} s)", it.arm_timeout_s),
        format!("`arm` and `disarm` older than {} s", it.request_time_to_live_s),
    ];
    phrases.extend(watched_sensors());
    holds("docs/guide/guard.md", &phrases);
}

/// Whoever adds a sensor is told which pages list them all.
#[test]
fn pages_that_list_the_sensors_have_every_one() {
    let quoted = |name: &str| format!("`{name}`");
    holds("docs/guide/can.md", &Channel::ALL.map(|channel| quoted(channel.name())));
    holds("docs/guide/emulate.md", &Sensor::ALL.map(|sensor| quoted(sensor.name())));
    let of_any_rotor = |name: &str| name.replace("_1", "_N").replace("_2", "_N");
    let signals = LOG_SIGNALS.iter().map(|signal| quoted(&of_any_rotor(signal.name)));
    holds("docs/guide/import.md", &signals.collect::<Vec<_>>());
}

/// Of an hour at 1 kHz, as measured: seconds and gigabytes, from the tool's own table.
#[test]
fn what_long_logs_cost_is_what_was_measured() {
    let table = fs::read_to_string(root().join("docs/evidence/scale.md")).expect("UTF-8");
    let of = |command: &str| {
        let row = table.lines().find(|line| line.starts_with(&format!("| 3,600,000 | `{command}`")));
        let cells: Vec<&str> =
            row.unwrap_or_else(|| panic!("no row of {command}")).split('|').map(str::trim).collect();
        let number = |at: usize| cells[at].parse::<f64>().expect("a number");
        format!("{:.0} s and {:.1} GB", number(3), number(5) / 1000.0)
    };
    let phrases = ["diagnose", "identify", "compare"].map(|command| format!("`{command}` {}", of(command)));
    holds("docs/limits.md", &phrases);
}
