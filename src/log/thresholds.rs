//! Numbers that decide something in reading logs.

crate::thresholds! {
    /// median sampling intervals from which a gap is a hole: one lost sample is jitter, two are a hole.
    hole: f64 = 2.5, "intervals", "judgement";
    /// median intervals of an input for which it is held over missing cells, at most.
    input_hold: f64 = 2.5, "intervals", "judgement";
    /// rows behind a backward stamp that are looked at to tell a glitch from a log that begins anew.
    restart_rows: usize = 10, "count", "judgement";
    /// a frame of a blackbox log further ahead of the last one is not believed before another one agrees.
    blackbox_pause: u32 = 10_000_000, "µs", "the firmware's own reader";
    /// turns of the control loop by which a frame of a blackbox log may be ahead of the last one, as `blackbox_pause`.
    blackbox_turns: u32 = 5_000, "count", "the firmware's own reader";
    /// numbers that one byte of a blackbox log may become; a header can ask for hundreds, and for all memory.
    blackbox_numbers: usize = 8, "count", "the emptiest frames of firmwares make 1.5 of one";
    /// lowest output of a motor below which a blackbox log's commands are DShot throttle, not pulses in µs.
    dshot_idle: f64 = 900.0, "-", "DShot's idle is 48 to 450, a pulse is 1000 µs or more";
    /// share of a foreign column's values that its size is greater than: glitches are no size.
    guess_size: f64 = 0.95, "-", "judgement";
    /// size up to which thrusts without a unit are newtons, not gram-force.
    guess_thrust: f64 = 100.0, "N", "a thrust stand's propellers give less than 100 N and more than 100 gf";
    /// size up to which voltages without a unit are volts, not millivolts.
    guess_voltage: f64 = 100.0, "V", "batteries of such benches";
    /// size up to which currents without a unit are amperes, not milliamperes.
    guess_current: f64 = 200.0, "A", "ESCs of such benches";
    /// size up to which temperatures without a unit are degrees Celsius, not kelvins.
    guess_temperature: f64 = 150.0, "degC", "a motor that is hotter is burnt, and 150 K is no weather";
    /// size up to which body rates without a unit are radians, not degrees a second.
    guess_body_rate: f64 = 25.0, "rad/s", "judgement";
    /// size up to which body angles without a unit are radians, not degrees.
    guess_body_angle: f64 = 6.3, "rad", "one turn";
    /// size up to which propeller rates without a unit are radians a second, not rpm.
    guess_propeller_rate: f64 = 2_500.0, "rad/s", "judgement";
    /// pole pairs that a rate in electrical revolutions is divided by until somebody says how many there are.
    guess_pole_pairs: f64 = 7.0, "-", "most motors of multirotors have 14 magnets";
    /// range of commands without a unit that are servo pulses.
    guess_pulse: (f64, f64) = (800.0, 2200.0), "µs", "servo pulses of 1000 to 2000 µs, and what overshoots";
    /// time from row to row of a machine's log: of a time without a unit, the unit that makes it so.
    guess_interval: (f64, f64) = (5e-5, 0.5), "s", "logs from 2 Hz to 20 kHz";
    /// how far beyond 0 and 1 the digits of a mapping's scale and offset put a command.
    command_rounding: f64 = 1e-5, "-", "five digits";
    /// log over in less time than this is none in microseconds, where all its stamps are round: its rows are as many ms apart.
    guess_short_us: f64 = 1e6, "µs", "judgement";
    /// multiples of this are round stamps in microseconds: the clocks of microcontrollers count single ones, or four.
    guess_round_us: f64 = 100.0, "µs", "judgement";
    /// share of a voltage's greatest size up to which it is 0, as of a motor that is given none.
    guess_no_volts: f64 = 0.05, "-", "judgement";
    /// share of a voltage's rows that are 0, for it to be none of a battery: single dropouts are no command.
    guess_dead_rows: f64 = 0.02, "-", "judgement";
    /// steps of a voltage from which on it may be one that was asked for, where nearly all other rows repeat the row before.
    guess_volt_steps: f64 = 2.0, "count", "judgement";
    /// share of rows that repeat the row before, of a voltage that may have been asked for.
    guess_held_rows: f64 = 0.9, "-", "judgement";
    /// share of its greatest size over which a voltage goes in steps that may have been asked for: a battery sags by less.
    guess_volt_range: f64 = 0.3, "-", "judgement";
    /// cells of text, each counted once, that a column of numbers may have, as marks of no value; with more of them it is no column of numbers.
    guess_texts: usize = 8, "count", "judgement";
    /// share of a command's values above the mapping's range from which that is too narrow for the log.
    narrow_share: f64 = 0.01, "-", "judgement: fewer are what overshoots";
    /// share of the values above the mapping's range that lie below what counts as the log's end: glitches are none.
    narrow_end: f64 = 0.95, "-", "judgement";
    /// share of what lies above the mapping's range that is its top, and that is near its end.
    narrow_part: f64 = 0.25, "-", "judgement";
    /// share of the mapping's range that is near its end.
    narrow_near: f64 = 0.02, "-", "judgement";
    /// share by which the rates differ at the end of the mapping's range and at the top of what lies above, for the range to be too narrow.
    narrow_rate: f64 = 0.05, "-", "judgement: more than rates at full command scatter";
    /// share by which the scales of a guess and of a shipped mapping may differ for the one to be the other.
    same_scale: f64 = 0.05, "-", "judgement";
    /// time from row to row of a table of levels whose pauses nobody recorded.
    level_period: f64 = 10.0, "s", "judgement: a rotor has settled";
    /// rows of a foreign table that are looked at to guess what its columns mean.
    guess_rows: usize = 2_000, "count", "judgement";
    /// bytes of a foreign table that are looked at to find out how it is laid out.
    guess_bytes: usize = 1_048_576, "byte", "judgement";
    /// letters that may be wrong in a name that is asked about as another one misspelt.
    misspelt_letters: usize = 2, "count", "judgement";
    /// letters that a name has at least to be asked about as another one misspelt: of a shorter one `misspelt_letters` are too many.
    misspelt_name: usize = 6, "count", "judgement";
    /// room made in columns for a long file, over what it has if its rows are as long as those read first.
    room: f64 = 1.05, "-", "judgement: rows are not all of one length; what is not written to takes no memory";
    /// longest file that is read whole.
    longest_file: u64 = 4 << 30, "byte", "judgement: what cannot be a log must not take the memory of the machine";
    /// most that is read of what has no length, as a pipe.
    longest_stream: u64 = 256 << 20, "byte", "judgement: as `longest_file`, and it may be without end";
    /// most columns of a table.
    most_columns: usize = 4_096, "count", "a log of sixteen rotors has some hundred";
    /// time after which a wait for input looks whether it was cancelled.
    cancel_look: u64 = 50, "ms", "judgement: nobody notices it";
    /// characters of the longest name of a column: it is compared with every name that is known
    longest_name: usize = 256, "count", "judgement: the longest of foreign logs has some 60";
}
