//! Numbers that decide what a report says or shows.

crate::thresholds! {
    /// a place with a smaller share of the error above the noise is not shown
    shown_share: f64 = 0.01, "-", "judgement";
    /// share below which a channel explains nothing of an error that is shown
    shown_explained: f64 = 0.005, "-", "rounding: it would be written as 0 %";
    /// times what chance reaches that a correlation must be to be spoken of
    plain_correlation: f64 = 1.5, "-", "judgement";
    /// samples within a delay that tell it from a lag, which bends the start
    samples_in_delay: f64 = 10.0, "count", "judgement";
    /// a share below this is written with two digits, others with three
    small_share: f64 = 0.1, "-", "judgement";
    /// points of a frequency response with less coherence are not drawn
    shown_coherence: f64 = 0.3, "-", "judgement";
    /// standard errors from the print from which a number is spoken of: of four honest ones one is in 44 of 100 runs
    remarkable_errors: f64 = 1.5, "standard errors", "the normal distribution";
    /// standard errors from the print from which a number is called less likely: of four honest ones one is in 17 of 100 runs
    unlikely_errors: f64 = 2.0, "standard errors", "the normal distribution";
    /// standard errors from the print from which a number is marked as wrong: of four honest ones one is in 1 of 100 runs
    wrong_errors: f64 = 3.0, "standard errors", "the normal distribution";
    /// eigenvalues nearer to 0 are not listed: what they stand for is over within a period
    shown_modulus: f64 = 1e-3, "-", "judgement";
    /// share of the crossover frequency below which no margin depends on the loop, and it is not drawn
    shown_from: f64 = 0.05, "-", "judgement";
    /// rows of a foreign log further apart than this may each be a level of a thrust stand, which is asked about
    slow_rows: f64 = 0.5, "s", "judgement: no log that shows how a rotor follows is so slow";
    /// a guessed scale of a command below this is DShot's, 1/1999
    dshot_scale: f64 = 1e-3, "-", "DShot and the usual PWM have 1/1999 and 1/1000";
    /// a curve breaks over a longer gap
    drawn_gap: f64 = 2.5, "intervals", "a row may be missing or late";
    /// buckets along x of a line, of each of which some samples are drawn: more than the pixels of a wide screen
    line_buckets: usize = 1500, "count", "judgement";
    /// points of a scatter plot that are drawn
    scatter_points: usize = 6000, "count", "judgement";
}
