//! Judges the answers of `discover` beside the hidden laws, and keeps their score.

use std::error::Error;
use std::path::Path;

use serde_json::Value;

use crate::answer::Answer;
use crate::form::{Log, SAME, is_form, is_relay};
use crate::laws::{Family, Numbers, family};

/// The law with a memory that has a formula.
const BACKLASH: &str = "backlash";
/// Relays by name, with the site and channel of each.
const RELAYS: [(&str, &str, &str); 2] = [
    ("relay over the command", "steady_rate", "command"),
    ("relay over the angle", "torque", "body_angle_rad"),
];
/// Held-out error over the noise floor that counts as explained.
const NEAR: f64 = 1.5;

/// One answer beside the truth.
pub struct Found {
    pub name: String,
    truth: String,
    said: String,
    /// Of a law that has a formula.
    is_law: bool,
    is_strong: bool,
    formula: bool,
    site: bool,
    channels: bool,
    /// Site and channels are those of the answer or of one of its alternatives.
    set: bool,
    form: bool,
    over_floor: Option<f64>,
    seconds: f64,
}

impl Found {
    fn is_near(&self) -> bool {
        self.over_floor.is_some_and(|over| over <= NEAR)
    }

    /// What the answer says.
    fn read(&mut self, json: &Value) {
        let verdict = json["verdict"].as_str().unwrap_or_default();
        let (channels, effects) = (list(&json["channels"]), list(&json["effects"]));
        self.said = format!(
            "{verdict} {} {} [{}] {}",
            text(&json["site"]),
            text(&json["expression"]),
            channels.join(","),
            effects.join("+")
        );
        self.formula = verdict == "law";
        self.over_floor = json["error"]["extended"]["validate"]
            .as_f64()
            .zip(json["error"]["noise_floor"].as_f64())
            .map(|(error, floor)| error / floor);
    }

    /// Whether it is the place of the hidden law, or one that it says it cannot tell from it.
    fn place(&mut self, json: &Value, site: &str, channels: &[String]) {
        self.site = json["site"] == site;
        self.channels = list(&json["channels"]) == channels;
        let others = json["alternatives"].as_array();
        let is_there = |other: &Value| other["site"] == site && list(&other["channels"]) == channels;
        self.set = self.site && self.channels || others.into_iter().flatten().any(is_there);
    }

    /// How it stands to a hidden play: that has a formula of its own, with a memory.
    fn beside_play(&mut self, json: &Value, numbers: &Value) {
        self.is_law = true;
        self.place(json, "command", &["command".to_owned()]);
        let number = |name: &str| json["parameters"][name]["value"].as_f64().unwrap_or(f64::NAN);
        let near = |value: f64, truth: f64| (value / truth - 1.0).abs() < SAME;
        let is_play = list(&json["forms"]) == ["play"];
        let width = numbers[0].as_f64().unwrap_or(f64::NAN);
        self.form = self.formula && is_play && near(number("a"), width) && near(number("k"), 1.0);
    }

    /// How it stands to a hidden relay: both levels, and the level in nearly every row.
    fn beside_relay(&mut self, json: &Value, numbers: &Value, folder: &Path) -> Result<(), Box<dyn Error>> {
        self.is_law = true;
        let (site, channel) =
            RELAYS.iter().find(|(name, ..)| *name == self.truth).map_or(("", ""), |it| (it.1, it.2));
        self.place(json, site, &[channel.to_owned()]);
        let own: Vec<f64> = numbers.as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        let log = Log::read_every(&folder.join("train.csv"), 1)?;
        let column = if site == "torque" { channel } else { "command_1" };
        self.form = self.formula && self.site && is_relay(json, &own, &log, column);
        Ok(())
    }

    /// How it stands to the hidden law.
    fn beside(
        &mut self,
        family: &Family,
        json: &Value,
        numbers: &Value,
        folder: &Path,
    ) -> Result<(), Box<dyn Error>> {
        self.is_law = true;
        let mut wanted: Vec<String> = family.channels.iter().map(|name| (*name).to_owned()).collect();
        wanted.sort();
        self.place(json, family.site, &wanted);
        let all = numbers.as_array().into_iter().flatten().filter_map(Value::as_f64);
        let mut own: Numbers = [0.0; 4];
        own.iter_mut().zip(all).for_each(|(number, value)| *number = value);
        let log = Log::read(&folder.join("train.csv"))?;
        self.form = self.formula && self.site && is_form(json, family, &own, &log);
        Ok(())
    }
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or("-").to_owned()
}

/// Names in one order.
fn list(value: &Value) -> Vec<String> {
    let mut names: Vec<String> = value.as_array().into_iter().flatten().map(text).collect();
    names.sort();
    names
}

pub fn judge(name: &str, truth: &Value, folder: &Path, answer: &Answer) -> Result<Found, Box<dyn Error>> {
    let effect = truth["effect"].as_str().unwrap_or_default();
    let law = truth["parameters"]["law"].as_str().unwrap_or(effect);
    let removal = truth["removal"].as_object().into_iter().flatten().filter_map(|(_, value)| value.as_f64());
    let mut found = Found {
        name: name.to_owned(),
        truth: law.to_owned(),
        said: String::new(),
        is_law: false,
        is_strong: removal.reduce(f64::min).is_none_or(|ratio| ratio > 1.2),
        formula: false,
        site: false,
        channels: false,
        set: false,
        form: false,
        over_floor: None,
        seconds: answer.seconds,
    };
    let json = match &answer.json {
        Ok(json) => json,
        Err(reason) => {
            found.said = reason.clone();
            return Ok(found);
        }
    };
    found.read(json);
    if law == BACKLASH {
        found.beside_play(json, &truth["parameters"]["numbers"]);
    }
    if RELAYS.iter().any(|(name, ..)| *name == law) {
        found.beside_relay(json, &truth["parameters"]["numbers"], folder)?;
    }
    let Some(family) = family(law) else { return Ok(found) };
    found.beside(family, json, &truth["parameters"]["numbers"], folder)?;
    Ok(found)
}

