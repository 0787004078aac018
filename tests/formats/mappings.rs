//! What comes with a format to say what its columns mean speaks of columns that there are, in their units.

use std::collections::BTreeSet;
use std::fs;

use super::reference::Reference;
use super::{format_of, logs, read};
use rotorbench::log::Mapping;
use rotorbench::log::tables::{Table, Tables};

/// Names and units of what a log holds, as a mapping calls it: `table.column`.
fn columns(tables: &Tables) -> Vec<(String, Option<&'static str>)> {
    let of_table = |table: &Table| -> Vec<_> {
        table.columns.iter().map(|column| (table.full_name(column), column.unit)).collect()
    };
    tables.tables.iter().flat_map(of_table).collect()
}

#[test]
fn mappings_name_columns_in_their_units() {
    let mut mapped = BTreeSet::new();
    let mut formats = BTreeSet::new();
    for (path, reference) in logs() {
        let bytes = fs::read(&path).expect("a log");
        let Some(format) = format_of(&path, &bytes) else { continue };
        let Some(mapping) = format.mapping() else { continue };
        Mapping::parse(mapping, &path).expect("a good mapping");
        let mapping: toml::Table = mapping.parse().expect("TOML");
        let tables = read(format, &path, &bytes, Reference::load(&reference).part()).expect("a good log");
        let columns = columns(&tables);
        formats.insert(format.name());
        for signal in mapping["signal"].as_array().expect("signals") {
            let text = |key: &str| signal.get(key).and_then(toml::Value::as_str);
            let column = text("column").expect("a column");
            if let Some((_, unit)) = columns.iter().find(|(name, _)| name == column) {
                assert!(
                    unit.is_none() || text("unit").is_none() || text("unit") == *unit,
                    "{column}: {unit:?}"
                );
                mapped.insert((format.name(), text("name").expect("a name").to_owned()));
            }
        }
    }
    for format in formats {
        for signal in ["command_1", "propeller_rate_1_rad_s"] {
            assert!(mapped.contains(&(format, signal.to_owned())), "no log of {format} has {signal}");
        }
    }
}
