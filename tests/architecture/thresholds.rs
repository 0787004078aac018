//! What a room decides by is on the page of thresholds.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::imports::{Source, program, read_sources};
use super::sources::sources;

/// Room and name of a threshold, and the files that use it, each from the top of `src/`.
type Uses = BTreeMap<(String, String), BTreeSet<String>>;

/// Every `THRESHOLDS.name` in `source`, tests apart, with the room whose table it is: named before it, or where it is imported.
fn find_uses(source: &Source, uses: &mut Uses) {
    let code = program(&source.text);
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

/// Rooms that decide something by numbers. What formats, codes and the kernel say of themselves is no decision of ours.
const DECIDING: [&str; 12] = [
    "estimation",
    "screening",
    "identify",
    "compare",
    "diagnose",
    "control",
    "guard",
    "experiment",
    "studies",
    "session",
    "report",
    "cli",
];

/// A number up to this is rounding, not a decision.
const ROUNDING: f64 = 1e-3;

/// Decimal numbers of a line of code that something is compared with; halves and ones decide nothing.
fn compared_with(line: &str) -> Vec<f64> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let number = |word: &&str| {
        let bare =
            word.trim_start_matches(['(', '-']).trim_end_matches(|letter: char| !letter.is_ascii_digit());
        let is_decimal =
            bare.starts_with(|letter: char| letter.is_ascii_digit()) && bare.contains(['.', 'e']);
        bare.parse::<f64>().ok().filter(|_| is_decimal)
    };
    let is_operator = |word: &&str| ["<", "<=", ">", ">="].contains(word);
    let beside = (0..words.len()).filter(|at| is_operator(&words[*at])).flat_map(|at| {
        [at.checked_sub(1), Some(at + 1)].into_iter().flatten().filter_map(|at| words.get(at))
    });
    beside.filter_map(number).filter(|it| it.abs() > ROUNDING && ![0.5, 1.0].contains(&it.abs())).collect()
}

/// A number that decides has a unit, a reason and what it was calibrated on.
#[test]
fn nothing_is_compared_with_a_number_of_its_own() {
    let mut found = Vec::new();
    for source in read_sources() {
        let is_test =
            source.module.iter().any(|word| ["tests", "interval_coverage"].contains(&word.as_str()));
        if !DECIDING.contains(&source.module[0].as_str()) || is_test {
            continue;
        }
        let code = program(&source.text);
        for line in code.lines() {
            found.extend(
                compared_with(line)
                    .into_iter()
                    .map(|number| format!("{}: {number}: {}", source.name, line.trim())),
            );
        }
    }
    assert!(found.is_empty(), "a threshold of the room says it instead: {found:#?}");
    assert_eq!(compared_with("if error > 1.05 * other && 3.0 <= x {"), [1.05, 3.0]);
    assert!(compared_with("if a < 0.0 || b > 1e-6 * c || n < 3 || x > 0.5 * y {").is_empty());
}
