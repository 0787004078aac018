//! What the processes of a bench say about themselves.

use iceoryx2::prelude::ZeroCopySend;

/// One transition of the guard, or one counted refusal.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::GuardEvent")]
pub struct GuardEvent {
    /// Counts the guard's events from 1.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC.
    pub stamp_ns: u64,
    /// Guard state before.
    pub from: u32,
    /// Guard state after (the same for a refusal without a transition).
    pub to: u32,
    /// Cause code, see `guard::Cause`.
    pub cause: u32,
    /// Which signal or rotor the cause speaks of; `u32::MAX` = none.
    pub subject: u32,
    /// The value that was refused or measured, in its unit.
    pub value: f64,
}

/// Identity and pulse of a process on the bench.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::Heartbeat")]
pub struct Heartbeat {
    /// Counts cycles.
    pub count: u64,
    /// [ns] CLOCK_MONOTONIC of the last cycle.
    pub stamp_ns: u64,
    /// [ns] CLOCK_MONOTONIC when this process began: a restart shows as a new one.
    pub born_ns: u64,
    /// 1 bridge, 2 control, 3 emulate, 4 run, 5 record, 6 monitor.
    pub role: u32,
    /// Operating-system process id.
    pub process_id: u32,
}

/// Statistics of one cycle, published each period for recorder and monitor.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, ZeroCopySend)]
#[type_name("rotorbench::CycleSample")]
pub struct CycleSample {
    /// Grid slot number from 0; slots = run + skipped.
    pub slot: u64,
    /// [ns] when the slot should have begun.
    pub due_ns: u64,
    /// [ns] when it began: minus `due_ns` = release lateness.
    pub released_ns: u64,
    /// [ns] when its command was out: minus `due_ns` is what the deadline is on.
    pub finished_ns: u64,
    /// [ns] age of the newest gyro sample when the step used it.
    pub sensor_age_ns: u64,
    /// Slots skipped so far.
    pub skipped: u64,
    /// Overruns so far.
    pub overruns: u64,
    /// 1 bridge, 2 control, 3 emulate, 4 run.
    pub role: u32,
    /// Zero; keeps the layout free of padding.
    pub reserved: u32,
}

/// What the bus does, for whoever watches. All but the first three are totals since the process began.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ZeroCopySend)]
#[type_name("rotorbench::BusStatus")]
pub struct BusStatus {
    /// Counts publications from 1.
    pub sequence: u64,
    /// [ns] CLOCK_MONOTONIC.
    pub stamp_ns: u64,
    /// [ns] that the first own frame without an echo had waited when the echoes were listened for last, which is each fourth
    /// period: 0, or what a frame takes to reach the wire, on a live bus; on a dead one it grows from one time to the next.
    pub echo_age_ns: u64,
    /// Frames of other senders received.
    pub received: u64,
    /// Frames lost because the process did not take them in time.
    pub lost: u64,
    /// Frames given to the interface.
    pub sent: u64,
    /// Own frames seen on the bus, as far as the echoes were listened for.
    pub echoed: u64,
    /// Frames that the interface did not take.
    pub not_sent: u64,
    /// Error frames.
    pub error_frames: u64,
    /// Frames with an identifier that no role names.
    pub unknown_id: u64,
    /// Frames with the identifier of our own command, from another sender.
    pub foreign_command: u64,
    /// Frames with the right identifier and the wrong number of bytes.
    pub wrong_length: u64,
    /// Frames whose counter does not go on.
    pub counter: u64,
    /// Values that are not a number.
    pub not_a_number: u64,
    /// Values outside the allowed range.
    pub out_of_range: u64,
}
