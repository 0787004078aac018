//! The guard alone: its table, every cause, the ladder period by period, and a million random steps.

mod commands;
mod edges;
mod events;
mod evidence;
mod ladder;
mod limits;
mod random;
mod requests;
mod rig;
mod settings;
mod signals;
mod speed;
mod table;
mod troubleshooting;
