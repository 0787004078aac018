//! Numbers that decide how closely a model is simulated, and what is meant by a name that it does not know.

crate::thresholds! {
    /// a step of the body's integration is at most so long: friction turns round within a few milliseconds, and so may an expression.
    longest_step_s: f64 = 5.5e-3, "s", "judgement";
    /// a step of the body's integration is at most so long where every law is smooth.
    longest_smooth_step_s: f64 = 1.1e-2, "s", "a law that takes a body's motion away within 40 ms: right to 1e-5 a step";
    /// most steps of body or gyroscope between two samples, however far apart they are.
    most_steps: f64 = 64.0, "count", "judgement (time of computing)";
    /// steps in an interval for laws with memory on the torque.
    stream_steps: usize = 4, "count", "judgement";
    /// a stride of a free body over several rows is at most so long.
    longest_stride_s: f64 = 5.5e-3, "s", "a law that takes a body's motion away within 40 ms: right to 1e-5 of it at each row";
    /// share of a rotor's fastest time constant that a step of its integration covers, at most.
    step_share: f64 = 0.35, "-", "judgement";
    /// a state of a rotor that reaches its steady state within a step this short needs no finer one.
    shortest_step_s: f64 = 2.5e-3, "s", "judgement";
    /// share of a step up to which a corner of a ramp is taken for its begin.
    corner_share: f64 = 0.01, "-", "a rotor is off by half of that of what it goes in the step";
    /// rate that resolves a corner whose place moves.
    moving_corner: f64 = 100.0, "1/s", "judgement";
    /// steps between two changes of what a rotor is given from which on it is asked whether it has settled.
    steps_to_rest: usize = 6, "count", "judgement (time of computing)";
    /// share of a state by which it moves in a step that is no motion any more.
    rests_within: f64 = 1e-12, "-", "a derivative's step moves it by a millionth";
    /// steps between two rows of a ramp that telemetry follows.
    ramp_steps: usize = 8, "count", "judgement";
    /// step in which a sensor's memory follows a rate that rises in a straight line.
    sensor_step_s: f64 = 1.4e-3, "s", "a filter of 300 rad/s: held at its mean over 5 ms, a rate would reach it with half a millisecond of delay";
    /// time to each side over which the slope of a lagging reading is taken.
    slope_reach_s: f64 = 0.02, "s", "a sensor that lags by 30 ms, at 100 Hz: the slope adds about its own noise";
    /// rows to each side, at most, over which the slope of a lagging reading is taken: of a quick log a part of the reach will do.
    most_slope_rows: f64 = 100.0, "count", "judgement (time of computing)";
    /// time between the rows of the ramp by which a sensor's lag is found, and how many rows it has.
    ramp: (f64, usize) = (0.02, 400), "s, count", "a lag of 1 s is known to 1 in 3,000 at its end";
    /// rate at which the ramp of a rotor ends: laws of a user's own may not be straight lines, and are straight enough near it.
    ramp_end: f64 = 500.0, "rad/s", "judgement";
    /// letter pairs that a name must share with a known one, more than these, to be taken for it misspelt: fewer would be a guess.
    nearest_name_percent: usize = 33, "%", "judgement";
}
