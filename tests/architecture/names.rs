//! A name of a public type stands for one thing.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::imports::read_sources;

/// Names that several files define, and why.
const SEVERAL: &[(&str, &str)] = &[("Arguments", "the options of a command; each file of cli/ has its own")];

/// Name of the type that a line defines for more than its own file.
fn defined(line: &str) -> Option<&str> {
    let rest = line.trim_start().strip_prefix("pub")?;
    let rest = if let Some(within) = rest.strip_prefix('(') { within.split_once(')')?.1 } else { rest };
    let rest = rest.strip_prefix(' ')?;
    let rest = rest.strip_prefix("unsafe ").unwrap_or(rest);
    let name =
        ["struct ", "enum ", "trait ", "type ", "union "].iter().find_map(|it| rest.strip_prefix(it))?;
    Some(name.split(|letter: char| !letter.is_alphanumeric() && letter != '_').next().unwrap_or_default())
}

/// Each public type, with the files that define one of its name.
fn public_types() -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for source in read_sources() {
        for name in source.text.lines().filter_map(defined) {
            found.entry(name.to_owned()).or_default().push(source.name.clone());
        }
    }
    assert!(found.len() > 500, "the types were found");
    found
}

#[test]
fn a_public_type_has_a_name_of_its_own() {
    let several: BTreeMap<String, Vec<String>> =
        public_types().into_iter().filter(|(_, files)| files.len() > 1).collect();
    let found: Vec<&str> = several.keys().map(String::as_str).collect();
    let listed: Vec<&str> = SEVERAL.iter().map(|(name, _)| *name).collect();
    assert_eq!(
        found, listed,
        "names with several meanings (left), and those of this test (right): {several:#?}"
    );
}

#[test]
fn the_glossary_names_types_where_they_are() {
    let glossary = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/glossary.md");
    let glossary = fs::read_to_string(glossary).expect("the glossary");
    let (_, table) = glossary.split_once("\n| name | file | what it is |\n").expect("the table of types");
    let types = public_types();
    let rows = table.lines().skip(1).map_while(|line| line.strip_prefix("| `")?.split_once("` | `src/"));
    let rows: Vec<(&str, &str)> =
        rows.map(|(name, rest)| (name, rest.split('`').next().unwrap_or(""))).collect();
    assert!(rows.len() > 10, "the table was read");
    for (name, file) in rows {
        let files = types.get(name).map_or(&[][..], Vec::as_slice);
        assert_eq!(files, [file], "{name} of the glossary");
    }
}

#[test]
fn the_search_for_types_sees_every_spelling() {
    let of = |text: &str| defined(text).map(str::to_owned);
    assert_eq!(of("pub struct Place;"), Some("Place".to_owned()));
    assert_eq!(of("    pub(in crate::cli) enum Line<'a> {"), Some("Line".to_owned()));
    assert_eq!(of("pub(super) unsafe trait Watch: Send {"), Some("Watch".to_owned()));
    assert_eq!(of("pub type Service<'a> = &'a dyn Fn();"), Some("Service".to_owned()));
    assert_eq!(of("pub(crate) fn place() {}").or(of("struct Own;")).or(of("public struct")), None);
}
