//! Asks `discover` for laws outside the catalogue, and about cases in which no law is hidden.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::{Map, Value};

use crate::answer::{self, Answer};
use crate::case::Question;
use crate::catalogue::Kind;
use crate::law_score::{Found, judge, line, tables};
use crate::laws::FAMILIES;
use crate::outside::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE};

/// Strengths of each law.
const STRENGTHS: u64 = 5;

/// Every law at so many strengths, laws without a formula, single effects of the catalogue, and nothing.
pub fn questions(draws: u64) -> Vec<Question> {
    let mut out = Vec::new();
    for _ in 0..draws {
        for strength in 0..STRENGTHS {
            let share = strength as f64 / (STRENGTHS - 1) as f64;
            out.extend(FAMILIES.iter().map(|family| Question::Law(family, share)));
        }
        for (count, kind) in [(OUTSIDE_ACTUATOR, Kind::Actuator), (OUTSIDE_ATTITUDE, Kind::Attitude)] {
            out.extend((0..count).map(|number| Question::Outside(number, kind)));
        }
        out.extend(Question::singles());
        for kind in [Kind::Actuator, Kind::Attitude] {
            out.extend((0..5).map(|_| Question::Nothing(kind)));
        }
    }
    out
}

/// Asks about every case of a folder and prints the score; whether the goals are reached.
pub fn score(
    folder: &Path,
    binary: &Path,
    jobs: usize,
    only: Option<&str>,
    brief: bool,
) -> Result<bool, Box<dyn Error>> {
    let binary = fs::canonicalize(binary).map_err(|error| format!("{}: {error}", binary.display()))?;
    let truths: Map<String, Value> = serde_json::from_str(&fs::read_to_string(folder.join("truth.json"))?)?;
    let law_of = |truth: &Value| {
        let named = truth["parameters"]["law"].as_str().or_else(|| truth["effect"].as_str());
        named.unwrap_or_default().to_owned()
    };
    let asked: Vec<(&String, &Value)> =
        truths.iter().filter(|(_, truth)| only.is_none_or(|only| law_of(truth).contains(only))).collect();
    let all = asked_all(&asked, folder, &binary, jobs)?;
    if !brief {
        println!(
            "| case | hidden | formula | place | form | error / floor | s | answer |\n|---|---|---|---|---|---|---|---|"
        );
        all.iter().for_each(|found| println!("{}", line(found)));
    }
    let (table, reached) = tables(&all);
    println!("{table}");
    Ok(reached)
}

/// The answers about the cases, in their order.
fn asked_all(
    asked: &[(&String, &Value)],
    folder: &Path,
    binary: &Path,
    jobs: usize,
) -> Result<Vec<Found>, Box<dyn Error>> {
    let (next, all) = (AtomicUsize::new(0), Mutex::new(Vec::<(usize, Found)>::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some((number, (name, truth))) = {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    asked.get(at).map(|case| (at, *case))
                } {
                    let own = folder.join(name);
                    let said = answer::ask(binary, &own, "discover")
                        .unwrap_or_else(|error| Answer { json: Err(error.to_string()), seconds: 0.0 });
                    let Ok(found) = judge(name, truth, &own, &said) else { continue };
                    eprintln!("{}", line(&found));
                    if let Ok(mut all) = all.lock() {
                        all.push((number, found));
                    }
                }
            });
        }
    });
    let mut all = all.into_inner().map_err(|_| "a judge gave up")?;
    all.sort_by_key(|(number, _)| *number);
    Ok(all.into_iter().map(|(_, found)| found).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every family leaves a trace on its bench, at its weakest too, unless a finer strength is needed.
    #[test]
    fn every_law_is_hidden_somewhere() {
        for family in FAMILIES {
            let case = Question::Law(family, 1.0).make(3).unwrap_or_else(|| panic!("{}", family.name));
            assert_eq!(case.truth["parameters"]["law"], family.name);
            assert!(case.truth["removal"]["unknown"].as_f64().is_some_and(|it| it > 1.2), "{}", family.name);
        }
    }
}
