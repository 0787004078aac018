//! Mappings that come with the program.

/// Name and text of each.
pub const SHIPPED: &[(&str, &str)] = &[("rcbenchmark", include_str!("../mappings/rcbenchmark.toml"))];
