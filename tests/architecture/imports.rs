//! What the files of `src/` import, read from their text.

use std::fs;
use std::path::Path;

use super::sources::sources;

/// A file without its tests, whether they stand in it, or in a file of their own that it names at its top or at its end.
pub fn program(text: &str) -> String {
    let text = text.replace("#[cfg(test)]\nmod tests;\n", "");
    text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default().to_owned()
}

#[test]
fn a_program_ends_where_its_tests_begin_and_not_where_they_are_named() {
    let named =
        "//! A file.\n#[cfg(test)]\nmod tests;\nfn left() {}\n#[cfg(test)]\nmod tests { fn gone() {} }";
    assert_eq!(program(named), "//! A file.\nfn left() {}\n");
}

/// Every path of `use` lines and of expressions that begins with `crate`, `super` or `self`, its groups written out.
pub fn paths(text: &str) -> Vec<Vec<String>> {
    renamed_paths(text).into_iter().map(|(path, _)| path).collect()
}

/// The same, each with the name that `as` gives it.
pub fn renamed_paths(text: &str) -> Vec<(Vec<String>, Option<String>)> {
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
pub fn read_path(
    letters: &mut std::iter::Peekable<std::str::Chars>,
    before: &[String],
    found: &mut Vec<(Vec<String>, Option<String>)>,
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
            found.push((path, renamed(letters.clone())));
            return;
        }
    }
}

/// The name behind ` as `, if that is what follows.
fn renamed(letters: std::iter::Peekable<std::str::Chars>) -> Option<String> {
    let rest: String = letters.take(60).collect();
    let name = rest.strip_prefix(" as ").or_else(|| rest.strip_prefix("as "))?;
    Some(name.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect())
}

/// A file of `src/` without comments and without its tests, beside the path of its module.
pub struct Source {
    /// Below `src/`.
    pub name: String,
    /// From the top of the crate on.
    pub module: Vec<String>,
    pub text: String,
}

pub fn read_sources() -> Vec<Source> {
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
pub fn from_the_top(source: &Source, path: &[String]) -> Vec<String> {
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
fn the_import_reader_sees_every_spelling() {
    let text = "use crate::can::Frame;\nuse crate::{guard, signal::{Sensors as S, Command}, rt::Cycle as C};
        fn f() { super::codec::walk(self::one()) }";
    let read: std::collections::BTreeSet<String> = paths(text).iter().map(|path| path.join("::")).collect();
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
