//! Names between backticks exist: files, options of the command they stand beside, keys of files, codes and fields.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::options::Commands;
use super::toml_blocks::read;
use super::{pages, root};

/// Pages that say what is; the changelog says what was, evidence is written by tools, thresholds by a test.
fn prose() -> Vec<(String, String)> {
    let is_prose = |page: &str| {
        !["CHANGELOG.md", "docs/thresholds.md"].contains(&page)
            && !page.starts_with("docs/evidence/")
            && !page.starts_with("docs/schema/")
    };
    pages().into_iter().filter(|(page, _)| is_prose(page)).collect()
}

/// What stands between backticks outside of blocks, with its line.
fn spans(text: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut is_block = false;
    for (at, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_block = !is_block;
            continue;
        }
        let mut rest = if is_block { "" } else { line };
        while let Some(begin) = rest.find('`') {
            let marks = rest[begin..].chars().take_while(|it| *it == '`').count();
            let mark = "`".repeat(marks);
            let inside = &rest[begin + marks..];
            // One that ends on the next line is left alone.
            let Some(end) = inside.find(&mark) else { break };
            if marks == 1 {
                found.push((at + 1, inside[..end].to_owned()));
            }
            rest = &inside[end + marks..];
        }
    }
    found
}

/// Every file of the project's own folders, from its root.
fn files() -> Vec<String> {
    fn gather(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("readable").map(|entry| entry.expect("an entry").path()) {
            if entry.is_dir() {
                gather(&entry, found);
            } else {
                found.push(entry);
            }
        }
    }
    let mut found = Vec::new();
    FOLDERS.iter().for_each(|folder| gather(&root().join(folder), &mut found));
    found.iter().map(|file| file.strip_prefix(root()).expect("below").display().to_string()).collect()
}

const FOLDERS: [&str; 6] = ["src", "tests", "docs", "tools", "examples", "dbc"];

/// Folders of the user's.
const OF_USERS: [&str; 1] = ["rotorbench-demo/"];

#[test]
fn files_and_folders_that_are_named_exist() {
    let files = files();
    let mut count = 0;
    for (page, text) in prose() {
        for (line, span) in spans(&text) {
            let word = span.split_whitespace().next().unwrap_or_default();
            let is_name = |it: char| it.is_ascii_alphanumeric() || "_-./".contains(it);
            let ours = FOLDERS.iter().any(|folder| word.starts_with(&format!("{folder}/")));
            let is_source = [".rs", ".js", ".mjs"].iter().any(|end| word.ends_with(end));
            let is_folder = word.ends_with('/') && word.len() > 1 && !OF_USERS.contains(&word);
            if !word.chars().all(is_name) || !(ours || is_source || is_folder) {
                continue;
            }
            let is_there = root().join(word).exists()
                || root().join("src").join(word).exists()
                || (is_source && files.iter().any(|file| file.ends_with(&format!("/{word}"))))
                || (is_folder && files.iter().any(|file| file.contains(&format!("/{word}"))));
            assert!(is_there, "{page}, line {line}: there is no `{word}`");
            count += 1;
        }
    }
    assert!(count > 150, "{count} files were named");
}

/// The commands in a line or a span: each the words from its name on.
fn calls<'a>(text: &'a str, commands: &Commands) -> Vec<Vec<&'a str>> {
    let text = text.split(" #").next().unwrap_or_default();
    let pieces = text.split(['&', ';', '|', '\'', '(']);
    let call = |piece: &'a str| {
        let words = piece.split_whitespace().skip_while(|word| *word == "sudo");
        let words: Vec<&str> = words.skip_while(|word| *word == "rotorbench").collect();
        words.first().is_some_and(|word| commands.names.contains(*word)).then_some(words)
    };
    pieces.filter_map(call).collect()
}

/// The options among words, as they are written in help.
fn options<'a>(words: &[&'a str]) -> Vec<&'a str> {
    let is_letter = |it: char| it.is_ascii_alphanumeric() || it == '-';
    let bare = |word: &'a str| {
        word.trim_start_matches('[').split(|it: char| !is_letter(it)).next().unwrap_or_default()
    };
    words.iter().map(|word| bare(word)).filter(|word| word.starts_with("--") && word.len() > 2).collect()
}

