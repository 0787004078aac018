//! Every check of a log, in the order in which they run. A check is one file here with one function, `check`; to add one: its file,
//! and its line in the table of what it looks at. (What it says of itself, and to whom: `docs/architecture.md`, "to add a screening
//! check".)
//!
//! What a check is given stands in `channel.rs`, `column.rs`, `rotor.rs`, `battery.rs`, `body.rs` and `attitude.rs`; what becomes of
//! what it finds, in `screened_log.rs` and its neighbours. Files that a macro names `cargo fmt` does not see: `tools/test` has
//! `rustfmt` look at them.

use super::attitude::{Attitude, Mistaken};
use super::battery::CheckedBattery;
use super::body::CheckedBody;
use super::channel::{CheckedChannel, Judgement};
use super::column::{CheckedColumn, Remark};
use super::finding::Finding;
use super::rotor::CheckedRotor;
use super::rotor_data::RotorLog;
use super::screened_log::ScreenedLog;
use super::suspicion::Suspicion;
use crate::log::Dataset;
use crate::model::Model;

/// Declares the files of the checks of each subject, and lists their functions in the same order.
macro_rules! checks {
    ($( $(#[doc = $doc:expr])+ $table:ident: $kind:ty = [$($check:ident,)+]; )+) => { $(
        $(pub mod $check;)+

        $(#[doc = $doc])+
        pub(crate) const $table: &[$kind] = &[$($check::check),+];
    )+ };
}

checks! {
    /// Of a log as a whole, before anything is known of its channels.
    LOG: fn(&Dataset) -> Vec<Suspicion> = [
        value_too_great,
        column_names,
    ];

    /// Of one channel: which of its cells are no measurements. Each may look at what is left of the ones before.
    CHANNEL: fn(&CheckedChannel) -> Option<Judgement> = [
        rate_dropout,
        battery_dropout,
        sample_and_hold,
        // A rate at the end of its range stands there, too: it is saturated, and not frozen.
        saturated,
        rate_frozen,
        gyro_frozen,
        outliers,
    ];

    /// Of any column, measured or not, for who looks at a log: nothing of it is left out.
    COLUMN: fn(&CheckedColumn) -> Vec<Remark> = [
        constant,
        perhaps_frozen,
        perhaps_saturated,
        dropouts,
    ];

    /// Of the columns of a rotor whose rates are measured: whether they can be what their names say.
    ROTOR_COLUMNS: fn(&RotorLog) -> Option<Suspicion> = [
        samples_too_far_apart,
        rows_are_levels,
        command_out_of_range,
        rate_too_fast,
        rotor_does_not_turn,
        rate_negative,
        battery_voltage_too_high,
        battery_reading_frozen,
    ];

    /// Of a rotor: which of its rates are no answers of a running rotor to a known command. Each takes what it finds out of the
    /// score itself, and looks at what the ones before left.
    ROTOR: fn(&mut CheckedRotor) -> Option<Judgement> = [
        command_saturated,
        standstill_left_out,
        moves_left_out,
        stalled,
        transient_behind_hole,
        uncommanded_motion,
        command_follows_rate,
        // Looks at the answers to steps that are left.
        steps_between_rows,
        rate_behind_thrust,
        // Says how many of the rates are used: all others come before it.
        commands_missing,
    ];

    /// Of the battery's reading as a whole, by the rotors that turn; the first that finds something decides. It takes all rows or
    /// none: what a battery had that is not connected or saturated is not known anywhere.
    BATTERY: fn(&CheckedBattery) -> Option<Judgement> = [
        battery_not_connected,
        battery_saturated,
        battery_reading_gap,
    ];

    /// Of the body as a whole: where one of them finds something, none of its rows is scored.
    BODY: fn(&CheckedBody) -> Option<Finding> = [
        body_held_still,
    ];

    /// Of the rows of the body, and of its columns: which of them are no motion of a free body, and what is said of the others.
    BODY_ROWS: fn(&CheckedBody) -> Option<Judgement> = [
        rate_is_angle_difference,
        end_stop,
    ];

    /// Of the units of time and of the body's rate and angle; the first that finds something decides.
    BODY_UNITS: fn(&Attitude) -> Option<Mistaken> = [
        body_samples_too_far_apart,
        body_rate_in_degrees,
        time_in_milliseconds,
        body_rate_too_fast,
        body_angle_in_degrees,
        body_turns_over,
    ];

    /// Of a rotor's battery beside a model of the bench, or the template of a fit.
    BATTERY_BESIDE_MODEL: fn(&RotorLog, &Model) -> Option<Suspicion> = [
        battery_in_other_unit,
        battery_of_other_bench,
    ];

    /// Of a rotor beside such a model, where its own columns can be what their names say.
    ROTOR_BESIDE_MODEL: fn(&RotorLog, &Model) -> Option<Suspicion> = [
        rate_unlike_template,
        thrust_unlike_template,
    ];

    /// Of a log's body beside such a model, where nothing else of the log is mistaken.
    BODY_BESIDE_MODEL: fn(&ScreenedLog, &Model) -> Option<Suspicion> = [
        torque_scale,
    ];
}
