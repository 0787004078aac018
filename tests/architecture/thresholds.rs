//! What a room decides by is on the page of thresholds.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::exempt_numbers::{FORMATS, NOT_LOOKED_AT, OTHER_NUMBERS, WHOLE_NUMBERS};
use super::imports::{Source, program, read_sources};
use super::sources::sources;

/// Room and name of a threshold, and the files that use it, each from the top of `src/`.
type Uses = BTreeMap<(String, String), BTreeSet<String>>;

/// Whether a source is compiled for tests alone.
fn is_test(source: &Source) -> bool {
    source.module.iter().any(|word| ["tests", "interval_coverage"].contains(&word.as_str()))
}

/// Every `THRESHOLDS.name` in `source`, tests apart, with the room whose table it is: named before it, or where it is imported.
fn find_uses(source: &Source, uses: &mut Uses) {
    if is_test(source) {
        return;
    }
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
    let test = Source {
        name: "control/tests/least.rs".to_owned(),
        module: vec!["control".to_owned(), "tests".to_owned(), "least".to_owned()],
        text: "fn f() { a > THRESHOLDS.least }".to_owned(),
    };
    let mut uses = Uses::new();
    [source, other, test].iter().for_each(|source| find_uses(source, &mut uses));
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

/// The units of thresholds: `-` for a share or a ratio, `count` for a number of things.
const UNITS_OF_THRESHOLDS: [&str; 36] = [
    "-",
    "count",
    "%",
    "s",
    "ms",
    "µs",
    "ns",
    "1/s",
    "m",
    "m/s",
    "rad",
    "rad/s",
    "rad/(s V)",
    "V",
    "A",
    "N",
    "N m/sqrt(s)",
    "degC",
    "SI",
    "byte",
    "pixel",
    "rows",
    "steps",
    "spacings",
    "periods",
    "turns",
    "1/turn",
    "intervals",
    "half intervals",
    "intervals²",
    "time constants",
    "correlation times",
    "standard deviations",
    "standard errors",
    "variances of a residual",
    "s, count",
];

/// The unit of a threshold stands in its column, and there alone: said twice it would be two units one day.
#[test]
fn a_threshold_has_its_unit_in_its_column_alone() {
    for (room, table) in rotorbench::thresholds_page::ROOMS {
        for it in *table {
            let (name, doc) = (it.name, it.decides.trim_start());
            assert!(
                !doc.starts_with('[') && !doc.starts_with("count:"),
                "the doc of {room}'s `{name}` begins with what it is, not with its unit"
            );
            let unit = it.unit;
            assert!(
                UNITS_OF_THRESHOLDS.contains(&unit),
                "{room}'s `{name}`: no other threshold is in `{unit}`; take a unit of UNITS_OF_THRESHOLDS, or add it there"
            );
        }
    }
}

fn is_looked_at(source: &Source) -> bool {
    let is_format = FORMATS.iter().any(|(start, _)| source.name.starts_with(start));
    !is_format && !NOT_LOOKED_AT.iter().any(|(room, _)| *room == source.module[0])
}

/// Whether a line is one of an effect's card, which tells users its numbers (`rotorbench effects`).
fn is_of_card(source: &Source, line: &str) -> bool {
    let fields = ["lower:", "upper:", "start:", "others:", "parameters:"];
    source.module[0] == "effect" && fields.iter().any(|it| line.trim_start().starts_with(it))
}

/// A number up to this is rounding, not a decision.
const ROUNDING: f64 = 1e-3;

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

/// A number in a line of code: as it is written, what it is, and where it begins and ends.
struct Literal<'a> {
    text: &'a str,
    value: f64,
    place: std::ops::Range<usize>,
}