#[test]
fn options_belong_to_the_command_they_stand_beside() {
    let commands = Commands::of_the_program();
    let (mut count, mut alone) = (0, 0);
    for (page, text) in prose() {
        let spans = spans(&text);
        let lines = text.lines().enumerate().map(|(at, line)| (at + 1, line.trim()));
        let lines = lines.filter(|(_, line)| line.starts_with("rotorbench "));
        let shown: Vec<(usize, &str)> =
            lines.chain(spans.iter().map(|(line, span)| (*line, span.as_str()))).collect();
        let stem = Path::new(&page).file_stem().and_then(|it| it.to_str()).unwrap_or_default().to_owned();
        let mut here = BTreeSet::from([stem]);
        for (line, shown) in &shown {
            for call in calls(shown, &commands) {
                here.insert(call[0].to_owned());
                for option in options(&call) {
                    let is_there = commands.options[call[0]].contains(option);
                    assert!(is_there, "{page}, line {line}: `{}` has no {option}", call[0]);
                    count += 1;
                }
            }
        }
        for (line, span) in spans.iter().filter(|(_, span)| span.starts_with("--")) {
            for option in options(&span.split_whitespace().collect::<Vec<_>>()) {
                let has =
                    |command: &String| commands.options.get(command).is_some_and(|it| it.contains(option));
                assert!(here.iter().any(has), "{page}, line {line}: none of {here:?} has {option}");
                alone += 1;
            }
        }
    }
    assert!(count > 100 && alone > 80, "{count} options beside a command and {alone} alone were found");
}

/// Keys that a reader knows in the table that `head` opens: it lists them when it meets another.
fn listed(kind: &str, head: &str) -> Option<Vec<String>> {
    let said = read(kind, &format!("{head}no_such_key = 1\n")).err()?;
    let (_, known) = said.split_once("unknown field `no_such_key`, expected ")?;
    Some(known.split('`').skip(1).step_by(2).map(str::to_owned).collect())
}

/// Tables whose keys are names: one of each.
const NAMED: [&str; 3] = ["[bus.sensors.body_rate]\n", "[bus.commands.rotor_1]\n", "[bus.messages.GYRO]\n"];

/// Every key of a kind of file, as its reader knows them, table by table.
fn keys(kind: &str) -> BTreeSet<String> {
    let mut heads = vec![(String::new(), String::new())];
    heads.extend(NAMED.iter().filter(|_| kind == "bench").map(|head| (String::new(), (*head).to_owned())));
    let mut found = BTreeSet::new();
    while let Some((path, head)) = heads.pop() {
        for key in listed(kind, &head).unwrap_or_default() {
            let is_new = found.insert(key.clone());
            let below = if path.is_empty() { key } else { format!("{path}.{key}") };
            if (is_new || below.len() < 40) && below.split('.').count() < 5 {
                let tables = [format!("[{below}]\n"), format!("[[{below}]]\n")];
                let table = tables.into_iter().find(|head| listed(kind, head).is_some());
                heads.extend(table.map(|head| (below, head)));
            }
        }
    }
    found
}

/// The reader of what a page shows in brackets, and what stands before a key without a table.
fn reader(page: &str) -> (&'static str, &'static str) {
    match page {
        "docs/guide/import.md" => ("mapping", ""),
        "docs/guide/control.md" => ("bench", "controller."),
        "docs/guide/emulate.md" => ("bench", "emulator."),
        _ => ("bench", ""),
    }
}

#[test]
fn keys_beside_their_table_exist() {
    let mut count = 0;
    for (page, text) in prose() {
        let kind = reader(&page).0;
        for (line, span) in spans(&text).iter().filter(|(_, span)| span.starts_with('[')) {
            let Some((table, rest)) = span.rsplit_once(']') else { continue };
            let table = format!("{table}]");
            let of_model = ["effects]]", "identified_from]]"].iter().any(|it| table.ends_with(it));
            let kind = if of_model { "model part" } else { kind };
            if !table.trim_matches(['[', ']']).chars().all(|it| it.is_ascii_lowercase() || "._".contains(it))
            {
                continue;
            }
            let keys = rest.split(',').map(|key| key.split('=').next().unwrap_or_default().trim());
            for key in keys {
                let assignment = if key.is_empty() { String::new() } else { format!("{key} = 0\n") };
                let said = read(kind, &format!("{table}\n{assignment}")).err().unwrap_or_default();
                assert!(!said.contains("unknown field"), "{page}, line {line}: `{span}`: {said}");
                count += 1;
            }
        }
    }
    assert!(count > 25, "{count} tables and keys were found");
}