pub fn line(found: &Found) -> String {
    let mark = |yes: bool| if yes { "yes" } else { "no" };
    let weak = if found.is_strong { "" } else { " (weak)" };
    format!(
        "| {} | {}{weak} | {} | {} | {} | {} | {:.1} | {} |",
        found.name,
        found.truth,
        mark(found.formula),
        mark(found.site && found.channels),
        mark(found.form),
        found.over_floor.map_or("-".to_owned(), |over| format!("{over:.3}")),
        found.seconds,
        found.said
    )
}

/// A line for each law, and the goals.
pub fn tables(all: &[Found]) -> (String, bool) {
    let mut out = String::from(
        "| hidden | cases | formula | site and channels | form | error ≤ 1.5 floor | longest [s] |\n|---|---|---|---|---|---|---|\n",
    );
    let count = |cases: &[&Found], of: &dyn Fn(&Found) -> bool| cases.iter().filter(|case| of(case)).count();
    let strong: Vec<&Found> = all.iter().filter(|found| found.is_strong).collect();
    let mut names: Vec<&str> = Vec::new();
    for found in &strong {
        let name = if found.is_law { found.truth.as_str() } else { kind_of(&found.truth) };
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        let is_of =
            |found: &&&Found| if found.is_law { found.truth == name } else { kind_of(&found.truth) == name };
        let own: Vec<&Found> = strong.iter().filter(is_of).copied().collect();
        let longest = own.iter().map(|found| found.seconds).fold(0.0, f64::max);
        out.push_str(&format!(
            "| {name} | {} | {} | {} | {} | {} | {longest:.0} |\n",
            own.len(),
            count(&own, &|it| it.formula),
            count(&own, &|it| it.site && it.channels),
            count(&own, &|it| it.form),
            count(&own, &Found::is_near),
        ));
    }
    out.push_str("\n| goal | reached | of | |\n|---|---|---|---|\n");
    let mut is_reached = true;
    let mut goal = |name: &str, right: usize, of: usize, is_good: bool| {
        if of > 0 {
            is_reached &= is_good;
            let verdict = if is_good { "yes" } else { "**no**" };
            let share = 100.0 * right as f64 / of as f64;
            out.push_str(&format!("| {name} | {share:.0} % | {of} | {verdict} |\n"));
        }
    };
    let laws: Vec<&Found> = strong.iter().filter(|found| found.is_law).copied().collect();
    let others: Vec<&Found> =
        all.iter().filter(|found| !found.is_law && kind_of(&found.truth) != UNTOLD).collect();
    let mut least = |name: &str, of: &dyn Fn(&Found) -> bool, share: f64| {
        let right = count(&laws, of);
        goal(name, right, laws.len(), right as f64 >= share * laws.len() as f64);
    };
    least("held-out error within 1.5 of the floor ≥ 70 %", &Found::is_near, 0.7);
    least("site and channels right ≥ 85 %", &|it| it.site && it.channels, 0.85);
    least("site and channels right, or among the alternatives ≥ 85 %", &|it| it.set, 0.85);
    least("form right over the visited range ≥ 60 %", &|it| it.form, 0.6);
    let named: Vec<&Found> = laws.iter().filter(|found| found.formula).copied().collect();
    let right = count(&named, &|it| it.form);
    goal("of the formulas named, those that are right", right, named.len(), true);
    let wrong = count(&others, &|it| it.formula);
    let few = wrong as f64 <= 0.02 * others.len() as f64;
    goal("a formula where nothing or a catalogue effect is hidden ≤ 2 %", wrong, others.len(), few);
    // Some of these the library comes near to: hysteresis to a spring that remembers.
    let untold: Vec<&Found> =
        all.iter().filter(|found| !found.is_law && kind_of(&found.truth) == UNTOLD).collect();
    goal(
        "laws of chance or with another memory: a formula named",
        count(&untold, &|it| it.formula),
        untold.len(),
        true,
    );
    (out, is_reached)
}

/// What is hidden where no formula of ours is: memory, chance and time, of which no function of the channels is the truth.
const UNTOLD: &str = "laws with memory, or of chance";

fn kind_of(truth: &str) -> &'static str {
    let is_effect = crate::catalogue::ENTRIES.iter().any(|entry| entry.id == truth);
    match truth {
        "none" => "nothing",
        _ if is_effect => "one effect of the catalogue",
        _ => UNTOLD,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_formula_where_none_is_hidden_counts_against_the_program() {
        let case = |truth: &str, formula: bool| Found {
            name: String::new(),
            truth: truth.to_owned(),
            said: String::new(),
            is_law: family(truth).is_some(),
            is_strong: true,
            formula,
            site: formula,
            channels: formula,
            set: formula,
            form: formula,
            over_floor: Some(1.0),
            seconds: 1.0,
        };
        assert!(tables(&[case("teeth", true), case("none", false), case("gusts", true)]).1);
        assert!(!tables(&[case("teeth", true), case("none", true)]).1);
        assert!(!tables(&[case("teeth", true), case("gyro_bias", true)]).1);
        assert!(!tables(&[case("teeth", false), case("none", false)]).1);
    }
}
