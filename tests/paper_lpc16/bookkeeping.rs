//! What the print gets wrong, marked in the code and listed in docs/deviations.md; and a test for every equation used.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use rotorbench::report::deviations::DEVIATIONS;

use crate::sources::sources;

const MARK: &str = "**Deviation:**";

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Room, and text, of every file of the library.
fn library() -> Vec<(String, String)> {
    let source = root().join("src");
    let paths = sources(&source);
    let each = paths.iter().map(|path| {
        let below = path.strip_prefix(&source).expect("below src").display().to_string();
        let room = below.split(['/', '.']).next().unwrap_or_default().to_owned();
        (room, fs::read_to_string(path).expect("readable"))
    });
    each.collect()
}

/// `(7)`, `Table IV` and `Fig. 4`, wherever the text names one.
fn places(text: &str) -> BTreeSet<String> {
    let mut places = BTreeSet::new();
    for (at, _) in text.match_indices('(') {
        let inside: String = text[at + 1..].chars().take_while(|letter| *letter != ')').collect();
        if inside.parse::<u32>().is_ok_and(|number| (1..=30).contains(&number)) {
            places.insert(format!("({inside})"));
        }
    }
    for word in ["Table ", "Fig. "] {
        for (at, _) in text.match_indices(word) {
            let number = text[at + word.len()..].split(|letter: char| !letter.is_ascii_alphanumeric());
            places.insert(format!("{word}{}", number.into_iter().next().unwrap_or_default()));
        }
    }
    places
}

/// The places that each mark in `text` names, in its own paragraph.
fn marks(text: &str) -> Vec<BTreeSet<String>> {
    let lines: Vec<&str> = text.lines().collect();
    let is_comment = |line: &str| line.trim_start().starts_with("//");
    let is_blank = |line: &str| line.trim().trim_start_matches(['/', '!']).is_empty();
    let mut marks = Vec::new();
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| line.contains(MARK)) {
        let ends = |line: &&&str| is_comment(line) && !is_blank(line) && !line.contains(MARK);
        let rest = lines[at + 1..].iter().take_while(ends).copied();
        let rest: Vec<&str> = if is_comment(line) { rest.collect() } else { Vec::new() };
        marks.push(places(&format!("{line} {}", rest.join(" "))));
    }
    marks
}

#[test]
fn every_deviation_is_documented_and_every_one_there_is_in_the_code() {
    let table = fs::read_to_string(root().join("docs/deviations.md")).expect("readable");
    let rows: Vec<(BTreeSet<String>, BTreeSet<&str>)> = table
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| place"))
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split(" | ").collect();
            assert_eq!(cells.len(), 4, "{line}");
            let rooms = cells[3].split('`').map(str::trim).filter(|room| !room.is_empty());
            (places(cells[0]), rooms.collect())
        })
        .collect();
    assert!(rows.len() >= 10, "the table was read");
    // The report says the same.
    for [place, printed, used] in DEVIATIONS {
        assert!(
            table.contains(&format!("| {place} | {printed} | {used} |")),
            "not in docs/deviations.md: {place}, {used}"
        );
    }
    assert_eq!(rows.len(), DEVIATIONS.len());
    let marked: Vec<(String, BTreeSet<String>)> = library()
        .into_iter()
        .flat_map(|(room, text)| marks(&text).into_iter().map(move |mark| (room.clone(), mark)))
        .collect();
    for (room, mark) in &marked {
        let listed = rows
            .iter()
            .any(|(place, rooms)| rooms.contains(room.as_str()) && place.intersection(mark).next().is_some());
        assert!(listed, "src/{room}: the mark that names {mark:?} is not in the table of docs/deviations.md");
    }
    for (place, rooms) in &rows {
        assert!(!rooms.is_empty(), "{place:?} names no room");
        for room in rooms {
            let found =
                marked.iter().any(|(of, mark)| of == room && place.intersection(mark).next().is_some());
            assert!(found, "docs/deviations.md says that {place:?} is marked in src/{room}");
        }
    }
}

/// Numbers of the equations that the names of a file's tests carry: `eq_7_...`, `eqs_16_to_19_...`.
fn tested(text: &str) -> BTreeSet<u32> {
    let mut numbers = BTreeSet::new();
    for name in text.split("fn eq").skip(1) {
        let words = name.trim_start_matches('s').trim_start_matches('_').split('_');
        let (mut last, mut is_range) = (0, false);
        for word in words.take_while(|word| matches!(*word, "to" | "and") || word.parse::<u32>().is_ok()) {
            if let Ok(number) = word.parse::<u32>() {
                numbers.extend(if is_range { last..=number } else { number..=number });
                last = number;
            }
            is_range = word == "to";
        }
    }
    numbers
}

#[test]
fn every_equation_used_has_its_test() {
    let tests: BTreeSet<u32> = sources(&root().join("tests/paper_lpc16"))
        .iter()
        .flat_map(|file| tested(&fs::read_to_string(file).expect("readable")))
        .collect();
    for (file, text) in library() {
        // Comments only: what stands in a string is for people.
        let comments = text.lines().filter_map(|line| line.split_once("//"));
        for cited in comments.filter_map(|(_, comment)| comment.split_once("[LPC16]")) {
            for place in places(cited.1).iter().filter(|place| place.starts_with('(')) {
                let number: u32 = place.trim_matches(['(', ')']).parse().expect("a number");
                assert!(
                    tests.contains(&number),
                    "src/{file} uses {place}, which no test carries in its name"
                );
            }
        }
    }
    for number in [1, 2, 6, 9, 16, 20, 24, 27, 30] {
        assert!(tests.contains(&number), "({number}) was read");
    }
}
