//! Answers about the rotors of a machine that has more of them than an attitude bench: one table, what they have in common, and
//! what only some of them have.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::notes::{self, Detail};
use super::story::{effect_card, in_range, wrapped};
use super::verdict::{self, beneath, other_bench};
use super::{Mark, TextTable, json as answer, number};
use crate::diagnose::{Diagnosis, RotorDiagnoses, Verdict};
use crate::estimation::moments::pooled_rms;
use crate::identify::{Identification, RotorModel, Validation};
use crate::screening::Finding;

/// What each rotor is missing, on one screen; `next` has the command that adds it to each rotor's model, in their order, and
/// `whole` the one that tells the whole story of the first; `detail` says how much of the notes is said.
#[must_use]
pub fn diagnoses(found: &RotorDiagnoses, next: &[String], whole: &str, detail: Detail) -> String {
    let other_bench = found.rotors.iter().map(|of| other_bench(&of.diagnosis)).find(|said| !said.is_empty());
    let mut out = wrapped("", &(other_bench.unwrap_or_default().to_owned() + &in_common(found)));
    for id in &found.effects {
        if let Some(first) = found.rotors.first() {
            out += &effect_card(id, &first.diagnosis.model);
        }
    }
    let _ = found.parameters.iter().try_for_each(|(name, range)| {
        writeln!(out, "    {name} = {}", in_range(range.least, range.greatest, &range.unit))
    });
    out.push('\n');
    out += &table(found).text();
    for of in &found.rotors {
        // No sentence of its own says it.
        let common = verdict::common(&of.diagnosis, "").filter(|_| verdict::says_common(&of.diagnosis));
        let said = beneath(&of.diagnosis, "").into_iter().chain(common);
        out += &said.map(|line| wrapped("", &format!("Rotor {}: {line}", of.rotor))).collect::<String>();
    }
    out.push('\n');
    if !next.is_empty() {
        out += "Next, rotor by rotor:\n";
    }
    for command in next {
        let _ = writeln!(out, "  {command}");
    }
    let _ = writeln!(out, "The whole story of a rotor:\n  {whole}");
    let whose = |(finding, rotors): (_, Vec<usize>)| {
        let whose = if rotors.len() == found.rotors.len() || rotors.is_empty() {
            String::new()
        } else {
            format!("rotor {}", rotors.iter().map(usize::to_string).collect::<Vec<_>>().join(", "))
        };
        (whose, finding)
    };
    out + &notes::lines(&said_once(found).into_iter().map(whose).collect::<Vec<_>>(), "Note: ", detail)
}

/// What the rotors have in common, in a sentence.
fn in_common(found: &RotorDiagnoses) -> String {
    let count = found.rotors.len();
    if !found.effects.is_empty() {
        return format!("{count} rotors, each by itself. All of them miss: {}.", found.effects.join(" + "));
    }
    let verdict = found.rotors.first().map(|rotor| rotor.diagnosis.verdict);
    let is_same = found.rotors.iter().all(|rotor| Some(rotor.diagnosis.verdict) == verdict);
    match verdict.filter(|_| is_same) {
        Some(verdict) if verdict != Verdict::MissingEffect => {
            format!("{count} rotors, each by itself. Of all of them: {}.", word(verdict))
        }
        _ => format!("{count} rotors, each by itself. No effect is missing of all of them."),
    }
}

/// A verdict in two words.
fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::MissingEffect => "missing effect",
        Verdict::Adequate => "adequate",
        Verdict::ParametersChanged => "numbers changed",
        Verdict::Unknown => "unknown",
        Verdict::InsufficientData => "cannot tell",
    }
}

fn table(found: &RotorDiagnoses) -> TextTable {
    let unit = found.rotors.first().map_or("", |rotor| rotor.diagnosis.error.unit);
    let headers = ["rotor", "verdict", "effects", "as it is", "refitted", "extended", "floor"];
    let caption = format!("Held-out error, free run between holes [{unit}]");
    let row = |table: TextTable, (rotor, of): (usize, &Diagnosis)| {
        let mark = if of.verdict == Verdict::Adequate { Mark::Good } else { Mark::Plain };
        let effects = if of.effects.is_empty() { "-".to_owned() } else { of.effects.join(" + ") };
        let error = &of.error;
        let errors =
            [error.base.validate, error.refitted.validate, error.extended.validate, error.noise_floor];
        let cells = [rotor.to_string(), word(of.verdict).to_owned(), effects];
        table.marked_row(mark, cells.into_iter().chain(errors.map(|value| number(value, 4))))
    };
    found
        .rotors
        .iter()
        .map(|of| (of.rotor, &of.diagnosis))
        .fold(TextTable::new(headers).caption(caption), row)
}

/// Each finding once, with the rotors that have it.
fn said_once(found: &RotorDiagnoses) -> Vec<(&Finding, Vec<usize>)> {
    let mut said: Vec<(&Finding, Vec<usize>)> = Vec::new();
    for of in &found.rotors {
        for finding in verdict::notes(&of.diagnosis) {
            match said.iter_mut().find(|(other, _)| *other == finding) {
                Some((_, rotors)) => rotors.push(of.rotor),
                None => said.push((finding, vec![of.rotor])),
            }
        }
    }
    // What is said of the body is said of no rotor.
    said.iter_mut().filter(|(finding, _)| finding.subject == "body").for_each(|(_, rotors)| rotors.clear());
    said
}

/// The answer of `--json`: each rotor's as that of a single bench.
///
/// # Errors
///
/// What cannot be written as JSON.
pub fn diagnoses_json(found: &RotorDiagnoses) -> Result<Value, serde_json::Error> {
    let mut value = serde_json::to_value(found)?;
    for (at, of) in found.rotors.iter().enumerate() {
        let mut own = answer::diagnosis(&of.diagnosis)?;
        own["rotor"] = json!(of.rotor);
        value["rotors"][at] = own;
    }
    Ok(value)
}

/// Each rotor identified by itself, below what all of them are together; `None` of an attitude bench.
#[must_use]
pub fn models(found: &Identification) -> Option<TextTable> {
    if found.rotors.is_empty() {
        return None;
    }
    let error = |runs: &[Validation], of: &[Validation]| {
        let shown = if of.is_empty() { runs } else { of };
        number(pooled_rms(shown.iter().map(|run| (run.rms, run.samples))), 4)
    };
    let row = |name: String, actuator: &crate::identify::IdentifiedActuator, error: String| {
        let curve: Vec<String> = actuator.coefficients.iter().map(|value| number(*value, 5)).collect();
        let numbers = [actuator.voltage_gain, actuator.pole, 1e3 * actuator.delay];
        [name, curve.join(", ")].into_iter().chain(numbers.map(|value| number(value, 4))).chain([error])
    };
    let headers =
        ["rotor", "g(u) from u [rad/s]", "k_V [rad/(s V)]", "p [rad/s]", "delay [ms]", "rms [rad/s]"];
    let mut table = TextTable::new(headers).caption("Each rotor by itself, and all as one");
    if found.findings.iter().all(|finding| finding.code != "no_common_model") {
        table = table.row(row("all".to_owned(), &found.actuator, error(&found.training, &found.validation)));
    }
    let own = |table: TextTable, of: &RotorModel| {
        table.row(row(of.rotor.to_string(), &of.actuator, error(&of.training, &of.validation)))
    };
    Some(found.rotors.iter().fold(table, own))
}
