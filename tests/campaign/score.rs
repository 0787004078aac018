//! Judges an answer against the truth, and tells apart the ways of being right and wrong.

use serde_json::Value;

use crate::answer::{Answer, Identified, set_of};

/// How an answer stands to the truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// The right set, and nothing else; or `adequate`, the right parameter, `unknown`, where that is the truth.
    Named,
    /// Another set, and the right one among at most two alternatives.
    Indistinguishable,
    /// The right effects and others that are not there.
    TooMany,
    /// Of several effects some, and none that is not there.
    Part,
    /// Something is hidden, and the answer sees nothing wrong or cannot tell.
    Missed,
    /// Nothing is hidden, and the answer names something.
    FalseAlarm,
    /// An effect of the catalogue is hidden, and the answer knows nothing that explains it.
    Unknown,
    /// Something else is named.
    Wrong,
    /// No answer that keeps the contract.
    Broken,
}

impl Mark {
    pub fn is_right(self) -> bool {
        matches!(self, Self::Named | Self::Indistinguishable)
    }
}

/// One case judged.
pub struct Judged {
    pub name: String,
    pub bench: String,
    pub truth: String,
    pub said: String,
    pub mark: Mark,
    /// Fitted parameters within 10 % or three standard errors, of those that the truth gives and the answer names.
    pub parameters: (usize, usize),
    /// Stated 95 % intervals that hold the truth, of those of the first effect that the truth gives and the answer names.
    pub intervals: (usize, usize),
    pub parameter_text: String,
    /// Extended validation error over the noise floor.
    pub over_floor: Option<f64>,
    /// Error over noise floor if the effect is left out, the smallest of several; where the truth says.
    pub removal: Option<f64>,
    pub seconds: f64,
    /// Of the effects that the answer names how many are there, and how many it names.
    pub named: (usize, usize),
    /// The same of those that every set has which an answer that is sure of any cannot tell from the one it names.
    pub common: (usize, usize),
    /// The right set is among those listed after the alternatives that may count.
    pub is_further: bool,
    /// The program made the base from the same log.
    pub is_own_base: bool,
}

impl Judged {
    /// What is hidden is named, or nothing that is not there.
    pub fn names_nothing_wrong(&self) -> bool {
        match self.mark {
            Mark::Named | Mark::Indistinguishable | Mark::Part | Mark::Missed => true,
            Mark::Unknown => self.named.0 == self.named.1,
            _ => false,
        }
    }
}

/// What follows the id of an effect beside which a small one is hidden.
pub const BESIDE: &str = " beside a small one";

/// What begins a truth in which nothing is hidden, and what the noise is.
pub const NOTHING_BUT: &str = "nothing but ";

/// Key of a truth whose bench nobody has numbers of; they are there.
pub const OWN_BASE: &str = "own_base";

/// A bend of the curve, what moves the curve as a whole, and the degree of a curve that has the one.
const CUBIC: &str = "static_cubic";
const OFFSET: &str = "static_offset";
const CUBIC_DEGREE: usize = 3;

/// The battery's pull at the rotors, which every bench with an own base has, and its number.
const SAG: &str = "battery_sag";
const SAG_GAIN: &str = "battery_sag.gain";

/// Sets named beside the first that may still count.
const ALTERNATIVES: usize = 2;

