//! Numbers that decide what a controller believes, and which gains `design` proposes.

crate::thresholds! {
    /// [rad/s] how fast a measured angle corrects the integrated one: far below the loop's own bandwidth
    angle_correction_rate: f64 = 1.0, "rad/s", "judgement";
    /// [ns] age at which a measured angle corrects nothing any more: the last word of an encoder that fell silent would hold the
    /// angle where it was while the body turns away
    angle_oldest_ns: u64 = 500_000_000, "ns", "judgement";
    /// [-] sensitivity peak above which a loop is called nervous
    nervous_peak: f64 = 2.0, "-", "the usual limit (Åström and Murray)";
    /// [-] sensitivity peak up to which a loop may be made faster
    calm_peak: f64 = 1.7, "-", "judgement";
    /// [-] factor by which the bandwidth must grow before a change of a knob is proposed for it
    bandwidth_gain: f64 = 1.02, "-", "judgement";
    /// [1/crossover] k_I over k_P of a PID that is laid out by margins: slow enough to cost 3 degrees of phase
    integral_share: f64 = 0.05, "-", "Table III of [LPC16] has about the same";
}
