//! The form of the pages: links and headings, evidence that tools write, pictures, the length of the README.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use super::{pages, root};

/// The anchor that a heading gets: lower case, blanks as hyphens, marks left out.
fn anchor(heading: &str) -> String {
    let kept = |letter: &char| letter.is_alphanumeric() || matches!(letter, ' ' | '-' | '_');
    heading
        .trim_start_matches('#')
        .trim()
        .to_lowercase()
        .chars()
        .filter(kept)
        .map(|it| if it == ' ' { '-' } else { it })
        .collect()
}

#[test]
fn links_lead_somewhere() {
    let mut count = 0;
    for (page, text) in pages() {
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") || link.starts_with('<') {
                continue;
            }
            let (file, place) =
                link.split_once('#').map_or((link, None), |(file, place)| (file, Some(place)));
            let target = if file.is_empty() {
                root().join(&page)
            } else {
                root().join(&page).with_file_name("").join(file)
            };
            let there = fs::read_to_string(&target).unwrap_or_else(|_| panic!("{page}: {link} is not there"));
            if let Some(place) = place {
                let headings = there.lines().filter(|line| line.starts_with('#'));
                assert!(headings.map(anchor).any(|it| it == place), "{page}: {link} has no such heading");
            }
            count += 1;
        }
    }
    assert!(count > 60, "{count} links were found");
}

/// What a page of the guide is read by, in this order; others may stand between.
const HEADINGS: [&str; 6] = [
    "## What it answers",
    "## The shortest command that works",
    "## What you see",
    "## Options that matter",
    "## How it decides",
    "## Limits",
];

#[test]
fn pages_of_the_guide_have_the_same_headings() {
    let mut count = 0;
    for (page, text) in pages().iter().filter(|(page, _)| page.starts_with("docs/guide/")) {
        // Tables of answers, of codes, and of fields.
        if ["troubleshooting.md", "findings.md", "json.md"].iter().any(|name| page.ends_with(name)) {
            continue;
        }
        let found: Vec<&str> = text.lines().filter(|line| HEADINGS.contains(line)).collect();
        assert_eq!(found, HEADINGS, "{page}");
        count += 1;
    }
    assert!(count > 15, "{count} pages were found");
}

/// Where tools write what they measured: page, place, and the script that knows both.
const PLACES: [(&str, &[&str], &str); 13] = [
    ("faults", &["lockstep", "real-time", "machine"], "faults"),
    (
        "scores",
        &["scores", "errors", "laws", "poor_laws", "noise", "three", "coarse", "between_rows", "own_base"],
        "campaign",
    ),
    ("speed", &["peers", "logs", "laws"], "peers"),
    ("speed", &["bench"], "bench"),
    (
        "long-runs",
        &["lockstep", "replay", "hour", "campaign", "real-time", "bus", "shifts", "speeds"],
        "soak",
    ),
    ("long-runs", &["mutants-guard", "mutants-can"], "mutants"),
    ("long-runs", &["fuzz"], "fuzz"),
    ("long-runs", &["coverage"], "coverage"),
    ("real-logs", &["logs"], "soak"),
    // What was found by hand is no tool's.
    ("real-logs", &["public"], "evidence"),
    ("scale", &["scale"], "scale"),
    ("fleet", &["fleet"], "fleet/test"),
    ("workbench", &["workbench"], "workbench"),
];

/// What was measured stands in a place that a tool writes, below the command, the machine and the day; by hand is how to read it.
#[test]
fn evidence_is_written_by_tools() {
    let mut count = 0;
    for (page, text) in pages().iter().filter(|(page, _)| page.starts_with("docs/evidence/")) {
        let name = page.trim_start_matches("docs/evidence/").trim_end_matches(".md");
        let places: BTreeSet<&str> = PLACES
            .iter()
            .filter(|(it, ..)| *it == name)
            .flat_map(|(_, places, _)| *places)
            .copied()
            .collect();
        let mut found = BTreeSet::new();
        let mut place = None;
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            if let Some((begun, _)) =
                line.strip_prefix("<!-- ").and_then(|it| it.split_once(": written by tools/"))
            {
                let head = lines.next().unwrap_or_default();
                assert!(
                    head.starts_with('`') && head.contains(" 202"),
                    "{page}, {begun}: command and day: {head}"
                );
                place = Some(begun);
                found.insert(begun);
            } else if line.starts_with("<!-- end of ") {
                place = None;
            } else {
                let is_measured = line.starts_with('|') || line.starts_with("- ");
                assert!(place.is_some() || !is_measured, "{page}: by hand: {line}");
            }
        }
        assert_eq!(found, places, "{page}");
        count += found.len();
    }
    assert!(count >= 15, "{count} places were found");
}

#[test]
fn tools_write_their_evidence_into_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let evidence = |page: &str, place: &str, text: &str| {
        fs::write(folder.path().join("measured"), text).expect("written");
        let measured = fs::File::open(folder.path().join("measured")).expect("there");
        let mut command = Command::new(root().join("tools/evidence"));
        let done = command
            .args([page, place, "tools/x", "--draws", "5"])
            .stdin(measured)
            .output()
            .expect("it starts");
        done.status.success()
    };
    for (name, places, script) in PLACES {
        let page = folder.path().join(format!("{name}.md"));
        let before = fs::read_to_string(root().join(format!("docs/evidence/{name}.md"))).expect("UTF-8");
        let tool = fs::read_to_string(root().join("tools").join(script)).expect("UTF-8");
        assert!(
            tool.contains(name) || tool.contains("\"docs/evidence/$page.md\""),
            "{script} does not write {name}"
        );
        for place in places {
            fs::write(&page, &before).expect("written");
            let path = page.display().to_string();
            assert!(evidence(&path, place, "| new |\n| 7 |\n"), "{name}: no place {place}");
            let after = fs::read_to_string(&page).expect("UTF-8");
            let (above, rest) =
                after.split_once(&format!("<!-- {place}: written by")).expect("its first line");
            let (inside, below) =
                rest.split_once(&format!("<!-- end of {place} -->")).expect("its last line");
            assert!(
                before.starts_with(above) && before.ends_with(below),
                "{name}: what is by hand has changed"
            );
            assert!(
                inside.contains("`tools/x --draws 5`, ") && inside.contains("\n| new |\n| 7 |\n"),
                "{inside}"
            );
        }
    }
    let page = folder.path().join("speed.md").display().to_string();
    assert!(
        !evidence(&page, "nowhere", "x\n") && !evidence(&page, "peers", ""),
        "refused, and nothing written"
    );
}

#[test]
fn pictures_are_there_and_small() {
    let mut count = 0;
    for (page, text) in pages() {
        for attribute in ["src=\"", "srcset=\""] {
            for file in text.split(attribute).skip(1).filter_map(|rest| rest.split('"').next()) {
                let picture = root().join(&page).with_file_name("").join(file);
                let size =
                    fs::metadata(&picture).unwrap_or_else(|_| panic!("{page}: {file} is not there")).len();
                // What a reader on a train waits for, and of a whole page of the workbench twice that (`tools/picture`).
                let most = if file.contains("workbench") { 300_000 } else { 150_000 };
                assert!((10_000..=most).contains(&size), "{page}: {file} has {size} bytes");
                count += 1;
            }
        }
    }
    assert!(count >= 6, "{count} pictures were found");
}

#[test]
fn the_readme_is_a_page() {
    let text = fs::read_to_string(root().join("README.md")).expect("UTF-8");
    assert!(text.lines().count() <= 150, "README.md is to be read in a minute");
}
