//! An effect is one file.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::imports::program;

/// Where `id` stands in `text` as a word of its own.
fn names(text: &str, id: &str) -> bool {
    let part_of_a_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    text.match_indices(id).any(|(at, _)| {
        !text[..at].ends_with(part_of_a_word) && !text[at + id.len()..].starts_with(part_of_a_word)
    })
}

/// The name that a type or variant of this id would have: `gyro_lag` in disguise is `GyroLag`.
fn in_camel_case(id: &str) -> String {
    let capital = |word: &str| word[..1].to_uppercase() + &word[1..];
    id.split('_').map(capital).collect()
}

/// Every file of text below `folder`: a page or a mapping may name an effect as well as a program.
fn texts(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder is readable") {
        let path = entry.expect("the entry is readable").path();
        if path.is_dir() {
            found.extend(texts(&path));
        } else if let Ok(text) = fs::read_to_string(&path) {
            found.push((path, text));
        }
    }
    found
}

/// The program without its tests and without what cards say they are confused with. Comments stay: one that speaks of an
/// effect by its id is as wrong as code when the effect goes.
fn without_tests(name: &str, text: &str) -> String {
    let text = program(text);
    match text.split_once("    confused_with: &[").filter(|_| name.starts_with("effect/")) {
        Some((before, behind)) => format!("{before}{}", behind.split_once(']').map_or("", |(_, rest)| rest)),
        None => text.to_owned(),
    }
}

/// The catalogue and the emulator's; the examples on the crate's front page and of what is hidden, which tests run and which have
/// to show what is typed.
const EXEMPT: [&str; 4] = ["effect/mod.rs", "emulate/hidden.rs", "emulate/hidden_config.rs", "lib.rs"];

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
    let files = texts(&root);
    for (file, text) in &files {
        let name = file.strip_prefix(&root).expect("below src").to_string_lossy().into_owned();
        if EXEMPT.contains(&name.as_str()) || name.ends_with("tests.rs") || name.contains("/tests/") {
            continue;
        }
        let text = without_tests(&name, text);
        let is_named = |id: &str| {
            names(&text, id) || (!name.starts_with("emulate/") && names(&text, &in_camel_case(id)))
        };
        let others = ids.iter().zip(&own).filter(|(_, own)| **own != name);
        found.extend(others.filter(|(id, _)| is_named(id)).map(|(id, _)| format!("{name} names {id}")));
    }
    assert!(ids.len() > 20, "the catalogue was read");
    for kind in ["js", "toml", "css", "html", "rs"] {
        assert!(
            files.iter().any(|(file, _)| file.extension().is_some_and(|it| it == kind)),
            "no {kind} was read"
        );
    }
    assert!(found.is_empty(), "a property of the card says it instead: {found:#?}");
}

#[test]
fn the_search_for_ids_sees_words_alone() {
    assert!(names("Kind::GyroLag =>", &in_camel_case("gyro_lag")) && !names("GyroLags", "GyroLag"));
    assert!(names("has(\"gyro_lag\")", "gyro_lag") && names("`gyro_lag.pole`", "gyro_lag"));
    assert!(!names("my_gyro_lag", "gyro_lag") && !names("gyro_lags", "gyro_lag"));
    let card = "{\n    id: \"a\",\n    confused_with: &[\"gyro_lag\"],\n    law: gyro_bias }\n#[cfg(test)]\nmod tests { gyro_scale }";
    let left = without_tests("effect/a.rs", card);
    assert!(!names(&left, "gyro_lag") && names(&left, "gyro_bias") && !names(&left, "gyro_scale"));
    assert!(names(&without_tests("model/a.rs", card), "gyro_lag"));
}
