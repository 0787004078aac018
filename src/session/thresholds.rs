//! Numbers that decide what is said of a changed model, of a controller's loop, and of a machine.

crate::thresholds! {
    /// an error that keeps more than this share has not fallen: half a percent is what any free parameter takes from noise
    fallen_share: f64 = 0.995, "-", "judgement";
    /// how many times the error of one model of a rotor that of another is, for the one to be said to be worse on the same rows
    models_differ: f64 = 1.25, "-", "judgement";
    /// frames that may wait in the interface: after a stall each of them is an old command
    longest_queue: u32 = 16, "count", "judgement";
    /// memory that a bench needs in `/dev/shm`
    shared_memory_need: u64 = 67_108_864, "byte", "judgement";
    /// memory that a real-time process locks
    locked_memory_need: u64 = 268_435_456, "byte", "judgement";
    /// `hold_s` above which `check` warns: what a lost signal leaves the rotors on their last command for, while a body with a torque on
    /// it turns over
    long_hold_s: f64 = 0.5, "s", "judgement";
    /// time above which a reading of the clock went through the kernel or to a slow device
    slow_clock_reading_ns: u64 = 400, "ns", "judgement";
    /// share of a ratio of two periods by which it may miss a whole number: then one is a multiple of the other
    whole_ratio: f64 = 0.01, "-", "judgement";
    /// time constant of a closed loop from which it is of little use: a body that hovers has long gone by then
    sluggish_s: f64 = 20.0, "s", "judgement";
    /// time for which a bus is listened to before somebody who only asks takes a node id that nobody was heard with: each node says once
    /// a second how it is
    own_id_listens_ns: u64 = 1_200_000_000, "ns", "DroneCAN specification (MAX_BROADCASTING_PERIOD_MS), and a little";
    /// time for which a bus is listened to before node ids are given: each node says once a second who it is, and an allocator that is
    /// there already answers within one
    allocator_listens_ns: u64 = 3_000_000_000, "ns", "judgement";
    /// time for which nobody on a bus may have said that rotors may turn, or turned one, before a node's parameter is written: who arms
    /// says so twice a second here, and each second elsewhere
    disarmed_for_ns: u64 = 3_000_000_000, "ns", "judgement";
    /// time after which an exchange about a node's parameters has ended, whatever comes
    longest_exchange_ns: u64 = 10_000_000_000, "ns", "beyond every answer and every silence";
    /// batches of readings of the clock, of which the fastest counts, and readings of a batch
    clock_readings: (u64, u64) = (50, 100), "count", "judgement: one of them is not interrupted";
}
