//! `diagnose` and `extend` as their user sees them: logs of the emulator, which integrates finer than the fitter and has
//! laws of its own, with something hidden in it; and the refusals.

mod battery;
mod bend;
mod cancelled;
mod columns;
mod dead_time;
mod desk;
mod discovered;
mod found;
mod holes;
mod ladder;
mod long;
mod readings;
mod refused;
mod rotors;
mod threads;
