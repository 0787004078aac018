//! Numbers that decide something in reading logs.

crate::thresholds! {
    /// [-] median sampling intervals from which a gap is a hole: one lost sample is jitter, two are a hole.
    hole: f64 = 2.5, "-", "judgement";
    /// [-] median intervals of an input for which it is held over missing cells, at most.
    input_hold: f64 = 2.5, "-", "judgement";
    /// count: rows behind a backward stamp that are looked at to tell a glitch from a log that begins anew.
    restart_rows: usize = 10, "count", "judgement";
    /// [µs] a frame of a blackbox log further ahead of the last one is not believed before another one agrees.
    blackbox_pause: u32 = 10_000_000, "µs", "the firmware's own reader";
    /// count: turns of the control loop, as `blackbox_pause`.
    blackbox_turns: u32 = 5_000, "count", "the firmware's own reader";
    /// count: numbers that one byte of a blackbox log may become; a header can ask for hundreds, and for all memory.
    blackbox_numbers: usize = 8, "count", "the emptiest frames of firmwares make 1.5 of one";
    /// [-] lowest output of a motor below which a blackbox log's commands are DShot throttle, not pulses in µs.
    dshot_idle: f64 = 900.0, "-", "DShot's idle is 48 to 450, a pulse is 1000 µs or more";
}