pub fn judge(name: &str, truth: &Value, answer: &Answer) -> Judged {
    let effect = truth["effect"].as_str().unwrap_or_default();
    let mut wanted: Vec<String> = match truth["effects"].as_array() {
        Some(_) => set_of(&truth["effects"]),
        None => effect.split('+').map(str::to_owned).collect(),
    };
    wanted.sort();
    let mut judged = Judged {
        name: name.to_owned(),
        bench: truth["bench"].as_str().unwrap_or_default().to_owned(),
        truth: wanted.join(" + "),
        said: String::new(),
        mark: Mark::Broken,
        parameters: (0, 0),
        intervals: (0, 0),
        parameter_text: String::new(),
        over_floor: None,
        removal: truth["removal"]
            .as_object()
            .and_then(|by_effect| by_effect.values().filter_map(Value::as_f64).reduce(f64::min)),
        seconds: answer.seconds,
        named: (0, 0),
        common: (0, 0),
        is_further: false,
        is_own_base: truth[OWN_BASE].is_object(),
    };
    match &answer.json {
        Err(reason) => judged.said = reason.clone(),
        Ok(json) => {
            judged.said = said(json);
            let true_of = |ids: &[String]| (ids.iter().filter(|id| wanted.contains(id)).count(), ids.len());
            judged.named = true_of(&set_of(&json["effects"]));
            if json["verdict"] == "missing_effect" {
                judged.common = true_of(&set_of(&json["common_effects"]));
            }
            let mut further = json["further_alternatives"].as_array().into_iter().flatten();
            judged.is_further = further.any(|set| set_of(set) == wanted);
            let ways = ways(&wanted, answer.identified.as_ref());
            judged.mark = best_mark(effect, &ways, json);
            if answer.identified.as_ref().is_some_and(|model| is_sag_found(model, truth, json)) {
                judged.count_sag(&wanted, &ways, json);
            }
            judged.over_floor = over_floor(json);
            (judged.parameters, judged.parameter_text) = parameters(&wanted, truth, json);
            judged.intervals = intervals(&wanted[0], truth, json);
        }
    }
    judged
}

fn said(json: &Value) -> String {
    let verdict = json["verdict"].as_str().unwrap_or_default();
    let mut text = match verdict {
        "missing_effect" => set_of(&json["effects"]).join(" + "),
        "parameters_changed" => {
            let names = json["changed_parameters"].as_array().into_iter().flatten();
            format!("changed: {}", names.filter_map(|p| p["name"].as_str()).collect::<Vec<_>>().join(", "))
        }
        other => other.to_owned(),
    };
    for other in json["alternatives"].as_array().into_iter().flatten() {
        text.push_str(&format!("; or {}", set_of(other).join(" + ")));
    }
    text
}

/// The sets that say what is hidden beside a model that the program identified from the same log: what is in that model already is
/// found, and a curve of the third degree holds a cubic about any command but for where it begins.
fn ways(wanted: &[String], identified: Option<&Identified>) -> Vec<Vec<String>> {
    let Some(model) = identified else { return vec![wanted.to_vec()] };
    let left: Vec<String> = wanted.iter().filter(|effect| !model.effects.contains(effect)).cloned().collect();
    let others: Vec<String> = left.iter().filter(|effect| *effect != CUBIC).cloned().collect();
    let mut ways = vec![left];
    if model.degree >= CUBIC_DEGREE && others.len() < ways[0].len() {
        let begins_elsewhere = with(others.clone(), OFFSET);
        ways.extend([others, begins_elsewhere]);
    }
    ways
}

fn with(mut set: Vec<String>, id: &str) -> Vec<String> {
    set.push(id.to_owned());
    set.sort();
    set
}

/// Whether the answer names the battery's sag of the bench, which the identified model left out, and within a tenth how large it is.
fn is_sag_found(model: &Identified, truth: &Value, json: &Value) -> bool {
    let found = json["parameters"][SAG_GAIN]["value"].as_f64();
    let hidden = truth[OWN_BASE]["voltage_gain"].as_f64();
    let is_close = found.zip(hidden).is_some_and(|(found, hidden)| (found / hidden - 1.0).abs() <= 0.1);
    !model.has_voltage_gain && is_close && set_of(&json["effects"]).iter().any(|id| id == SAG)
}

impl Judged {
    /// The battery's sag is missing from the model, too, and named: it is as true as what is hidden.
    fn count_sag(&mut self, wanted: &[String], ways: &[Vec<String>], json: &Value) {
        if wanted.iter().any(|id| id == SAG) {
            return;
        }
        let is_common = set_of(&json["common_effects"]).iter().any(|id| id == SAG);
        (self.named.0, self.common.0) = (self.named.0 + 1, self.common.0 + usize::from(is_common));
        if self.mark.is_right() {
            return;
        }
        let hidden = |way: &Vec<String>| with(way.iter().filter(|id| *id != "none").cloned().collect(), SAG);
        let marks: Vec<Mark> = ways.iter().map(|way| mark(SAG, &hidden(way), json)).collect();
        let better =
            marks.iter().find(|mark| mark.is_right()).or(marks.iter().find(|mark| **mark == Mark::Part));
        self.mark = better.copied().unwrap_or(self.mark);
    }
}

