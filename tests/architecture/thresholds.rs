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
    let place = |room: &str| super::rooms::TABLE.iter().position(|(name, _)| *name == room);
    assert!(
        rotorbench::thresholds_page::ROOMS.is_sorted_by_key(|(room, _)| place(room)),
        "src/thresholds_page.rs has the rooms in another order than tests/architecture/rooms.rs"
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
const DECIDING: [&str; 13] = [
    "estimation",
    "screening",
    "identify",
    "compare",
    "diagnose",
    "discover",
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

/// Files whose numbers are no decisions, and what they are.
const OTHER_NUMBERS: &[(&str, &str)] = &[
    ("cli/demo", "what happens in the demo"),
    ("cli/effects.rs", "an example in the help"),
    ("cli/experiment.rs", "defaults of options"),
    ("compare/config.rs", "defaults of settings"),
    ("compare/gyro_block.rs", "the weights of a parabola"),
    ("control/compensation.rs", "defaults of settings"),
    ("control/config.rs", "defaults of settings, many of the paper's"),
    ("control/parameters.rs", "the bench of the paper"),
    ("diagnose/config.rs", "defaults of settings"),
    ("discover/forms.rs", "where the functions of the library start"),
    ("estimation/frequency_response.rs", "Welch's"),
    ("estimation/golden_section.rs", "the golden section"),
    ("estimation/quantile.rs", "the median of a normal variable's size"),
    ("estimation/robust_errors.rs", "Student's quantile"),
    ("experiment/mod.rs", "shapes of test signals"),
    ("guard/config.rs", "defaults of settings"),
    ("screening/checks/thrust_unlike_template.rs", "units"),
    ("screening/plausibility.rs", "units"),
    ("studies/jitter/measurement.rs", "signals made up"),
    ("studies/paper/", "the paper's"),
];

/// Decimal numbers of a line of code that are no whole ones, quarters or halves: what something is multiplied, limited or compared
/// with, taken at (a quantile), or called (a constant). Whole ones are a formula's more often than not.
fn fractions(line: &str) -> Vec<f64> {
    let code = without_literals(line);
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '.' | '_');
    // The minus of an exponent belongs to its number.
    let joined = code.replace("e-", "e~");
    let words = joined.split(|letter| !is_part(letter) && letter != '~');
    let number = |word: &str| {
        let bare = word.trim_end_matches("f64").trim_end_matches('.').replace('~', "-").replace('_', "");
        bare.starts_with(|letter: char| letter.is_ascii_digit()).then(|| bare.parse::<f64>().ok()).flatten()
    };
    let decides = |it: &f64| it.abs() > ROUNDING && (4.0 * it).fract() != 0.0;
    words.filter_map(number).filter(decides).collect()
}

/// A line without what stands in quotation marks or behind `//`.
fn without_literals(line: &str) -> String {
    let code = line.split("//").next().unwrap_or_default();
    code.split('"').step_by(2).collect::<Vec<_>>().join("\"\"")
}

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
fn nothing_is_decided_by_a_number_of_its_own() {
    let mut found = Vec::new();
    let mut unused: BTreeSet<&str> = OTHER_NUMBERS.iter().map(|(start, _)| *start).collect();
    for source in read_sources() {
        let is_test =
            source.module.iter().any(|word| ["tests", "interval_coverage"].contains(&word.as_str()));
        if !DECIDING.contains(&source.module[0].as_str()) || is_test || source.name.ends_with("thresholds.rs")
        {
            continue;
        }
        let other = OTHER_NUMBERS.iter().find(|(start, _)| source.name.starts_with(start));
        let is_shown = source.module[0] == "report";
        for line in program(&source.text).lines() {
            let fractions = if is_shown { Vec::new() } else { fractions(line) };
            if let Some((start, _)) = other.filter(|_| !fractions.is_empty()) {
                unused.remove(start);
            }
            let numbers = if other.is_some() { Vec::new() } else { fractions };
            let numbers = numbers.into_iter().chain(compared_with(line));
            found.extend(numbers.map(|number| format!("{}: {number}: {}", source.name, line.trim())));
        }
    }
    assert!(found.is_empty(), "a threshold of the room says it instead: {found:#?}");
    assert!(unused.is_empty(), "files without such numbers: {unused:?}");
    assert_eq!(compared_with("if error > 1.05 * other && 3.0 <= x {"), [1.05, 3.0]);
    assert!(compared_with("if a < 0.0 || b > 1e-6 * c || n < 3 || x > 0.5 * y {").is_empty());
    assert_eq!(fractions("let a = 0.2 * b.max(0.3 / c).clamp(-0.1, 2.0); // 0.7"), [0.2, 0.3, 0.1]);
    assert_eq!(fractions("const SHARE: f64 = 2.5e-1 + 0.05;"), [0.05]);
    assert!(fractions("let a = 12.0 * b / 1e-9 + x.0.1 + \"0.3\".len() + 0.75;").is_empty());
}
