//! Holds the import table of the rooms of `src/`: a room imports only from the rooms named for it.
//! The order stays free of circles, because each room may name only rooms above it in the table.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

mod sources;

use sources::sources;

/// Room, and the rooms it may import from. `*` = every room above it.
const TABLE: &[(&str, &[&str])] = &[
    // Files that appear complete or not at all: recordings, models, reports and logs need the same.
    ("file", &[]),
    ("unit", &[]),
    ("clock", &[]),
    ("signal", &[]),
    ("can", &["*"]),
    ("shm", &["clock", "signal"]),
    ("control", &["unit", "clock", "signal"]),
    ("guard", &["unit", "clock", "signal"]),
    ("effect", &["unit", "signal"]),
    ("model", &["file", "unit", "signal", "effect"]),
    ("record", &["file", "unit", "clock", "signal", "can", "control", "guard", "model"]),
    ("experiment", &["unit", "clock", "signal", "control", "guard"]),
    ("identify", &["unit", "signal", "effect", "model", "record", "experiment"]),
    ("diagnose", &["unit", "signal", "effect", "model", "record", "experiment", "identify"]),
    ("rt", &["clock", "signal"]),
    // The guard on the running bench; bridge and emulator both own one.
    ("gate", &["clock", "signal", "shm", "guard", "rt"]),
    ("emulate", &["unit", "clock", "signal", "can", "shm", "guard", "effect", "model", "rt", "gate"]),
    // The bench file puts the tables of the other rooms together.
    ("bench", &["*"]),
    // The bodies of bridge, control, run, record: what a process does, apart from how it is called.
    ("process", &["*"]),
    ("report", &["*"]),
    ("cli", &["*"]),
];

fn allowed(room: &str) -> BTreeSet<&'static str> {
    let position = TABLE.iter().position(|(name, _)| *name == room).unwrap_or_else(|| {
        panic!("src/ holds the room `{room}`, which tests/architecture.rs does not list");
    });
    let above: Vec<&str> = TABLE[..position].iter().map(|(name, _)| *name).collect();
    let named = TABLE[position].1;
    if named == ["*"] {
        return above.into_iter().collect();
    }
    for name in named {
        assert!(above.contains(name), "`{room}` names `{name}`, which is not above it");
    }
    named.iter().copied().collect()
}

/// Rooms that the text names as `crate::room`, also inside `use crate::{a, b::c}`.
fn imported(text: &str) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for (at, _) in text.match_indices("crate::") {
        if text[..at].ends_with('$') {
            continue;
        }
        let rest = &text[at + "crate::".len()..];
        if let Some(list) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut word = String::new();
            let mut at_room = true;
            for letter in list.chars() {
                match letter {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => at_room = true,
                    letter if depth == 0 && at_room && (letter.is_alphanumeric() || letter == '_') => {
                        word.push(letter)
                    }
                    letter if letter.is_whitespace() => {}
                    _ => {
                        at_room = depth == 0 && at_room && word.is_empty();
                    }
                }
                if (!at_room || letter == ',') && !word.is_empty() {
                    rooms.insert(std::mem::take(&mut word));
                }
            }
            if !word.is_empty() {
                rooms.insert(word);
            }
        } else {
            rooms.insert(
                rest.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect(),
            );
        }
    }
    rooms
}

#[test]
fn rooms_import_only_what_the_table_allows() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let files = sources(&root);
    assert!(files.len() > 20, "the walk found the sources");
    let mut wrong = Vec::new();
    for file in files {
        let relative = file.strip_prefix(&root).expect("below src");
        let first =
            relative.components().next().expect("a component").as_os_str().to_string_lossy().into_owned();
        let room = first.trim_end_matches(".rs").to_owned();
        if room == "lib" || room == "main" {
            continue;
        }
        let allowed = allowed(&room);
        let text: String = fs::read_to_string(&file)
            .expect("source is UTF-8")
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n");
        for name in imported(&text) {
            let is_room = TABLE.iter().any(|(room, _)| *room == name);
            if is_room && name != room && !allowed.contains(name.as_str()) {
                wrong.push(format!("{} uses crate::{name}", relative.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "imports the table does not allow:\n{}", wrong.join("\n"));
}

/// The program's path is there only for a crate that has the program.
#[test]
fn the_tests_of_guard_and_can_do_without_the_program() {
    let files: Vec<_> =
        ["tests/guard", "tests/can"].iter().flat_map(|room| sources(Path::new(room))).collect();
    for file in &files {
        let text = fs::read_to_string(file).expect("the file is readable");
        assert!(!text.contains("CARGO_BIN_EXE"), "{}: tools/mutants could not build it", file.display());
    }
    assert!(files.len() > 10, "{files:?}");
}

#[test]
fn the_import_reader_sees_every_spelling() {
    let rooms =
        imported("use crate::can::Frame;\nuse crate::{guard, signal::{Sensors, Command}, rt::Cycle as C};");
    let expected: BTreeSet<String> =
        ["can", "guard", "signal", "rt"].iter().map(|s| (*s).to_owned()).collect();
    assert_eq!(rooms, expected);
}
