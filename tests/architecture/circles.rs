//! Inside a room no files import each other in a circle.
//!
//! Seen are paths in `use` lines and in expressions, through names given by `use` and `as`, through a parent's re-exports and the
//! parent's own code, functions of a type that stand in another file than the type, and methods that do, where their name is
//! the only one of its kind in the room. A parent may name its children and hand on their names; what it uses itself, of those names
//! too, counts as any other file's. Not seen are methods whose names several types have, methods of a trait, and what a macro writes.

use std::collections::{BTreeMap, BTreeSet};

use super::imports::{Source, from_the_top, paths, program, read_path, read_sources, renamed_paths};

/// Files by their module.
type Files<'a> = BTreeMap<&'a [String], &'a Source>;

/// What a file says itself: without its tests, and without the lines by which a parent names its children and hands on their
/// names, as far as it does not use these itself.
fn own_code(source: &Source, files: &Files) -> String {
    let code = program(&source.text);
    if !is_parent(source, files) {
        return code;
    }
    let handed_on = |statement: &str| {
        let words = statement.trim_start().trim_start_matches("#[doc(hidden)]").trim_start();
        let bare = words.strip_prefix("pub(crate) ").or_else(|| words.strip_prefix("pub ")).unwrap_or(words);
        bare.starts_with("mod ") || (bare.starts_with("use ") && bare.len() < words.len())
    };
    let (naming, own): (Vec<&str>, Vec<&str>) =
        code.split_inclusive(';').partition(|statement| handed_on(statement));
    let mut own = own.concat();
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    let words: BTreeSet<String> = own.split(|letter| !is_part(letter)).map(str::to_owned).collect();
    for list in naming.iter().filter_map(|statement| statement.split_once("use ")).map(|(_, list)| list) {
        let mut named = Vec::new();
        read_path(&mut list.chars().peekable(), &[], &mut named);
        for (path, _) in named.iter().filter(|(path, name)| {
            name.as_ref().or(path.last()).is_some_and(|name| words.contains(name)) && path[0] != "crate"
        }) {
            own.push_str(&format!("\nuse self::{};", path.join("::").replace("self::", "")));
        }
    }
    own
}

/// Whether a module has children of its own.
fn is_parent(source: &Source, files: &Files) -> bool {
    let is_child =
        |module: &&[String]| module.len() > source.module.len() && module.starts_with(&source.module);
    files.keys().any(is_child)
}

/// What each file of a room imports of the room's other files. Tests are left out.
fn arrows(all: &[Source]) -> BTreeMap<String, BTreeSet<String>> {
    let is_test = |source: &Source| source.module.iter().any(|word| word == "tests");
    let file_of: Files =
        all.iter().filter(|source| !is_test(source)).map(|source| (&source.module[..], source)).collect();
    let code_of: BTreeMap<&str, String> =
        file_of.values().map(|source| (source.name.as_str(), own_code(source, &file_of))).collect();
    let elsewhere = methods_elsewhere(&file_of, &code_of);
    let of_types = functions_elsewhere(&file_of, &code_of);
    let mut arrows = BTreeMap::new();
    for source in file_of.values() {
        let code = &code_of[source.name.as_str()];
        let mut seen = BTreeSet::new();
        for absolute in paths_from_the_top(source, code, &file_of) {
            if let Some(file) = defined_in(&file_of, &absolute, 0)
                && (!is_parent(file, &file_of)
                    || defines(&code_of[file.name.as_str()], &absolute[file.module.len()..]))
            {
                seen.insert(file.name.clone());
            }
        }
        let called = elsewhere
            .iter()
            .filter(|(method, home, _)| *home == source.name && code.contains(&format!(".{method}(")));
        seen.extend(called.map(|(_, _, file)| file.clone()));
        let named = of_types.iter().filter(|function| function.is_called_in(source, code));
        seen.extend(named.map(|function| function.file.clone()));
        seen.retain(|file| room(file) == room(&source.name) && *file != source.name);
        arrows.insert(source.name.clone(), seen);
    }
    arrows
}

fn room(file: &str) -> &str {
    file.split(['/', '.']).next().unwrap_or_default()
}

