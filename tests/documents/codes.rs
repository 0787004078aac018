//! Every code of a finding has its sentence and its row in the guide.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::root;

/// Words that stand in the match arms of the sentences and are no codes of findings: reasons within one, steps, and what drives a
/// body.
const NO_CODES: [&str; 16] = [
    "duplicate",
    "holds",
    "inertia",
    "joint_estimation",
    "measured_rotor_rates",
    "no_commands",
    "no_rate_under_command",
    "no_rotor_columns",
    "no_rows",
    "not_identified",
    "pole",
    "static_curve",
    "thrust_curve",
    "too_small",
    "torque_command",
    "voltage_gain",
];

/// The codes that have a sentence: the literals of match arms in `src/report/findings` and `src/report/check.rs`.
fn codes() -> BTreeSet<String> {
    fn gather(place: &Path, codes: &mut BTreeSet<String>) {
        if place.is_dir() {
            let entries = fs::read_dir(place).expect("readable").map(|entry| entry.expect("an entry").path());
            entries.for_each(|entry| gather(&entry, codes));
            return;
        }
        let text = fs::read_to_string(place).expect("UTF-8");
        for arm in text.lines().filter(|line| line.trim_start().starts_with('"') && line.contains(" =>")) {
            let arm = arm.split(" =>").next().unwrap_or_default();
            let is_code = |word: &&str| {
                !word.is_empty() && word.chars().all(|letter| letter.is_ascii_lowercase() || letter == '_')
            };
            codes.extend(arm.split('"').skip(1).step_by(2).filter(is_code).map(str::to_owned));
        }
    }
    let mut codes = BTreeSet::new();
    ["src/report/findings", "src/report/check.rs"].iter().for_each(|it| gather(&root().join(it), &mut codes));
    NO_CODES.iter().for_each(|word| assert!(codes.remove(*word), "{word} is no longer there"));
    codes
}

/// The codes that the code of `src/` makes findings of, each with its file: where a finding is begun with a literal, and the
/// constants that say "The code: ...".
fn made() -> BTreeSet<(String, String)> {
    fn gather(place: &Path, made: &mut BTreeSet<(String, String)>) {
        if place.is_dir() {
            let entries = fs::read_dir(place).expect("readable").map(|entry| entry.expect("an entry").path());
            entries.for_each(|entry| gather(&entry, made));
            return;
        }
        let text = fs::read_to_string(place).expect("UTF-8");
        let program = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
        let words = |start: &str| -> Vec<&str> {
            let behind = program.match_indices(start).map(|(at, _)| &program[at + start.len()..]);
            behind.filter_map(|rest| rest.trim_start().strip_prefix('"')?.split('"').next()).collect()
        };
        let mut found: Vec<&str> =
            ["Finding::new(", "Finding::of_rotor(", "finding(", "of_rate(", "of_angle("]
                .iter()
                .flat_map(|it| words(it))
                .collect();
        for (at, _) in program.match_indices("/// The code: ") {
            let declared = program[at..].split_once("&str = \"").and_then(|(_, rest)| rest.split('"').next());
            found.extend(declared);
        }
        let name = place.strip_prefix(root()).unwrap_or(place).display().to_string();
        made.extend(found.into_iter().map(|code| (code.to_owned(), name.clone())));
    }
    let mut made = BTreeSet::new();
    gather(&root().join("src"), &mut made);
    // Why a row is not scored, of which nothing else is said.
    made.retain(|(code, _)| !REASONS_ALONE.contains(&code.as_str()));
    made
}

/// Codes of rows that are not scored, for which there is no finding.
const REASONS_ALONE: [&str; 2] = ["rotor_rate_missing", "short_run"];

/// A finding without a sentence shows its name: whoever adds a check is told what is missing.
#[test]
fn every_code_of_a_finding_has_its_sentence() {
    let (made, said) = (made(), codes());
    assert!(made.len() > 100, "{made:?}");
    let missing: Vec<String> = made
        .iter()
        .filter(|(code, _)| !said.contains(code))
        .map(|(code, file)| {
            format!("`{code}` of {file} has no sentence: give it a match arm in src/report/findings/")
        })
        .collect();
    assert!(missing.is_empty(), "{missing:#?}");
    // A check that the search does not see is a check that nobody is told of.
    let checks = fs::read_dir(root().join("src/screening/checks")).expect("readable");
    for file in checks.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")) {
        let name = format!("src/screening/checks/{file}");
        let is_seen = file == "mod.rs"
            || USES_THE_CODE_OF.contains(&file.as_str())
            || made.iter().any(|(_, it)| *it == name);
        assert!(
            is_seen,
            "{name}: no code is seen in it; begin its finding with a literal, or with a constant `/// The code: ...`"
        );
    }
}

/// Checks whose code is the reason of rows, too, and stands where these are known.
const USES_THE_CODE_OF: [&str; 2] = ["commands_missing.rs", "standstill_left_out.rs"];

/// Who meets a code finds its row, and no row speaks of a code that is gone.
#[test]
fn every_code_of_a_finding_has_its_row_in_the_guide() {
    let page = fs::read_to_string(root().join("docs/guide/findings.md")).expect("UTF-8");
    let first_cells = page.lines().filter_map(|line| line.strip_prefix("| `")?.split(" | ").next());
    let rows: BTreeSet<String> = first_cells
        .flat_map(|cell| {
            cell.split("`, `").map(|code| code.trim_end_matches('`').to_owned()).collect::<Vec<_>>()
        })
        .collect();
    let codes = codes();
    assert!(codes.len() > 100, "{codes:?}");
    let missing: Vec<&String> = codes.difference(&rows).collect();
    let gone: Vec<&String> = rows.difference(&codes).collect();
    assert!(missing.is_empty(), "no row in docs/guide/findings.md of {missing:?}");
    assert!(gone.is_empty(), "rows in docs/guide/findings.md of codes that are gone: {gone:?}");
}
