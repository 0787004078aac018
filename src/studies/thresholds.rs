//! Numbers that decide how runs and machines are compared.

crate::thresholds! {
    /// share of the largest angle below which a run has not been struck yet
    unmoved_share: f64 = 0.05, "-", "judgement";
    /// how far the largest angle has to stand over the usual one (rms) for an impulse to be seen in it; raised, weak impulses are not
    /// seen, lowered, noise is taken for one
    strike_over_usual: f64 = 6.0, "-", "the largest of a million values of normal noise is 5 rms";
    /// shortest stretch behind an impulse that says anything; impulses closer than that are one
    shortest_answer_s: f64 = 0.5, "s", "judgement";
    /// share of the peak within which the angle counts as settled, and beyond which it counts as a swing
    settled_share: f64 = 0.05, "-", "the usual 5 % band of a step response";
    /// share of the time judged, at its end, for which the angle has to stay within the band: it may just be passing through
    held_share: f64 = 0.05, "-", "judgement";
    /// how long the answer to an impulse is judged; what crosses the band long after is the drift of an angle that no gyro shows, and no
    /// answer to the impulse
    answer_window_s: f64 = 8.0, "s", "several times what a loop of a bench needs";
    /// shortest time for a stage of a round of `jitter`: less is no measurement
    shortest_stage_s: f64 = 0.05, "s", "judgement";
    /// how long a peer of `jitter` may take to be there
    peer_s: f64 = 10.0, "s", "judgement";
    /// most rounds of `jitter`
    most_rounds: u32 = 1000, "count", "judgement";
    /// periods that each stage of `jitter` lasts at least
    fewest_periods: f64 = 2.0, "periods", "one to begin, one to measure";
}
