//! How the source is laid out: rooms, circles inside them, thresholds, sensors, effects, sentences, lengths, unsafe code. A file for
//! each below `tests/architecture/`.

#[path = "architecture/circles.rs"]
mod circles;
#[path = "architecture/effects.rs"]
mod effects;
#[path = "architecture/examples.rs"]
mod examples;
#[path = "architecture/exempt_numbers.rs"]
mod exempt_numbers;
#[path = "architecture/imports.rs"]
mod imports;
#[path = "architecture/lengths.rs"]
mod lengths;
#[path = "architecture/names.rs"]
mod names;
#[path = "architecture/rooms.rs"]
mod rooms;
#[path = "architecture/sensors.rs"]
mod sensors;
#[path = "architecture/sentences.rs"]
mod sentences;
mod sources;
#[path = "architecture/thresholds.rs"]
mod thresholds;
#[path = "architecture/unsafe_code.rs"]
mod unsafe_code;
