//! Numbers that decide what `doctor`, `demo` and `design` say of a machine, a flight, a loop.

crate::thresholds! {
    /// [count] frames that may wait in the interface: after a stall each of them is an old command
    longest_queue: u32 = 16, "count", "judgement";
    /// [byte] that a bench needs in `/dev/shm`
    shared_memory_need: u64 = 67_108_864, "byte", "judgement";
    /// [byte] that a real-time process locks into memory
    locked_memory_need: u64 = 268_435_456, "byte", "judgement";
    /// [ns] above which a reading of the clock went through the kernel or to a slow device
    slow_clock_reading_ns: u64 = 400, "ns", "judgement";
    /// [-] share of a flight of the demo in which the guard may have been degraded before that is said beside the tracking error
    degraded_share: f64 = 0.05, "-", "judgement";
    /// [s] after the controller's first step, when the guard opens at the latest in a flight of the demo that is shown: the first
    /// impulse comes soon after
    open_at_latest_s: f64 = 2.0, "s", "the first impulse of the demo, at 2.5 s";
    /// [s] time constant of a closed loop from which it is of little use: a body that hovers has long gone by then
    sluggish_s: f64 = 20.0, "s", "judgement";
}
