//! Numbers of `diagnose` that decide something.

use crate::estimation::output_error::FitConfig;

crate::thresholds! {
    /// fewer training samples cannot tell anything of a block
    fewest_samples: usize = 100, "count", "judgement";
    /// held-out errors of the refitted baseline above so many times the nominal one's are said
    refitted_worse: f64 = 1.05, "-", "judgement";
    /// share of the held-out squared error that one effect takes off beside a held curve; where it is less, effects are looked for beside a free one, too
    explained_by_one: f64 = 0.25, "-", "two real logs: 0.11 where a free curve leaves a quarter of the error, 0.45 where it leaves nearly twice as much";
    /// commands of a rotor that stay within this excite nothing
    least_command_range: f64 = 1e-3, "-", "judgement";
    /// share of the greatest torque that its changes must be: less is rounding
    least_torque_range: f64 = 1e-6, "-", "judgement";
    /// below so many training samples starts are compared on all of them
    many_samples: usize = 3000, "count", "times of the development cases";
    /// one sample in so many suffices to compare starts
    coarse_share: usize = 3, "count", "times and answers of the development cases";
    /// readings that suffice to compare starts, of however many
    enough_samples: usize = 12_000, "count", "times and answers of the development cases";
    /// where starts are compared, one part in so many of a level held for long, the first, is seen in full
    way_to_level: usize = 4, "count", "times and answers of a public log of 103 levels";
    /// where starts are compared, one reading in so many is seen behind that part
    thinned_level: usize = 8, "count", "times and answers of a public log of 103 levels";
    /// from so many readings on a fit goes on a part of them first
    long_log: usize = 30_000, "count", "times of long synthetic logs";
    /// rows that a search goes over at least: of logs with more than twice as many it sees stretches
    searched_rows: usize = 20_000, "count", "times of long logs, real ones among them";
    /// rows of each of several rotors that a search goes over at least
    searched_rows_of_each: usize = 8_000, "count", "times and answers of a public log of four motors: the same as of 30,000 rows";
    /// a search goes over one row in so many of a very long log, as far as `most_searched_rows`
    searched_share: usize = 30, "count", "times of long synthetic logs";
    /// rows that a search goes over at most
    most_searched_rows: usize = 120_000, "count", "times of long synthetic logs";
    /// rows of a rotor's error of which is asked what it depends on at most; of more, as many scattered over them
    most_evidence_rows: usize = 240_000, "count", "times of long synthetic logs";
    /// stretches of a log that a search sees: as many of two rotors as leave a slow state of each run its own start
    searched_stretches: usize = 2, "count", "most_slow_starts";
    /// places to which a stretch is moved over its own length to see where most moves
    stretch_steps: usize = 8, "count", "judgement";
    /// parts that a log is cut into where no other log is held out
    folds: usize = 3, "count", "judgement";
    /// samples of a piece of a run, at least, of which a part of it is made
    shortest_piece: usize = 50, "count", "judgement";
    /// pieces of a run, at most, of which a part of it is made
    most_pieces: usize = 10, "count", "judgement";
    /// stretches that data are cut into, so that each fold has something of everything
    fold_stretches: usize = 30, "count", "judgement";
    /// window over which the gyro is held against the angle: longer than the angle's noise, shorter than a swing.
    gyro_window_s: f64 = 0.1, "s", "judgement";
    /// windows from which on the gyro held against the angle says anything.
    fewest_gyro_windows: usize = 50, "count", "judgement";
    /// standard errors that are added to the lag of the gyro which the angle shows.
    behind_angle_errors: f64 = 3.0, "standard errors", "normal distribution: 0.3 %";
    /// lag of the gyro behind the angle below which it is none.
    behind_angle_rows: f64 = 0.15, "rows", "a twentieth of a row on a public pitch bench";
    /// what does not count where a run begins, up to so long, is not run through: the rate is free where it first counts.
    longest_uncounted_start_s: f64 = 0.25, "s", "transients of real logs behind a hole";
    /// parts of a log whose biases of the gyro are held against each other.
    drift_parts: usize = 20, "count", "judgement";
    /// squared steps between neighbouring biases over the squares about their mean below which they drift: without order it is two.
    drift_ratio: f64 = 0.61, "-", "drawn normal biases of twenty parts: one in ten thousand";
    /// standard deviation below which a drifting bias is none.
    least_drift_rad_s: f64 = 1e-5, "rad/s", "judgement: far below the noise of any gyro";
    /// angle turned over the gyro's integral from which on a gyro moves as the angle does.
    least_gyro_scale: f64 = 0.5, "-", "judgement: a scale is off by a tenth at most";
    /// standard deviation of a drifting bias over its mean from which on it is no constant.
    drift_of_bias: f64 = 0.25, "-", "judgement";
    /// heat at the start is fitted for at most so many stretches: for many short ones it is not identifiable
    most_slow_starts: usize = 4, "count", "judgement";
    /// time constants after which a rotor has forgotten where it began: e^-8 is below any noise
    forgotten_after: f64 = 8.0, "time constants", "the exponential";
    /// what was commanded before a log began is not known: the body windows that a rotor with a dead time drives begin so much later
    unlogged_command_s: f64 = 0.1, "s", "the longest dead time of real benches";
    /// different commands that can show a quantization grid: over fewer it is an offset of each level
    fewest_commands_for_grid: usize = 60, "count", "development cases of tools/campaign";
    /// samples for which commands are held, on the whole, where levels were meant
    held_samples: usize = 20, "count", "judgement";
    /// fewer levels than these are no experiment of levels
    fewest_levels: usize = 9, "count", "judgement: three for each fold";
    /// a fit to the end: a change of the cost by a hundred-thousandth decides nothing
    full_fit: FitConfig = FitConfig { iterations: 40, tolerance: 1e-5, goal: None, reuses_slopes: true, rescues_units: true }, "-", "judgement";
    /// the first fit of a set, by which the best sets are chosen
    brief_fit: FitConfig = FitConfig { iterations: 10, tolerance: 1e-3, goal: None, reuses_slopes: true, rescues_units: false }, "-", "times of the development cases";
    /// a fit on a fold from the end of the fit on all data, or back: it is not far
    fold_fit: FitConfig = FitConfig { iterations: 15, tolerance: 1e-4, goal: None, reuses_slopes: true, rescues_units: true }, "-", "times of the development cases";
    /// the first steps by which starts are compared
    start_fit: FitConfig = FitConfig { iterations: 4, tolerance: 1e-3, goal: None, reuses_slopes: true, rescues_units: false }, "-", "times of the development cases";
    /// share of the cost without the effect that a fit must fall below to be fitted to the end: model selection asks for more
    promising_share: f64 = 0.99, "-", "least_gain, with room";
    /// a second start is fitted from when its first look was within this factor of the best
    second_start: f64 = 1.1, "-", "judgement";
    /// starts of a set that are followed behind their first step
    starts_followed: usize = 3, "count", "times and answers of sets of three of tools/campaign";
    /// starts of one candidate, at most, from the same base numbers
    most_starts: usize = 12, "count", "times of the development cases";
    /// a start that costs so many times what it costs without the effect is made weaker
    too_strong_start: f64 = 4.0, "-", "benches that turn five times as fast";
    /// times, at most, that a start which is too strong is made weaker, to `weakening` of it each time
    most_weakenings: usize = 6, "count", "judgement";
    /// a base number refitted by more than this share may have been driven into another valley: fits start from its nominal value, too
    moved_base: f64 = 0.25, "-", "development cases of tools/campaign";
    /// moved by more than this share, base numbers hide the steps of a grid, which are a few rad/s
    moved_base_for_grid: f64 = 0.002, "-", "steps of 1/256 to 1/4096 on the development cases";
    /// stretches by which residuals of two fits are compared
    stretches_compared: usize = 24, "count", "judgement";
    /// fewer stretches have no scatter that says anything
    fewest_stretches_compared: usize = 4, "count", "judgement";
    /// standard errors by which the one parameter of an effect must differ from none
    identifiable: f64 = 2.0, "standard errors", "normal distribution: 5 %";
    /// time constants of a slow state that the longest run must last: over less its course is a constant, and the effect is the same as a level
    /// of its own for each run
    least_slow_course: f64 = 0.2, "time constants", "development cases of tools/campaign";
    /// standard errors by which the one parameter of an effect must differ from none, for an effect whose state at the start of each run is free, too
    identifiable_slow: f64 = 3.0, "standard errors", "development cases of tools/campaign";
    /// of two effects that cancel, less than this share of the power of either is left
    cancelled_share: f64 = 0.2, "-", "development cases of tools/campaign";
    /// samples on which every value of a grid is looked at
    grid_first_samples: usize = 1000, "count", "times of the development cases";
    /// samples that the best values of a grid are looked at with after the first look
    grid_second_samples: usize = 3000, "count", "times of the development cases";
    /// share of a step by which the place of a typical command on the grid moves from one value to the next
    grid_phase: f64 = 0.07, "-", "judgement";
    /// places within a step at which a grid behind a law that moves the command is looked at
    grid_places: u32 = 4, "count", "judgement: an eighth of the rows are off by a step at most";
    /// places within a step at which a grid behind a law that moves the command is looked at first, with every value of its step
    grid_places_first: u32 = 2, "count", "times of a slow ramp behind a dead zone: a quarter of the rows are off at most";
    /// places within a step at which a grid behind a law that moves the command is looked at last, with the best values of its step
    grid_places_closer: u32 = 16, "count", "judgement";
    /// steps of a grid to each side over which the number of a law ahead of it is looked for; a few values fall into each
    steps_ahead_of_grid: f64 = 2.0, "steps", "a quarter of a step from one value to the next";
    /// whole steps to each side by which a grid is moved that lies there as before: a curve that bent takes up a few
    whole_steps: u32 = 8, "steps", "ramps and steps behind a dead zone";
    /// secants by which the place of a grid moved by whole steps is found: behind a dead zone, where they are exact, it takes a few
    most_secants: usize = 8, "count", "judgement";
    /// steps by which the place of a grid moved by whole steps may be off
    whole_step_tolerance: f64 = 1e-6, "steps", "judgement: far below what a look tells";
    /// turns, at most, in which a grid and what is ahead of it are moved, as long as the cost falls by `grid_turn_tolerance`
    most_grid_turns: usize = 6, "count", "judgement";
    /// share by which a turn of moving a grid and what is ahead of it must lower the cost for another turn to follow
    grid_turn_tolerance: f64 = 0.003, "-", "judgement";
    /// standard errors within which the fitted data hardly tell the numbers of a grid from the best: held out, where a new command comes to
    /// one level or the one beside it, all of these count
    hardly_worse_errors: f64 = 2.0, "standard errors", "normal distribution: 5 %";
    /// numbers of a grid looked at to each side within `hardly_worse_errors`
    hardly_worse_looks: i32 = 8, "count", "judgement";
    /// grids that the fitted data hardly tell from the best, at most, that are looked at on held-out data
    most_hardly_worse: usize = 200, "count", "times of a ramp behind a dead zone";
    /// share of a step of a grid to each side over which the number of a law ahead of it is looked for after the first turn
    phase_reach: f64 = 0.25, "-", "judgement";
    /// differences of neighbouring commands to each side over which a grid and the law ahead of it are looked at together, and then about
    /// the best
    joint_scan_reach: [f64; 2] = [2.0, 0.4], "-", "judgement: the width of a dead zone was off by one, at most; thirty levels ask for a thirtieth";
    /// looks to each side at what is ahead of the grid, and at its spacing
    joint_scan_counts: [i32; 2] = [20, 10], "count", "times of a ramp behind a dead zone";
    /// share by which the step of a grid is made longer or shorter, at most, where it is looked at together with what is ahead of it
    most_grid_stretch: f64 = 0.2, "-", "judgement: three levels are half their range apart";
    /// rows at which `joint_scan_counts` looks are taken; of more rows as many fewer
    joint_scan_rows: usize = 10_000, "count", "times of long synthetic logs";
    /// commands, evenly over their range, of which is asked whether the laws ahead of a grid, as a dead zone, let them through
    commands_asked: usize = 32, "count", "judgement";
    /// share of the range of commands that come through, to each side of its middle, over which what a law ahead of a grid makes of more command is taken
    spacing_reach: f64 = 0.01, "-", "judgement: a dead zone is a straight line there";
    /// a grid whose rounding error is below this share of the noise cannot be seen
    least_grid_noise: f64 = 0.4, "-", "development cases of tools/campaign";
    /// commands that a step of a grid holds, on the whole, at least: with fewer it is an offset of each of them
    least_commands_of_step: f64 = 2.0, "count", "counting; a public log with commands 8 µs apart: steps of 1 and 8.6 µs took what a drag and a delay explain";
    /// share of the finest grid looked at below which one that a fit ends with is too fine
    end_of_finest_grid: f64 = 0.95, "-", "judgement: looks nearby move it by less";
    /// values of a grid looked at, at most
    most_grid_values: usize = 10_000, "count", "times of the development cases";
    /// values of a grid's step, the best on few samples, that are looked at on more samples
    grid_values_second: usize = 40, "count", "judgement";
    /// values of a grid's step, the best on more samples, that are looked at on all samples
    grid_values_third: usize = 10, "count", "judgement";
    /// residual, over the noise, from which on it counts by its size, not its square (pseudo-Huber)
    grid_robust_width: f64 = 1.5, "-", "the usual 1.345 to 1.5 of robust regression";
    /// values of a grid's step that get closer looks
    grid_values_closer: usize = 3, "count", "judgement";
    /// values of a closer look at a grid on each side
    grid_fine_values: i32 = 8, "count", "judgement";
    /// factor by which the next look at a grid is wider than the spacing of the one before
    grid_overlap: f64 = 1.5, "-", "judgement";
    /// size that a parameter is taken to have where its card starts it from zero alone
    unknown_size: f64 = 0.1, "-", "judgement";
    /// bounds of a pole in a fit: faster than a sample, or slower than a log, no fit can see
    pole_bounds: (f64, f64) = (0.05, 400.0), "rad/s", "judgement";
    /// bounds of the inertia in a fit, over where it starts
    inertia_bounds: (f64, f64) = (1e-4, 1e4), "-", "judgement: no fit is to end there";
    /// share of its bound within which a number has run off to it
    bound_share: f64 = 1e-3, "-", "judgement";
    /// greatest voltage gain in a fit
    most_voltage_gain: f64 = 1e3, "rad/(s V)", "judgement: no fit is to end there";
    /// rounds, at most, in which a grid and the numbers beside it are moved in turns, as long as that gains `promising_share`
    grid_rounds: usize = 3, "count", "judgement";
    /// looks at a grid, closer and closer: on a long log a step shows to a millionth
    grid_looks: i32 = 4, "count", "long synthetic logs";
    /// beam width: single effects that are carried on
    beam_width_single: usize = 3, "count", "development cases of tools/campaign";
    /// beam width: sets of two and more that are carried on; what several laws approach together is mostly none of them
    beam_width_sets: usize = 2, "count", "development cases of tools/campaign";
    /// pairs: candidates fitted briefly beside each effect, and fitted to the end; a law in a corner looks like nothing at first
    pair_candidates: (usize, usize) = (usize::MAX, 8), "count", "development cases of tools/campaign";
    /// larger sets: candidates fitted briefly beside each set, and fitted to the end
    set_candidates: (usize, usize) = (8, 4), "count", "development cases of tools/campaign";
    /// effects, and pairs, those that leave least, which get one more effect each where the beam's answer leaves much of the error
    wide_beam: usize = 5, "count", "sets of three of tools/campaign";
    /// candidates fitted briefly beside each of the `wide_beam` sets, and fitted to the end beside all of them
    wide_candidates: (usize, usize) = (8, 16), "count", "times of sets of three of tools/campaign";
    /// times the squares that the best known set of as many effects leaves, from which a set that grew from the `wide_beam` is not fitted
    /// to the end after its brief fit
    wide_reach: f64 = 1.5, "-", "a fit to the end takes off up to a fifth: two real logs";
    /// how often one effect of the best three is exchanged for another, and a set for one that leaves less
    most_exchanges: usize = 2, "count", "judgement: two wrong ones";
    /// beyond so many times the noise floor more than one effect of the best three is wrong
    exchange_over_floor: f64 = 2.0, "-", "sets of three of tools/campaign: one wrong one leaves 1.1 to 1.5";
    /// sets with one effect of the best three exchanged, or with two in the place of one of the answer's: fitted briefly, and fitted to the end
    exchange_candidates: (usize, usize) = (16, 6), "count", "times of sets of three of tools/campaign";
    /// by so many times another weight of rate to angle is one for which sets are fitted again
    other_weights: f64 = 1.25, "-", "judgement";
    /// sets of each size that are fitted again under other weights, at most, best first; of those larger than the answer a few
    most_reweighed: (usize, usize) = (12, 4), "count", "times of sets of three of tools/campaign";
    /// indistinguishable sets, nearest first, whose exchanges are made two at once
    near_exchanged: usize = 6, "count", "judgement";
    /// sets with two effects of the answer exchanged that are fitted to the end
    twice_exchanged: usize = 4, "count", "two laws in the place of each of two, or three in that of one";
    /// effects of one block, at most, with one to spare
    most_effects: usize = 5, "count", "judgement";
    /// below this factor of the noise floor no pair is looked for whose effects gain nothing one by one
    nearly_at_floor: f64 = 1.06, "-", "development cases of tools/campaign";
    /// below this factor of the noise floor no further effect is looked for
    done_at_floor: f64 = 1.03, "-", "development cases of tools/campaign";
    /// what is so many times over its noise floor has something else on it, where one more effect leaves more than `hopeless_left`
    hopeless_over_floor: f64 = 3.0, "-", "development cases of tools/campaign: two of three effects leave up to 2.3; with 3.0, 39 laws outside the catalogue are all still unknown";
    /// share of the error that one more effect leaves: beyond it a further one would bend a curve to the data
    hopeless_left: f64 = 0.8, "-", "development cases of tools/campaign";
    /// an effect that leaves so many times the squares that another one leaves is no answer, and no start of a good one
    hopeless_single: f64 = 4.0, "-", "development cases of tools/campaign";
    /// indistinguishable sets named beside the answer
    most_alternatives: usize = 2, "count", "judgement";
    /// indistinguishable sets listed after those named beside the answer
    most_further_alternatives: usize = 4, "count", "three laws in the place of one effect, two in that of another";
    /// held-out squared error must fall by this share for one more effect: less is no law
    least_gain: f64 = 0.03, "-", "development cases of tools/campaign";
    /// share, smaller than `least_gain`, that will do where the fall is very consistent and the fitted data gain much
    little_gain: f64 = 0.01, "-", "development cases of tools/campaign";
    /// the error must fall by more than so many standard errors of its fall, stretch by stretch
    consistent: f64 = 2.0, "standard errors", "normal distribution: 5 %";
    /// standard errors of a fall that is very consistent
    very_consistent: f64 = 3.0, "standard errors", "normal distribution: 0.3 %";
    /// greatest surrogate-test p-value of an effect that counts
    significance_level: f64 = 0.05, "-", "convention";
    /// share of its error that the noise of a channel counts as, at least: model error must not rule by a small noise
    least_channel_weight: f64 = 0.2, "-", "judgement";
    /// different commands that must lie beyond a limit: one is indistinguishable from a curve that bends there
    fewest_beyond_limit: usize = 2, "count", "counting: a curve through one level is free";
    /// share of the unexplained squared error within which two sets are the same: a tenth of the error itself
    indistinguishable_share: f64 = 0.21, "-", "development cases of tools/campaign";
    /// times the cost of changed numbers at which a fit of one effect instead is given up
    given_up: f64 = 1.2, "-", "times of the development cases";
    /// shifted traces tried for each candidate: p-values to 0.005
    surrogates: usize = 199, "count", "resolution 1 / (1 + n)";
    /// one shifted trace of so many does as well as the level shown: 5 %
    surrogate_quantile: usize = 20, "count", "convention";
    /// a p-value that this or fewer shifts could not show is taken from windows with random signs
    rare_p_value: f64 = 0.01, "-", "resolution of few windows";
    /// windows below which no surrogate tells anything
    fewest_windows: usize = 8, "count", "2^8 signs";
    /// changes between rows with and without a measurement, one in so many rows, from which on a log is patchy
    patchy: usize = 20, "count", "judgement";
    /// share of the power of a shifted trace that must lie on measurements
    least_shared_power: f64 = 0.2, "-", "judgement";
    /// shifted battery readings tried; none of them may do as well: two laws are tested, each perhaps beside several sets
    battery_surrogates: usize = 79, "count", "development cases of tools/campaign";
    /// p-value above which a law that reads the battery is dropped: 1 / (1 + battery_surrogates)
    battery_significance_level: f64 = 1.0 / 80.0, "-", "development cases of tools/campaign";
    /// share of the log by which a reading is shifted at least: the battery of the next second says nearly the same
    least_battery_shift: f64 = 0.05, "-", "judgement";
    /// costs within this factor of each other are nearly the same
    nearly_as_well: f64 = 1.02, "-", "judgement";
    /// relative difference of costs within which fits have converged to the same
    converged_cost: f64 = 1e-4, "-", "full_fit, with room";
    /// samples that suffice for the test of shifted battery readings; of more, pieces from all over the log are taken
    battery_samples: usize = 10_000, "count", "times of long synthetic logs";
    /// share by which the squared error of the body must differ before it decides about the rotors
    decides_between_drivers: f64 = 0.05, "-", "development cases of tools/campaign";
    /// sets of the rotors that are tried as what drives the body, beside their answer
    drivers_tried: usize = 4, "count", "times of the development cases";
    /// share of the squared error of the body that another driver must take off to be searched
    driver_gain: f64 = 0.2, "-", "development cases of tools/campaign";
    /// standard errors by which a number of the base differs plainly
    base_differs: f64 = 3.0, "standard errors", "normal distribution: 0.3 %";
    /// changed numbers of a rotor from which the model is another bench's.
    numbers_of_another: usize = 2, "count", "judgement: one may have been replaced or worn";
    /// squared error over the noise variance of one reading that an effect which nobody named takes off beside the answer, at least, for the
    /// answer's errors to allow for it
    more_than_chance: f64 = 9.0, "-", "three standard errors of one number: with twenty effects tried, by chance in about one log of twenty";
    /// share of its first size at which a law is faint
    faint: f64 = 0.01, "-", "judgement";
    /// share of the greatest such gain from which another effect is thought of as well
    unnamed_share: f64 = 0.5, "-", "judgement";
    /// an error within this factor of the noise floor leaves nothing to explain
    at_floor: f64 = 1.1, "-", "scatter of the noise floor on the development cases";
    /// a body driven by measured rotors: an error within this factor of the noise floor leaves nothing to explain; the floor does not know how far the rotor model is off, which the body integrates
    at_floor_driven: f64 = 1.25, "-", "development cases of tools/campaign";
    /// bins of the body's angle or rate over which what such a body leaves is looked at
    bins_of_rest: usize = 8, "count", "judgement: of some 250 windows thirty each";
    /// shifts of the angle or the rate that what is left is held against
    surrogates_of_rest: usize = 99, "count", "resolution 1 / (1 + n)";
    /// the channel's share of what is left, over the greatest that its shifts reach, from which on what is left is a law of it
    rest_is_a_law: f64 = 1.2, "-", "judgement: the greatest of each log are added, which chance hardly reaches";
    /// share above the noise that effects must explain to be the answer short of the floor: a wrong law can come near
    explained: f64 = 0.95, "-", "development cases of tools/campaign";
    /// share of what a battery's voltage does that goes with the time of its logs, from which nothing tells the two apart
    battery_with_time: f64 = 0.8, "-", "judgement";
    /// looks at two curves, evenly over the commands, by which they are held against each other
    curve_looks: usize = 100, "count", "judgement: g(u) has five numbers at most";
    /// share of a named shift of g(u) that the whole curve must differ by somewhere, for the shift to be one
    shift_of_curve: f64 = 0.5, "-", "judgement";
    /// times the noise floor beyond which effects are not the answer, whatever they explain: a gyro clock with a delay is explained to 95 % by others
    near_floor: f64 = 1.5, "-", "development cases of tools/campaign";
    /// difference of the command and its lag from which a row is on the way to a new level
    transient_way: f64 = 0.02, "-", "the least jump of a command, `jump` of the screening";
    /// difference of the command and its lag up to which a row is at rest: half a rad/s of a rotor, less than the noise of a reading
    resting_way: f64 = 5e-4, "-", "judgement";
    /// rows that are not at rest, at least, that show how a rotor follows its command: of one step
    fewest_moving_rows: usize = 4, "count", "judgement";
    /// rows on their way to a new level, at least, of which it is said that they all go one way
    fewest_transient_rows: usize = 20, "count", "judgement";
    /// share of the rows on their way to a new level that must go the other way: with less, a difference between the ways is known to
    /// five times the error of the better one, at best
    least_direction_share: f64 = 0.05, "-", "judgement";
    /// share of the rates that an error exceeds, and their spread, too, where the model is another bench's: no effect of the catalogue
    /// takes as much
    foreign_error: f64 = 0.3, "-", "judgement";
    /// share of what the answer leaves over that is a straight line in time, from which it is called a slow drift.
    drift_share: f64 = 0.25, "-", "emulated benches with a drift of no catalogue";
    /// times the noise floor from which an error is plain to see
    plain_error: f64 = 1.5, "-", "judgement";
    /// times the inertia of the model from which a body does not follow its torque
    held_inertia: f64 = 100.0, "-", "no bench differs by as much";
    /// share of the rate by which rotors at the same commands must differ to be reported
    rotors_differ: f64 = 3e-3, "-", "development cases and two real logs";
    /// standard errors by which rotors at the same commands must differ, too
    rotors_differ_errors: f64 = 5.0, "standard errors", "development cases and two real logs";
    /// samples, one in so many, that count as independent ones of an error that no model explains
    correlated_samples: f64 = 20.0, "count", "judgement";
    /// two benches differ in a number by more than this factor: less is a battery, a temperature, an effect that one log excites more
    benches_differ: f64 = 1.3, "-", "judgement";
    /// standard errors by which the numbers of two benches must differ, too
    benches_differ_errors: f64 = 8.0, "standard errors", "judgement";
    /// one set of numbers for all logs must cost so many times the squared error of one set for each
    pooled_cost: f64 = 2.0, "-", "judgement";
    /// a rotor rate goes with at most this power of the voltage: the square with a drag that hardly grows
    most_voltage_power: f64 = 2.0, "-", "physics of a rotor";
    /// how near the rates of two logs are known at a command that one of them may hardly have been at (logarithm)
    rate_uncertainty: f64 = 0.05, "-", "judgement";
    /// share of the voltage by which a supply was set to another
    supply_differs: f64 = 0.02, "-", "judgement";
    /// times what it was that no number of a bench becomes
    absurd_change: f64 = 100.0, "-", "judgement";
    /// share by which the squared error of the fitted data must fall for one more effect: half of `least_gain`
    least_training_gain: f64 = 0.015, "-", "development cases of tools/campaign";
    /// share by which the fitted data must gain where the held-out error falls by `little_gain` only: twice `least_gain`
    much_training_gain: f64 = 0.06, "-", "development cases of tools/campaign";
    /// difference in log-likelihood within which two sets are indistinguishable
    same_likelihood: f64 = 10.0, "-", "judgement: far beyond the 2 of a single parameter";
    /// share of the squared error within which two sets are indistinguishable, however many samples there are
    same_error: f64 = 0.005, "-", "judgement";
    /// share by which one effect may do worse than several changed numbers and be the answer: half of `least_gain`
    instead_of_several: f64 = 0.015, "-", "judgement";
    /// share by which one effect must do better than one changed number: a quarter of `least_gain`
    instead_of_one: f64 = 0.0075, "-", "judgement";
    /// no surrogate is shifted by less than one part in so many of the log
    least_surrogate_shift: usize = 50, "count", "judgement";
    /// what is left of a start that is too strong, each time
    weakening: f64 = 0.2, "-", "judgement";
    /// share of a step by which the next value of a grid looked at differs, at most
    most_grid_spacing: f64 = 0.05, "-", "judgement";
    /// one window in so many, up to which a run of the body is thinned in step; where fewer are taken, each is at random among its
    /// neighbours
    windows_in_step: usize = 3, "count", "judgement";
    /// a window with fewer samples cannot tell a start from a law
    window_samples: usize = 6, "count", "two numbers of a start and four of a law";
    /// share of the horizon below which the rest of a log joins no window
    window_rest: f64 = 0.7, "-", "judgement";
    /// spacings of a grid's values within which two starts are of one valley
    starts_apart: f64 = 2.0, "spacings", "judgement";
    /// steps, each longer by the root of two, by which the standard error of a number found on a grid is looked for
    error_steps: i32 = 40, "count", "from a millionth of the number to three quarters of it";
}
