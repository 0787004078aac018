//! Numbers that decide what a controller believes, and which gains `design` proposes.

crate::thresholds! {
    /// how fast a measured angle corrects the integrated one: far below the loop's own bandwidth
    angle_correction_rate: f64 = 1.0, "rad/s", "judgement";
    /// age at which a measured angle corrects nothing any more: the last word of an encoder that fell silent would hold the angle where
    /// it was while the body turns away
    angle_oldest_ns: u64 = 500_000_000, "ns", "judgement";
    /// sensitivity peak above which a loop is called nervous
    nervous_peak: f64 = 2.0, "-", "the usual limit (Åström and Murray)";
    /// sensitivity peak up to which a loop may be made faster
    calm_peak: f64 = 1.7, "-", "judgement";
    /// factor by which the bandwidth must grow before a change of a knob is proposed for it
    bandwidth_gain: f64 = 1.02, "-", "judgement";
    /// share of the Nyquist frequency at which the search for a PID by margins begins, and each crossover over the one before
    crossover_grid: (f64, f64) = (0.9, 0.97), "-", "judgement: as fast as can be first, in steps of 3 %";
    /// by how much a change of γ_0 is tried, down and up
    gamma_turn: [f64; 2] = [0.8, 1.25], "-", "judgement";
    /// by how much a change of α and of α_c is tried, down and up
    alpha_turn: f64 = 0.2, "-", "judgement";
    /// commands within which the inverse of a known static curve is looked for: beyond 0..1 so far that a limited command is seen as
    /// limited
    inverse_range: (f64, f64) = (-0.5, 1.5), "-", "judgement";
    /// k_I over k_P of a PID that is laid out by margins, as a share of its crossover frequency: slow enough to cost 3 degrees of phase
    integral_share: f64 = 0.05, "-", "Table III of [LPC16] has about the same";
    /// points of the frequency grid of a loop, and decades below the Nyquist frequency at which it begins
    frequency_grid: (usize, f64) = (4000, 5.0), "-", "judgement";
    /// steps of Newton's method on the inverse of a known static curve: a fixed number, so that each period takes as long
    newton_steps: usize = 6, "count", "judgement";
    /// times that the interval 0..1 is halved before Newton's method, for a static curve whose parabola alone has no inverse: what is
    /// left of it is 2.4e-4
    inverse_halvings: usize = 12, "count", "judgement";
    /// equal steps from 0 to 1 at which a static curve must rise
    rise_points: usize = 1000, "count", "judgement: of degree 5 at most, it does not dip between them by what a rotor would show";
    /// times that the interval of a crossing of the open loop is halved
    crossing_halvings: usize = 40, "count", "judgement: to the last digits";
    /// crossovers that the search for a PID by margins tries
    crossovers_tried: i32 = 250, "count", "crossover_grid's steps of 3 %, over three decades";
}