/// `a.b` and `a.b = 1` on pages about the bench file.
#[test]
fn dotted_keys_exist() {
    let mut count = 0;
    let about = ["bench-file", "control", "emulate", "guard", "run", "experiment"];
    for (page, text) in
        prose().iter().filter(|(page, _)| about.iter().any(|it| page.ends_with(&format!("guide/{it}.md"))))
    {
        for (line, span) in spans(text) {
            let key = span.split('=').next().unwrap_or_default().trim();
            let parts: Vec<&str> = key.split('.').collect();
            let is_part = |part: &&str| {
                !part.is_empty()
                    && part.chars().all(|it| it.is_ascii_lowercase() || it == '_' || it.is_ascii_digit())
            };
            if parts.len() < 2
                || !parts.iter().all(is_part)
                || ["mcap", "toml", "csv", "md", "html"].contains(&parts[parts.len() - 1])
            {
                continue;
            }
            let said =
                |before: &str| read("bench", &format!("{before}{key} = 0\n")).err().unwrap_or_default();
            let is_there = ["", reader(page).1].iter().any(|before| !said(before).contains("unknown field"));
            assert!(is_there, "{page}, line {line}: `{key}`: {}", said(""));
            count += 1;
        }
    }
    assert!(count > 10, "{count} dotted keys were found");
}

fn gather_words(text: &str, words: &mut BTreeSet<String>) {
    let is_letter = |it: char| it.is_ascii_alphanumeric() || it == '_';
    words.extend(text.split(|it| !is_letter(it)).filter(|word| !word.is_empty()).map(str::to_owned));
}

/// `NodeSilent` as it is written in answers: `node_silent`.
fn snake(name: &str) -> String {
    let mut out = String::new();
    for (at, letter) in name.chars().enumerate() {
        if letter.is_ascii_uppercase() && at > 0 {
            out.push('_');
        }
        out.push(letter.to_ascii_lowercase());
    }
    out
}

/// Words that a user meets (in files, answers and messages), and those of the source besides.
fn vocabulary() -> (BTreeSet<String>, BTreeSet<String>) {
    let (mut met, mut source) = (BTreeSet::new(), BTreeSet::new());
    ["bench", "mapping", "plan", "model part"].iter().for_each(|kind| met.extend(keys(kind)));
    for file in files() {
        let Ok(text) = fs::read_to_string(root().join(&file)) else { continue };
        if file.starts_with("docs/schema/")
            || file.starts_with("dbc/")
            || file.starts_with("examples/benches/")
        {
            gather_words(&text, &mut met);
        } else if file.starts_with("src/") {
            gather_words(&text, &mut source);
            // What is between quotes is said or read; of names of the code those of variants are.
            text.lines().filter(|line| !line.trim_start().starts_with("//")).for_each(|line| {
                line.split('"').skip(1).step_by(2).for_each(|literal| gather_words(literal, &mut met));
            });
        }
    }
    let is_variant = |word: &&String| word.starts_with(|it: char| it.is_ascii_uppercase());
    met.extend(source.iter().filter(is_variant).map(|word| snake(word)));
    source.extend(met.iter().cloned());
    (met, source)
}

/// Names of other programs' and of other documents'.
const OF_OTHERS: [&str; 2] = ["io_uring", "vehicle_attitude"];

