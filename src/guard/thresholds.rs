//! Numbers that decide when the guard holds, degrades or latches, beside those of the bench file.

crate::thresholds! {
    /// share of a period by which a command may be late before it counts as missed, a ramp's step may come early, and an unanswered
    /// period may be long: the jitter of an ordinary kernel
    lateness_share: f64 = 0.25, "-", "jitter of stock kernels, docs/evidence";
    /// share of a period after which the command in force counts as held
    held_share: f64 = 0.75, "-", "one period less the lateness allowed";
    /// share of its limit at which what is not yet lost degrades: the age of a signal, the silence of a controller
    warning_share: f64 = 0.5, "-", "judgement";
    /// periods for which a controller may leave newer sensors unanswered before it degrades, whatever the hold
    unanswered_periods: f64 = 1.25, "periods", "one period and the lateness allowed";
    /// holds that the bucket of misses takes where the bench file does not say
    bucket_holds: f64 = 3.0, "-", "judgement";
    /// time in which as many swings from limit to limit leak away as are too many
    swing_leak_s: f64 = 3.0, "s", "judgement";
    /// time between two wishes to arm of a bench that arms itself
    arming_period_ns: u64 = 100_000_000, "ns", "judgement";
    /// standard deviations of the model's error, of its numbers and of its logs, by which a rotor's speed may be off for as long as it
    /// likes, where the bench file does not say
    speed_band: f64 = 7.0, "standard deviations", "normal distribution: 3e-12 by chance, whatever the correlation";
    /// standard deviations that each reading of a rotor's speed must lie outside the band to add to the sum; the sum's bound on false
    /// alarms is for this shift
    speed_drift: f64 = 1.0, "standard deviations", "Page's test: exp(-2 x drift x limit) a reading";
    /// sum of what readings of a speed lie outside the band by, at which it does not answer its command
    speed_limit: f64 = 18.0, "standard deviations", "exp(-36) a reading: 1e-6 in 100 h at 1 kHz of two rotors, both signs";
    /// most that one reading of a speed adds to the sum: three readings at least are outside, whatever one says
    speed_most: f64 = 6.0, "standard deviations", "a third of the limit";
    /// time after a command came into the model's range until its speed is judged: a rotor starts
    speed_settle_s: f64 = 0.5, "s", "as a rotor that starts in a log";
    /// time for which a command is zero before a rotor must stand: time constants of a propeller that runs out
    speed_run_out_s: f64 = 1.5, "s", "judgement: 24 time constants of the paper's rotor, which brakes";
    /// share of the hover rate below which a rotor stands
    speed_standing: f64 = 0.1, "-", "judgement: ESCs that report slow rotors at random";
    /// share of the identified commands' range by which a command may lie outside it and still be judged
    speed_range_margin: f64 = 0.05, "-", "judgement";
    /// steps in which a rotor of the model comes to rest where the speed check is only asked what it would see
    speed_rest_steps: usize = 60, "count", "exp(-15) of its way is left";
    /// length of each step in which a rotor of the model comes to rest where the speed check is only asked what it would see
    speed_rest_step: f64 = 0.25, "time constants", "as fine as a step of integration";
    /// longest step over which the model is run on; after a longer one it begins anew
    speed_longest_step_s: f64 = 2.0, "s", "twice the longest period";
    /// numbers of a model, at most, whose errors widen the band of a speed
    speed_numbers: usize = 14, "count", "time of a step";
}

/// [ns] this share of a span.
pub(super) fn share_of(share: f64, span_ns: u64) -> u64 {
    (share * span_ns as f64) as u64
}