/// Every path of a file's code from the top of the crate on, those that begin with a module's own name in it, too.
fn paths_from_the_top(source: &Source, code: &str, file_of: &Files) -> Vec<Vec<String>> {
    let mut found: Vec<Vec<String>> = paths(code).iter().map(|path| from_the_top(source, path)).collect();
    // Its own children go by their names.
    let is_child =
        |module: &&&[String]| module.len() == source.module.len() + 1 && module.starts_with(&source.module);
    let children =
        file_of.keys().filter(is_child).map(|module| (module[module.len() - 1].clone(), module.to_vec()));
    let modules: Vec<(String, Vec<String>)> = renamed_paths(code)
        .into_iter()
        .filter_map(|(path, renamed)| {
            let absolute = from_the_top(source, &path);
            let name = renamed.or_else(|| absolute.last().cloned())?;
            file_of.contains_key(&absolute[..]).then_some((name, absolute))
        })
        .chain(children)
        .collect();
    for (name, absolute) in modules {
        let start = format!("{name}::");
        let part_of_a_path = |letter: char| letter.is_alphanumeric() || letter == '_' || letter == ':';
        for (at, _) in code.match_indices(&start).filter(|(at, _)| !code[..*at].ends_with(part_of_a_path)) {
            let mut below = Vec::new();
            read_path(&mut code[at + start.len()..].chars().peekable(), &absolute, &mut below);
            found.extend(below.into_iter().map(|(path, _)| path));
        }
    }
    found
}

/// Whether code has an item of the first of these names.
fn defines(code: &str, names: &[String]) -> bool {
    const KINDS: [&str; 8] = ["struct", "enum", "trait", "fn", "const", "static", "type", "union"];
    let Some(name) = names.first() else { return false };
    let ends = |rest: &str| !rest.starts_with(|letter: char| letter.is_alphanumeric() || letter == '_');
    KINDS.iter().any(|kind| {
        let item = format!("{kind} {name}");
        code.match_indices(&item).any(|(at, _)| ends(&code[at + item.len()..]))
    })
}

/// Methods in another file than their type: name, file of the type, file of the method. Names that the room has twice are
/// left out: a call does not say whose it is.
fn methods_elsewhere(file_of: &Files, code_of: &BTreeMap<&str, String>) -> Vec<(String, String, String)> {
    let mut count: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut found = Vec::new();
    for source in file_of.values() {
        let mut is_of = None;
        let code = &code_of[source.name.as_str()];
        for (at, _) in code.match_indices('\n').map(|(at, _)| (at + 1, ())).chain([(0, ())]) {
            let rest = &code[at..];
            if let Some(rest) = rest.strip_prefix("impl").filter(|rest| rest.starts_with(['<', ' '])) {
                is_of = type_of(rest.lines().next().unwrap_or_default());
            }
            let Some(method) = method_of(rest) else { continue };
            *count.entry((room(&source.name).to_owned(), method.clone())).or_default() += 1;
            let home = is_of.as_ref().and_then(|name: &String| {
                let own = std::slice::from_ref(name);
                if defines(&code_of[source.name.as_str()], own) {
                    return None;
                }
                let of_room = |file: &&&Source| room(&file.name) == room(&source.name);
                file_of.values().filter(of_room).find(|file| defines(&code_of[file.name.as_str()], own))
            });
            found.extend(home.map(|home| (method, home.name.clone(), source.name.clone())));
        }
    }
    found.retain(|(method, home, _)| count[&(room(home).to_owned(), method.clone())] == 1);
    found
}

/// A function of a type, without `self`, that stands in another file than the type.
struct TypeFunction {
    kind: String,
    name: String,
    home: String,
    file: String,
}

impl TypeFunction {
    /// Whether code calls it by its type's name, or in the type's own file by `Self`; the whole name is meant, of the same room.
    fn is_called_in(&self, source: &Source, code: &str) -> bool {
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
        let calls = |kind: &str| {
            let call = format!("{kind}::{}(", self.name);
            code.match_indices(&call).any(|(at, _)| !code[..at].ends_with(is_part))
        };
        room(&source.name) == room(&self.home)
            && (calls(&self.kind) || (source.name == self.home && calls("Self")))
    }
}

