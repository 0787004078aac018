//! Any text as the `[bus]` table, which is built without a panic or refused.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rotorbench::can::{BusConfig, Database, Roles};

fuzz_target!(|text: &str| {
    let Ok(config) = toml::from_str::<BusConfig>(text) else { return };
    // Only the built-in files: the fuzzer must not open what it makes up.
    let bench = include_bytes!("../../../dbc/bench.dbc");
    let databases: Vec<Database> =
        config.database.iter().take(2).filter_map(|_| Database::parse("bench", bench).ok()).collect();
    let _ = Roles::resolve(&config, &databases, 0.02);
});
