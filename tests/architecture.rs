//! Holds the import table of the rooms of `src/`: a room imports only from the rooms named for it, and inside a room no files
//! import each other in a circle. The rooms stay free of circles, because each may name only rooms above it in the table.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

mod sources;

use sources::sources;

/// Room, and the rooms it may import from. `*` = every room above it.
const TABLE: &[(&str, &[&str])] = &[
    // Files that appear complete or not at all: recordings, models, reports and logs need the same.
    ("file", &[]),
    ("unit", &[]),
    // What a number that decides something says of itself.
    ("threshold", &[]),
    ("clock", &[]),
    // The wish to end a long computation: heard deep inside fits.
    ("cancel", &[]),
    ("signal", &["unit"]),
    ("effect", &["unit", "signal"]),
    ("model", &["file", "unit", "signal", "effect"]),
    // Mathematics without rotors and without logs.
    ("estimation", &["cancel", "unit"]),
    ("can", &["unit", "clock", "signal"]),
    ("rt", &["cancel", "clock", "signal"]),
    // Whose memory may be taken away, which `rt` survives.
    ("shm", &["clock", "signal", "rt"]),
    ("control", &["unit", "clock", "signal"]),
    ("guard", &["unit", "clock", "signal"]),
    ("experiment", &["unit", "clock", "signal", "control", "guard"]),
    ("recording", &["file", "unit", "clock", "signal", "can", "control", "guard", "model"]),
    ("log", &["cancel", "file", "unit", "clock", "signal", "can", "estimation", "recording"]),
    ("screening", &["unit", "signal", "effect", "model", "estimation", "log"]),
    // The guard on the running bench; bridge and emulator both own one.
    ("bus_guard", &["clock", "signal", "shm", "guard", "rt"]),
    ("emulate", &["unit", "clock", "signal", "can", "shm", "guard", "effect", "model", "rt", "bus_guard"]),
    // The bench file puts the tables of the other rooms together.
    ("bench", &["*"]),
    ("identify", &["unit", "signal", "effect", "model", "estimation", "log", "screening", "experiment"]),
    (
        "compare",
        &["cancel", "unit", "signal", "effect", "model", "estimation", "log", "screening", "identify"],
    ),
    (
        "diagnose",
        &[
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
    // What a process of the bench does, apart from how it is called.
    ("runtime", &["*"]),
    // Experiments on the system itself: the paper, jitter, comparison of controllers.
    ("studies", &["*"]),
    // What a person does with logs and models; results, never text.
    ("session", &["*"]),
    ("report", &["*"]),
    ("cli", &["*"]),
    // The thresholds of all rooms, for the documentation.
    ("thresholds_page", &["*"]),
];

/// Imports against the table that are still there. Each must be found: a line that is no longer true is taken out.
const STILL_UPWARD: &[(&str, &str)] = &[];

/// Files of one room that still import each other in a circle; likewise.
const STILL_IN_CIRCLES: &[&[&str]] = &[];

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
    // Every room may have thresholds.
    named.iter().copied().chain(above.contains(&"threshold").then_some("threshold")).collect()
}

/// Every path of `use` lines and of expressions that begins with `crate`, `super` or `self`, its groups written out.
fn paths(text: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for start in ["crate::", "super::", "self::"] {
        for (at, _) in text.match_indices(start) {
            let inside =
                |letter: char| letter.is_alphanumeric() || letter == '_' || letter == '$' || letter == ':';
            if !text[..at].ends_with(inside) {
                read_path(&mut text[at..].chars().peekable(), &[], &mut found);
            }
        }
    }
    found
}

/// One path, `a::b` or `a::{b, c::d}`, behind `before`.
fn read_path(
    letters: &mut std::iter::Peekable<std::str::Chars>,
    before: &[String],
    found: &mut Vec<Vec<String>>,
) {
    let mut path = before.to_vec();
    loop {
        while letters.next_if(|letter| letter.is_whitespace()).is_some() {}
        if letters.next_if_eq(&'{').is_some() {
            loop {
                read_path(letters, &path, found);
                // What follows a name in a group (`as Other`) up to the comma.
                while letters.next_if(|letter| *letter != ',' && *letter != '}').is_some() {}
                if letters.next() != Some(',') {
                    return;
                }
            }
        }
        let mut word = String::new();
        while let Some(letter) = letters.next_if(|letter| letter.is_alphanumeric() || *letter == '_') {
            word.push(letter);
        }
        if !word.is_empty() {
            path.push(word);
        }
        if letters.next_if_eq(&':').is_none() || letters.next_if_eq(&':').is_none() {
            found.push(path);
            return;
        }
    }
}

/// A file of `src/` without comments and without its tests, beside the path of its module.
struct Source {
    name: String,
    module: Vec<String>,
    text: String,
}

fn read_sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut all = Vec::new();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        let mut module: Vec<String> = name.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
        if module.last().is_some_and(|last| last == "mod") {
            module.pop();
        }
        if ["lib", "main"].contains(&module[0].as_str()) {
            continue;
        }
        let code = |line: &&str| !line.trim_start().starts_with("//");
        let text = fs::read_to_string(&file).expect("source is UTF-8");
        let text: Vec<&str> = text.lines().filter(code).collect();
        all.push(Source { name, module, text: text.join("\n") });
    }
    assert!(all.len() > 20, "the walk found the sources");
    all
}

