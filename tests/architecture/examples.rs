//! What the programs in `examples/` use has an example in its documentation, or names one.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::imports::{program, read_path};
use super::sources::sources;

/// What a program names of this crate: the items of its `use` lines, and the functions it calls by their room's name.
fn used(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices("use rotorbench::") {
        let mut paths = Vec::new();
        read_path(&mut text[at + "use ".len()..].chars().peekable(), &[], &mut paths);
        found.extend(paths.into_iter().filter_map(|(path, _)| path.last().cloned()));
    }
    let rooms: Vec<String> = found.iter().filter(|name| is_room(name)).cloned().collect();
    found.retain(|name| !is_room(name) && name != "self");
    // `use rotorbench::session::{self, ..}`: its functions go by `session::`.
    for room in rooms.iter().map(String::as_str).chain(["session"]) {
        for (at, start) in text.match_indices(&format!("{room}::")) {
            let word: String = text[at + start.len()..]
                .chars()
                .take_while(|it| it.is_alphanumeric() || *it == '_')
                .collect();
            let is_function = word.starts_with(|letter: char| letter.is_lowercase());
            if is_function && !text[..at].ends_with(':') {
                found.insert(word);
            }
        }
    }
    found
}

fn is_room(name: &str) -> bool {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(name).is_dir()
}

/// The documentation of each public item of this name.
fn documented(text: &str, name: &str) -> Vec<String> {
    const KINDS: [&str; 5] = ["struct", "enum", "trait", "fn", "type"];
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let is_it = |line: &str| {
        let items = KINDS.iter().filter_map(|kind| line.strip_prefix(&format!("pub {kind} {name}")));
        items
            .map(|rest| rest.chars().next())
            .any(|next| !next.is_some_and(|it| it.is_alphanumeric() || it == '_'))
    };
    let above = |index: usize| {
        let above =
            lines[..index].iter().rev().take_while(|line| line.starts_with("///") || line.starts_with("#["));
        above.copied().collect::<Vec<_>>().join("\n")
    };
    lines.iter().enumerate().filter(|(_, line)| is_it(line)).map(|(index, _)| above(index)).collect()
}

#[test]
fn what_the_examples_use_is_shown_in_use() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR"));
    let programs = sources(&top.join("examples"));
    let names: BTreeSet<String> =
        programs.iter().flat_map(|path| used(&fs::read_to_string(path).expect("a program"))).collect();
    assert!(
        names.len() > 25 && ["Model", "diagnose", "Sensors"].iter().all(|name| names.contains(*name)),
        "{names:?}"
    );
    let shown = |doc: &String| doc.contains("```") || doc.contains("examples/") || doc.contains("As [`");
    let texts = sources(&top.join("src")).into_iter().map(|path| fs::read_to_string(path).expect("a file"));
    let texts: Vec<String> = texts.map(|text| program(&text)).collect();
    let mut bare = Vec::new();
    for name in &names {
        let docs: Vec<String> = texts.iter().flat_map(|text| documented(text, name)).collect();
        assert!(!docs.is_empty(), "{name}: not found");
        if !docs.iter().any(shown) {
            bare.push(name.as_str());
        }
    }
    assert!(bare.is_empty(), "without an example: {}", bare.join(", "));
}
