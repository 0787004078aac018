//! Numbers that decide what in shared memory was left behind.

crate::thresholds! {
    /// age from which a bench's place without a live process is left behind: a younger one may still be being made
    youngest_leftover_s: u64 = 2, "s", "judgement";
}
