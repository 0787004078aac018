//! Asks `discover` for laws outside the catalogue, and about cases in which no law is hidden.

use std::error::Error;
use std::path::Path;

use serde_json::Value;

use crate::answer::{self, Answer};
use crate::case::Question;
use crate::catalogue::Kind;
use crate::law_score::{judge, line, tables};
use crate::laws::FAMILIES;
use crate::outside::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE, RELAY};

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
        // Behind the others, whose seeds stay as they were.
        for kind in [Kind::Actuator, Kind::Attitude] {
            out.extend((0..STRENGTHS).map(|_| Question::Outside(RELAY, kind)));
        }
    }
    out
}

/// The same on benches of other numbers, in logs as poor as telemetry is, each flaw in turn.
pub fn poor(draws: u64) -> Vec<Question> {
    let wrapped = |(number, question)| Question::OtherBench(Box::new(question), Some(number));
    (0..).zip(questions(draws)).map(wrapped).collect()
}

/// Asks about every case of a folder and prints the score; whether the goals are reached.
pub fn score(
    folder: &Path,
    binary: &Path,
    jobs: usize,
    only: Option<&str>,
    brief: bool,
) -> Result<bool, Box<dyn Error>> {
    let law_of = |truth: &Value| {
        let named = truth["parameters"]["law"].as_str().or_else(|| truth["effect"].as_str());
        named.unwrap_or_default().to_owned()
    };
    let counts = |truth: &Value| only.is_none_or(|only| law_of(truth).contains(only));
    let judge = |name: &str, truth: &Value, answer: &Answer| {
        let found = judge(name, truth, &folder.join(name), answer).ok()?;
        eprintln!("{}", line(&found));
        Some(found)
    };
    let all = answer::ask_all((folder, binary, jobs), "discover", counts, judge)?;
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

#[cfg(test)]
mod tests {
    use rotorbench::model::Model;

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

    /// The model that is asked about has the numbers of the bench, which are not the paper's: its log begins at the rate that it settles at.
    #[test]
    fn on_another_bench_the_model_is_its_own() {
        let drawn = |seed| {
            Question::OtherBench(Box::new(Question::Nothing(Kind::Actuator)), Some(1)).make(seed).unwrap()
        };
        let folder = tempfile::tempdir().unwrap();
        let pole = |seed| {
            let case = drawn(seed);
            case.write(folder.path()).unwrap();
            let rotor = Model::load(&folder.path().join("model.toml")).unwrap().actuator;
            let (inputs, first) = (&case.train.inputs, case.train.rows[0].true_rate[0]);
            let command = inputs.commands[0][0];
            let steady = rotor.steady_rate[1] * command + rotor.steady_rate[2] * command * command
                - rotor.voltage_gain * (rotor.full_voltage - inputs.voltages[0][0]);
            assert!((first - steady).abs() < 10.0, "{first} and {steady} rad/s");
            rotor.pole
        };
        assert!(pole(3) != pole(4));
        let case = drawn(3);
        assert!(case.truth["flaw"].as_str().is_some_and(|flaw| flaw.starts_with("Steps")), "{}", case.truth);
    }
}
