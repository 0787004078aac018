//! Numbers that decide which bench files are refused.

crate::thresholds! {
    /// shortest period of a bench.
    shortest_period_s: f64 = 0.0001, "s", "judgement";
    /// longest period of a bench.
    longest_period_s: f64 = 1.0, "s", "judgement";
}
