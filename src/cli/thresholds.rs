//! Numbers that decide what `demo` and `design` say of a run, a loop.

crate::thresholds! {
    /// [-] share of a run of the demo in which the guard may have been degraded before that is said beside the tracking error
    degraded_share: f64 = 0.05, "-", "judgement";
    /// [s] after the controller's first step, when the guard opens at the latest in a run of the demo that is shown: the first
    /// impulse comes soon after
    open_at_latest_s: f64 = 2.0, "s", "the first impulse of the demo, at 2.5 s";
}