/// A path of `source` from the top of the crate on: `super::x` in `can/port.rs` is `can::x`.
fn from_the_top(source: &Source, path: &[String]) -> Vec<String> {
    let mut absolute = if path[0] == "crate" { Vec::new() } else { source.module.clone() };
    for word in path {
        match word.as_str() {
            "crate" | "self" => {}
            "super" => drop(absolute.pop()),
            _ => absolute.push(word.clone()),
        }
    }
    absolute
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

/// What each file of a room imports of the room's other files, through the parent's re-exports, too. Tests and the parent
/// `mod.rs`, which gathers its children, are left out.
fn arrows(all: &[Source]) -> BTreeMap<String, BTreeSet<String>> {
    let is_test = |source: &Source| source.module.iter().any(|word| word == "tests");
    let file_of: BTreeMap<&[String], &Source> =
        all.iter().filter(|source| !is_test(source)).map(|source| (&source.module[..], source)).collect();
    let mut arrows = BTreeMap::new();
    for source in file_of.values() {
        if source.name.ends_with("mod.rs") {
            continue;
        }
        let code = source.text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let mut seen = BTreeSet::new();
        for path in paths(code) {
            let absolute = from_the_top(source, &path);
            if let Some(file) = defined_in(&file_of, &absolute, 0)
                && file.module[0] == source.module[0]
                && file.name != source.name
                && !file.name.ends_with("mod.rs")
            {
                seen.insert(file.name.clone());
            }
        }
        arrows.insert(source.name.clone(), seen);
    }
    arrows
}

/// The file that an absolute path leads to: the longest module of it, or where that module has a name from.
fn defined_in<'a>(
    file_of: &BTreeMap<&[String], &'a Source>,
    absolute: &[String],
    depth: usize,
) -> Option<&'a Source> {
    let length = (1..=absolute.len()).rev().find(|length| file_of.contains_key(&absolute[..*length]))?;
    let file = file_of[&absolute[..length]];
    let rest = &absolute[length..];
    if !file.name.ends_with("mod.rs") || rest.is_empty() || depth > 4 {
        return Some(file);
    }
    for line in
        file.text.split(';').filter(|statement| statement.contains("pub") && statement.contains("use "))
    {
        let Some((_, list)) = line.split_once("use ") else { continue };
        let mut named = Vec::new();
        read_path(&mut list.chars().peekable(), &[], &mut named);
        let own = named.iter().find(|path| path.last() == rest.first() && path[0] != "crate");
        if let Some(path) = own {
            let path: Vec<_> = [&absolute[..length], path].concat();
            return defined_in(file_of, &path, depth + 1);
        }
    }
    Some(file)
}

