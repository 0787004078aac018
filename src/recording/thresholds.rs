//! Numbers that decide when a recording is given up, and what in a file is damage.

crate::thresholds! {
    /// time for which a recording that is being closed waits for a full disk
    closing_s: f64 = 2.0, "s", "judgement";
    /// a longer record in a file is damage, not data: a chunk of ours is a few MB
    longest_record: usize = 256 << 20, "byte", "judgement";
}
