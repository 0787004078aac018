//! `signal/channels.rs` is the one table of sensors: no other file spells the name of a sensor or of a log's column.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rotorbench::signal::{Channel, Sensor, columns};

use super::sentences::{is_sentence, literals};
use super::sources::sources;

/// The table, and the columns that no sensor measures.
const TABLE: [&str; 2] = ["signal/channels.rs", "signal/columns.rs"];

/// What has the name of a column and is none: file, literal, what it is.
const OTHERS: &[(&str, &str, &str)] = &[
    ("compare/blocks.rs", "thrust_{}", "a block of the model"),
    ("log/guess/meanings.rs", "body_rate", "a word in the column names of others"),
    ("log/guess/meanings.rs", "propeller_rate", "a word in the column names of others"),
];

/// Names of sensors, channels and columns, a rotor's number written as a star. Names of one word mean other things, too.
fn names() -> BTreeSet<String> {
    let of_sensors = Sensor::ALL.iter().flat_map(|it| [it.name(), it.name_with_unit()]);
    let of_channels = Channel::ALL.iter().flat_map(|it| [it.name(), it.column()]);
    let unmeasured = [columns::TIME, columns::TORQUE_COMMAND, columns::ANY_COMMAND];
    let all = of_sensors.chain(of_channels).chain(unmeasured).map(any_rotor);
    all.filter(|name| name.contains('_')).collect()
}

/// A name with stars for what stands for a rotor's number: digits, a placeholder, an `N`.
fn any_rotor(name: &str) -> String {
    let is_number = |part: &str| part == "N" || part.starts_with('{') || part.parse::<usize>().is_ok();
    let star = |part| if is_number(part) { "*" } else { part };
    name.split('_').map(star).collect::<Vec<_>>().join("_")
}

/// Whether a literal spells one of `names`, alone, among other words, or up to a rotor's number.
fn spells(literal: &str, names: &BTreeSet<String>) -> bool {
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || "_*{}".contains(letter);
    literal.split(|letter| !is_part(letter)).map(any_rotor).any(|word| {
        let of_any = |name: &&String| {
            name.split_once('*')
                .is_some_and(|(start, _)| word == start || word.starts_with(&format!("{start}*")))
        };
        names.contains(&word) || names.iter().find(of_any).is_some()
    })
}

/// The literals of a file that spell a column; what people read may name it.
fn spelled_in(name: &str, text: &str, names: &BTreeSet<String>) -> Vec<String> {
    let all = literals(text).into_iter().map(|(_, literal)| literal);
    let is_other = |literal: &str| OTHERS.iter().any(|(file, other, _)| *file == name && *other == literal);
    all.filter(|it| spells(it, names) && !is_sentence(it) && !is_other(it))
        .map(|it| format!("{name}: {it}"))
        .collect()
}

#[test]
fn sensors_and_columns_are_spelled_in_their_table_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let names = names();
    let mut found = Vec::new();
    let mut unused: BTreeSet<_> = OTHERS.iter().map(|(file, literal, _)| (*file, *literal)).collect();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        let is_test =
            name.ends_with("tests.rs") || ["/tests/", "interval_coverage"].iter().any(|it| name.contains(it));
        if is_test || TABLE.contains(&name.as_str()) {
            continue;
        }
        let text = fs::read_to_string(&file).expect("source is UTF-8");
        unused.retain(|(file, literal)| *file != name || !text.contains(&format!("\"{literal}\"")));
        found.extend(spelled_in(&name, &text, &names));
    }
    assert!(found.is_empty(), "`signal::columns` or `Channel` has the name: {found:#?}");
    assert!(unused.is_empty(), "exceptions that nothing needs: {unused:?}");
}

#[test]
fn a_column_is_seen_in_each_guise() {
    let names = names();
    let seen = |code: &str| spelled_in("compare/a.rs", code, &names).len();
    let guises = [
        "propeller_rate_2_rad_s",
        "propeller_rate_{}_rad_s",
        "command_{rotor}",
        "command_",
        "propeller_rate_*_rad_s",
        "current_N_a",
        "command_{number}_change",
        "time_s",
        "body_rate",
        "name,time_s",
    ];
    for guise in guises {
        assert_eq!(seen(&format!("let name = \"{guise}\";")), 1, "{guise}");
    }
    let others =
        ["command_dead_zone", "thrust_coefficient", "thrust", "body_rate_in_degrees", "no_battery_voltage"];
    for other in others {
        assert_eq!(seen(&format!("let name = \"{other}\";")), 0, "{other}");
    }
    assert_eq!(seen("let said = \"the log has no column time_s\";"), 0);
    assert_eq!(seen("// \"time_s\"\n#[serde(rename = \"time_s\")]\nstruct A;"), 0);
}
