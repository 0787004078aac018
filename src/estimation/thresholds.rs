//! Numbers that decide something in estimation. What only ends a search at the precision of a computer stays where it is.

crate::thresholds! {
    /// ⟨e, e⟩ from which an initial state counts as known: its standard error is then at most three times the noise. Less comes from
    /// segments whose beginning was not measured, and blows up when carried back to it.
    known_state: f64 = 0.1, "-", "judgement";
    /// rows of the record that the coarse search for a pole looks at.
    coarse_rows: usize = 6000, "count", "judgement (time of computing)";
    /// the slowest pole that the coarse search tries.
    slowest_pole: f64 = 0.1, "rad/s", "judgement";
    /// poles that the coarse search tries.
    coarse_poles: i32 = 22, "count", "from slowest_pole to 500 rad/s";
    /// ratio of each pole that the coarse search tries to the one before.
    coarse_ratio: f64 = 1.5, "-", "judgement";
    /// factor by which the beginning of a record may move the pole away from the grid before it is not believed.
    refined_factor: f64 = 1.5, "-", "the ratio of the grid";
    /// blocks over which correlated scores are summed: enough to estimate a variance, long enough to hold the correlation of slow
    /// residuals.
    most_blocks: usize = 60, "count", "coverage of 95 % intervals in the room's tests";
    /// fewest samples in a block.
    shortest_block: usize = 10, "count", "judgement";
    /// correlation times that a block should last: what neighbours share is then a tenth of their variance.
    block_correlation_times: f64 = 8.0, "correlation times", "coverage of 95 % intervals in the room's tests";
    /// fewer blocks than these say little about a variance.
    fewest_blocks: usize = 20, "count", "coverage of 95 % intervals in the room's tests";
    /// lag-one correlation up to which it is allowed for that blocks share what reaches over their edges.
    strongest_memory: f64 = 0.98, "-", "judgement";
    /// least share of the variance that blocks are taken to see.
    least_seen_variance: f64 = 0.25, "-", "judgement";
    /// clusters that residuals are cut into when one unit spans a whole log.
    clusters: usize = 40, "count", "judgement";
    /// residuals from which on their derivatives are worth a thread each.
    parallel_residuals: usize = 50_000, "count", "judgement: a thread starts in a hundredth of their time";
    /// residuals of short units up to which a fit keeps its derivatives. Those of more are made anew for each step, a few units at a
    /// time.
    kept_slopes: usize = 500_000, "count", "judgement (memory): each derivative takes 4 MB";
    /// units that a fit of short units works on together.
    units_together: usize = 16, "count", "judgement: their derivatives stay in the cache";
    /// a step of a fit of short units that lowers the cost by what was predicted of it, but for so little, is the last one: what is left
    /// is no more, a thirtieth of a standard error
    predicted: f64 = 1e-3, "variances of a residual", "judgement";
    /// share of measured rows from which on all rows of a residual vector are kept.
    mostly_measured: f64 = 0.8, "-", "judgement (memory)";
    /// share of the cost below which a step's fall is slow.
    slow_fall: f64 = 2e-4, "-", "times of the development cases";
    /// slow steps in a row that lead nowhere soon.
    slow_steps: usize = 3, "count", "times of the development cases";
    /// what the damping is multiplied by after a step that led on, and after one that did not.
    damping_turn: (f64, f64) = (0.1, 10.0), "-", "as usual (Marquardt 1963)";
    /// damping from which a step is much shorter than the one without.
    held_back: f64 = 1e-2, "-", "judgement";
    /// share of its size by which a global parameter may move before the derivatives by the locals are taken anew.
    moved: f64 = 0.05, "-", "times of the development cases";
    /// a step's fall over the predicted one within which the derivatives it was made with hold for the next step, too.
    as_predicted: (f64, f64) = (0.9, 1.1), "-", "times of the development cases";
    /// steps in a row made with derivatives that were not taken for them, at most.
    reused_steps: usize = 3, "count", "times of the development cases";
    /// samples of the longest window of a frequency response.
    longest_window: usize = 2048, "count", "judgement";
    /// samples of the shortest window of a frequency response.
    shortest_window: usize = 64, "count", "judgement";
    /// windows that must fit before a longer one is taken for a frequency response; half as many must be there.
    fewest_windows: usize = 8, "count", "judgement";
    /// one sample in so many must lie in a window of a frequency response.
    reached: usize = 4, "count", "judgement";
    /// share by which sampling intervals may differ from their median where a record is taken as uniform.
    interval_jitter: f64 = 0.2, "-", "judgement";
    /// bins of equal count that a channel is cut into, of at least four rows each.
    bins: usize = 16, "count", "judgement";
    /// standard deviation of noise, in steps of the reading, from which it is seen for what it is.
    dithered: f64 = 0.5, "steps", "made readings of the room's tests";
    /// rows from which on the memory of noise is looked for in stretches.
    memory_rows: usize = 240_000, "count", "judgement (time of computing): their differences know it to 0.3 %";
    /// length of the stretches in which the memory of noise is looked for.
    memory_stretch: usize = 10_000, "rows", "judgement: many times the longest memory";
    /// strides over which third differences show the memory of noise.
    noise_strides: [i32; 7] = [1, 2, 3, 4, 6, 8, 12], "rows", "up to what noise with the longest memory has forgotten for the most part";
    /// longest memory of a sensor's noise: what resembles itself for longer may as well be what the model misses.
    longest_noise_memory: f64 = 8.0, "rows", "judgement: a filter at a fiftieth of the sampling rate";
    /// rms distance of the logarithms of the noise's variances, seen over several strides, from those of noise with one memory: beyond it
    /// the noise has no such memory, and only its white part counts.
    memory_misfit: f64 = 0.08, "-", "made noise of 3,000 readings and a memory of up to six rows: 0.06 in the worst of 60";
    /// rms of what is left, over the noise seen in it with its memory and what other sensors carry in: up to here all of it counts as
    /// noise. Raised, a weak law passes for noise; lowered, only white and steady noise counts.
    all_noise: f64 = 1.1, "-", "`at_floor` of diagnose";
    /// standard deviations of white noise beyond which a third difference does not tell of the memory of noise.
    outlying_differences: f64 = 3.5, "standard deviations", "normal distribution: 0.05 %";
    /// shifted channels none of which may have as much to do with what is left where that is coloured noise.
    noise_surrogates: usize = 99, "count", "p-value of 1 %";
    /// third differences of samples some rows apart that suffice.
    enough_differences: usize = 50_000, "count", "judgement: their scatter is below 1 %";
    /// one value in so many must stand with three others in a row, else only the rows with a value are counted.
    in_a_row: usize = 4, "count", "made readings of the room's tests";
    /// share of the range below which two readings are one.
    same_reading: f64 = 1e-7, "-", "digits of a CSV log";
    /// share of a step by which a reading may lie beside the grid.
    off_grid: f64 = 0.05, "-", "judgement";
    /// share of the gaps between readings that must be whole steps.
    on_grid: f64 = 0.95, "-", "judgement";
    /// gaps between readings that show a grid.
    fewest_gaps: usize = 5, "count", "judgement";
    /// log-likelihood that a random walk must win over a constant level: a walk carries noise along.
    walk_penalty: f64 = 5.0, "-", "judgement";
    /// walks of a level from sample to sample, over the noise, of which the likeliest is taken.
    walks: [f64; 12] = [0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0], "-", "a factor of three apart";
    /// share of a record by which a channel is shifted at least, and at most short of all of it, to mean nothing.
    least_shift: f64 = 0.05, "-", "judgement: none is near to no shift at all";
    /// standard errors from which a mean is not zero.
    mean_errors: f64 = 4.0, "standard errors", "normal distribution: 6e-5 by chance";
    /// a correlation of a residual from one row to the next counts from here on: four are not chance
    memory_errors: f64 = 4.0, "standard errors", "four standard errors of a correlation that is not there";
    /// pivot of a correlation matrix below which a column is what the others already say
    least_pivot: f64 = 1e-6, "-", "judgement";
    /// share of the rows that keeps directions apart which the data do not separate, as two levels do u and u²
    ridge: f64 = 1e-9, "-", "judgement";
    /// evaluations of a golden-section search behind the first two
    golden_steps: usize = 16, "count", "the bracket shrinks to 5e-4 of its width";
    /// times what most units of a fit leave, from which one is fitted by itself
    stuck_unit: f64 = 2.0, "-", "80 readings of noise leave 1 ± 0.16";
    /// share of the units, at most, that are fitted by themselves: where more leave much, it is the law
    most_stuck: f64 = 0.1, "-", "judgement";
    /// damping of the first step of the fit of a unit by itself
    rescue_damping: f64 = 1e-3, "-", "as usual (Marquardt 1963)";
    /// steps of the fit of a unit by itself, at most
    rescue_steps: usize = 20, "count", "judgement";
    /// share of a unit's squares by which a step must lower them for another one to follow
    rescue_tolerance: f64 = 1e-3, "-", "judgement";
    /// share of all squares that units by themselves must take off for the fit of all to go on
    rescued: f64 = 1e-3, "-", "judgement: a hundred times `full_fit`'s tolerance";
    /// damping at which a step of a fit is so short that no descent is left
    most_damping: f64 = 1e10, "-", "judgement";
    /// steps of the search for a pole, at most
    most_pole_steps: usize = 40, "count", "judgement";
    /// times that a step of the search for a pole is halved, at most, until it lowers the cost
    most_halvings: usize = 20, "count", "a millionth of the step";
    /// least and greatest relative change of the pole in one step of the search for it
    pole_step: (f64, f64) = (-0.5, 1.0), "-", "a factor of two to both sides";
    /// rows that a bin has on average, at least, where an error is held against a channel
    fewest_in_bin: usize = 4, "count", "judgement";
    /// times the largest lag over which a signal's own correlation is taken to have died away
    colour_lags: usize = 4, "count", "judgement";
    /// times the largest lag that a signal lasts, at least, where it is correlated with another
    shortest_of_lag: usize = 8, "count", "judgement: most of both is still in common";
    /// length of a hold up to which a step to it says nothing of its instant: level and instant are two numbers
    shortest_hold_rows: usize = 4, "rows", "judgement";
    /// size of a change of the input, over that of usual steps, from which it disturbs what follows them
    disturbing_step: f64 = 0.5, "-", "judgement: a ramp's changes are far below, those of a random sequence as large";
    /// steps, from the beginning on, to which the way an output follows them is fitted
    searched_steps: usize = 40, "count", "judgement (time of computing)";
    /// steps from which on it is asked whether their instants drift
    steps_with_trend: usize = 20, "count", "judgement: three for each number that is asked";
    /// steps by which it is judged when steps happened
    judged_steps: usize = 400, "count", "judgement (time of computing)";
    /// logarithm of the likelihood that each step gains by an instant of its own, below which steps at their rows are enough
    instants_gain: f64 = 0.6, "-", "1/2 by chance, for one number each; random benches whose commands step between rows: 0.69 and more";
    /// poles, from 2 rad/s on by 1.5 each, of which the best is refined
    tried_poles: i32 = 12, "count", "to 170 rad/s";
    /// dead time behind a step that is looked for, at most
    longest_step_delay: f64 = 0.15, "s", "judgement: ESCs answer within a tenth of that";
    /// rows by which all steps may be logged late
    longest_lead: f64 = 2.0, "rows", "loggers that write a command with the next row";
    /// dead times behind a step that are tried before the best is refined, at most
    most_step_delays: f64 = 80.0, "count", "judgement (time of computing)";
    /// longest second time constant behind a step, over the first
    longest_second_lag: f64 = 0.95, "-", "judgement: at one the two cannot be told apart";
    /// logarithm of a likelihood by which all other dead times of a grid must lie below the best for it to stand alone: then a finer grid
    /// is laid about it
    far_below: f64 = 10.0, "-", "judgement: a weight of 1 in 20,000";
    /// share of all gains that another input may have, by which those beside the best are looked at closer
    closer_gain: f64 = 0.02, "-", "far more than the search before leaves open";
    /// standard deviation up to which the instant of a step is known
    known_instant: f64 = 0.2, "intervals", "judgement: of an even one of which nothing is known it is 0.29";
    /// dead times, over two intervals, by which the dead time behind steps is judged
    step_delay_grid: usize = 24, "count", "a twelfth of an interval";
    /// logarithm of a likelihood below the best with which a dead time of none is allowed
    no_step_delay: f64 = 2.0, "-", "two standard errors of a normal distribution";
    /// logarithm of a likelihood by which a fit must gain for each number more of the way an output follows steps
    step_shape_gain: f64 = 4.0, "-", "as information criteria of some thousand rows ask";
    /// logarithm of a likelihood: a round of the search for how an output follows steps that gains less ends it
    step_search_end: f64 = 0.05, "-", "far below what decides anything";
    /// rounds of the search for the way in which an output follows steps, at most
    step_rounds: usize = 9, "count", "judgement (time of computing)";
    /// one round in so many of the search for how an output follows steps asks again for what did not show: not before pole and dead time
    /// are near
    asked_again: usize = 3, "count", "judgement";
    /// rounds of the search for how an output follows steps by a pole and a dead time alone
    plain_step_rounds: usize = 2, "count", "judgement (time of computing)";
    /// factor to both sides within which a round of the search for how an output follows steps looks for the pole
    pole_span: f64 = 1.5, "-", "the ratio of `tried_poles`";
    /// half of the logarithm of the pole of steps up over that of steps down, at most: a ratio of 2.2
    most_upward: f64 = 0.4, "-", "judgement";
    /// logarithms of what a unit of the input makes of the pole, about which that is looked for first
    by_inputs: [f64; 3] = [-1.5, 0.0, 1.5], "-", "judgement: with `by_input_reach` one overlaps the next";
    /// how far to both sides of each of `by_inputs` it is looked for what a unit of the input makes of the pole
    by_input_reach: f64 = 1.0, "-", "judgement";
    /// times the way that a round of the search for how an output follows steps has gone, by which it looks further on, at most
    furthest_on: f64 = 4.0, "-", "judgement";
    /// rounds, each of three steps, in which the gain of another input and the pole are found in turn
    gain_rounds: usize = 4, "count", "judgement (time of computing)";
    /// share of the widest gain of another input by less than which it no longer moves
    same_gain: f64 = 1e-3, "-", "judgement: far below `closer_gain`";
    /// time constant of a second lag, over the first, below which it is none
    no_second_lag: f64 = 1e-3, "-", "judgement";
    /// passes of the fit of levels by the input: each weighs levels by how far they lie about the curve of the one before
    curve_passes: usize = 3, "count", "judgement";
    /// places of an interval at which the instant of a step is looked for first
    instant_places: usize = 8, "count", "judgement";
    /// looks for the instant of a step in its interval, at most, each four times closer than the one before
    instant_looks: i32 = 4, "count", "the last one's places are 1/512 of an interval apart";
    /// points over which the likelihood of an instant is summed
    instant_points: usize = 48, "count", "some five to each standard deviation";
    /// standard deviations to both sides over which the likelihood of an instant is summed
    instant_reach: f64 = 5.0, "standard deviations", "normal distribution: 6e-7 lies outside";
    /// rms of a residual that a step, moved by its standard deviation, must move the output by to count as one
    felt_step: f64 = 0.1, "-", "judgement: a hundredth of the information of a row";
}