/// Functions without `self` in another file than their type.
fn functions_elsewhere(file_of: &Files, code_of: &BTreeMap<&str, String>) -> Vec<TypeFunction> {
    let mut found = Vec::new();
    for source in file_of.values() {
        let mut of: Option<(String, String)> = None;
        for line in code_of[source.name.as_str()].lines() {
            if let Some(rest) = line.strip_prefix("impl").filter(|rest| rest.starts_with(['<', ' '])) {
                of = type_of(rest).and_then(|kind| Some((home_of(source, &kind, file_of, code_of)?, kind)));
            }
            let Some((home, kind)) = of.as_ref().filter(|_| line.starts_with("    ")) else { continue };
            let Some((before, behind)) = line[4..].split_once("fn ") else { continue };
            let visible =
                ["", "pub ", "pub(crate) ", "pub(super) ", "const ", "pub const "].contains(&before);
            let name: String =
                behind.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
            if visible {
                let (kind, home, file) = (kind.clone(), home.clone(), source.name.clone());
                found.push(TypeFunction { kind, name, home, file });
            }
        }
    }
    found
}

/// The file of the room that has the type, where that is another one than `source`.
fn home_of(source: &Source, kind: &str, file_of: &Files, code_of: &BTreeMap<&str, String>) -> Option<String> {
    let own = [kind.to_owned()];
    let has = |file: &Source| defines(&code_of[file.name.as_str()], &own);
    if has(source) {
        return None;
    }
    let mut of_room = file_of.values().filter(|file| room(&file.name) == room(&source.name));
    of_room.find(|file| has(file)).map(|file| file.name.clone())
}

/// The type of an `impl` line that is no trait's.
fn type_of(rest: &str) -> Option<String> {
    let rest = match rest.strip_prefix('<') {
        Some(generic) => generic.split_once("> ")?.1,
        None => rest.trim_start(),
    };
    let name: String = rest.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
    (!rest.contains(" for ")).then_some(name)
}

/// The name of a method that code begins with; its arguments may stand on lines of their own.
fn method_of(code: &str) -> Option<String> {
    let line = code.strip_prefix("    ")?;
    let (before, behind) = line.split_once("fn ")?;
    let visible = ["", "pub ", "pub(crate) ", "pub(super) ", "const ", "pub const "].contains(&before);
    let name: String =
        behind.chars().take_while(|letter| letter.is_alphanumeric() || *letter == '_').collect();
    let signature = behind.split(['{', ';']).next().unwrap_or_default();
    (visible && signature.contains("self")).then_some(name)
}

/// The file that an absolute path leads to: the longest module of it, or where that module has a name from.
fn defined_in<'a>(file_of: &Files<'a>, absolute: &[String], depth: usize) -> Option<&'a Source> {
    let length = (1..=absolute.len()).rev().find(|length| file_of.contains_key(&absolute[..*length]))?;
    let file = file_of[&absolute[..length]];
    let rest = &absolute[length..];
    if !is_parent(file, file_of) || rest.is_empty() || depth > 4 {
        return Some(file);
    }
    for line in
        file.text.split(';').filter(|statement| statement.contains("pub") && statement.contains("use "))
    {
        let Some((_, list)) = line.split_once("use ") else { continue };
        let mut named = Vec::new();
        read_path(&mut list.chars().peekable(), &[], &mut named);
        let is_it = |(path, renamed): &&(Vec<String>, Option<String>)| {
            renamed.as_ref().or(path.last()) == rest.first() && path[0] != "crate"
        };
        if let Some((path, _)) = named.iter().find(is_it) {
            let path: Vec<_> = [&absolute[..length], path].concat();
            return defined_in(file_of, &path, depth + 1);
        }
    }
    Some(file)
}