/// Files that reach each other both ways, each group sorted.
fn circles(arrows: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reach = |from: &String| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&String> = arrows.get(from).into_iter().flatten().collect();
        while let Some(file) = next.pop() {
            if seen.insert(file.clone()) {
                next.extend(arrows.get(file).into_iter().flatten());
            }
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<String>> =
        arrows.keys().map(|file| (file, reach(file))).collect();
    let mut found = BTreeSet::new();
    for (file, all) in &reached {
        if all.contains(*file) {
            let group: Vec<String> = all
                .iter()
                .filter(|other| reached.get(other).is_some_and(|back| back.contains(*file)))
                .cloned()
                .collect();
            found.insert(group);
        }
    }
    found
}

#[test]
fn inside_a_room_no_files_import_each_other_in_a_circle() {
    let all = read_sources();
    let known: BTreeSet<Vec<String>> =
        STILL_IN_CIRCLES.iter().map(|group| group.iter().map(|file| (*file).to_owned()).collect()).collect();
    assert_eq!(circles(&arrows(&all)), known, "circles (left), and those known (right)");
}

#[test]
fn a_circle_is_seen_through_the_parent_too() {
    let source = |name: &str, module: &[&str], text: &str| Source {
        name: name.to_owned(),
        module: module.iter().map(|word| (*word).to_owned()).collect(),
        text: text.to_owned(),
    };
    let parent = source("can/mod.rs", &["can"], "mod a;\nmod b;\npub use a::{A, Other};\npub use b::B;");
    let a = source("can/a.rs", &["can", "a"], "use super::{B, Outside};");
    let b = source("can/b.rs", &["can", "b"], "use crate::can::A;");
    let alone = source("can/c.rs", &["can", "c"], "use super::a::A;\nuse crate::clock::now;");
    let group = vec!["can/a.rs".to_owned(), "can/b.rs".to_owned()];
    assert_eq!(circles(&arrows(&[parent, a, b, alone])), BTreeSet::from([group]));
}

/// Room and name of a threshold, and the files that use it, each from the top of `src/`.
type Uses = BTreeMap<(String, String), BTreeSet<String>>;

/// Every `THRESHOLDS.name` in `source`, tests apart, with the room whose table it is: named before it, or where it is imported.
fn find_uses(source: &Source, uses: &mut Uses) {
    let code = source.text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let part_of_a_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let room_before = |at: usize| {
        let path = code[..at].strip_suffix("::thresholds::")?;
        let room = path.rsplit(|letter| !part_of_a_word(letter)).next()?;
        Some(if ["super", "self"].contains(&room) { source.module[0].clone() } else { room.to_owned() })
    };
    let import = "::thresholds::THRESHOLDS;";
    let imported = code.find(import).and_then(|at| room_before(at + "::thresholds::".len()));
    for (at, word) in code.match_indices("THRESHOLDS") {
        let Some(behind) = code[at + word.len()..].trim_start().strip_prefix('.') else { continue };
        let room = room_before(at).or_else(|| imported.clone()).unwrap_or_else(|| source.module[0].clone());
        let name = behind.split(|letter| !part_of_a_word(letter)).next().unwrap_or_default().to_owned();
        uses.entry((room, name)).or_default().insert(source.name.clone());
    }
}

/// The files that use a threshold, without the path where they are its room's.
fn used_in(uses: &Uses, room: &str, name: &str) -> String {
    let files = uses
        .get(&(room.to_owned(), name.to_owned()))
        .unwrap_or_else(|| panic!("nobody uses {room}'s `{name}`"));
    let own = format!("{room}/");
    let short = |file: &String| format!("`{}`", file.strip_prefix(&own).unwrap_or(file));
    files.iter().map(short).collect::<Vec<_>>().join(" ")
}

#[test]
fn uses_of_thresholds_are_found_by_the_room_whose_they_are() {
    let text = "use super::super::thresholds::THRESHOLDS;\nfn f() { a > THRESHOLDS\n    .least || b > crate::log::thresholds::THRESHOLDS.hole }
#[cfg(test)]\nmod tests { THRESHOLDS.most }";
    let module = vec!["control".to_owned(), "design".to_owned(), "tune".to_owned()];
    let source =
        Source { name: "control/design/tune.rs".to_owned(), module: module.clone(), text: text.to_owned() };
    let other = Source {
        name: "cli/show.rs".to_owned(),
        module: vec!["cli".to_owned(), "show".to_owned()],
        text: "use crate::control::thresholds::THRESHOLDS;\nfn f() { a > THRESHOLDS.least }".to_owned(),
    };
    let mut uses = Uses::new();
    [source, other].iter().for_each(|source| find_uses(source, &mut uses));
    let found: Vec<_> = uses.keys().map(|(room, name)| format!("{room} {name}")).collect();
    assert_eq!(found, ["control least", "log hole"]);
    assert_eq!(used_in(&uses, "control", "least"), "`cli/show.rs` `design/tune.rs`");
}

/// What a room decides by is on the page of thresholds, and the page says what is in the code.
#[test]
fn the_page_of_thresholds_is_current() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = sources(&root.join("src"));
    let with_thresholds =
        files.iter().filter(|file| file.file_name().is_some_and(|it| it == "thresholds.rs"));
    let rooms: BTreeSet<String> = with_thresholds
        .filter_map(|file| Some(file.parent()?.strip_prefix(root.join("src")).ok()?.display().to_string()))
        .collect();
    let listed: BTreeSet<String> =
        rotorbench::thresholds_page::ROOMS.iter().map(|(room, _)| (*room).to_owned()).collect();
    assert_eq!(
        rooms, listed,
        "rooms with a thresholds.rs (left), and those in src/thresholds_page.rs (right)"
    );
    let mut uses = Uses::new();
    read_sources().iter().for_each(|source| find_uses(source, &mut uses));
    let (path, page) = (
        root.join("docs/thresholds.md"),
        rotorbench::thresholds_page::markdown(|room, name| used_in(&uses, room, name)),
    );
    if std::env::var_os("ROTORBENCH_BLESS").is_some_and(|value| value == "1") {
        fs::create_dir_all(root.join("docs")).expect("a folder");
        fs::write(&path, &page).expect("written");
    }
    let written = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/thresholds.md is not what the code says; `ROTORBENCH_BLESS=1 cargo test --test architecture` writes it anew"
    );
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
    let text = "use crate::can::Frame;\nuse crate::{guard, signal::{Sensors as S, Command}, rt::Cycle as C};
        fn f() { super::codec::walk(self::one()) }";
    let read: BTreeSet<String> = paths(text).iter().map(|path| path.join("::")).collect();
    let expected = [
        "crate::can::Frame",
        "crate::guard",
        "crate::signal::Sensors",
        "crate::signal::Command",
        "crate::rt::Cycle",
        "super::codec::walk",
        "self::one",
    ];
    assert_eq!(read, expected.iter().map(|path| (*path).to_owned()).collect());
}

