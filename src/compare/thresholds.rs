//! Numbers of `compare` that decide something.

crate::thresholds! {
    /// fewer samples of a log say nothing
    fewest_samples: usize = 50, "count", "judgement";
    /// departure of a slow state from its steady state that is tried to learn what it does: the response is close to linear
    slow_trial: f64 = -0.5, "-", "linearity of the memory laws";
    /// variance of the noise alone over that of the signal, from which on the signal counts as one that never moves
    still_noise: f64 = 1.5, "-", "a signal that is noise and nothing else: 1";
    /// what a noise floor may be off by its assumptions: white noise, straight lines between samples
    floor_error: f64 = 1.05, "-", "judgement";
    /// relative scatter of a noise estimate
    floor_scatter: f64 = 0.02, "-", "6,000 normal samples: 1.5 %";
    /// share of one estimate of a noise below which another one is clearly less, and not the same within their scatter: only beyond it does
    /// what a model leaves replace what the signal shows, and all that is left its white part
    clearly_less_noise: f64 = 0.9, "-", "judgement";
    /// third differences in windows, at least, that tell the noise of what a model leaves
    fewest_differences: usize = 200, "count", "the block of a noise estimate";
    /// the window of a slope reaches so far to both sides
    slope_reach_s: f64 = 0.08, "s", "judgement";
    /// share of an interval by which its neighbours may differ and rows are even
    even_rows: f64 = 0.1, "-", "judgement";
    /// bins of equal count over a channel
    bins: usize = 24, "count", "judgement";
    /// circular shifts of a channel with which its share is compared: 5 %
    surrogates: usize = 19, "count", "resolution 1 / (1 + n)";
    /// share by which a dependence must exceed the best of its surrogates to be real
    least_dependence: f64 = 0.02, "-", "judgement";
    /// samples of an error that are held beside the channels of a log at most
    most_related_rows: usize = 240_000, "count", "times of long synthetic logs";
    /// stretches of a long error in which is looked for what it follows in time
    related_stretches: usize = 24, "count", "many times the greatest lag each, and more than any phase of an experiment";
    /// standard errors of a correlation between unrelated signals beyond which it counts
    correlation_bound: f64 = 2.58, "standard errors", "normal distribution: 1 %";
    /// greatest lag looked at, in samples
    most_lag: usize = 50, "count", "judgement";
    /// stretches of time that the error is shown over
    stretches_shown: usize = 60, "count", "columns of a small terminal";
    /// quantile of the slopes that counts as the fastest: beyond it lies noise
    fast_share: f64 = 0.99, "-", "judgement";
    /// a signal slower than this share of its fast motion (99th percentile) is at rest
    at_rest: f64 = 0.05, "-", "judgement";
    /// share of samples up to which lines over the missing ones do not show in a spectrum
    few_missing: f64 = 0.03, "-", "judgement";
    /// samples of a piece that is transformed at once; half of it overlaps the next
    spectrum_piece: usize = 512, "count", "judgement";
    /// how fast the slope of the unknown torque walks beside the torque itself
    slope_rate: f64 = 1.0, "1/s", "judgement";
    /// least walk of the unknown torque tried
    slowest_walk: f64 = 1e-4, "N m/sqrt(s)", "torques of benches of 0.1 to 10 N m";
    /// walks tried, each twice the one before
    walks_tried: usize = 17, "count", "slowest_walk to 10 N m/sqrt(s)";
    /// samples from which the walk is chosen
    walk_samples: usize = 20_000, "count", "times of long logs";
    /// pieces so near each other are one to the spectrum
    joined_gap: f64 = 2.5, "intervals", "a row may be missing or late";
    /// samples to both sides over which a channel's rate of change is taken
    rate_reach: usize = 2, "count", "judgement";
    /// samples to both sides, at least and at most, of the window of a slope
    slope_reach: (usize, usize) = (2, 100), "count", "a slope needs five samples; time of computing";
    /// length of a stretch over the reach of the window of a slope, below which it says nothing of the gyroscope: half of it is edge
    slope_stretch: usize = 4, "-", "judgement";
    /// noise that a gyroscope has at least: one without visible noise still has a last digit
    least_gyro_noise: f64 = 1e-6, "rad/s", "judgement";
    /// noise that a measured angle has at least: one without visible noise still has a last digit
    least_angle_noise: f64 = 1e-7, "rad", "judgement";
    /// rows from one reading to the next, at most, for the spectrum of an error that is not there in each row
    widest_stride: usize = 4, "rows", "judgement";
    /// horizon of the windows of the body, unless another one is asked for
    usual_horizon_s: f64 = 0.3, "s", "judgement";
    /// shortest and longest horizon that make sense
    horizons_s: (f64, f64) = (0.01, 600.0), "s", "judgement";
}
