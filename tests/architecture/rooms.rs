//! A room imports only from rooms above it in the table: the rooms stay free of circles.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::imports::{Source, from_the_top, paths, program, read_sources};

/// Room, and the rooms it may import from. `*` = every room above it.
pub const TABLE: &[(&str, &[&str])] = &[
    // Files that appear complete or not at all: recordings, models, reports and logs need the same.
    ("file", &[]),
    ("unit", &[]),
    // What a number that decides something says of itself.
    ("threshold", &[]),
    ("clock", &[]),
    // The wish to end a long computation: heard deep inside fits.
    ("cancel", &[]),
    // Work on several threads, which share their number and hear of that wish.
    ("threads", &["cancel"]),
    // Columns that log and model share.
    ("cells", &[]),
    // The allocator of the program: no room names it but one whose process lives on behind long work.
    ("memory", &[]),
    ("signal", &["unit"]),
    ("effect", &["unit", "signal"]),
    ("model", &["cells", "cancel", "file", "unit", "signal", "effect"]),
    // Mathematics without rotors and without logs.
    ("estimation", &["cancel", "threads", "unit"]),
    ("can", &["file", "unit", "clock", "signal"]),
    ("rt", &["cancel", "clock", "signal"]),
    // Whose memory may be taken away, which `rt` survives.
    ("shm", &["clock", "signal", "rt"]),
    ("control", &["unit", "clock", "signal"]),
    // It holds the rotors against the model of the bench.
    ("guard", &["unit", "clock", "signal", "model"]),
    ("experiment", &["unit", "clock", "signal", "control", "guard"]),
    ("recording", &["file", "unit", "clock", "signal", "can", "control", "guard", "model", "rt"]),
    (
        "log",
        &["cells", "cancel", "threads", "file", "unit", "clock", "signal", "can", "estimation", "recording"],
    ),
    ("screening", &["threads", "unit", "signal", "effect", "model", "estimation", "log"]),
    // The guard on the running bench; bridge and emulator both own one.
    ("bus_guard", &["clock", "signal", "shm", "guard", "rt"]),
    ("emulate", &["unit", "clock", "signal", "can", "shm", "guard", "effect", "model", "rt", "bus_guard"]),
    // The bench file puts the tables of the other rooms together.
    ("bench", &["*"]),
    (
        "identify",
        &[
            "cancel",
            "threads",
            "unit",
            "signal",
            "effect",
            "model",
            "estimation",
            "log",
            "screening",
            "experiment",
        ],
    ),
    (
        "compare",
        &[
            "threads",
            "cancel",
            "unit",
            "signal",
            "effect",
            "model",
            "estimation",
            "log",
            "screening",
            "identify",
        ],
    ),
    (
        "diagnose",
        &[
            "threads",
            "unit",
            "cancel",
            "signal",
            "effect",
            "model",
            "estimation",
            "log",
            "screening",
            "experiment",
            "identify",
            "compare",
        ],
    ),
    // Laws that no catalogue has: it goes on where a diagnosis ends.
    ("discover", &["threads", "cancel", "signal", "effect", "model", "estimation", "screening", "diagnose"]),
    // What a process of the bench does, apart from how it is called.
    ("runtime", &["*"]),
    // Experiments on the system itself: the paper, jitter, comparison of controllers.
    ("studies", &["*"]),
    // What a person does with logs and models; results, never text.
    ("session", &["*"]),
    // Many benches, diagnosed one by one and put together.
    ("fleet", &["*"]),
    ("report", &["*"]),
    // The page and its server.
    ("workbench", &["*"]),
    ("cli", &["*"]),
    // The thresholds of all rooms, for the documentation.
    ("thresholds_page", &["*"]),
];

/// Imports against the table that are still there. Each must be found: a line that is no longer true is taken out.
const STILL_UPWARD: &[(&str, &str)] = &[];

/// Whoever reads the map of the code must find every room, in the order in which they may import.
#[test]
fn the_page_has_the_rooms_of_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/architecture.md");
    let page = fs::read_to_string(path).expect("UTF-8");
    let (_, table) = page.split_once("| room | what lives there |").expect("the table");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let first_cells = rows.filter_map(|row| row.split('|').nth(1));
    let on_the_page: Vec<&str> = first_cells
        .flat_map(str::split_whitespace)
        .map(|room| room.trim_matches('`').trim_end_matches('/'))
        .collect();
    let in_the_test: Vec<&str> = TABLE.iter().map(|(room, _)| *room).collect();
    assert_eq!(
        on_the_page, in_the_test,
        "the rooms of docs/architecture.md (left), and those of this test (right)"
    );
}

fn allowed(room: &str) -> BTreeSet<&'static str> {
    let position = TABLE.iter().position(|(name, _)| *name == room).unwrap_or_else(|| {
        panic!("src/ holds the room `{room}`, which tests/architecture/rooms.rs does not list");
    });
    let above: Vec<&str> = TABLE[..position].iter().map(|(name, _)| *name).collect();
    let named = TABLE[position].1;
    if named == ["*"] {
        return above.into_iter().collect();
    }
    for name in named {
        assert!(above.contains(name), "`{room}` names `{name}`, which is not above it");
    }
    // Every room may have thresholds.
    named.iter().copied().chain(above.contains(&"threshold").then_some("threshold")).collect()
}

#[test]
fn rooms_import_only_what_the_table_allows() {
    let mut wrong = BTreeSet::new();
    for source in read_sources() {
        let room = &source.module[0];
        let allowed = allowed(room);
        for path in paths(&source.text) {
            let Some(name) = from_the_top(&source, &path).into_iter().next() else { continue };
            let is_room = TABLE.iter().any(|(room, _)| *room == name);
            if is_room && name != *room && !allowed.contains(name.as_str()) {
                wrong.insert((source.name.clone(), name));
            }
        }
    }
    let known: BTreeSet<_> =
        STILL_UPWARD.iter().map(|(file, room)| ((*file).to_owned(), (*room).to_owned())).collect();
    assert_eq!(wrong, known, "imports the table does not allow (left), and those known (right)");
}

/// The program's path is there only for a crate that has the program.
#[test]
fn the_tests_of_guard_and_can_do_without_the_program() {
    let files: Vec<_> = ["tests/guard", "tests/can"]
        .iter()
        .flat_map(|room| super::sources::sources(Path::new(room)))
        .collect();
    for file in &files {
        let text = fs::read_to_string(file).expect("the file is readable");
        assert!(!text.contains("CARGO_BIN_EXE"), "{}: tools/mutants could not build it", file.display());
    }
    assert!(files.len() > 10, "{files:?}");
}

/// What closes the loop speaks to any bus alike: a protocol is named by those that ask its nodes, and by who plays its bench.
#[test]
fn no_protocol_is_named_in_the_loop() {
    let asks_nodes = |name: &str| {
        let file = name.rsplit('/').next().unwrap_or(name);
        file.starts_with("dronecan") || name == "cli/emulate.rs"
    };
    let mut asked = 0;
    let is_above = |source: &&Source| source.module[0] != "can" && !source.name.ends_with("/tests.rs");
    for source in read_sources().iter().filter(is_above) {
        let named = paths(&program(&source.text))
            .iter()
            .flat_map(|path| from_the_top(source, path))
            .any(|word| ["dronecan", "ProtocolName", "Roles"].contains(&word.as_str()));
        assert!(!named || asks_nodes(&source.name), "{}: a protocol is named above `can`", source.name);
        asked += usize::from(named);
    }
    assert!(asked > 5, "{asked} files name a protocol: is the name another one?");
}
