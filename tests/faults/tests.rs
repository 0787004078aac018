//! Every promise over every run of the matrix.

use rotorbench::guard::{Cause, State};

use crate::bench::run_row;
use crate::fault::{Expect, Kind, ROWS, Row};
use crate::outcome::Outcome;
use crate::table::{self, RATES, RowRuns, SEED};

fn named(name: &str) -> &'static Row {
    ROWS.iter().find(|row| row.name == name).expect("a row of that name")
}

/// No command beyond the limits leaves the guard or is obeyed, no latch is left by itself, nothing turns past the hold
/// and two periods where a fault must stop it, nothing is stopped that may run on; and docs/evidence/faults.md says what came of it.
#[test]
fn the_matrix_breaks_no_promise_and_is_the_documented_table() {
    let matrix = table::matrix(SEED);
    let broken: Vec<String> = matrix
        .iter()
        .flat_map(|RowRuns { row, outcomes }| {
            let broken = outcomes.iter().flatten().flat_map(|outcome| &outcome.broken);
            broken.map(move |what| format!("{}: {what}", row.name))
        })
        .collect();
    assert!(broken.is_empty(), "{broken:#?}");
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/evidence/faults.md");
    let page = std::fs::read_to_string(page).expect("the page is there");
    let written = table::in_page(&page).expect("the page has the table's place");
    let now = table::markdown(&matrix);
    for (written, now) in written.lines().zip(now.trim().lines()) {
        assert_eq!(
            written, now,
            "the page is not what the seed gives; `tools/faults --write` writes it anew"
        );
    }
    assert_eq!(written.lines().count(), now.trim().lines().count());
}

#[test]
fn a_row_repeats_from_its_seed_and_another_seed_is_another_flight() {
    for row in ROWS.iter().filter(|row| row.kind != Kind::RecorderStuck) {
        let first = run_row(row, RATES[0].0, 77);
        assert_eq!(first, run_row(row, RATES[0].0, 77), "{}", row.name);
        assert_ne!(first.digest, run_row(row, RATES[0].0, 78).digest, "{}", row.name);
    }
}

/// One flight of 400: the count of the other node's first frame goes on from the bridge's, so that an ESC takes it. Would the bridge
/// count on as before, the ESC would take every further one, too, and refuse the bridge's as repeated.
#[test]
fn another_node_whose_count_goes_on_from_ours_is_not_obeyed_for_long() {
    let flight = run_row(named("second node commands full throttle, once a period"), 1000, 1055);
    assert_eq!(flight.highest, 1.0, "its first frame is obeyed: is there another such flight?");
    assert_eq!(flight.broken, Vec::<String>::new());
}

/// The disk is never felt: the same run to the last bit, with a recorder whose disk is full and without any.
#[test]
fn a_recorder_whose_disk_is_full_changes_no_bit_of_the_flight() {
    let fault = named("recorder's disk full");
    let with = run_row(fault, 50, 5);
    assert!(with.recorder_refused > 0, "the queue was full");
    // The same name, so that the same is drawn.
    let without = run_row(&Row { name: fault.name, kind: Kind::Nothing, expect: Expect::RunsOn }, 50, 5);
    assert_eq!(with.digest, without.digest);
}

/// The causes are those that the faults deserve: a matrix in which everything is "no fresh command" would show nobody
/// anything.
#[test]
fn faults_are_found_by_their_own_cause() {
    for (name, cause) in [
        ("gyro frames lost, all", Cause::SignalStale),
        ("gyro value frozen, frames live", Cause::SignalFrozen),
        ("gyro not a number", Cause::SignalNotANumber),
        ("gyro out of range", Cause::SignalOutOfRange),
        ("gyro frame repeated", Cause::SignalCounter),
        ("sensor frames doubled", Cause::SignalCounter),
        ("error frame: bus off", Cause::BusDead),
        ("second node commands full throttle, once a period", Cause::ForeignCommand),
        ("no room to send (ENOBUFS)", Cause::BusDead),
        ("SIGKILL of control", Cause::CommandMissing),
        ("command not a number", Cause::CommandNotANumber),
        ("command sent again and again", Cause::CommandMissing),
        ("command stamped in the future", Cause::CommandFromFuture),
        ("command new, answers old sensors (hung)", Cause::CommandAnswersOldSensors),
        ("command from limit to limit each period", Cause::Oscillation),
        ("DroneCAN: checksums of one ESC wrong", Cause::SignalStale),
        ("DroneCAN: toggle bits of the IMU wrong", Cause::SignalStale),
        ("DroneCAN: second node with one ESC's number", Cause::NodeIdTwice),
        ("DroneCAN: second node with the bridge's number", Cause::NodeIdTwice),
        ("DroneCAN: one ESC silent about how it is", Cause::NodeSilent),
        ("DroneCAN: one ESC in health ERROR", Cause::NodeUnhealthy),
        ("DroneCAN: another node says that no rotor may turn", Cause::ForeignCommand),
        ("speed check: a propeller loses 30 % of its thrust", Cause::SpeedWrong),
        ("speed check: a rotor loses step and stops", Cause::SpeedWrong),
        ("speed check: an ESC turns by itself", Cause::SpeedWrong),
    ] {
        for seed in SEED..SEED + 3 {
            let outcome: Outcome = run_row(named(name), 50, seed);
            assert_eq!(
                outcome.end,
                Some((State::FailsafeLatched, cause)),
                "{name}, seed {seed}: {outcome:?}"
            );
        }
    }
}
