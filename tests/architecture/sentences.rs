//! Sentences are made in `report/` and in errors, and no code takes one apart.

use std::fs;
use std::path::Path;

use super::imports::program;
use super::sources::sources;

/// Methods by which code would take a sentence apart.
const PARSERS: [&str; 16] = [
    ".contains(\"",
    ".starts_with(\"",
    ".ends_with(\"",
    ".strip_prefix(\"",
    ".strip_suffix(\"",
    ".split_once(\"",
    ".find(\"",
    ".matches(\"",
    ".eq(\"",
    ".rsplit_once(\"",
    ".rfind(\"",
    ".replace(\"",
    ".replacen(\"",
    ".trim_matches(\"",
    ".trim_start_matches(\"",
    ".trim_end_matches(\"",
];

/// What the kernel writes is no sentence of ours, nor is a line of TOML.
const OTHERS_TEXT: &[&str] = &[" /dev/shm tmpfs ", r"signal = []\n"];

/// What model files of version 0.1 hold is read as those wrote it; nobody writes it any more.
const EARLIER_TEXT: (&str, &[&str]) = ("model/measure.rs", &["rms of ", ", free run ", "over windows of "]);

/// Literals of two words or more that a text is searched for, or that are put in the place of what is found.
fn searched_for(text: &str) -> Vec<&str> {
    let literals = |(at, method): (usize, &str)| {
        let behind = &text[at + method.len()..];
        let mut parts = behind.split('"');
        let (searched, between, other) = (parts.next(), parts.next(), parts.next());
        let is_second = between.is_some_and(|between| between.trim() == ",");
        [searched, other.filter(|_| is_second)].into_iter().flatten()
    };
    let each = PARSERS.iter().flat_map(|method| text.match_indices(method));
    each.flat_map(literals).filter(|literal| literal.split_whitespace().count() > 1).collect()
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
        let program = program(&text);
        let code: Vec<&str> = program.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        let code = code.join("\n");
        let is_earlier = |literal: &str| name == EARLIER_TEXT.0 && EARLIER_TEXT.1.contains(&literal);
        let searched = searched_for(&code).into_iter();
        let searched = searched.filter(|literal| !OTHERS_TEXT.contains(literal) && !is_earlier(literal));
        found.extend(searched.map(|literal| format!("{name} looks for \"{literal}\"")));
    }
    assert!(found.is_empty(), "match a code instead: {found:#?}");
    assert_eq!(searched_for(r#"said.contains("held still") || name.starts_with("rotor ")"#), ["held still"]);
    assert_eq!(searched_for(r#"said.trim_end_matches(", in the model")"#), [", in the model"]);
    assert_eq!(searched_for(r#"said.replace("`--mapping`", "a key of the plan")"#), ["a key of the plan"]);
    assert!(searched_for(r#"name.replace("esc", "motor"), "two words""#).is_empty());
}

/// Sentences of errors that say their source: who shows an error with its causes would have to look into the sentence for what
/// was said.
fn said_twice(text: &str) -> Vec<String> {
    let program = program(text);
    let of = |variant: &str| {
        let (sentence, rest) = variant.split_once(")]\n")?;
        let fields = rest.split("\n}\n").next()?;
        let source = if fields.contains("#[from]") || fields.contains("(#[source]") {
            "0"
        } else if let Some((_, behind)) = fields.split_once("#[source]\n") {
            behind.trim_start().split(':').next()?
        } else {
            fields.contains(" source: ").then_some("source")?
        };
        sentence.contains(&format!("{{{source}")).then(|| sentence.to_owned())
    };
    program.split("#[error(").skip(1).filter_map(of).collect()
}

#[test]
fn no_error_says_its_source() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let read = |file: &std::path::PathBuf| fs::read_to_string(file).expect("source is UTF-8");
    let found: Vec<String> = sources(&root).iter().flat_map(|file| said_twice(&read(file))).collect();
    assert!(found.is_empty(), "a field of another name, without #[source], is no source: {found:#?}");
    let variant = |sentence: &str, fields: &str| {
        said_twice(&format!("enum E {{\n    #[error(\"{sentence}\")]\n    A{fields},\n}}\n")).len()
    };
    assert_eq!(variant("file: {source}", " {\n        source: io::Error,\n    }"), 1);
    assert_eq!(variant("file: {error}", " {\n        #[source]\n        error: io::Error,\n    }"), 1);
    assert_eq!(variant("start: {0}", "(#[from] io::Error)"), 1);
    assert_eq!(variant("file: {error}", " {\n        error: io::Error,\n    }"), 0);
    assert_eq!(variant("file", " {\n        source: io::Error,\n    }"), 0);
}

/// Rooms whose results carry codes and numbers. What `model` writes is data: names and units of a model file.
const ROOMS_OF_RESULTS: [&str; 10] = [
    "estimation",
    "screening",
    "identify",
    "compare",
    "diagnose",
    "discover",
    "emulate",
    "studies",
    "session",
    "guard",
];

/// What a statement names that builds an error or writes to the log.
const SPEAKS_OF_ERRORS: [&str; 11] = [
    "Err(",
    "Error",
    "error",
    "ok_or",
    "reason",
    "refus",
    "fault(",
    "expect(",
    "tracing::",
    ".say(",
    "must be",
];

/// Files whose words are data, and why.
const WORDS_OF_DATA: &[(&str, &str)] = &[
    ("guard/table.rs", "the names of causes, which recordings and answers hold"),
    ("guard/config.rs", "what a setting must be, for the error that refuses it"),
    ("rt/thread.rs", "what the kernel granted, for a line of the log"),
    ("session/machine/bus.rs", "the name of a check"),
    ("studies/paper/mod.rs", "the names of its logs"),
    ("studies/paper/bench.rs", "the names of its runs"),
];

/// Files of the command line that put a sentence together, and why.
const SENTENCES_OF_CLI: &[(&str, &str)] = &[("cli/commands.rs", "the last line of `--help`, which is help")];

/// Macros that print or write.
const PRINTERS: [&str; 4] = ["print!(", "println!(", "write!(", "writeln!("];

/// Literals of a file of Rust with what stands before each in its statement; without attributes, comments and tests.
pub fn literals(text: &str) -> Vec<(String, String)> {
    let program = program(text);
    let is_code = |line: &&str| !line.trim_start().starts_with("//");
    let code = program.lines().filter(is_code).collect::<Vec<_>>().join("\n");
    let (mut found, mut statement) = (Vec::new(), String::new());
    let mut letters = code.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            // A character, not a lifetime.
            '\'' => {
                let rest: String = letters.clone().take(12).collect();
                let length =
                    if rest.starts_with('\\') { rest[2..].find('\'').map(|at| at + 3) } else { None };
                let length = length.or_else(|| (rest.chars().nth(1) == Some('\'')).then_some(2));
                for _ in 0..length.unwrap_or(0) {
                    letters.next();
                }
            }
            '"' => {
                let mut literal = String::new();
                while let Some(letter) = letters.next().filter(|letter| *letter != '"') {
                    if letter == '\\' {
                        literal.extend(letters.next().filter(|escaped| escaped.is_alphabetic()).map(|_| ' '));
                    } else {
                        literal.push(letter);
                    }
                }
                found.push((statement.clone(), literal));
                statement.push_str("\"\"");
            }
            ';' | '}' => statement.clear(),
            _ => statement.push(letter),
        }
    }
    found.retain(|(before, _)| before.rfind("#[").is_none_or(|at| before[at..].contains(']')));
    found
}

/// Whether a literal has four words or more beside what stands in braces.
pub fn is_sentence(literal: &str) -> bool {
    let mut depth = 0;
    let outside = literal.chars().filter(|letter| {
        depth += i32::from(*letter == '{') - i32::from(*letter == '}');
        depth == 0 && *letter != '}'
    });
    let text: String = outside.collect();
    let is_word = |word: &&str| {
        let word = word.trim_matches(|letter: char| letter.is_ascii_punctuation());
        !word.is_empty() && word.chars().all(|letter| letter.is_ascii_alphabetic() || "'-".contains(letter))
    };
    text.split_whitespace().filter(is_word).count() >= 4
}

/// The sentences of a file that are no errors: all that are printed, in rooms of results all others, too, and in the command line
/// those that are put together. (What stands whole in its literals is help.)
fn said_in(name: &str, text: &str) -> Vec<String> {
    let room = name.split('/').next().unwrap_or_default();
    let has_results = ROOMS_OF_RESULTS.contains(&room);
    let is_help = SENTENCES_OF_CLI.iter().any(|(file, _)| *file == name);
    let is_said = |(before, literal): &(String, String)| {
        let is_error = SPEAKS_OF_ERRORS.iter().any(|word| before.contains(word) || literal.starts_with(word));
        let is_printed = PRINTERS.iter().any(|printer| before.contains(printer));
        let is_made = room == "cli" && !is_help && before.trim_end().ends_with("format!(");
        is_sentence(literal) && !is_error && (is_printed || has_results || is_made)
    };
    literals(text).into_iter().filter(is_said).map(|(_, literal)| format!("{name}: {literal}")).collect()
}

/// A result is numbers and codes; what is said of it is said in one place. Errors say themselves what is wrong.
#[test]
fn sentences_are_made_in_report() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        // The page of thresholds is a document; the coverage of intervals is a test.
        let is_page_or_test = ["report", "threshold"].iter().any(|start| name.starts_with(start))
            || ["thresholds.rs", "tests.rs"].iter().any(|end| name.ends_with(end))
            || ["/tests/", "interval_coverage"].iter().any(|part| name.contains(part));
        if is_page_or_test || WORDS_OF_DATA.iter().any(|(file, _)| *file == name) {
            continue;
        }
        found.extend(said_in(&name, &fs::read_to_string(&file).expect("source is UTF-8")));
    }
    assert!(found.is_empty(), "report/ says it instead: {found:#?}");
}

#[test]
fn the_search_for_sentences_sees_what_is_said_and_no_errors() {
    let said = |text: &str| said_in("compare/a.rs", text).len();
    assert_eq!(said("fn f() { println!(\"nothing of this is left\"); }"), 1);
    assert_eq!(said("let why = \"the rotor was late again\";"), 1);
    assert_eq!(said("let why = \"{} of {about the} rotor\"; let c = '\"'; let unit = \"rad/s\";"), 0);
    assert_eq!(
        said(
            "#[error(\"no log to identify from\")]\nstruct A;
// \"four words and more\""
        ),
        0
    );
    assert_eq!(said("return Err(f(\"the rotor was late again\"));"), 0);
    assert_eq!(said("#[cfg(test)]\nmod tests { const A: &str = \"the rotor was late again\"; }"), 0);
    let in_cli = |text: &str| said_in("cli/a.rs", text).len();
    assert_eq!(in_cli("let help = \"write it with a comma\";"), 0);
    assert_eq!(in_cli("let tip = format!(\"a file needs its option: {option}\");"), 1);
    assert_eq!(
        in_cli("let command = format!(\n    \"rotorbench diagnose --model {model} --log {log}\");"),
        1
    );
    assert_eq!(in_cli("return Err(format!(\"a file needs its option: {option}\"));"), 0);
}
