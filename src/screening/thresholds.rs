//! Numbers that decide whether a log is believed: each with its unit, why, and what it was calibrated on.

crate::thresholds! {
    /// no body on a bench turns faster than a gyroscope of 2000 deg/s can read.
    greatest_body_rate: f64 = 60.0, "rad/s", "range of common gyroscopes";
    /// ratio of a rate to the slope of its angle from which it is 180/π, as far as noise and lag of a sensor can move it.
    degrees_least: f64 = 40.0, "-", "judgement";
    /// ratio of a rate to the slope of its angle up to which it is 180/π.
    degrees_greatest: f64 = 80.0, "-", "judgement";
    /// ratio of a rate to the slope of its angle from which the time is in milliseconds (1000, as far as noise and lag move it).
    milliseconds_least: f64 = 700.0, "-", "judgement";
    /// ratio of a rate to the slope of its angle up to which the time is in milliseconds.
    milliseconds_greatest: f64 = 1400.0, "-", "judgement";
    /// time over which the slope of the angle is taken, so that its noise does not count.
    slope_span: f64 = 0.1, "s", "judgement";
    /// times `slope_span`, or the time from angle to angle where that is more, that the slope of an angle is taken over at most.
    slope_span_longest: f64 = 3.0, "-", "judgement";
    /// correlation of rate and slope from which one is the other: both are noise where the body is held.
    slope_correlation: f64 = 0.7, "-", "judgement";
    /// no battery that turns a rotor has less.
    least_battery: f64 = 2.0, "V", "one lithium cell";
    /// times the middle reading of a battery from which one is no measurement.
    overfull_battery: f64 = 3.0, "-", "judgement";
    /// jumps of the command from which a pole may be fitted.
    fewest_jumps: usize = 8, "count", "judgement";
    /// change of command within `jump_span` that is a jump and no ramp.
    jump: f64 = 0.02, "-", "judgement";
    /// time over which a jump is looked for.
    jump_span: f64 = 0.1, "s", "judgement";
    /// time after a jump before a rotor counts as settled: more than ten times 1/p of a slow rotor.
    settling: f64 = 2.0, "s", "a pole of 6 rad/s";
    /// shortest steady segment that is used.
    shortest_steady: f64 = 5.0, "s", "judgement";
    /// chance of a run of equal values, over the whole channel, below which it is frozen.
    frozen_chance: f64 = 1e-3, "-", "judgement";
    /// no run shorter than this is frozen.
    frozen_least: usize = 10, "count", "judgement";
    /// share of the range of the angle by which it must move while the gyro stands.
    frozen_angle_moves: f64 = 0.02, "-", "judgement";
    /// times that what turns the body must change while the gyro stands, where no angle is measured.
    frozen_drive_changes: usize = 3, "count", "made logs of the room's tests";
    /// share of the range of what turns the body that a change of it must be to count while the gyro stands.
    frozen_drive_share: f64 = 0.25, "-", "made logs of the room's tests";
    /// smallest steps of the gyro's reading by which it usually moves in as short a time as it stands.
    frozen_steps: f64 = 5.0, "steps", "made logs of the room's tests";
    /// commands that show at which interval they come.
    command_fewest: usize = 20, "count", "judgement";
    /// quantile of the gaps between commands that is one interval, as long as three in four commands are there.
    command_quantile: f64 = 0.25, "-", "three in four commands are there";
    /// share of the interval within which a multiple of it is met.
    command_near: f64 = 0.2, "-", "made logs of the room's tests";
    /// share of the gaps near a multiple, from which commands come at an interval at all.
    command_steady: f64 = 0.85, "-", "made logs of the room's tests";
    /// share of the gaps that are the interval itself, from which its multiples are commands that are missing.
    command_itself: f64 = 0.5, "-", "else another interval is the usual one";
    /// share of the lower quartile of the gaps below which one is no interval.
    command_early: f64 = 0.75, "-", "made logs of the room's tests";
    /// intervals without a command from which one is missing.
    command_late: f64 = 1.5, "intervals", "made logs of the room's tests";
    /// intervals behind a command up to which the next one cannot have come.
    command_due: f64 = 1.25, "intervals", "made logs of the room's tests";
    /// change of the command that moves no rotor by more than its noise.
    command_same: f64 = 0.002, "-", "judgement";
    /// change of the command that is a jump; a log without any is read as it is.
    command_jump: f64 = 0.02, "-", "judgement";
    /// share of commands that differ from the one before, from which a log says a command only when it changes.
    command_differs: f64 = 0.98, "-", "made logs of the room's tests";
    /// share of commands that follow the one before at once, below which empty cells may say "as before".
    command_at_once: f64 = 0.6, "-", "made logs of the room's tests";
    /// readings to each side that predict one: of two, one of which is an outlier, too, nothing is left to predict from.
    outlier_side: usize = 3, "count", "judgement";
    /// usual steps from one neighbour to the next that an outlier of a body lies beyond what is far.
    outlier_goes: f64 = 2.0, "-", "judgement";
    /// shares of the distances that say what is usual, each with its multiple; their sum is far.
    outlier_usual: [(f64, f64); 2] = [(0.5, 7.0), (0.8, 6.0)], "-", "normal noise (ten times its size) and Laplace noise, which stays below";
    /// quantiles between which the range of a channel lies: outliers are beyond
    outlier_range: (f64, f64) = (0.01, 0.99), "-", "judgement";
    /// least distance of an outlier as a share of the middle 98 % of the channel.
    outlier_of_range: f64 = 0.05, "-", "judgement";
    /// least distance of an outlier as a share of the level of the channel.
    outlier_of_level: f64 = 0.02, "-", "judgement";
    /// smallest steps between readings that an outlier must be away: a coarse reading flickers.
    outlier_steps: f64 = 6.0, "steps", "made logs of the room's tests";
    /// multiple of the range of its neighbours by which an outlier of a body lies beside their middle.
    outlier_beside_range: f64 = 5.0, "-", "made logs of the room's tests";
    /// multiple of the noise by which an outlier of a body lies beside the middle of its neighbours, beyond `outlier_beside_range`.
    outlier_beside_noise: f64 = 10.0, "-", "made logs of the room's tests";
    /// time between readings above which a body or a rotor under unknown commands may move and come back.
    outlier_too_slow: f64 = 0.05, "s", "made logs of the room's tests";
    /// time for which a rotor goes on answering to a command.
    outlier_answers: f64 = 0.25, "s", "judgement";
    /// readings beside commands that moved, from which on it is known what commands do.
    outlier_commands: usize = 30, "count", "judgement";
    /// quantile of how far readings lie off for each unit that the commands about them moved, which is taken for usual.
    outlier_commands_usual: f64 = 0.9, "-", "judgement";
    /// multiple of what a moved command usually does to a reading that none does.
    outlier_commands_most: f64 = 4.0, "-", "made logs of the room's tests";
    /// share of its way that a rotor goes from one reading to the next, above which a peak may be true.
    outlier_at_once: f64 = 0.7, "-", "made logs of the room's tests";
    /// least middle command that the chord of the rotor curve is taken at.
    outlier_least_command: f64 = 0.05, "-", "judgement";
    /// multiple of the chord of the rotor curve by which no command moves it.
    outlier_steepest: f64 = 4.5, "-", "made logs of the room's tests";
    /// share of a channel from which on outliers are something else, and stay.
    outlier_too_many: f64 = 0.1, "-", "judgement";
    /// readings of a channel, at least, that are looked at for outliers.
    outlier_fewest: usize = 50, "count", "judgement";
    /// times that the rest of a channel is looked through again for outliers: of two neighbours one may hide the other.
    outlier_passes: usize = 5, "count", "judgement";
    /// a greater command is percent or microseconds.
    impossible_command: f64 = 1.5, "-", "judgement";
    /// a greater rate is rpm: the tip of a propeller reaches the speed of sound 5 cm from its axis.
    impossible_rate: f64 = 7000.0, "rad/s", "speed of sound";
    /// a greater voltage is millivolts.
    impossible_voltage: f64 = 1000.0, "V", "judgement";
    /// a greater rate is asked about: few propellers turn so fast.
    fast_rate: f64 = 5000.0, "rad/s", "judgement";
    /// no battery of such a bench has less.
    lowest_battery: f64 = 3.0, "V", "one cell of lithium, empty";
    /// no battery of such a bench has so much.
    high_voltage: f64 = 100.0, "V", "judgement";
    /// share of the greatest rate down to which rates below zero are noise.
    negative_rate: f64 = 0.05, "-", "judgement";
    /// samples further apart say nothing of a rotor, whose transients last a tenth of that.
    slowest_samples: f64 = 2.0, "s", "judgement";
    /// rows for each command, on average, that a table of levels has at most; commands of a log that stands for longer are steps in time.
    rows_of_a_level: usize = 3, "count", "judgement: a level read three times; a step of 0.1 s at 50 Hz has five rows";
    /// rows more than `slowest_samples` apart that are levels of a thrust stand, at most; more of them are a log whose time is in another
    /// unit.
    most_levels: usize = 200, "count", "judgement: a day's work at a stand, and four seconds of a log at 50 Hz";
    /// the noise of a rotor that stands stays below.
    standing_rate: f64 = 50.0, "rad/s", "judgement";
    /// share of the ends of the noise of a rotor that stands within which its middle lies.
    standing_middle: f64 = 0.5, "-", "judgement";
    /// share of samples at the limit of the command from which it is a finding.
    command_at_limit: f64 = 0.02, "-", "judgement";
    /// share of samples at the highest command below the limit from which that one is a limit, too.
    command_at_highest: f64 = 0.1, "-", "judgement";
    /// share of samples at the limit of the command from which most of a log says one thing.
    command_mostly_at_limit: f64 = 0.3, "-", "judgement";
    /// distinct commands below the highest that a signal with more than a few levels has.
    command_levels: usize = 50, "count", "judgement";
    /// factor between the rates and those of the template from which a unit is asked about.
    another_rate_unit: f64 = 3.5, "-", "other rotors than the paper rotor";
    /// factor between a unit and the ratio that was found, within which it may be that unit.
    unit_like: f64 = 1.8, "-", "judgement";
    /// share of a column below its greatest values that a few flipped bits may be.
    most_of_a_column: f64 = 0.99, "-", "judgement";
    /// command from which rates are compared with those of the template: below, losses count, and dead zones.
    least_compared_command: f64 = 0.15, "-", "judgement";
    /// samples of an attitude further apart than this do not show how the body moves.
    sparsest_attitude: f64 = 2.0, "s", "judgement";
    /// share of the model's greatest rate from which a rate is compared with it: where a curve begins it may be anything.
    fair_rate_share: f64 = 0.3, "-", "judgement";
    /// a unit is one factor in all rows: largest factor between the quartiles of the ratios.
    unit_ratio_spread: f64 = 1.3, "-", "judgement";
    /// factor between a unit's ratio and the one that was found within which it is that unit.
    unit_factor: f64 = 1.5, "-", "judgement";
    /// range of the share of its full voltage that a battery in use has.
    battery_in_use: [f64; 2] = [0.6, 1.1], "-", "LiPo: 3.0 V to 4.2 V a cell";
    /// factor above the model's full voltage from which a battery is refused as another one.
    other_battery_refused: f64 = 4.5, "-", "judgement";
    /// factor above the model's full voltage from which it is a finding.
    other_battery_noted: f64 = 1.1, "-", "judgement";
    /// a rate is compared with the model's by one factor up to this factor between the quartiles of the ratios: another rotor's curve
    /// bends it by so much, a dead zone by more.
    unlike_ratio_spread: f64 = 2.0, "-", "a rate that goes with the root of the command beside the paper's curve: 1.5";
    /// factor between the thrusts and those of the template, which go with the square of the rates, from which a unit is asked about.
    another_thrust_unit: f64 = 6.0, "-", "judgement";
    /// factor within which a thrust is in a unit near 1 N, where the rates are those of the template within as much.
    near_unit: f64 = 1.15, "-", "judgement";
    /// thrust coefficient T / (ρ n² D⁴) that no open propeller goes beyond: what its thrust says of its diameter.
    greatest_thrust_coefficient: f64 = 0.2, "-", "propellers of two to four blades: 0.08 to 0.17";
    /// no propeller's tips turn faster: thrusts that would ask for it are in another unit.
    fastest_tip: f64 = 400.0, "m/s", "a thrust stand's racing propeller 195 and in gf 618, electric ducted fans up to 330";
    /// windows over which what a body's rate gains is held against the impulse of a torque.
    response_spans: [f64; 3] = [0.1, 0.2, 0.4], "s", "a gyro's noise, and how fast a body on a pivot turns round";
    /// times by which a body may answer late: a delay of its torque, and most of the lag of rotors that nobody measured.
    response_delays: [f64; 4] = [0.0, 0.02, 0.05, 0.1], "s", "hidden delays and lags of the emulated bench";
    /// rows of a very long log over which a body's answer is asked for.
    response_most: usize = 200_000, "count", "memory";
    /// windows from which a body's answer is asked for.
    response_fewest: usize = 50, "count", "judgement";
    /// share of what the rate gains, beyond what goes with angle and rate, that the torque explains where it is the cause.
    response_explains: f64 = 0.9, "-", "emulated benches with strong hidden effects: where less is explained the factor is a friction's";
    /// factor within which the answers over short and long windows are one.
    response_same_factor: f64 = 1.25, "-", "emulated benches with strong hidden effects";
    /// factor within which a body's answer is ten times, or a tenth, of what the model makes: a bench's own scale may be near it.
    torque_power_near: f64 = 1.15, "-", "a pitch bench with a torque in its own scale: 8.1 times the paper's model";
    /// factor within which a body's answer is a hundred or a thousand times what the model makes, or a hundredth or a thousandth of it.
    torque_power_far: f64 = 1.35, "-", "a third";
    /// command from which on every rotor turns: the dead zones of speed controllers end below it.
    dropout_turns: f64 = 0.15, "-", "judgement";
    /// time behind which a rotor commanded to turn has started.
    dropout_started: f64 = 2.0, "s", "judgement";
    /// zeros in a row that are a dropout wherever their neighbours turn: no rotor stops and runs up again so fast.
    dropout_isolated: usize = 3, "count", "made logs of the room's tests";
    /// share of the middle rate from which a neighbour of zeros turns.
    dropout_neighbour: f64 = 0.1, "-", "judgement";
    /// time behind a reading from which a rotor that began to turn with it would have got far.
    dropout_got_far: f64 = 0.25, "s", "made logs of the room's tests";
    /// share of what a rotor which begins to turn reads behind `dropout_got_far` that it does not reach at once.
    dropout_at_once: f64 = 0.7, "-", "made logs of the room's tests";
    /// quantile of what a rotor reads behind `dropout_got_far` that is compared: not the least, which may be an outlier.
    dropout_low: f64 = 0.1, "-", "judgement";
    /// shortest standstill of a rate that is looked at.
    rate_frozen_shortest: f64 = 1.0, "s", "judgement";
    /// time for which a standstill of a rate goes on behind the change of the command: no such rotor waits for so long.
    rate_frozen_unanswered: f64 = 0.5, "s", "judgement";
    /// equal readings, at least, of a standstill of a rate: of a few a coarse reading may well be the same.
    rate_frozen_fewest: usize = 5, "count", "judgement";
    /// change of the command that moves no rotor by more than its noise.
    rate_frozen_same: f64 = 0.002, "-", "judgement";
    /// change of the command that moves any reading.
    rate_frozen_jump: f64 = 0.02, "-", "judgement";
    /// steps of the reading of a rate that the change of the command would have moved it by.
    rate_frozen_steps: f64 = 2.0, "steps", "made logs of the room's tests";
    /// intervals of a channel over which what lies between two readings is a straight line.
    bridged: f64 = 4.5, "intervals", "judgement";
    /// no bench measures more; its square is still a number.
    greatest_value: f64 = 1e100, "SI", "range of f64";
    /// command below which a rotor may stand still; the model does not speak of starting from standstill.
    least_command: f64 = 0.05, "-", "judgement";
    /// share of a rotor's greatest measured rate below which it stands, or has not started yet.
    standing_share: f64 = 0.05, "-", "judgement";
    /// share of what a rotor does at the median under way down to which it has come to rest, when a command turns it again.
    rested_share: f64 = 0.1, "-", "judgement";
    /// time after leaving standstill before samples count.
    starting: f64 = 0.5, "s", "judgement";
    /// share of what a command moves in rows that are left out from which on that is said.
    moves_left_out: f64 = 0.5, "-", "judgement: most of it";
    /// way that a command must go in such rows to be a move.
    least_way: f64 = 0.1, "-", "judgement: a flicker of a thousandth goes less in a hundred rows";
    /// share of a rotor's greatest measured rate up to which it stands still, where the command would turn it: noise of a sensor.
    stall_share: f64 = 0.01, "-", "judgement";
    /// time for which a rate on its way to a standstill may pause: a longer one is where the fall began.
    stall_pause: f64 = 0.1, "s", "made logs of the room's tests";
    /// readings from which it is asked whether what is new in a channel is another's: a command made from a rate, a rate from an angle.
    new_fewest: usize = 200, "count", "judgement";
    /// readings of a long log that are looked at for what is new in a channel.
    new_most: usize = 5_000, "count", "time of computing";
    /// readings before one on which what comes next may depend.
    new_before: usize = 3, "count", "judgement";
    /// readings by which a controller answers later, at the most.
    loop_latest: usize = 3, "count", "judgement";
    /// share of the readings before which a controller's command moves, at least: an experiment holds its levels.
    loop_moves: f64 = 0.5, "-", "judgement";
    /// correlation of what is new in the rate with what is new in the command below which a controller makes it.
    loop_correlation: f64 = -0.4, "-", "made logs: -0.8 and below; experiments: -0.13 and above, -0.3 where rows come late and nothing says so";
    /// times its usual size beyond which what is new is a step of a setpoint.
    loop_clip: f64 = 3.0, "-", "normal distribution: 0.3 %";
    /// share of a column's range that must be new in it: below are its digits, and the bend of a curve that a line does not follow.
    loop_news: f64 = 1e-4, "-", "judgement: a sensor's noise is more, an exact simulation's less";
    /// passes in which steps of a setpoint are taken out of what is new.
    loop_passes: usize = 3, "count", "judgement";
    /// latest time that a rate is looked for behind the thrust that it makes, and steps up to there, at most; half a row is the shortest.
    late_span: (f64, f64) = (0.15, 60.0), "s, count", "judgement: telemetry of ESCs is not older; time of computing";
    /// rows that are looked at, scattered over the log, at most, for whether a rate is late behind its thrust.
    late_most_rows: usize = 10_000, "count", "time of computing";
    /// rows with thrust and rate, at least, from which it is asked whether a rate is late behind its thrust.
    late_fewest_rows: usize = 200, "count", "judgement";
    /// parts of a log that are left out in turn, for the error of how late a rate is.
    late_parts: usize = 8, "count", "judgement";
    /// standard errors by which a rate must be late behind its thrust.
    late_errors: f64 = 4.0, "standard errors", "normal distribution: 3e-5 by chance";
    /// a rate that is late by less is in time: air that has yet to move lets thrust go before c ω² by as much.
    late_rate_s: f64 = 0.005, "s", "judgement";
    /// share of what a rate in time leaves of the thrust's variance that a late one leaves, at most.
    late_error_left: f64 = 2.0 / 3.0, "-", "judgement: as `lead_error_share` of identify";
    /// rates further apart show a rotor that has settled, whatever its pole: 92 of 100 of its way.
    seldom_readings: f64 = 2.5, "time constants", "judgement";
    /// steps with a reading on the way that say how quickly a rotor follows, at least.
    fewest_rises: usize = 5, "count", "judgement";
    /// readings at the end of a level at which a rotor has come to rest, at least.
    readings_at_rest: usize = 3, "count", "judgement";
    /// one in so many readings of a longer level is at its end.
    level_ends: usize = 4, "count", "judgement";
    /// share of a step that is left where a reading counts as on the way.
    share_on_the_way: (f64, f64) = (0.1, 0.9), "-", "judgement: noise and drift below, a dead time above";
    /// times its scatter at rest that a step must go, and a reading be away from rest, to be on the way.
    plain_rise: f64 = 8.0, "-", "judgement";
    /// rows so far apart say nothing: between them a rotor may settle to the last digit.
    hold_too_slow: f64 = 0.15, "s", "judgement";
    /// share of cells equal to the one before, below which nobody holds a reading.
    hold_fewest_equal: f64 = 0.1, "-", "judgement";
    /// steps of the reading by which it moves into a run of equal cells and out of it.
    hold_steps: f64 = 5.0, "steps", "noise of so many steps brings two equal readings in one of twenty cases";
    /// different values, to both sides, over which the step of a reading is taken.
    hold_neighbours: usize = 5, "count", "judgement";
    /// runs of equal cells in motion from which their lengths say something.
    hold_fewest_runs: usize = 20, "count", "judgement";
    /// share of the runs in motion that have one of two neighbouring lengths, where a reading is held.
    hold_common: f64 = 0.8, "-", "made logs of the room's tests";
    /// share of the runs in motion that are longer than one cell, where a reading is held.
    hold_longer: f64 = 0.2, "-", "made logs of the room's tests";
    /// share of the runs in motion, in each part of the log, that are longer than one cell, at least, where a reading is held.
    hold_longer_everywhere: f64 = 0.1, "-", "made logs of the room's tests";
    /// parts of the log in each of which `hold_longer_everywhere` must be so.
    hold_parts: usize = 3, "count", "judgement";
    /// share of the runs in motion that are not longer than the pace of the telemetry.
    hold_usual: f64 = 0.97, "-", "made logs of the room's tests";
    /// a channel with fewer distinct values is a switch; it cannot saturate.
    saturated_levels: usize = 20, "count", "judgement";
    /// times as often as the next value inside that the extreme value of a saturated channel occurs.
    saturated_factor: usize = 5, "-", "judgement";
    /// no fewer samples at the extreme are saturated.
    saturated_least: usize = 10, "count", "judgement";
    /// times that a saturated channel must have come to its end and stood there.
    saturated_visits: usize = 3, "count", "judgement";
    /// share of the readings at the end of a saturated channel that the next one is equal to, at least.
    saturated_stands: f64 = 0.15, "-", "made logs of the room's tests";
    /// share of a saturated channel's readings within its range that the next one is equal to, at most.
    saturated_stands_inside: f64 = 0.4, "-", "made logs of the room's tests";
    /// share of a usual step with which a saturated channel comes to its end: what settles comes with less and less.
    saturated_comes: f64 = 0.1, "-", "made logs of the room's tests";
    /// steps of the reading with which a channel comes to a level, and no end of its range, at most.
    level_steps: f64 = 2.5, "steps", "made logs of the room's tests";
    /// share of a channel's arrivals at a level, and no end of its range, that are under one command.
    level_share: f64 = 0.9, "-", "made logs of the room's tests";
    /// difference of two commands up to which a channel's arrivals at a level are under one command.
    level_command: f64 = 1e-3, "-", "made logs of the room's tests";
    /// share of both rotors' thrust by which the one must outdo the other for a body that rests to be held.
    held_imbalance: f64 = 0.05, "-", "noise of rotor rates of 2 % makes 4 %";
    /// times its noise up to which a body that is held still may move.
    held_motion: f64 = 3.0, "-", "judgement";
    /// time for which a body stands at an end of its travel, at least, before that may be a stop.
    stop_shortest: f64 = 1.0, "s", "judgement";
    /// times that a body comes to an end of its travel, at least, before that may be a stop.
    stop_arrivals: usize = 2, "count", "made logs with dry friction";
    /// time behind a change of what drives it by when a free body is seen moving.
    stop_answer: f64 = 0.5, "s", "judgement";
    /// times what noise makes of a standing angle within which it is at its end.
    stop_band: f64 = 2.0, "-", "judgement";
    /// parts of a body's standing, the inner and the outer of which have one level at a stop: a turning point goes there and back.
    stop_parts: usize = 3, "count", "judgement";
    /// times what noise makes of a standing angle within which the parts of a standing have one level.
    stop_level: f64 = 0.5, "-", "judgement";
    /// times what noise makes of an angle that it must travel, for its ends to be looked at.
    stop_travel: f64 = 20.0, "-", "judgement";
    /// share of its standing at the ends that a body with friction stands elsewhere although it is driven.
    stop_elsewhere: f64 = 0.25, "-", "made logs of the room's tests";
    /// rows before one whose angles its rate may be made of: a filter's part beyond shows in the rates before.
    angle_before: usize = 4, "count", "judgement";
    /// angles that the rate of a row may be made of: those of `angle_before` rows before it, its own and the next row's.
    angles: usize = 6, "count", "`angle_before` and two";
    /// correlation of neighbouring third differences of an angle below which its noise is what is new in it: -0.75 of noise, -0.67 of steps.
    angle_noise: f64 = -0.6, "-", "arithmetic";
    /// share of what is new in a rate that its angle may leave over, for the one to be made from the other.
    angle_explains: f64 = 0.3, "-", "made logs of the room's tests: 0.05 and below; gyros: 0.6 and above";
    /// windows in which a body that is held still would be seen to move: what a gyro drifts meanwhile is no motion.
    held_window: f64 = 0.5, "s", "judgement";
    /// fewest readings of a run that say anything of a rotor, where its start has to be found from them, too.
    fewest_in_run: usize = 5, "count", "judgement";
    /// rows between two holes, up to which they say nothing.
    fewest_rows: usize = 2, "count", "judgement";
    /// cells of a column that never changes, from which it is constant.
    constant_fewest: usize = 3, "count", "judgement";
    /// times as many thrusts beside a rate on a line as beside a rate of their own, beyond which the two come in turns.
    thrust_in_turns: usize = 2, "-", "judgement";
    /// median intervals of a channel from which a stretch without a value is a gap in it.
    gap_factor: f64 = 2.5, "intervals", "judgement";
    /// steps of its reading that a battery takes at once, at most.
    battery_step: f64 = 2.5, "steps", "judgement";
    /// times as long as its other plateaus that the last one of a battery may be at the end of a log.
    battery_last_plateau: usize = 2, "-", "judgement";
    /// longer than this no battery under load keeps its voltage to the last digit.
    battery_frozen: f64 = 30.0, "s", "judgement";
    /// steps of a quantized voltage that a log reaches over from which their plateaus average out.
    quantized_steps: f64 = 30.0, "steps", "emulated benches read in steps";
    /// share of a step by which the difference of two readings of a battery may miss a multiple of it.
    step_tolerance: f64 = 0.02, "-", "judgement";
    /// no reading of a battery is as fine: smaller differences are rounding.
    finest_step: f64 = 1e-6, "V", "digits of a CSV log";
    /// length of a plateau of a battery over the mean of all from which its reading froze.
    longest_plateau: f64 = 3.0, "-", "judgement";
    /// longest time without a reading over which a held voltage is not worth a word.
    battery_gap: f64 = 30.0, "s", "judgement";
    /// share of the time for which commands are held that a hole may last for the rotor to run on across it.
    short_hole: f64 = 0.1, "-", "judgement";
    /// time after a step until rates have settled, where the log has no step without a hole that says so.
    transient: f64 = 0.25, "s", "four times 1/p of the paper's rotor";
    /// times as long as rates take to settle that commands are held, at the least, for transients behind holes to be left out.
    transient_held: f64 = 3.0, "-", "judgement";
    /// time behind a step in which rates are looked at: they settle in the first half, and their level is that of the second.
    transient_seen: f64 = 1.0, "s", "judgement";
    /// share of its way within which a rate has come to its level behind a step.
    transient_near: f64 = 0.03, "-", "judgement";
    /// times its scatter within which a rate has come to its level behind a step, too.
    transient_scatter: f64 = 4.0, "-", "judgement";
    /// share of the steps in sight that settle as fast as transients are taken to.
    transient_usual: f64 = 0.9, "-", "judgement";
    /// share of its way from which a rate was seen to answer a step.
    transient_begun: f64 = 0.1, "-", "judgement";
    /// rows back from a row in which the rate at it is looked for.
    transient_rows: usize = 5, "count", "judgement";
    /// time behind a step by when the rotor is on its way to the new level.
    transient_under_way: f64 = 0.1, "s", "judgement";
    /// a change of command this long before a hole is named with it.
    before_hole: f64 = 0.1, "s", "judgement";
    /// scatter about its smooth course, as a share of the rate, where neighbours are correlated, that no rotor has under one command.
    scatter_correlated: f64 = 0.02, "-", "made logs of the room's tests";
    /// scatter about its smooth course, as a share of the rate, that no rotor has under one command, neighbours correlated or not.
    scatter: f64 = 0.04, "-", "made logs of the room's tests";
    /// lag-one correlation of a rate under one command from which neighbours are correlated.
    scatter_lag_one: f64 = 0.3, "-", "judgement";
    /// powers of time in the smooth course of a rate: battery and temperature.
    scatter_course: usize = 4, "count", "judgement";
    /// rates under one steady command from which their scatter is judged.
    scatter_fewest: usize = 50, "count", "judgement";
    /// quantiles of a log's intervals that `import` shows
    shown_intervals: [f64; 3] = [0.05, 0.95, 1.0], "-", "judgement";
    /// error of an edge between two plateaus of a quantized voltage.
    edge_error: f64 = 0.05, "steps", "emulated benches read in steps";
    /// error of the fall of a quantized voltage, as a share of it, up to which the edges show how it fell.
    known_fall: f64 = 0.15, "-", "judgement";
    /// logarithm of the likelihood by which a load must improve the fit of a quantized voltage.
    load_likelihood: f64 = 6.0, "-", "chi-squared of one freedom: 5e-4 by chance";
    /// steps of a quantized voltage for each knot of its course.
    knot_steps: f64 = 2.0, "steps", "judgement";
    /// steps of a quantized voltage for each knot of the course that is followed for what it drives.
    followed_knot_steps: f64 = 0.5, "steps", "voltages of made benches, known beside their readings";
    /// time between two knots of the course of a quantized voltage that is followed, at the least.
    followed_bend: f64 = 3.0, "s", "voltages of made benches, known beside their readings";
    /// standard deviation, in steps, of how much the course of a quantized voltage that is followed bends at a knot.
    followed_smooth: f64 = 0.3, "steps", "voltages of made benches, known beside their readings";
    /// time to either side of a row over which what is left beside the course of a quantized voltage that is followed is averaged.
    averaged_beside: f64 = 0.5, "s", "voltages of made benches, known beside their readings";
    /// a discharge bends over no shorter time.
    shortest_bend: f64 = 10.0, "s", "judgement";
    /// standard deviation of the load over its mean from which it can be separated from the course of a quantized voltage.
    load_spread: f64 = 0.1, "-", "judgement";
    /// least noise of a quantized voltage.
    least_step_noise: f64 = 0.02, "steps", "judgement";
    /// noise of a quantized voltage from which it carries the reading over the plateaus, so that nothing is to be mended.
    most_step_noise: f64 = 0.5, "steps", "dither theory: half a step";
    /// weight of all plateaus beside all edges where the fit of a quantized voltage starts.
    plateau_weight: f64 = 0.01, "-", "judgement";
    /// least weight of a row in the fit of a quantized voltage.
    least_row_weight: f64 = 1e-3, "-", "judgement";
    /// passes of the search for the edges of a battery reading's steps, which needs two to eight
    most_passes: usize = 60, "count", "the development cases";
    /// rows from which on a pass of the search for the edges of a battery reading's steps goes over parts of them side by side
    spread_rows: usize = 240_000, "count", "judgement: threads start in a hundredth of the time of a pass";
    /// parts of a pass of the search for the edges of a battery reading's steps, whatever the number of threads
    spread_parts: usize = 32, "count", "judgement";
    /// share of a step of a battery's reading below which the search for the edges of its steps has ended
    pass_ended: f64 = 1e-3, "-", "judgement";
    /// share of what is seen of a transient behind which it has settled
    transient_late: f64 = 0.5, "-", "judgement";
    /// samples of one noise estimate
    noise_block: usize = 200, "count", "judgement";
    /// rank, from the quietest, among the estimates of pieces of `noise_block` samples that stands for the noise: the others may move too fast
    /// to show it. Raised, motion counts as noise
    noise_rank: f64 = 0.4, "-", "judgement";
    /// pieces up to this many times the ranked one count as noise: their estimates scatter by a few per cent
    noise_scatter: f64 = 1.15, "-", "200 normal samples: 5 %, three times";
    /// differences beyond this many standard deviations are steps and spikes
    outlier_differences: f64 = 3.5, "standard deviations", "normal distribution: 0.05 %";
    /// share of a signal's own spread below which no error says anything about physics: samples with straight lines between them, and
    /// arithmetic, know no more. Without it data free of noise would have something missing for ever.
    resolution: f64 = 1e-3, "-", "judgement";
    /// standard deviations of a dead time of commands that step between rows, by which two of them are one
    same_step_delay: f64 = 2.0, "standard deviations", "normal distribution: 5 %";
    /// steps whose instants are looked at, at least, before commands are said to step between rows
    fewest_between_steps: usize = 10, "count", "judgement: the spread of their instants is then known to a third";
    /// steps whose instants are looked at, at least, before commands are said to step between rows where they do in another log of the
    /// bench
    fewest_steps_elsewhere: usize = 3, "count", "judgement: their dead time is then known to a third of a row";
    /// logarithm of a likelihood, instants anywhere between rows over instants at rows, from which commands step between rows
    between_rows_evidence: f64 = 6.0, "-", "random benches: 10 to 10,000 of those that do, -500 to 1 of those that do not";
    /// logarithm of a likelihood, instants anywhere between rows over commands that are all logged late by one time, below which they are
    /// logged late
    logged_late_evidence: f64 = -2.0, "-", "random benches";
    /// variance of the instants that neither direction, size nor level of a step explains, over that of even ones: halfway between these
    /// and noise is the least
    even_spread: f64 = 0.5, "-", "random benches: 0.8 to 1.3 of even ones, 0 to 0.3 of laws that were not known";
    /// variance of even instants that the rates can tell from chance, below which they say nothing
    telling_spread: f64 = 0.015, "intervals²", "random benches: 0.03 and more of those whose commands step between rows";
    /// rms of what is left with steps at their instants, over the rate's noise, up to which instants explain the rates
    most_left_of_steps: f64 = 2.5, "-", "random benches: 0.1 to 1.7 of those whose commands do, 4 and more of laws that are no lag";
    /// variance that the estimated variance of one even instant has, over the square of that variance
    even_variance_error: f64 = 0.8, "-", "the kurtosis of an even distribution, 1.8, less one";
    /// share of all changes of a rotor's level that goes with its commands, from which it answers to them
    answered_steps: f64 = 0.5, "-", "judgement: a rotor that answers has nearly 1, a rate that drifts for itself nearly 0";
    /// standard errors of the variance of even instants by which they may spread wider than even ones
    widest_spread_errors: f64 = 3.0, "standard errors", "normal distribution: 1 in 700 by chance";
}