/// The numbers of a line of code, those apart that are part of a name, of a field's or of a version.
fn numbers(code: &str) -> Vec<Literal<'_>> {
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(start) = code[at..].find(|letter: char| letter.is_ascii_digit()).map(|it| at + it) {
        let before = &code[..start];
        let is_own = !before.ends_with(is_part) && (!before.ends_with('.') || before.ends_with(".."));
        let rest = &code[start..];
        let mut end = start + rest.find(|letter: char| !is_part(letter)).unwrap_or(rest.len());
        let behind = &code[end..];
        // A point is the number's where neither a range nor a method follows.
        if behind.starts_with('.')
            && !behind[1..].starts_with(|it: char| it == '.' || it.is_ascii_alphabetic())
        {
            let digits = behind[1..].find(|letter: char| !is_part(letter)).unwrap_or(behind.len() - 1);
            end += 1 + digits;
        }
        if code[..end].ends_with('e') && code[end..].starts_with('-') {
            end += 1 + code[end + 1..].find(|letter: char| !is_part(letter)).unwrap_or(code.len() - end - 1);
        }
        let kinds = ["f64", "usize", "u64", "u32", "u16", "u8", "i64", "i32"];
        let whole = &code[start..end];
        let text = kinds.iter().find_map(|it| whole.strip_suffix(it)).unwrap_or(whole).trim_end_matches('_');
        if let Some(value) = text.replace('_', "").parse().ok().filter(|_| is_own) {
            found.push(Literal { text, value, place: start..start + text.len() });
        }
        at = end;
    }
    found
}

/// Numbers by which a unit is another one: percent, milli, minutes, degrees.
const UNITS: [f64; 9] = [10.0, 60.0, 100.0, 180.0, 360.0, 1e3, 3.6e3, 1e6, 1e9];

/// Methods that hold a value within a bound, or take so many.
const BOUNDING: [&str; 6] = [".min(", ".max(", ".take(", ".skip(", ".step_by(", ".chunks("];

/// Whether a number stands in an array that holds nothing but numbers.
fn is_listed(line: &str, place: &std::ops::Range<usize>) -> bool {
    let (before, behind) = (&line[..place.start], &line[place.end..]);
    let Some(open) = before.rfind('[').filter(|open| !before[*open..].contains(']')) else { return false };
    let Some(close) = behind.find(']').filter(|close| !behind[..*close].contains('[')) else { return false };
    let items = || line[open + 1..place.end + close].split(',').map(str::trim).filter(|it| !it.is_empty());
    let is_number = |item: &str| {
        numbers(item).first().is_some_and(|it| item.trim_start_matches('-').len() == it.place.len())
    };
    let is_index = before[..open]
        .ends_with(|letter: char| letter.is_ascii_alphanumeric() || matches!(letter, '_' | ')' | ']'));
    !is_index && items().count() > 1 && items().all(is_number)
}

/// Numbers of a line of code, whole ones and halves, too, that something is compared with, held within, repeated or divided by
/// as a whole, or that a constant has. 0, 1 and 2 are a formula's.
fn deciding(line: &str) -> Vec<&str> {
    let is_in_formula = |value: f64| [0.0, 1.0, 2.0].contains(&value) || value.abs() <= ROUNDING;
    let declared = line.trim_start();
    let declared =
        declared.strip_prefix("pub ").or_else(|| declared.strip_prefix("pub(crate) ")).unwrap_or(declared);
    let declared = declared.strip_prefix("pub(super) ").unwrap_or(declared);
    let is_constant = declared.starts_with("const ") && !declared.starts_with("const fn");
    let value_from = line.find(" = ").filter(|_| is_constant);
    let decides = |it: &Literal| {
        let before = line[..it.place.start].trim_end_matches(['-', '(']);
        let behind = &line[it.place.end..];
        let follows = |signs: &[&str]| signs.iter().any(|sign| before.ends_with(&format!(" {sign} ")));
        let leads = |signs: &[&str]| signs.iter().any(|sign| behind.starts_with(&format!(" {sign} ")));
        let compared = ["<", "<=", ">", ">=", "==", "!="];
        let is_whole = !it.text.contains(['.', 'e']);
        let is_scale = is_whole && it.value > 2.0 && !UNITS.contains(&it.value);
        let within = line[..it.place.start].trim_end_matches('-');
        let listed = !is_whole && is_listed(line, &it.place);
        let clamped = within.rfind(".clamp(").is_some_and(|at| !within[at..].contains(')'));
        (is_constant && value_from.is_some_and(|from| it.place.start > from))
            || follows(&compared)
            || leads(&compared[..4])
            || (is_whole && (before.ends_with("..") || before.ends_with("..=")))
            || (is_scale && (follows(&["*", "/", "*=", "/="]) || leads(&["*", "/"])))
            || BOUNDING.iter().any(|method| within.ends_with(method))
            || clamped
            || listed
    };
    numbers(line).iter().filter(|it| !is_in_formula(it.value) && decides(it)).map(|it| it.text).collect()
}

