//! The fields of everything that lies in a recording: names, order and units, once; those of the sensors' message are in
//! [`super::sensors`].

use std::fmt::Write as _;

use super::cdr::{CdrField, CdrMessage, Emitter, NestedDefinitions, Parser};
use super::raw_frame::RawFrame;
use crate::signal::{Applied, Command, CycleSample, GuardEvent, Heartbeat, Request, Sample, StateEstimate};

/// Names the fields of a message, in order, each with its unit or meaning; a forgotten field does not compile. In recordings a message is
/// called as its type is, or as `as` says.
macro_rules! message {
    ($type:ident $(as $name:literal)? { $($field:ident : $kind:ty = $comment:literal),* $(,)? }) => {
        impl CdrField for $type {
            fn type_name() -> String {
                Self::NAME.to_owned()
            }
            fn define(into: &mut NestedDefinitions) {
                into.add::<Self>();
                $(<$kind as CdrField>::define(into);)*
            }
            fn emit(&self, to: &mut Emitter<'_>) {
                $(CdrField::emit(&self.$field, to);)*
            }
            fn parse(from: &mut Parser<'_>) -> Option<Self> {
                Some(Self { $($field: CdrField::parse(from)?),* })
            }
            fn numbers(&self, name: &str, with: &mut dyn FnMut(String, u64, String)) {
                let dot = if name.is_empty() { "" } else { "." };
                $(self.$field.numbers(&format!("{name}{dot}{}", stringify!($field)), with);)*
            }
        }
        impl CdrMessage for $type {
            const NAME: &'static str = [$($name,)? stringify!($type)][0];
            fn fields_text() -> String {
                let mut text = String::new();
                $(
                    let _ = writeln!(
                        text, "{} {} # {}", <$kind as CdrField>::type_name(), stringify!($field), $comment
                    );
                )*
                text
            }
        }
    };
}

message!(Sample {
    value: f64 = "SI unit of the field that holds it",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC at arrival; 0 = never",
    count: u32 = "values received so far, wrapping",
    health: u32 = "bits: 1 never, 2 stale, 4 out of range, 8 not a number, 16 frozen, 32 counter",
});
message!(StateEstimate as "Estimate" {
    reference_angle: f64 = "rad",
    body_angle: f64 = "rad",
    body_rate: f64 = "rad/s",
    actuator_acceleration: f64 = "rad/s^2",
    disturbance_torque: f64 = "N m",
    model_error: f64 = "rad/s",
});
message!(Command {
    sequence: u64 = "steps of the controller from 1",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    sensors_sequence: u64 = "the sensors it answers",
    rotor: [f64; 2] = "0..1",
    torque: f64 = "N m",
    flags: u32 = "bits: 1 saturated, 2 sensor missing, 4 voltage assumed",
    controller: u32 = "1 EMC, 2 PID, 3 experiment",
    estimate: StateEstimate = "the controller's view of its state",
});
message!(Applied {
    sequence: u64 = "periods of the guard from 1",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    command_sequence: u64 = "the command it came from; 0 = safe command",
    rotor: [f64; 2] = "0..1",
    state: u32 = "guard state code",
    cause: u32 = "code of the last transition's cause",
    flags: u32 = "bits: 1 limited, 2 slewed, 4 held, 8 ramping to safe",
    misses: u32 = "consecutive periods without a fresh command",
});
message!(Request {
    sequence: u64 = "requests of this sender from 1",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    act: u32 = "1 arm, 2 disarm, 3 emergency stop",
    reserved: u32 = "0",
});
message!(GuardEvent {
    sequence: u64 = "events from 1",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    from: u32 = "guard state code before",
    to: u32 = "guard state code after",
    cause: u32 = "cause code",
    subject: u32 = "signal or rotor the cause speaks of",
    value: f64 = "the value refused or measured, in its unit",
});
message!(Heartbeat {
    count: u64 = "cycles",
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    born_ns: u64 = "ns, when this life of the process began",
    role: u32 = "1 bridge, 2 control, 3 emulate, 4 run, 5 record, 6 monitor",
    process_id: u32 = "operating-system process id",
});
message!(CycleSample {
    slot: u64 = "grid slot from 0",
    due_ns: u64 = "ns, when the slot should have begun",
    released_ns: u64 = "ns, when it began",
    finished_ns: u64 = "ns, when its command was out",
    sensor_age_ns: u64 = "ns, age of the newest gyro sample when used",
    skipped: u64 = "slots skipped so far",
    overruns: u64 = "overruns so far",
    role: u32 = "1 bridge, 2 control, 3 emulate, 4 run",
    reserved: u32 = "0",
});
message!(RawFrame {
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC at arrival or sending",
    hardware_ns: u64 = "ns, the adapter's clock; 0 = none",
    id: u32 = "11 or 29 bits",
    flags: u32 =
        "bits: 1 extended, 2 remote, 4 error, 8 FD, 16 bit rate switch, 32 error state, 64 sent by us",
    length: u8 = "data bytes used",
    data: [u8; 64] = "payload, zero behind its length",
});

/// One controller step by reference: ordinals of messages of this file, counted from 1 within their topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ControlStepLine {
    /// Which `/sensors` message it was given.
    pub sensors: u64,
    /// Which `/applied` message was fed back; 0 is never used.
    pub applied: u64,
    /// Which `/command` message it answered.
    pub command: u64,
}
message!(ControlStepLine {
    sensors: u64 = "ordinal from 1 of the /sensors message it was given",
    applied: u64 = "ordinal of the /applied message fed back to it",
    command: u64 = "ordinal of the /command message it answered",
});

/// One period of the guard by reference; ordinals as in [`ControlStepLine`], 0 = not given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GuardStepLine {
    /// [ns] the time it was given.
    pub now_ns: u64,
    /// Which `/sensors` message it was given.
    pub sensors: u64,
    /// Which `/command` message it was given, if any.
    pub newest: u64,
    /// Which `/request` message it was given, if any.
    pub request: u64,
    /// Which `/applied` message it answered.
    pub applied: u64,
    /// [ns] the time it was tripped with from outside before this step; 0 = it was not.
    pub trip_ns: u64,
    /// Code of the cause of that trip.
    pub trip_cause: u32,
}
message!(GuardStepLine {
    now_ns: u64 = "ns, the time it was given",
    sensors: u64 = "ordinal from 1 of the /sensors message it was given",
    newest: u64 = "ordinal of the /command message it was given; 0 = none",
    request: u64 = "ordinal of the /request message it was given; 0 = none",
    applied: u64 = "ordinal of the /applied message it answered",
    trip_ns: u64 = "ns, when it was tripped from outside before this step; 0 = it was not",
    trip_cause: u32 = "cause code of that trip",
});

/// What the recorder says about itself, once a second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RecorderStatus {
    /// [ns] CLOCK_MONOTONIC.
    pub stamp_ns: u64,
    /// Records written so far.
    pub written: u64,
    /// Records refused so far because the queue was full: the disk was too slow.
    pub dropped: u64,
    /// [ns] time so far in which the disk took nothing because it was full.
    pub disk_full_ns: u64,
}
message!(RecorderStatus {
    stamp_ns: u64 = "ns, CLOCK_MONOTONIC",
    written: u64 = "records written so far",
    dropped: u64 = "records refused so far because the queue was full",
    disk_full_ns: u64 = "ns so far in which the disk was full",
});