/// The mark of the first way that is right, else of the first.
fn best_mark(effect: &str, ways: &[Vec<String>], json: &Value) -> Mark {
    let of = |wanted: &Vec<String>| mark(if wanted.is_empty() { "none" } else { effect }, wanted, json);
    ways.iter().map(of).find(|mark| mark.is_right()).unwrap_or_else(|| of(&ways[0]))
}

fn mark(effect: &str, wanted: &[String], json: &Value) -> Mark {
    let verdict = json["verdict"].as_str().unwrap_or_default();
    let expected = match effect {
        "none" => "adequate",
        nothing if nothing.starts_with(NOTHING_BUT) => "adequate",
        "unknown" => "unknown",
        changed if changed.ends_with("_change") => "parameters_changed",
        _ => "missing_effect",
    };
    match (expected, verdict) {
        ("parameters_changed", "parameters_changed") => changed_parameter(effect, json),
        (e, v) if e == v && e != "missing_effect" => Mark::Named,
        ("missing_effect", "missing_effect") => named_set(wanted, json),
        ("adequate", "insufficient_data") => Mark::Missed,
        ("adequate", _) => Mark::FalseAlarm,
        (_, "adequate" | "insufficient_data") => Mark::Missed,
        (_, "unknown") => Mark::Unknown,
        _ => Mark::Wrong,
    }
}

fn changed_parameter(effect: &str, json: &Value) -> Mark {
    let wanted = effect.trim_end_matches("_change");
    let named: Vec<&str> = json["changed_parameters"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|parameter| parameter["name"].as_str())
        .collect();
    // Without a measured thrust only d c / J is seen, and the inertia is its name.
    let right = |name: &&str| *name == wanted || (wanted == "thrust_coefficient" && *name == "inertia");
    match (named.iter().any(right), named.len()) {
        (true, 1) => Mark::Named,
        (true, _) => Mark::TooMany,
        (false, _) => Mark::Wrong,
    }
}

fn named_set(wanted: &[String], json: &Value) -> Mark {
    let named = set_of(&json["effects"]);
    if named == wanted {
        return Mark::Named;
    }
    let alternatives: Vec<Vec<String>> =
        json["alternatives"].as_array().into_iter().flatten().map(set_of).collect();
    if alternatives.len() <= ALTERNATIVES && alternatives.iter().any(|set| set == wanted) {
        return Mark::Indistinguishable;
    }
    if wanted.iter().all(|effect| named.contains(effect)) {
        return Mark::TooMany;
    }
    if named.iter().all(|effect| wanted.contains(effect)) {
        return Mark::Part;
    }
    Mark::Wrong
}

fn over_floor(json: &Value) -> Option<f64> {
    let floor = json["error"]["noise_floor"].as_f64()?;
    Some(json["error"]["extended"]["validate"].as_f64()? / floor)
}

/// Of the true parameters that the answer gives: how many are close, how many there are; and which are not.
fn parameters(wanted: &[String], truth: &Value, json: &Value) -> ((usize, usize), String) {
    let (mut close, mut given, mut text) = (0, 0, Vec::new());
    for (name, value) in truth["parameters"].as_object().into_iter().flatten() {
        let Some(value) = value.as_f64() else { continue };
        let (fitted, error, value) = if let Some(parameter) = wanted[0].strip_suffix("_change") {
            let changed = json["changed_parameters"].as_array().into_iter().flatten();
            let Some(found) = changed.into_iter().find(|p| p["name"] == parameter) else { continue };
            let (Some(from), Some(to)) = (found["from"].as_f64(), found["to"].as_f64()) else { continue };
            (to, found["standard_error"].as_f64(), value * from)
        } else {
            let key = if name.contains('.') { name.clone() } else { format!("{}.{name}", wanted[0]) };
            let Some(fitted) = json["parameters"][&key]["value"].as_f64() else { continue };
            (fitted, json["parameters"][&key]["standard_error"].as_f64(), value)
        };
        given += 1;
        let off = (fitted - value).abs();
        let error = error.unwrap_or(0.0);
        if off <= 0.1 * value.abs() || off <= 3.0 * error {
            close += 1;
        } else {
            text.push(format!("{name} {fitted:.4} ± {error:.2e}, true {value:.4}"));
        }
    }
    ((close, given), text.join("; "))
}

