//! Numbers that decide which benches of a fleet are shown as unlike the others.

crate::thresholds! {
    /// benches from which one may be called unlike the others: of fewer nobody knows what is usual
    fewest_benches: usize = 8, "count", "judgement";
    /// share of the benches from which on an effect, or a verdict, is usual
    usual_share: f64 = 0.9, "-", "judgement";
    /// a parameter further from the median than this many robust standard deviations is unlike the others; of a normal distribution one in two million is
    unlike_deviations: f64 = 5.0, "standard deviations", "normal distribution";
    /// a parameter nearer to the median than this share of it is never called unlike, however little the others differ
    least_deviation_share: f64 = 0.02, "-", "judgement";
}
