//! Numbers that decide something in identification.

crate::thresholds! {
    /// a slower response to commands than this pole is asked about: no rotor on a bench is as slow.
    slowest_pole: f64 = 0.3, "rad/s", "judgement";
    /// steps whose time is read off them that may speak against a pole, at least.
    fewest_step_times: usize = 5, "count", "judgement";
    /// share of a step that counts as most of its way: a first-order lag has gone it after its time constant.
    risen_share: f64 = 0.632, "-", "1 - 1/e";
    /// pole times the time in which steps go most of their way, below which it is no pole: of a first-order lag it is 1, a dead time or a
    /// second lag make it more.
    least_pole_time: f64 = 0.5, "-", "judgement";
    /// part of a level behind which the rate counts as at rest.
    level_end_share: f64 = 0.75, "-", "judgement";
    /// commands at which a curve is asked whether it rises.
    curve_points: usize = 100, "count", "judgement";
    /// rates on each side of a step that a level needs, at least.
    fewest_level_rates: usize = 3, "count", "judgement";
    /// times its scatter at rest that a step must go.
    plain_step: f64 = 8.0, "-", "judgement";
    /// share of a step that the rate may still go in the last half of its level.
    settled_share: f64 = 0.1, "-", "judgement";
    /// share of its rise within the commands that were logged by which g(u) may fall, as a polynomial does beside a dead zone.
    falling_curve_share: f64 = 0.02, "-", "judgement";
    /// a faster pole asks for the unit of time: no rotor with a propeller is as fast.
    fastest_pole: f64 = 200.0, "rad/s", "judgement";
    /// a slow pole is off by a unit of time when it is that unit times the model's pole within this factor.
    time_unit_factor: f64 = 5.0, "-", "poles of rotors on benches: 4 to 60 rad/s";
    /// share of the voltage that a battery may have lost where nobody read it, before falling rates are blamed on the command.
    unread_battery_fall: f64 = 0.3, "-", "judgement";
    /// rates belong to another rotor's command when the error behind it is below this share of the error behind their own.
    other_rotor_error_share: f64 = 0.5, "-", "judgement";
    /// rms errors of the fit by which a curve must fall over the commands before the command counts the other way round.
    falling_rate_rms: f64 = 2.0, "-", "judgement";
    /// time over which a command's change, and the rate's behind it, are taken for the sign of an answer.
    answer_span: f64 = 0.1, "s", "a rotor with a pole of 10 rad/s has gone most of its way";
    /// standard errors of the mean of the products of changes and answers from which the rate answers a change of the command downwards.
    answer_errors: f64 = 4.0, "standard errors", "normal distribution: 3e-5 by chance";
    /// changes of one size whose answers agree, at least, where the rate is held against what it does under a command that stands.
    answers_agree: f64 = 3.0, "count", "judgement: one change may come with any event";
    /// rows under a command that stands from which it is known what the rate does there.
    answers_still: usize = 50, "count", "judgement";
    /// range of steady commands below which nothing is said of where the curve goes.
    narrowest_steady_range: f64 = 0.05, "-", "judgement";
    /// correlation of steady rates with their commands below which the rates fall.
    falling_correlation: f64 = -0.8, "-", "judgement";
    /// share of the error that commands a row earlier must take away before rates lead their commands.
    lead_error_share: f64 = 1.0 / 3.0, "-", "judgement";
    /// rows from the first jump on that a rotor is fitted alone to; four minutes at 50 Hz.
    single_fit_rows: usize = 12_000, "count", "judgement (time of computing)";
    /// by how much a command leaves a straight line at once to have made a move.
    quick_move: f64 = 0.002, "-", "judgement: 3 rad/s of a rate that goes to 1500";
    /// such moves from which a log without jumps may show how a rotor follows.
    fewest_quick_moves: usize = 24, "count", "judgement: corners of triangles are fewer";
    /// standard error of a pole, as a share of it, up to which small moves of the command are taken to show it.
    plain_pole_share: f64 = 0.1, "-", "judgement";
    /// share of the rates' scatter that a fit may leave over where rates follow their commands.
    follows_share: f64 = 0.6, "-", "judgement";
    /// power of the voltage with which a rate at one command falls at most.
    voltage_power: f64 = 2.0, "-", "judgement";
    /// share of the commands left out at either end of the range in which a rotor was seen.
    command_range_edge: f64 = 0.05, "-", "judgement";
    /// difference of two commands below which they are one: rounding of a written log.
    same_command: f64 = 1e-6, "-", "digits of a CSV log";
    /// spread of the difference of two commands from which its part in the rates is known.
    apart_spread: f64 = 0.02, "-", "judgement";
    /// steady rows that show a difference of rates.
    fewest_steady_rows: usize = 100, "count", "judgement";
    /// standard errors from which two rotors differ.
    mismatch_errors: f64 = 5.0, "standard errors", "normal distribution: 6e-7 by chance";
    /// share of a rate from which two rotors of one log differ.
    mismatch_rate_share: f64 = 0.005, "-", "judgement";
    /// share of a pole from which two rotors of one log differ.
    mismatch_pole_share: f64 = 0.02, "-", "judgement";
    /// share of a rate from which rotors of two logs differ.
    log_mismatch_rate_share: f64 = 0.01, "-", "judgement";
    /// share of a pole from which rotors of two logs differ: a battery that gives way under load makes a pole a few percent faster.
    log_mismatch_pole_share: f64 = 0.05, "-", "emulated benches with internal resistance";
    /// times that steps one way take as long as those the other way from which on a rotor has two poles.
    ways_apart: f64 = 1.5, "-", "judgement";
    /// share of the highest command from which on rates say what the rotor does at full command.
    high_command: f64 = 0.6, "-", "judgement";
    /// share of these rates, over their commands, below which the rate at full command is taken to lie.
    high_rates: f64 = 0.9, "-", "judgement: a rotor that comes down is far above its command";
    /// k_V beyond this many times the share of a volt in the greatest rate is no motor's.
    voltage_gain_of_motor: f64 = 1.5, "-", "judgement: 1 without drag, less with any; the rest for a curve that is extrapolated";
    /// share of the narrower range of commands that two logs must have in common to compare their rates.
    common_range_share: f64 = 0.5, "-", "judgement";
    /// factor between full voltages from which a battery is another one than the template's.
    fuller_battery: f64 = 1.05, "-", "judgement";
    /// share of the voltages below the one that is taken as the best: a glitch of the reading is not the battery.
    best_voltage: f64 = 0.99, "-", "judgement";
    /// share of the full voltage below which a log's battery is not the one that the full voltage is of.
    low_battery_share: f64 = 0.7, "-", "judgement";
    /// rows for each number fitted to the voltage, at least: the noise they carry over is a tenth of the reading's variance.
    rows_per_number: usize = 10, "count", "one over it is the share of noise";
    /// passes of two-stage least squares; each leaves a twentieth of the error before it.
    instrument_passes: usize = 2, "count", "emulated battery with 0.3 V of sag at hover";
    /// joint fits more, each with instruments from the numbers of the one before.
    instrument_refits: usize = 2, "count", "emulated battery with 0.3 V of sag at hover";
    /// standard errors from which the battery shows in the joint estimation.
    battery_shows_errors: f64 = 3.0, "standard errors", "normal distribution: 0.1 % by chance";
    /// time behind the begin of a level until its rotor has settled; half of a short one.
    level_settles: f64 = 2.0, "s", "a pole of 6 rad/s";
    /// time that a command is held for at the least to be a level.
    shortest_level: f64 = 2.0, "s", "judgement";
    /// readings of a settled rotor that a level has at the least.
    fewest_of_level: usize = 3, "count", "judgement";
    /// levels more than numbers that k_V between several supplies needs.
    spare_levels: usize = 3, "count", "judgement";
    /// voltage by which the supplies of several logs differ at the least for k_V to be taken from that.
    supplies_differ: f64 = 0.3, "V", "judgement: a battery's own fall in a short log";
    /// first-stage F statistic below which the voltage of a level moved too little over its noise.
    weakest_first_stage: f64 = 15.0, "-", "Stock and Yogo 2005: 10 to 16 for weak instruments";
    /// rows of one constant command that k_V needs.
    fewest_level_rows: usize = 100, "count", "judgement";
    /// standard deviation of a k_V taken from the template, as a share of it.
    assumed_gain_error: f64 = 0.5, "-", "judgement";
    /// scored samples from which anything may be fitted.
    fewest_samples: usize = 100, "count", "judgement";
    /// rows of each log that decide on the degree of g(u); four minutes at 50 Hz.
    degree_rows: usize = 12_000, "count", "judgement (time of computing)";
    /// folds of the cross-validation of the curve.
    curve_folds: usize = 5, "count", "judgement";
    /// blocks of neighbouring samples that stay together in one fold.
    curve_blocks: usize = 40, "count", "judgement";
    /// times the best degree's held-out squared error that a lower one may leave.
    degree_squares: f64 = 1.5, "-", "public logs of a nanodrone: 1.8 moved the pole by a fifth";
    /// share of the held-out squared error by which a higher degree that falls beyond the logged commands is hardly better than a lower one
    /// that rises over all of them.
    hardly_better_degree: f64 = 0.01, "-", "judgement: a tenth of the noise; a curve over 0.4 to 0.6 of the command gained 0.3 % by turning down beyond";
    /// all commands.
    all_commands: (f64, f64) = (0.0, 1.0), "-", "the range of a command";
    /// time for which a command is held, at least, to ask whether the rates settle where the model says.
    shortest_held: f64 = 1.0, "s", "judgement";
    /// difference within which two commands are one level.
    same_level: f64 = 1e-3, "-", "judgement: half a step of a command of 9 bits";
    /// readings in the second half of a hold from which on their median says where the rates settle.
    fewest_settled: usize = 8, "count", "judgement";
    /// readings of a hold that count as independent, at most: what wanders slowly is no level.
    independent_settled: f64 = 10.0, "count", "judgement";
    /// share of a rate by which a model that misses it is wrong there, whatever the noise.
    missed_level_share: f64 = 0.05, "-", "judgement: effects of the catalogue move a level by less, most of them";
    /// standard errors of a settled rate by which a model misses it.
    missed_level_errors: f64 = 5.0, "standard errors", "normal distribution, over many levels";
    /// standard errors of the held-out difference from which a higher degree is better; with 1 it was too high one time in twenty.
    degree_errors: f64 = 2.0, "standard errors", "emulated benches";
    /// steady rows from which a curve may be fitted.
    fewest_curve_rows: usize = 100, "count", "judgement";
    /// rows that are levels each from which a curve, or a thrust curve, may be fitted.
    fewest_points: usize = 6, "count", "judgement: each is an average, and no curve has more than four numbers";
    /// range of commands below which a curve is not fitted.
    narrowest_curve: f64 = 0.05, "-", "judgement";
    /// half of the time over which the slope of a command is taken: quantized commands stand still between steps.
    slope_reach: f64 = 0.125, "s", "judgement";
    /// share of the rows in which the command rises, and in which it falls, from which ramps go both ways.
    both_ways_share: f64 = 0.2, "-", "judgement";
    /// standard errors from which ramps show a lag.
    ramp_lag_errors: f64 = 3.0, "standard errors", "normal distribution: 0.1 % by chance";
    /// factor by which the pole fitted to ramps may end away from where it was seen first.
    ramp_pole_factor: f64 = 3.0, "-", "judgement";
    /// share of the curve's range that a ramp's lag may take before the ramp is too fast for Eq. (4).
    ramp_lag_share: f64 = 0.005, "-", "judgement";
    /// sampling intervals at the beginning of a stretch that are not scored with a delay; no delay that is tried is longer.
    unheard_intervals: f64 = 7.0, "intervals", "longest delay tried, and one more";
    /// half sampling intervals of the longest delay tried.
    longest_delay: usize = 12, "half intervals", "judgement";
    /// rows of each log that decide between model structures; two minutes at 50 Hz.
    alternative_rows: usize = 6_000, "count", "judgement (time of computing)";
    /// share of a time (for a dead time: of the interval) beside the best one at which the curvature of the cost is taken
    curvature_reach: f64 = 0.2, "-", "judgement";
    /// least time constant of the fast pole that is tried, over that of one lag
    least_fast_time: f64 = 1e-4, "-", "judgement: below it nothing shows";
    /// ratio of each time constant of the fast pole that is tried to the one before
    fast_time_ratio: f64 = 2.5, "-", "judgement";
    /// greatest time constant of the fast pole that is tried, over that of one lag
    most_fast_time: f64 = 0.9, "-", "judgement: the other pole is the slower one";
    /// least time constant of the slower pole, over that of one lag
    least_slow_time: f64 = 0.3, "-", "judgement";
    /// the slower pole is looked for between these shares of where both times make up that of one lag
    slow_pole_bracket: (f64, f64) = (0.6, 1.6), "-", "judgement";
    /// the slower pole stays below this share of the fast one: where they are equal the difference has no digits
    poles_apart: f64 = 0.95, "-", "judgement";
    /// quantile of the errors that is reported as the worst: beyond it lie outliers
    worst_share: f64 = 0.99, "-", "judgement";
    /// standard errors from which an alternative structure is needed, and preferred to the others.
    alternative_errors: f64 = 4.0, "standard errors", "normal distribution: 3e-5 by chance";
    /// share of the rms error that an alternative must take away.
    alternative_gain: f64 = 0.01, "-", "judgement";
    /// lag-one correlation of the residual up to which the error of an alternative is widened.
    most_correlated: f64 = 0.98, "-", "judgement";
    /// folds of the cross-validation of a delay and of the joint degree.
    delay_folds: usize = 3, "count", "judgement";
    /// lag-one correlation of the residual from which it is not noise alone.
    correlated_residual: f64 = 0.5, "-", "judgement";
    /// standard errors around an alternative's delay within which the whole record's delay is looked for.
    delay_search_errors: f64 = 6.0, "standard errors", "judgement";
    /// sampling intervals around an alternative's delay, at least, within which the whole record's delay is looked for.
    delay_search_intervals: f64 = 0.1, "intervals", "judgement";
    /// sampling intervals of the step of derivatives by the delay: between two samples the cost is a parabola.
    delay_step: f64 = 0.1, "intervals", "judgement";
    /// standard error, as a share of a number, beyond which the logs do not show it.
    insignificant_share: f64 = 0.4, "-", "2.5 standard errors";
    /// standard error, as a share of a number, beyond which it is uncertain.
    uncertain_share: f64 = 0.2, "-", "5 standard errors";
    /// standard errors from which a k_V that hardly shows speaks against the template's.
    against_template_errors: f64 = 4.0, "standard errors", "normal distribution: 6e-5 by chance";
    /// standard errors from which two estimates of one number disagree.
    disagreement_errors: f64 = 4.0, "standard errors", "normal distribution: 6e-5 by chance";
    /// distance from 1 from which the gain from z to the rate says that the static curve does not hold in motion.
    gain_off_one: f64 = 0.02, "-", "judgement";
    /// range of exciting commands below which g(u) holds near them only.
    narrow_excitation: f64 = 0.05, "-", "judgement";
    /// times the step from one rate to the next, over √2, from which on an error is far off, though no command steps.
    far_off_noise: f64 = 5.0, "-", "judgement";
    /// the same as a share of the rates themselves.
    far_off_share: f64 = 0.05, "-", "judgement: a controller has room for that";
    /// fit of a log with steps, or that is far off, below which the model does not explain it.
    unexplained_fit: f64 = 40.0, "%", "judgement";
    /// share of the body's motion from which a correlated residual counts: below, summed noise of the rotor rates looks the same.
    unexplained_motion_share: f64 = 0.2, "-", "emulated benches";
    /// length of a window of the body rate.
    body_window: f64 = 0.5, "s", "judgement";
    /// samples of the gyro in a window, at least.
    fewest_window_samples: usize = 5, "count", "judgement";
    /// windows with as many samples that J needs, at least.
    fewest_windows: usize = 10, "count", "judgement";
    /// standard errors from which the torque shows in the body rate.
    torque_shows_errors: f64 = 3.0, "standard errors", "normal distribution: 0.1 % by chance";
    /// standard errors from which a torque of the body's own is missing in the fit of J.
    omitted_torque_errors: f64 = 5.0, "standard errors", "normal distribution: 6e-7 by chance";
    /// standard errors of d/J by which a torque of the body's own that is missing must move it.
    omitted_torque_shift: f64 = 2.0, "standard errors", "judgement";
    /// rows with thrust and rate that a thrust curve needs.
    fewest_thrust_rows: usize = 20, "count", "judgement";
    /// share of the thrust that a linear part may take before c ω² is wrong.
    linear_thrust_share: f64 = 0.03, "-", "judgement";
    /// standard errors from which a linear part of the thrust counts.
    linear_thrust_errors: f64 = 4.0, "standard errors", "normal distribution: 6e-5 by chance";
    /// samples that a free run must be scored on.
    fewest_validated: usize = 10, "count", "judgement";
    /// time constants after which a free run has forgotten where it began: a fiftieth is left
    forgotten_after: f64 = 4.0, "time constants", "exp(-4) = 0.018";
    /// knots of the voltage's course, at most: 40 minutes of the shortest bends.
    most_knots: usize = 240, "count", "judgement (time of computing)";
    /// rows by which commands may stand late in a log: a row, or half of one.
    command_leads: [f64; 2] = [1.0, 0.5], "rows", "loggers that write a command with the next row";
    /// degrees of g(u) that are tried.
    highest_degree: usize = 4, "count", "[LPC16] compares several, and takes 2";
    /// share of the dead time by which it is moved, at most, where the curvature of its cost is taken
    delay_step_share: f64 = 0.5, "-", "judgement: it stays above none";
    /// share of a held command's length in which the rotor settles, at the latest
    level_settles_share: f64 = 0.5, "-", "judgement: half of the level counts";
    /// time constants of a second lag that are tried before the best of them is refined
    fast_times: i32 = 10, "count", "judgement: from least_fast_time on by fast_time_ratio each";
}