/// Intervals of 1.96 standard errors about the parameters of effect `id` that hold the truth.
fn intervals(id: &str, truth: &Value, json: &Value) -> (usize, usize) {
    let id = id.trim_end_matches(BESIDE);
    let given = truth["parameters"].as_object().into_iter().flatten().filter_map(|(name, value)| {
        let key = if name.contains('.') { name.clone() } else { format!("{id}.{name}") };
        let found = json["parameters"].get(key.starts_with(&format!("{id}.")).then_some(&key)?)?;
        Some((value.as_f64()?, found["value"].as_f64()?, found["standard_error"].as_f64()?))
    });
    given.fold((0, 0), |(held, of), (truth, value, error)| {
        (held + usize::from((value - truth).abs() <= 1.96 * error), of + 1)
    })
}

/// How many effects a truth names.
pub fn effects(truth: &str) -> usize {
    1 + truth.matches(" + ").count()
}

fn count(cases: &[&Judged], mark: Mark) -> usize {
    cases.iter().filter(|case| case.mark == mark).count()
}

/// A line a case.
pub fn case_table(cases: &[Judged]) -> String {
    let mut out = String::from(
        "| case | bench | hidden | without it, error / floor | answer | mark | parameters close | extended error / floor | s |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for case in cases {
        let ratio = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.3}"));
        let (close, given) = case.parameters;
        let mut parameters = if given == 0 { "-".to_owned() } else { format!("{close} of {given}") };
        if !case.parameter_text.is_empty() {
            parameters.push_str(&format!(" ({})", case.parameter_text));
        }
        out.push_str(&format!(
            "| {} | {} | {} | {} | {} | {:?} | {} | {} | {:.1} |\n",
            case.name,
            case.bench,
            case.truth,
            ratio(case.removal),
            case.said,
            case.mark,
            parameters,
            ratio(case.over_floor),
            case.seconds
        ));
    }
    out
}

/// A line per hidden thing; weak cases, which hardly rise above the noise, in their own column.
pub fn summary_table(cases: &[Judged]) -> String {
    let mut out = String::from(
        "| hidden | bench | cases | named | indistinguishable | too many | part | missed | false alarm | unknown | wrong | broken \
         | weak: right of | parameters close | extended error / floor: median, worst |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let group = |case: &Judged| -> (String, String) {
        let hidden = match effects(&case.truth) {
            1 => case.truth.clone(),
            2 => "two effects".to_owned(),
            _ => "three effects".to_owned(),
        };
        (hidden, case.bench.clone())
    };
    let mut groups: Vec<(String, String)> = Vec::new();
    for case in cases {
        if !groups.contains(&group(case)) {
            groups.push(group(case));
        }
    }
    for key in groups {
        let all: Vec<&Judged> = cases.iter().filter(|case| group(case) == key).collect();
        let (strong, weak): (Vec<&Judged>, Vec<&Judged>) = all.iter().partition(|case| is_strong(case));
        let marks = [
            Mark::Named,
            Mark::Indistinguishable,
            Mark::TooMany,
            Mark::Part,
            Mark::Missed,
            Mark::FalseAlarm,
            Mark::Unknown,
            Mark::Wrong,
            Mark::Broken,
        ];
        let counts: Vec<String> = marks.iter().map(|mark| count(&strong, *mark).to_string()).collect();
        let right = weak.iter().filter(|case| case.mark.is_right()).count();
        let mut ratios: Vec<f64> =
            strong.iter().filter(|c| c.mark.is_right()).filter_map(|c| c.over_floor).collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = match ratios.last() {
            Some(worst) => format!("{:.3}, {worst:.3}", ratios[ratios.len() / 2]),
            None => "-".to_owned(),
        };
        let (close, given) =
            strong.iter().fold((0, 0), |sum, case| (sum.0 + case.parameters.0, sum.1 + case.parameters.1));
        out.push_str(&format!(
            "| {} | {} | {} | {} | {right} of {} | {close} of {given} | {ratio} |\n",
            key.0,
            key.1,
            strong.len(),
            counts.join(" | "),
            weak.len()
        ));
    }
    out
}

/// Removal costs at least 20 % of error over the noise floor; a truth that does not say counts in full.
pub fn is_strong(case: &Judged) -> bool {
    case.removal.is_none_or(|ratio| ratio > 1.2)
}
