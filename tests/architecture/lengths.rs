//! Functions and files are short enough to be read at once.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::imports::program;
use super::sources::sources;

/// Lines of a function, at most, its first and last one with them.
const LONGEST_FUNCTION: usize = 50;

/// Lines of a file, at most, without its tests.
const LONGEST_FILE: usize = 420;

/// Files that are longer: each is one table, which is read by the line.
const LONG_FILES: &[&str] = &["screening/thresholds.rs"];

/// Functions that are longer: file, name, and why.
const LONG_FUNCTIONS: &[(&str, &str, &str)] = &[
    (
        "can/port.rs",
        "receive",
        "each arrival passes through it: its parts share nine variables, and a call costs what it saves",
    ),
    ("report/check.rs", "sentence", "one table of sentences"),
    ("report/doctor.rs", "found", "one table of sentences"),
    ("report/findings/diagnose.rs", "sentence", "one table of sentences"),
    ("report/findings/identify/battery.rs", "sentence", "one table of sentences"),
    ("report/findings/identify/commands.rs", "sentence", "one table of sentences"),
    ("report/findings/identify/fits.rs", "of_residuals", "one table of sentences"),
    ("report/findings/identify/template.rs", "sentence", "one table of sentences"),
    ("report/findings/screening.rs", "log", "one table of sentences"),
    ("report/findings/screening/cells.rs", "sentence", "one table of sentences"),
    ("report/findings/screening/rotor.rs", "sentence", "one table of sentences"),
    ("studies/paper/mod.rs", "beside", "the tables of the paper"),
];

/// Name and lines of each function of a file, as rustfmt lays it out: it ends with the brace that stands where it began.
fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let is_of_name = |letter: &char| letter.is_alphanumeric() || *letter == '_';
    let begun = |line: &str| {
        let (before, behind) = line.split_once("fn ")?;
        let qualifiers = ["pub", "pub(crate)", "pub(super)", "const", "unsafe", "async"];
        before.split_whitespace().all(|word| qualifiers.contains(&word)).then_some(())?;
        Some((
            line.len() - line.trim_start().len(),
            behind.chars().take_while(is_of_name).collect::<String>(),
        ))
    };
    let length = |at: usize, indent: usize| {
        let end = format!("{}}}", " ".repeat(indent));
        let is_whole = lines[at].ends_with(['}', ';']);
        if is_whole { Some(1) } else { Some(1 + lines[at..].iter().position(|line| *line == end)?) }
    };
    let each = lines.iter().enumerate().filter_map(|(at, line)| {
        let (indent, name) = begun(line)?;
        Some((name, length(at, indent)?))
    });
    each.collect()
}

#[test]
fn functions_and_files_are_short() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut unused: BTreeSet<(&str, &str)> =
        LONG_FUNCTIONS.iter().map(|(file, name, _)| (*file, *name)).collect();
    let mut found = Vec::new();
    for file in sources(&root) {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        if name.ends_with("tests.rs") || name.contains("/tests/") {
            continue;
        }
        let text = program(&fs::read_to_string(&file).expect("source is UTF-8"));
        let lines = text.lines().count();
        if LONG_FILES.contains(&name.as_str()) {
            assert!(lines > LONGEST_FILE, "{name} is no longer long");
        } else if lines > LONGEST_FILE {
            found.push(format!("{name}: {lines} lines"));
        }
        for (function, lines) in functions(&text).into_iter().filter(|(_, lines)| *lines > LONGEST_FUNCTION) {
            let is_listed = LONG_FUNCTIONS.iter().any(|(file, long, _)| *file == name && *long == function);
            unused.retain(|it| *it != (name.as_str(), function.as_str()));
            if !is_listed {
                found.push(format!("{name}: {function}: {lines} lines"));
            }
        }
    }
    assert!(found.is_empty(), "part it by meaning: {found:#?}");
    assert!(unused.is_empty(), "no longer long, or gone: {unused:?}");
}

#[test]
fn a_function_is_as_long_as_it_stands() {
    let text = "impl A {\n    /// Says fn a.\n    pub(crate) const fn a(\n        b: u8,\n    ) -> u8 {\n        if b > 0 {\n        }\n    }\n\n    fn c() {}\n}\nlet d = |fn e| {\n};\nfn f<T>() {\n}";
    let expected = [("a", 6), ("c", 1), ("f", 2)].map(|(name, lines)| (name.to_owned(), lines));
    assert_eq!(functions(text), expected);
}
