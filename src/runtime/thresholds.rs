//! Numbers that decide when a process of the bench gives up waiting.

crate::thresholds! {
    /// periods without news of the guard after which the controller takes it as closed
    silent_periods: u64 = 10, "periods", "judgement";
    /// time without a new value after which a controller says that its sensors have stopped, `silent_periods` at least
    sensors_silent_s: f64 = 0.5, "s", "judgement: longer than any hold that `check` does not warn of, so that the guard has acted";
    /// time without a word from the guard after which the bench counts as gone for an experiment
    gone_s: f64 = 5.0, "s", "judgement";
    /// time after which a process that is to end does, whatever the guard says
    longest_end_s: f64 = 1.0, "s", "judgement";
    /// time in which a running guard publishes at least once: the longest period of a bench and some
    silence_s: f64 = 2.0, "s", "twice the longest period of a bench, 1 s";
    /// time without sensors after which a controller says that it waits for them
    waiting_s: f64 = 1.0, "s", "judgement";
    /// time of the machine's clock after which a silent peer in lockstep is taken as gone
    patience_s: f64 = 2.0, "s", "judgement";
    /// time for which `arm`, `disarm` and `stop` wait for the guard's answer; `arm` the time of its checks longer
    answer_s: f64 = 3.0, "s", "judgement";
    /// time behind the guard's time for arming after which an experiment in lockstep gives it up
    arming_grace_s: f64 = 1.0, "s", "judgement";
    /// time over which the commands of a finished experiment run out
    run_out_s: f64 = 1.0, "s", "judgement";
    /// time between two log lines on another sender's commands: a flood of them must not fill the log
    foreign_logged_every_ns: u64 = 1_000_000_000, "ns", "judgement";
    /// periods after which the bus is listened to for the echoes of the commands, where nobody waits for the answer
    listen_every: u64 = 4, "periods", "judgement: a look costs a system call";
    /// what a step's distance from its schedule moves the schedule by, one in so many: the IMU's clock is followed, its jitter is not
    followed_share: u64 = 8, "count", "judgement";
    /// intervals between two gyro frames over which their mean is taken, the newest counting most
    interval_memory: u64 = 8, "count", "judgement: over so many the jitter of frames averages out";
}
