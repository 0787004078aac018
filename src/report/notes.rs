//! The notes beneath an answer, as short as they can be: the same of several logs once, and what was taken out of the logs in one
//! line that names its codes.

use std::collections::BTreeMap;
use std::path::Path;

use super::findings::text;
use super::wrapped::wrapped;
use crate::screening::Finding;

/// How much of the notes is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Detail {
    /// What bears on the answer; of the rest, that there is more.
    Short,
    /// Each finding of each log.
    Every,
}

/// Codes of what was taken out of a log, where nothing is to be done about it: [findings](../../docs/guide/findings.md) has them all.
const TAKEN_OUT: [&str; 10] = [
    "battery_dropout",
    "commands_missing",
    "dropouts",
    "holes",
    "outliers",
    "rate_dropout",
    "sample_and_hold",
    "standstill_left_out",
    "starts_from_standstill",
    "transient_behind_hole",
];
/// So few of these are shown as they are.
const MOST_SHOWN: usize = 1;
/// Other places of the same finding that are named.
const PLACES: usize = 3;

/// A finding, and whose it is where that is said before its log and its rotor.
pub(crate) type Note<'a> = (String, &'a Finding);

/// Findings that are nobody's in particular.
pub(crate) fn of_all<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> Vec<Note<'a>> {
    findings.into_iter().map(|finding| (String::new(), finding)).collect()
}

/// The notes as lines of a terminal, each behind `head`.
pub(crate) fn lines(notes: &[Note], head: &str, detail: Detail) -> String {
    let names = names(notes);
    if detail == Detail::Every {
        return notes.iter().map(|note| wrapped(head, &said(note, &names))).collect();
    }
    let groups = groups(notes);
    let (taken_out, shown): (Vec<&Vec<&Note>>, Vec<&Vec<&Note>>) =
        groups.iter().partition(|group| TAKEN_OUT.contains(&group[0].1.code));
    let (folded, as_it_is) =
        if taken_out.len() > MOST_SHOWN { (taken_out, vec![]) } else { (vec![], taken_out) };
    let mut out: String =
        shown.into_iter().chain(as_it_is).map(|group| wrapped(head, &once(group, &names))).collect();
    if !folded.is_empty() {
        out += &wrapped(head, &format!("not used of the logs: {} (--notes says more)", counted(&folded)));
    }
    out
}

/// The short name of each log: its file's, where no other log has the same.
fn names<'a>(notes: &[Note<'a>]) -> BTreeMap<&'a str, &'a str> {
    let file = |log: &'a str| Path::new(log).file_name().and_then(|name| name.to_str()).unwrap_or(log);
    let logs: BTreeMap<&str, &str> =
        notes.iter().map(|(_, finding)| (finding.log.as_str(), file(&finding.log))).collect();
    let is_one = |name: &str| logs.values().filter(|other| **other == name).count() == 1;
    logs.iter().map(|(log, name)| (*log, if is_one(name) { *name } else { *log })).collect()
}

/// Whose it is: what stands before it, its log, its rotor.
fn place((whose, finding): &Note, names: &BTreeMap<&str, &str>) -> String {
    let log = names.get(finding.log.as_str()).copied().unwrap_or_default();
    let own = (*finding).clone().of(log).place();
    [whose.clone(), own].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(": ")
}

fn said(note: &Note, names: &BTreeMap<&str, &str>) -> String {
    at(&place(note, names), &text(note.1))
}

fn at(place: &str, said: &str) -> String {
    if place.is_empty() { said.to_owned() } else { format!("{place}: {said}") }
}

/// The same of several logs and rotors together, in the order of the first of each.
fn groups<'n, 'a>(notes: &'n [Note<'a>]) -> Vec<Vec<&'n Note<'a>>> {
    // A rotor is a place; a channel, a number and an effect are not.
    let is_same = |a: &Finding, b: &Finding| {
        a.code == b.code
            && a.is_of_rotor == b.is_of_rotor
            && (a.is_of_rotor || a.subject == b.subject || TAKEN_OUT.contains(&a.code))
    };
    let mut groups: Vec<Vec<&Note>> = Vec::new();
    for note in notes {
        match groups.iter_mut().find(|group| is_same(group[0].1, note.1)) {
            Some(group) => group.push(note),
            None => groups.push(vec![note]),
        }
    }
    groups
}

/// What is said of the first, and where it holds, too.
fn once(group: &[&Note], names: &BTreeMap<&str, &str>) -> String {
    let first = text(group[0].1);
    let places: Vec<String> = group.iter().map(|note| place(note, names)).collect();
    let list = |places: &[String]| {
        let more = places.len().saturating_sub(PLACES);
        let shown = places[..places.len() - more].join("; ");
        if more > 0 { format!("{shown} and {more} more") } else { shown }
    };
    if group.iter().all(|(_, finding)| text(finding) == first) {
        return at(&list(&places), &first);
    }
    format!("{}; likewise {}", at(&places[0], &first), list(&places[1..]))
}

/// Codes, with the rows that they concern.
fn counted(groups: &[&Vec<&Note>]) -> String {
    let each = groups.iter().map(|group| {
        let rows: usize = group.iter().map(|(_, finding)| finding.rows).sum();
        let code = group[0].1.code;
        if rows == 0 { code.to_owned() } else { format!("{code} ({rows} rows)") }
    });
    each.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(code: &'static str, log: &str, rows: usize) -> Finding {
        Finding::of_rotor(code, 1).of(log).rows(rows)
    }

    #[test]
    fn what_was_taken_out_is_one_line_and_the_rest_is_said() {
        let findings = [
            Finding::new("holes", "").of("logs/a.csv").rows(3),
            found("standstill_left_out", "logs/a.csv", 40),
            found("standstill_left_out", "logs/b.csv", 2),
            Finding::new("error_above_floor", "body_rate_rad_s").with("times_floor", 2.5),
        ];
        let notes = of_all(&findings);
        let short = lines(&notes, "Note: ", Detail::Short);
        assert_eq!(
            short,
            "Note: body_rate_rad_s: the error stays at 2.50 times the noise floor\n\
             Note: not used of the logs: holes (3 rows), standstill_left_out (42 rows)\n      (--notes says more)\n"
        );
        let every = lines(&notes, "Note: ", Detail::Every);
        assert_eq!(every.matches("Note: ").count(), 4, "{every}");
        assert!(
            every.starts_with("Note: a.csv: ") && every.contains("Note: b.csv, rotor 1: 2 samples"),
            "{every}"
        );
    }

    #[test]
    fn the_same_of_several_logs_is_said_once() {
        let same =
            ["one/a.csv", "two/a.csv", "c.csv"].map(|log| Finding::new("base_saw_held_out", "").of(log));
        let said = lines(&of_all(&same), "", Detail::Short);
        assert!(said.starts_with("one/a.csv; two/a.csv; c.csv: the model was identified"), "{said}");
        let other = |rows: usize, log: &str| Finding::new("outliers", "command_1").of(log).rows(rows);
        let several: Vec<Finding> = (1..=6).map(|rows| other(rows, &format!("log_{rows}.csv"))).collect();
        let said = lines(&of_all(&several), "", Detail::Short);
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(said.starts_with("log_1.csv: "), "{said}");
        assert!(said.ends_with("; likewise log_2.csv; log_3.csv; log_4.csv and 2 more"), "{said}");
    }

    #[test]
    fn what_is_folded_has_a_sentence_of_its_own() {
        for code in TAKEN_OUT {
            assert_ne!(text(&Finding::new(code, "x")), format!("{code} x"));
        }
    }
}
