//! `identify` against the emulator, which integrates finer than the fitter and shares no code with it.

mod at_random;
mod bench;
mod dead_time;
mod findings;
mod logs;
mod margins;
mod missing;
mod points;
mod readings;
mod same_codes;
mod screened;
mod section_three;