/// Where `id` stands in `text` as a word of its own.
fn names(text: &str, id: &str) -> bool {
    let part_of_a_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    text.match_indices(id).any(|(at, _)| {
        !text[..at].ends_with(part_of_a_word) && !text[at + id.len()..].starts_with(part_of_a_word)
    })
}

/// The program without its tests and without what cards say they are confused with. Comments stay: one that speaks of an
/// effect by its id is as wrong as code when the effect goes.
fn without_tests(name: &str, text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    match text.split_once("    confused_with: &[").filter(|_| name.starts_with("effect/")) {
        Some((before, behind)) => format!("{before}{}", behind.split_once(']').map_or("", |(_, rest)| rest)),
        None => text.to_owned(),
    }
}

/// The catalogue and the emulator's; the example on the crate's front page, and those of `--help`, which tests run.
const EXEMPT: [&str; 4] = ["effect/mod.rs", "emulate/hidden.rs", "lib.rs", "cli/commands.rs"];

/// An effect is one file. What others must know of it is on its card; the emulator's laws are a second catalogue on purpose.
#[test]
fn no_file_but_its_own_names_an_effect() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let read = |name: &str| fs::read_to_string(root.join(name)).expect("source is UTF-8");
    let catalogue = read("effect/mod.rs");
    let (_, list) = catalogue.split_once("\ncatalogue![").expect("the catalogue");
    let (list, _) = list.split_once(']').expect("its end");
    let ids: Vec<&str> = list.split(',').map(str::trim).filter(|id| !id.is_empty()).collect();
    let own: Vec<String> = ids.iter().map(|id| format!("effect/{id}.rs")).collect();
    for (id, own) in ids.iter().zip(&own) {
        assert!(names(&read(own), id), "{own} is another card");
    }
    let mut found = BTreeSet::new();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        if EXEMPT.contains(&name.as_str()) || name.ends_with("tests.rs") {
            continue;
        }
        let text = without_tests(&name, &read(&name));
        let others = ids.iter().zip(&own).filter(|(_, own)| **own != name);
        found.extend(others.filter(|(id, _)| names(&text, id)).map(|(id, _)| format!("{name} names {id}")));
    }
    assert!(ids.len() > 20, "the catalogue was read");
    assert!(found.is_empty(), "a property of the card says it instead: {found:#?}");
}