/// Files that reach each other both ways, each group sorted.
fn circles(arrows: &BTreeMap<String, BTreeSet<String>>) -> BTreeSet<Vec<String>> {
    let reach = |from: &String| {
        let mut seen = BTreeSet::new();
        let mut next: Vec<&String> = arrows.get(from).into_iter().flatten().collect();
        while let Some(file) = next.pop() {
            if seen.insert(file.clone()) {
                next.extend(arrows.get(file).into_iter().flatten());
            }
        }
        seen
    };
    let reached: BTreeMap<&String, BTreeSet<String>> =
        arrows.keys().map(|file| (file, reach(file))).collect();
    let mut found = BTreeSet::new();
    for (file, all) in &reached {
        if all.contains(*file) {
            let group: Vec<String> = all
                .iter()
                .filter(|other| reached.get(other).is_some_and(|back| back.contains(*file)))
                .cloned()
                .collect();
            found.insert(group);
        }
    }
    found
}

#[test]
fn inside_a_room_no_files_import_each_other_in_a_circle() {
    let found = circles(&arrows(&read_sources()));
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_circle_is_seen_in_each_guise() {
    let source = |name: &str, text: &str| {
        let module = name.trim_end_matches(".rs").trim_end_matches("/mod");
        let module = module.split('/').map(str::to_owned).collect();
        Source { name: name.to_owned(), module, text: text.to_owned() }
    };
    let seen = |files: &[(&str, &str)]| {
        let sources: Vec<Source> = files.iter().map(|(name, text)| source(name, text)).collect();
        circles(&arrows(&sources)).into_iter().next().unwrap_or_default()
    };
    let parent = ("can/mod.rs", "mod a;\nmod b;\npub use a::{A, Other};\npub use b::B;");
    let group = ["can/a.rs", "can/b.rs"];
    let alone = ("can/c.rs", "use super::a::A;\nuse crate::clock::now;");
    assert_eq!(
        seen(&[parent, ("can/a.rs", "use super::{B, Outside};"), ("can/b.rs", "use crate::can::A;"), alone]),
        group
    );
    // By a name for the room, and by a module's own.
    let named = ("can/a.rs", "use crate::can as bus;\nfn f() { bus::b::g() }");
    assert_eq!(seen(&[parent, named, ("can/b.rs", "use super::a;\nfn g() { a::f() }")]), group);
    assert!(seen(&[parent, named, ("can/b.rs", "fn g() {}")]).is_empty());
    // By a method that stands elsewhere.
    let home = ("can/a.rs", "pub struct A;\nimpl A {\n    pub fn f(&self) { self.g() }\n}");
    assert_eq!(
        seen(&[parent, home, ("can/b.rs", "use super::A;\nimpl A {\n    pub fn g(&self) {}\n}")]),
        group
    );
    let home = ("can/a.rs", "pub struct A;\nimpl A {\n    pub fn f(&self) { self.g() }\n}");
    let long =
        "use super::A;\nimpl A {\n    pub fn g(\n        &self,\n        wide: bool,\n    ) {\n    }\n}";
    assert_eq!(seen(&[("can/mod.rs", "mod a;\nmod b;\npub use a::A;"), home, ("can/b.rs", long)]), group);
    // By a function of a type that stands elsewhere.
    let home = ("can/a.rs", "pub struct A;\npub fn f() { A::new() }");
    let made = ("can/b.rs", "use super::A;\nimpl A {\n    pub fn new() -> Self {\n        A\n    }\n}");
    assert_eq!(
        seen(&[("can/mod.rs", "mod a;\nmod b;\npub use a::A;"), home, made]),
        ["can/a.rs", "can/b.rs"]
    );
    // By a parent's own code, with a file beside it and with a child of its own, and not by what it hands on.
    let parent = ("can/a/mod.rs", "mod c;\nuse super::b::B;\npub struct A(B, c::C);");
    let group = ["can/a/mod.rs", "can/b.rs"];
    assert_eq!(seen(&[parent, ("can/b.rs", "use super::a::A;\npub struct B;")]), group);
    let child = ("can/a/c.rs", "use super::A;\npub struct C;");
    assert_eq!(seen(&[parent, child]), ["can/a/c.rs", "can/a/mod.rs"]);
    assert!(
        seen(&[("can/a/mod.rs", "mod c;\n#[doc(hidden)]\npub use c::C;\npub struct A;"), child]).is_empty()
    );
}
