//! Numbers that decide when the guard holds, degrades or latches, beside those of the bench file.

crate::thresholds! {
    /// [-] share of a period by which a command may be late before it counts as missed, a ramp's step may come early, and an
    /// unanswered period may be long: the jitter of an ordinary kernel
    lateness_share: f64 = 0.25, "-", "jitter of stock kernels, docs/evidence";
    /// [-] share of a period after which the command in force counts as held
    held_share: f64 = 0.75, "-", "one period less the lateness allowed";
    /// [-] share of its limit at which what is not yet lost degrades: the age of a signal, the silence of a controller
    warning_share: f64 = 0.5, "-", "judgement";
    /// [-] periods for which a controller may leave newer sensors unanswered before it degrades, whatever the hold
    unanswered_periods: f64 = 1.25, "-", "one period and the lateness allowed";
    /// [-] holds that the bucket of misses takes where the bench file does not say
    bucket_holds: f64 = 3.0, "-", "judgement";
    /// [s] time in which as many swings from limit to limit leak away as are too many
    swing_leak_s: f64 = 3.0, "s", "judgement";
    /// [ns] between two wishes to arm of a bench that arms itself
    arming_period_ns: u64 = 100_000_000, "ns", "judgement";
}

/// [ns] this share of a span.
pub(super) fn share_of(share: f64, span_ns: u64) -> u64 {
    (share * span_ns as f64) as u64
}
