//! Numbers that decide what `demo` and `design` say of a run, a loop, and what options may be given.

crate::thresholds! {
    /// share of a run of the demo in which the guard may have been degraded before that is said beside the tracking error
    degraded_share: f64 = 0.05, "-", "judgement";
    /// time after the controller's first step when the guard opens at the latest in a run of the demo that is shown: the first impulse
    /// comes soon after
    open_at_latest_s: f64 = 2.0, "s", "the first impulse of the demo, at 2.5 s";
    /// shortest and longest lever arm that `identify` takes
    arms_m: [f64; 2] = [0.001, 100.0], "m", "judgement: anything else is in another unit";
    /// lowest and highest full voltage that `identify` takes
    full_voltages_v: [f64; 2] = [1.0, 1000.0], "V", "judgement: anything else is in another unit";
    /// lowest and highest hover rate that `identify` takes
    hover_rates: [f64; 2] = [1.0, 10_000.0], "rad/s", "judgement: anything else is in another unit";
}
