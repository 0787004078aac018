//! Constant, ramp, step, PRBS and chirp commands.