#[test]
fn the_search_for_ids_sees_words_alone() {
    assert!(names("has(\"gyro_lag\")", "gyro_lag") && names("`gyro_lag.pole`", "gyro_lag"));
    assert!(!names("my_gyro_lag", "gyro_lag") && !names("gyro_lags", "gyro_lag"));
    let card = "{\n    id: \"a\",\n    confused_with: &[\"gyro_lag\"],\n    law: gyro_bias }\n#[cfg(test)]\nmod tests { gyro_scale }";
    let left = without_tests("effect/a.rs", card);
    assert!(!names(&left, "gyro_lag") && names(&left, "gyro_bias") && !names(&left, "gyro_scale"));
    assert!(names(&without_tests("model/a.rs", card), "gyro_lag"));
}

/// Methods by which code would take a sentence apart.
const PARSERS: [&str; 9] = [
    ".contains(\"",
    ".starts_with(\"",
    ".ends_with(\"",
    ".strip_prefix(\"",
    ".strip_suffix(\"",
    ".split_once(\"",
    ".find(\"",
    ".matches(\"",
    ".eq(\"",
];

/// What the kernel writes is no sentence of ours.
const OTHERS_TEXT: &[&str] = &[" /dev/shm tmpfs "];

/// Literals of two words or more that a text is searched for.
fn searched_for(text: &str) -> Vec<&str> {
    let literal =
        |(at, method): (usize, &str)| text[at + method.len()..].split('"').next().unwrap_or_default();
    let each = PARSERS.iter().flat_map(|method| text.match_indices(method));
    each.map(literal).filter(|literal| literal.split_whitespace().count() > 1).collect()
}

/// Findings, caveats and notes are codes with evidence: who wants to know what was found matches a code.
#[test]
fn no_code_parses_a_sentence() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        let text = fs::read_to_string(&file).expect("source is UTF-8");
        if name.ends_with("tests.rs") || name.contains("/tests/") {
            continue;
        }
        let program = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        let code: Vec<&str> = program.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let code = code.join("\n");
        let searched = searched_for(&code).into_iter().filter(|literal| !OTHERS_TEXT.contains(literal));
        found.extend(searched.map(|literal| format!("{name} looks for \"{literal}\"")));
    }
    assert!(found.is_empty(), "match a code instead: {found:#?}");
    assert_eq!(searched_for(r#"said.contains("held still") || name.starts_with("rotor ")"#), ["held still"]);
}
