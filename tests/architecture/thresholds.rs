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
const DECIDING: [&str; 16] = [
    "estimation",
    "screening",
    "identify",
    "compare",
    "diagnose",
    "discover",
    "control",
    "guard",
    "experiment",
    "runtime",
    "studies",
    "session",
    "fleet",
    "report",
    "workbench",
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
    ("workbench/demo.rs", "what happens in the demo"),
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

/// Whole numbers, halves and the like that stand where numbers decide, and decide nothing: file, the numbers, what they are. Files
/// of [`OTHER_NUMBERS`] are left out, and what is shown (`report`).
const WHOLE_NUMBERS: &[(&str, &[&str], &str)] = &[
    ("cli/brief.rs", &["130", "390", "60"], "lengths of a text"),
    ("cli/design.rs", &["1e6"], "the largest number that an option takes"),
    ("cli/monitor.rs", &["10"], "looks before there is anything to show"),
    (
        "cli/progress.rs",
        &["40", "50", "80"],
        "a bar: its length, how often it is drawn, how wide a terminal is",
    ),
    ("control/controller.rs", &["3"], "a code of recordings"),
    ("diagnose/block_builder.rs", &["3"], "coefficients of a cubic"),
    ("diagnose/grid_search.rs", &["12"], "variance of a uniform distribution"),
    ("estimation/slope.rs", &["16"], "samples of a piece of work"),
    ("estimation/step_course.rs", &["3"], "equations of a parabola, and passes of its fit"),
    ("estimation/step_other.rs", &["4"], "rounds of a search"),
    ("estimation/step_search.rs", &["9", "3"], "rounds of a search"),
    (
        "estimation/step_trial.rs",
        &["0.5", "8", "4", "48", "5.0"],
        "an input in the middle, and places of a search and a quadrature over an interval",
    ),
    ("screening/checks/steps_between_rows.rs", &["12.0"], "variance of a uniform distribution"),
    ("diagnose/problem.rs", &["64"], "windows that one thread takes at a time"),
    ("discover/assemble.rs", &["101"], "points of a curve that is drawn"),
    ("discover/mod.rs", &["1000"], "names with a number"),
    ("estimation/dependence.rs", &["4"], "sums side by side in the processor"),
    ("estimation/kalman_smoother.rs", &["1_024"], "states that are kept"),
    ("estimation/lag_products.rs", &["128", "4", "8"], "rows and lanes of the processor"),
    ("estimation/lagged_products.rs", &["1_024", "4", "4_096"], "lengths of a transform"),
    (
        "estimation/noise_floor.rs",
        &["1.5", "100"],
        "the root of 2.3, which the line before derives; how finely it is tried",
    ),
    ("estimation/normal_equations.rs", &["8"], "pieces of work"),
    ("estimation/ranks.rs", &["11", "14"], "size of a table"),
    (
        "estimation/third_differences.rs",
        &["20.0", "3"],
        "1 + 9 + 9 + 1: the variance of a third difference, which spans three steps",
    ),
    ("estimation/two_poles.rs", &["8"], "size of an array"),
    ("fleet/answer.rs", &["16"], "letters of a digest"),
    ("fleet/plan.rs", &["100"], "letters of a name"),
    ("guard/events.rs", &["64"], "size of a buffer"),
    ("guard/speed_model.rs", &["16"], "size of an array"),
    ("guard/speed_track.rs", &["256", "8"], "sizes of buffers"),
    ("guard/table.rs", &["33"], "how many causes there are"),
    ("experiment/prbs.rs", &["24"], "bits of a register"),
    ("identify/command_response.rs", &["1e3", "1e6"], "milli and micro"),
    ("identify/pipeline.rs", &["7"], "how many steps there are"),
    ("identify/supply_gain.rs", &["12"], "variance of a uniform distribution"),
    ("identify/voltage_instruments.rs", &["5"], "columns"),
    ("runtime/bridge.rs", &["256"], "size of a buffer"),
    ("runtime/control.rs", &["64"], "size of a buffer"),
    ("runtime/emulate.rs", &["64"], "size of a buffer"),
    ("runtime/experiment.rs", &["5000"], "how often progress is said"),
    ("runtime/lockstep/run.rs", &["60.0"], "default of an option"),
    ("runtime/lockstep/two_process.rs", &["20_000_000"], "how often it is looked whether to end"),
    ("runtime/monitor.rs", &["100", "300", "8"], "how often, how much and how many are shown"),
    ("runtime/operator.rs", &["5"], "how often it is looked for an answer"),
    ("runtime/record.rs", &["50"], "how often it is looked whether to end"),
    ("runtime/run.rs", &["256"], "size of a buffer"),
    ("screening/checks/battery_in_other_unit.rs", &["1e1", "1e2", "1e3"], "deci, centi and milli"),
    ("screening/checks/command_follows_rate.rs", &["3"], "readings of a second difference"),
    ("screening/checks/outliers.rs", &["16"], "rows of a piece of work"),
    ("screening/missing_commands.rs", &["0.5"], "rounding to the nearest"),
    ("screening/rotor_data.rs", &["3"], "1 + 2: the numbers of both rotors"),
    ("session/dronecan_parameters.rs", &["13"], "bits of a number"),
    ("session/dronecan_wire.rs", &["50_000_000"], "how often it is looked what to send"),
    ("session/machine/host.rs", &["1000"], "the first user who is no part of the system"),
    ("workbench/door.rs", &["16", "32", "80"], "bytes of a token and of a path, and the port of the web"),
    ("workbench/guesses.rs", &["4"], "rotors that are offered"),
    ("workbench/live.rs", &["500"], "how often a bench that is gone is looked for"),
    ("workbench/places.rs", &["100"], "letters of a name"),
    ("workbench/server.rs", &["50"], "how often it is looked whether to end"),
];

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
        let clamped = within.rfind(".clamp(").is_some_and(|at| !within[at..].contains(')'));
        (is_constant && value_from.is_some_and(|from| it.place.start > from))
            || follows(&compared)
            || leads(&compared[..4])
            || (is_whole && (before.ends_with("..") || before.ends_with("..=")))
            || (is_scale && (follows(&["*", "/", "*=", "/="]) || leads(&["*", "/"])))
            || BOUNDING.iter().any(|method| within.ends_with(method))
            || clamped
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
        let is_test =
            source.module.iter().any(|word| ["tests", "interval_coverage"].contains(&word.as_str()));
        let is_other =
            name.ends_with("thresholds.rs") || OTHER_NUMBERS.iter().any(|(start, _)| name.starts_with(start));
        let decides = DECIDING.contains(&source.module[0].as_str()) && source.module[0] != "report";
        if is_test || is_other || !decides {
            continue;
        }
        let known: &[&str] =
            WHOLE_NUMBERS.iter().find(|(file, ..)| *file == name).map_or(&[], |(_, known, _)| known);
        // What an option takes stands in an attribute, and whoever gives something else is told.
        let is_attribute = |line: &&str| line.trim_start().starts_with("#[");
        for line in program(&source.text).lines().filter(|line| !is_attribute(line)) {
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
    let formulas = [
        "let middle = 0.5 * (low + high) + 4.0 * x.powi(3);",
        "if n < 2 || x >= 0.0 || share > 1e-9 {",
        "let percent = 100.0 * share; let seconds = ns / 1_000_000_000; let x = pair.1 / a[3];",
        "let shape: [f64; 4] = [0.0; 4]; const FOUR: fn(u8) -> u8 = f;",
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
