//! From logs to models: what identifies, compares, diagnoses and extends, and the paper's own numbers. One program: each
//! would be linked with the whole library for itself.

#[path = "diagnose/main.rs"]
mod diagnose;
#[path = "effects.rs"]
mod effects;
#[path = "examples.rs"]
mod examples;
#[path = "fleet.rs"]
mod fleet;
#[path = "formats/main.rs"]
mod formats;
#[path = "identify/main.rs"]
mod identify;
mod json_schema;
#[path = "paper.rs"]
mod paper;
#[path = "paper_lpc16.rs"]
mod paper_lpc16;
mod sources;
