//! How the source is laid out: rooms, circles inside them, thresholds, effects, sentences.

mod circles;
mod effects;
mod imports;
mod rooms;
mod sentences;
#[path = "../sources/mod.rs"]
mod sources;
mod thresholds;
