//! Numbers of `discover` that decide something.

crate::thresholds! {
    /// share of what acts at a site that a law there usually has
    usual_share: f64 = 0.01, "-", "judgement: the first step of a derivative";
    /// residual, over the noise, by which a law is put on to see what it does: seen, and nothing bends
    put_on: f64 = 0.01, "-", "judgement";
    /// times `put_on` by which a first step may miss it
    put_on_within: f64 = 100.0, "-", "judgement";
    /// times its lower bound beyond which the upper bound of a number inside a formula lies where it is a size: of a place it is less
    scale_span: f64 = 10.0, "-", "the library sizes span a factor of 20 and more, wave numbers and lines 3 at most";
    /// knots of a shape over one channel, first coarse: a bend, a threshold, a slope
    coarse_knots: usize = 9, "count", "judgement";
    /// knots of a fine shape over one channel: teeth and waves
    fine_knots: usize = 25, "count", "judgement";
    /// share of the held-out error by which a fine shape must do better than a coarse one
    fine_gain: f64 = 0.02, "-", "diagnose's least_gain";
    /// knots of a shape along each of two channels
    pair_knots: usize = 5, "count", "judgement";
    /// share of the held-out error by which a shape over two channels must do better than over one of them
    pair_gain: f64 = 0.1, "-", "judgement";
    /// share of a channel's values beyond each end of a shape
    tail: f64 = 0.002, "-", "judgement: a knot that no row comes near is not determined";
    /// ridge of a shape's coefficients, over the largest of their squared traces
    ridge: f64 = 1e-6, "-", "judgement: knots that no row comes near stay at none";
    /// share of the best shape's gain from which on formulas of a channel are tried
    promising_gain: f64 = 0.3, "-", "judgement";
    /// places (site and channels) whose formulas are tried, at most
    most_places: usize = 4, "count", "times of development cases";
    /// formulas that are refitted through the whole simulation, at most, of one term and of each further one
    most_refitted: usize = 10, "count", "times of development cases";
    /// formulas of one place that are refitted, at most
    most_of_place: usize = 6, "count", "times of development cases";
    /// terms of a formula, at most
    most_terms: usize = 2, "count", "judgement: three terms bend to anything";
    /// share of the held-out squared error that one more term must take off
    term_gain: f64 = 0.05, "-", "diagnose's least_gain, with room for how many are tried";
    /// standard errors by which each coefficient of a formula must differ from none
    coefficient: f64 = 3.0, "standard errors", "normal distribution: 0.3 %, as hundreds of forms are tried";
    /// share of the held-out squared error above the noise that a formula must explain
    least_explained: f64 = 0.6, "-", "judgement";
    /// times the noise floor below which no formula is looked for: what is left is as little as a floor is off by
    least_left: f64 = 1.15, "-", "diagnose's at_floor";
    /// share of the squared error by which two formulas are the same to the data, beside diagnose's own tolerance
    same_error: f64 = 0.01, "-", "diagnose's same_error, for two logs";
    /// share of its upper bound from which on a size in a formula is at it
    at_bound: f64 = 0.99, "-", "bounds are written with three digits";
    /// standard errors from stretch to stretch by which one formula does better than another at another place: then it is that place
    steadily_better: f64 = 3.0, "standard errors", "normal distribution: 0.3 %";
    /// share by which a number of the base differs from the model's own from which on laws are looked for beside the model's, too
    moved_base: f64 = 0.5, "-", "judgement: no law bends a number so far, unless the number stands in for it";
    /// times the noise floor up to which a shape is an answer
    shape_near_floor: f64 = 1.5, "-", "diagnose's near_floor";
    /// share of the error above the noise that a shape must explain to be shown as one
    shape_explained: f64 = 0.5, "-", "judgement";
    /// stretches over which it is drawn by lot which place explains most
    stretches: usize = 40, "count", "judgement";
    /// draws of the stretches over which it is drawn by lot which place explains most
    draws: usize = 400, "count", "a share known to 2.5 %";
    /// readings above which shapes and forms are compared on a part of the data
    preselected_readings: usize = 30_000, "count", "times of long logs";
    /// lines of the residual that lie closer than so many turns over the log are one
    lines_apart: f64 = 2.0, "turns", "the foot of a line in a periodogram without a window";
    /// lines (frequencies) of the residual that are tried
    lines: usize = 3, "count", "judgement";
    /// turns of a line over the log: fewer are a drift
    fewest_turns: f64 = 3.0, "turns", "judgement";
    /// alternatives named beside a formula
    most_alternatives: usize = 4, "count", "judgement";
    /// frequencies tried for each turn that the whole log lasts
    tries_per_turn: f64 = 3.0, "1/turn", "a line lies within a sixth of a turn of one";
    /// share of the readings' rate up to which lines are looked for
    highest_line: f64 = 0.25, "-", "half of Nyquist's";
    /// frequencies that are tried, at most
    most_lines_tried: usize = 6000, "count", "times of long logs";
    /// times that each number inside a formula is moved before the whole simulation refits it
    inner_rounds: usize = 3, "count", "judgement";
    /// the same of one that jumps there, which no fit moves any further
    jump_rounds: usize = 6, "count", "from a twentieth of the range to a five-thousandth";
    /// factor by which each number inside a formula is moved less far than the time before
    inner_shrink: f64 = 3.0, "-", "judgement";
    /// how far beyond the visited range formulas are held against each other, over that range
    compared_beyond: f64 = 0.5, "-", "judgement";
    /// places over a channel's range, or sizes over its size, at which thresholds, ramps and peaks of the library are tried
    places: [f64; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9], "-", "judgement: a fit goes on from the nearest";
    /// widths of the library's saturations over a channel's size
    widths: [f64; 4] = [0.02, 0.1, 0.3, 0.7], "-", "judgement";
    /// widths of the library's peaks over a channel's range
    peaks: [f64; 3] = [0.04, 0.1, 0.25], "-", "judgement: a factor of 2.5 apart";
    /// time constants of the library's warm-ups, exp(-t/τ), over the time of a log
    warm_ups: [f64; 3] = [0.05, 0.15, 0.4], "-", "judgement: a factor of some three apart";
    /// widths of the library's plays over a channel's range
    plays: [f64; 7] = [0.01, 0.02, 0.04, 0.07, 0.12, 0.2, 0.35], "-", "judgement: a factor of some two apart";
    /// widths over a channel's range of the play that says which way it went last
    ways: [f64; 3] = [0.02, 0.08, 0.25], "-", "judgement: a factor of three to four apart";
    /// half of the way between the two thresholds of the library's relays over a channel's range
    relays: [f64; 4] = [0.03, 0.08, 0.16, 0.3], "-", "judgement: a factor of two apart";
    /// time constants, in the library, of what follows a command late, beside the rotor's own
    lag_spans_s: [f64; 5] = [0.03, 0.15, 0.6, 2.5, 10.0], "s", "judgement: a factor of four to five apart";
    /// shortest and longest time constant of what follows a command late that a fit may come to
    lag_spans_within_s: (f64, f64) = (5e-3, 100.0), "s", "judgement";
    /// change of the phase at a range's ends from one wave number of the library to the next
    phase_step: f64 = 0.7, "rad", "judgement: a fit goes on from the nearest";
    /// phases at a range's ends of the longest wave and beyond the shortest, counted in `phase_step`
    waves: (usize, usize) = (3, 64), "count", "judgement: from two thirds of a wave over the range to fourteen";
}