/// A word with an underscore is a name of ours.
#[test]
fn keys_codes_fields_and_channels_that_are_named_exist() {
    let (met, source) = vocabulary();
    assert!(met.contains("rotor_maximum") && met.contains("stale_after_s") && met.contains("decimal_comma"));
    let mut count = 0;
    for (page, text) in prose() {
        let is_of_developers =
            ["CONTRIBUTING.md", "docs/architecture.md", "docs/deviations.md"].contains(&page.as_str());
        let known = if is_of_developers { &source } else { &met };
        for (line, span) in spans(&text) {
            let is_letter = |it: char| it.is_ascii_alphanumeric() || it == '_';
            let word = span.split(|it| !is_letter(it)).next().unwrap_or_default();
            // `command_N`, `m_rotor_3`: of each rotor. `_ms`: an ending.
            let is_name = word.contains('_')
                && word.chars().all(|it| it.is_ascii_lowercase() || it == '_' || it.is_ascii_digit());
            let is_file = span
                .strip_prefix(word)
                .is_some_and(|rest| [".toml", ".csv", ".rs", ".mcap", ".html"].contains(&rest));
            if !is_name || is_file || word.starts_with('_') || OF_OTHERS.contains(&word) {
                continue;
            }
            let of_each =
                ["_1_", "_2_"].iter().fold(word.to_owned(), |word, rotor| word.replace(rotor, "_N_"));
            let is_there = known.contains(word) || known.contains(&of_each);
            assert!(is_there, "{page}, line {line}: `{span}`: nothing is called {word}");
            count += 1;
        }
    }
    assert!(count > 250, "{count} names were found");
}

/// Every name and every word of a choice in a schema.
fn words_of(schema: &Value, words: &mut BTreeSet<String>) {
    match schema {
        Value::Object(fields) => {
            words.extend(
                fields
                    .get("properties")
                    .and_then(Value::as_object)
                    .into_iter()
                    .flatten()
                    .map(|it| it.0.clone()),
            );
            fields.get("const").and_then(Value::as_str).map(|word| words.insert(word.to_owned()));
            let choices = fields.get("enum").and_then(Value::as_array);
            words.extend(choices.into_iter().flatten().filter_map(Value::as_str).map(str::to_owned));
            fields.values().for_each(|below| words_of(below, words));
        }
        Value::Array(items) => items.iter().for_each(|below| words_of(below, words)),
        _ => {}
    }
}

fn words_of_answer(command: &str) -> BTreeSet<String> {
    let mut words = BTreeSet::new();
    for name in [command.to_owned(), format!("{command}-rotors")] {
        let Ok(text) = fs::read_to_string(root().join(format!("docs/schema/{name}.json"))) else { continue };
        words_of(&serde_json::from_str(&text).expect("JSON"), &mut words);
    }
    words
}

/// Below a heading that is a command, the page on answers speaks of the fields of that command's answer.
#[test]
fn fields_of_answers_are_in_their_schemas() {
    let text = fs::read_to_string(root().join("docs/guide/json.md")).expect("UTF-8");
    let commands = Commands::of_the_program();
    let mut count = BTreeMap::new();
    for section in text.split("\n## `").skip(1) {
        let (command, body) = section.split_once('`').expect("a heading");
        let words = words_of_answer(command);
        let is_word = |span: &String| span.chars().all(|it| it.is_ascii_lowercase() || it == '_');
        for (_, span) in
            spans(body).iter().filter(|(_, span)| is_word(span) && !commands.names.contains(span))
        {
            assert!(words.contains(span), "json.md, {command}: no field is called `{span}`");
            *count.entry(command.to_owned()).or_insert(0) += 1;
        }
    }
    assert!(count.len() >= 4 && count.values().all(|fields| *fields >= 4), "{count:?}");
}

/// The table of conditions has a row for each code of the schema, and no other.
#[test]
fn conditions_of_candidates_have_their_rows() {
    let schema = fs::read_to_string(root().join("docs/schema/diagnose.json")).expect("UTF-8");
    let schema: Value = serde_json::from_str(&schema).expect("JSON");
    let mut codes = BTreeSet::new();
    words_of(&schema["$defs"]["NotNamed"]["oneOf"], &mut codes);
    let page = fs::read_to_string(root().join("docs/guide/diagnose.md")).expect("UTF-8");
    let table = page.split("| code | it means | do |").nth(1).expect("the table");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with("| `"));
    let rows: BTreeSet<String> = rows.filter_map(|line| line.split('`').nth(1).map(str::to_owned)).collect();
    assert!(rows.len() > 8 && rows.is_subset(&codes), "{rows:?} {codes:?}");
    let fields = ["code", "needed", "share", "standard_errors", "p_value", "most", "set"];
    let missing: Vec<&String> =
        codes.difference(&rows).filter(|code| !fields.contains(&code.as_str())).collect();
    assert!(missing.is_empty(), "no row of {missing:?}");
}