/// No whole number and no half decides in private, as far as a line of code says that it does.
#[test]
fn nothing_is_decided_by_a_whole_number_of_its_own() {
    let mut found = Vec::new();
    let mut unused: BTreeSet<(&str, &str)> = BTreeSet::new();
    for (file, numbers, _) in WHOLE_NUMBERS {
        unused.extend(numbers.iter().map(|number| (*file, *number)));
    }
    for source in read_sources() {
        let name = source.name.as_str();
        let is_other =
            name.ends_with("thresholds.rs") || OTHER_NUMBERS.iter().any(|(start, _)| name.starts_with(start));
        let decides = is_looked_at(&source) && source.module[0] != "report";
        if is_test(&source) || is_other || !decides {
            continue;
        }
        let known: &[&str] =
            WHOLE_NUMBERS.iter().find(|(file, ..)| *file == name).map_or(&[], |(_, known, _)| known);
        // What an option takes stands in an attribute, and whoever gives something else is told.
        let is_attribute = |line: &&str| line.trim_start().starts_with("#[");
        for line in
            program(&source.text).lines().filter(|line| !is_attribute(line) && !is_of_card(&source, line))
        {
            let code = without_literals(line);
            for number in deciding(&code) {
                if known.contains(&number) {
                    unused.retain(|it| *it != (name, number));
                } else {
                    found.push(format!("{name}: {number}: {}", line.trim()));
                }
            }
        }
    }
    assert!(found.is_empty(), "a threshold of the room says it instead: {found:#?}");
    assert!(unused.is_empty(), "numbers that are no longer there: {unused:?}");
}

#[test]
fn whole_numbers_are_seen_where_they_decide() {
    assert_eq!(deciding("const ROUNDS: usize = 3;"), ["3"]);
    assert_eq!(deciding("    pub(super) const SHARES: [f64; 2] = [0.5, 1.0];"), ["0.5"]);
    assert_eq!(deciding("if rows.len() < 4 * count || share > 0.5 * all {"), ["4", "0.5"]);
    assert_eq!(
        deciding("for _ in 0..20 { step = step.clamp(-0.5, 3.0).min(7.0); }"),
        ["20", "0.5", "3.0", "7.0"]
    );
    assert_eq!(deciding("mean = (mean * 7 + new) / 8;"), ["7", "8"]);
    let arrays = "(given, place, [0.001, 100.0]), (given, place, &[-1.5, 0.0, 0.5])";
    assert_eq!(deciding(arrays), ["100.0", "1.5", "0.5"]);
    let formulas = [
        "let middle = 0.5 * (low + high) + 4.0 * x.powi(3);",
        "if n < 2 || x >= 0.0 || share > 1e-9 {",
        "let percent = 100.0 * share; let seconds = ns / 1_000_000_000; let x = pair.1 / a[3];",
        "let shape: [f64; 4] = [0.0; 4]; const FOUR: fn(u8) -> u8 = f;",
        "let three = [x, 0.25 * y, 3.0]; let taps = [3, 5]; let one = [7.5]; let it = a[[0, 3][k]];",
    ];
    for formula in formulas {
        assert!(deciding(formula).is_empty(), "{formula}: {:?}", deciding(formula));
    }
}

/// A number that decides has a unit, a reason and what it was calibrated on.
#[test]
fn nothing_is_decided_by_a_number_of_its_own() {
    let mut found = Vec::new();
    let mut unused: BTreeSet<&str> = OTHER_NUMBERS.iter().map(|(start, _)| *start).collect();
    for source in read_sources() {
        if !is_looked_at(&source) || is_test(&source) || source.name.ends_with("thresholds.rs") {
            continue;
        }
        let other = OTHER_NUMBERS.iter().find(|(start, _)| source.name.starts_with(start));
        let is_shown = source.module[0] == "report";
        for line in program(&source.text).lines().filter(|line| !is_of_card(&source, line)) {
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

/// What is left out is there to be left out: a room or a file that is gone, or that would pass, is no exemption.
#[test]
fn what_is_not_looked_at_is_there() {
    let sources = read_sources();
    let has_numbers = |source: &Source| {
        program(&source.text).lines().any(|line| !deciding(&without_literals(line)).is_empty())
    };
    for (room, _) in NOT_LOOKED_AT {
        assert!(sources.iter().any(|it| it.module[0] == *room && has_numbers(it)), "the room {room}");
    }
    for (start, _) in FORMATS {
        assert!(sources.iter().any(|it| it.name.starts_with(start) && has_numbers(it)), "{start}");
    }
}
