//! Asks `discover` for laws outside the catalogue and holds its formulas against the hidden ones: the place, the form over the range that
//! the logs visit, the error that is left; and what it makes of cases in which no law is hidden.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::{DMatrix, DVector};
use rotorbench::effect::{Expression, Point};
use serde_json::{Map, Value};

use crate::answer;
use crate::case::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE, Question};
use crate::catalogue::Kind;
use crate::laws::{FAMILIES, Family, Numbers, Seen, family};

/// Strengths of each law.
const STRENGTHS: u64 = 5;
/// Held-out error over the noise floor that counts as explained.
const NEAR: f64 = 1.5;
/// Share of the hidden law over the visited range by which a formula may differ from it, rms.
const SAME: f64 = 0.15;
/// One row in so many is looked at.
const ROWS: usize = 7;

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

/// One answer beside the truth.
struct Found {
    name: String,
    truth: String,
    said: String,
    /// Of a law that has a formula.
    is_law: bool,
    is_strong: bool,
    formula: bool,
    site: bool,
    channels: bool,
    form: bool,
    over_floor: Option<f64>,
    seconds: f64,
}

impl Found {
    fn is_near(&self) -> bool {
        self.over_floor.is_some_and(|over| over <= NEAR)
    }
}

/// Columns of a log by name.
struct Log(BTreeMap<String, Vec<f64>>);

impl Log {
    fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let text = fs::read_to_string(path)?;
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for line in lines.step_by(ROWS) {
            for (name, cell) in names.iter().zip(line.split(',')) {
                columns.entry((*name).to_owned()).or_default().push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        Ok(Self(columns))
    }

    fn at(&self, name: &str, row: usize) -> f64 {
        self.0.get(name).and_then(|column| column.get(row)).copied().unwrap_or(0.0)
    }

    fn rows(&self) -> usize {
        self.0.get("time_s").map_or(0, Vec::len)
    }

    /// What the adversary's law sees in a row, with the rate of rotor `rotor`.
    fn seen(&self, row: usize, rotor: usize) -> Seen {
        Seen {
            time: self.at("time_s", row),
            command: self.at("command_1", row),
            voltage: self.at("battery_voltage_v", row),
            rate: self.at(&format!("propeller_rate_{rotor}_rad_s"), row),
            angle: self.at("body_angle_rad", row),
            body_rate: self.at("body_rate_rad_s", row),
        }
    }

    /// What the base's own numbers can take up of a law at `site`: it makes no difference between laws.
    fn taken_up(&self, site: &str, row: usize) -> Vec<f64> {
        let s = self.seen(row, 1);
        let torque = s.rate.powi(2) - self.at("propeller_rate_2_rad_s", row).powi(2);
        match site {
            "steady_rate" | "rotor_rate_sensor" | "rotor_acceleration" => {
                vec![1.0, s.command, s.command * s.command, s.voltage, s.rate]
            }
            "thrust" | "torque" => vec![torque],
            _ => vec![s.body_rate],
        }
    }
}

/// The part of `values` that no combination of `columns` gives.
fn beside(values: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let right = DVector::from_column_slice(values);
    let count = columns.first().map_or(0, Vec::len);
    // Scaled, so that no column's unit decides.
    let size = |at: usize| columns.iter().map(|row| row[at].powi(2)).sum::<f64>().sqrt().max(1e-300);
    let sizes: Vec<f64> = (0..count).map(size).collect();
    let matrix = DMatrix::from_fn(values.len(), count, |row, at| columns[row][at] / sizes[at]);
    let solved = matrix.clone().svd(true, true).solve(&right, 1e-10);
    solved.map_or_else(|_| values.to_vec(), |solution| (right - matrix * solution).iter().copied().collect())
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// What the answer's formula adds in each row; `None` where it is no formula.
fn said_in_rows(answer: &Value, log: &Log, rotor: usize) -> Option<Vec<f64>> {
    let parameters = answer["parameters"].as_object()?;
    let names: Vec<&str> = parameters.keys().map(String::as_str).collect();
    let values: Vec<f64> = parameters.values().filter_map(|it| it["value"].as_f64()).collect();
    let expression = Expression::parse(answer["expression"].as_str()?, &names).ok()?;
    let value = |row: usize| {
        let s = log.seen(row, rotor);
        let rate_of = |rotor: usize| log.at(&format!("propeller_rate_{rotor}_rad_s"), row);
        let point = Point {
            time: s.time,
            command: s.command,
            battery_voltage: s.voltage,
            propeller_rate: s.rate,
            propeller_rate_1: rate_of(1),
            propeller_rate_2: rate_of(2),
            body_angle: s.angle,
            body_rate: s.body_rate,
            ..Point::default()
        };
        expression.value(&values, &point)
    };
    Some((0..log.rows()).map(value).collect())
}

/// Whether the answer's formula is the hidden law over the visited range, what the base can take up apart.
fn is_form(answer: &Value, family: &Family, numbers: &Numbers, log: &Log) -> bool {
    // Both rotors have the thrust's law, and the body sees the difference.
    let rotors: &[(usize, f64)] = if family.site == "thrust" { &[(1, 1.0), (2, -1.0)] } else { &[(1, 1.0)] };
    let (mut truth, mut said) = (vec![0.0; log.rows()], vec![0.0; log.rows()]);
    for (rotor, side) in rotors {
        let Some(own) = said_in_rows(answer, log, *rotor) else { return false };
        for row in 0..log.rows() {
            truth[row] += side * (family.adds)(numbers, &log.seen(row, *rotor));
            said[row] += side * own[row];
        }
    }
    let taken_up: Vec<Vec<f64>> = (0..log.rows()).map(|row| log.taken_up(family.site, row)).collect();
    let difference: Vec<f64> = truth.iter().zip(&said).map(|(truth, said)| truth - said).collect();
    difference.iter().all(|value| value.is_finite())
        && rms(&beside(&difference, &taken_up)) <= SAME * rms(&beside(&truth, &taken_up))
}

fn judge(name: &str, truth: &Value, folder: &Path, answer: &answer::Answer) -> Result<Found, Box<dyn Error>> {
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
    let verdict = json["verdict"].as_str().unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap_or("-").to_owned();
    let list = |value: &Value| -> Vec<String> {
        let mut names: Vec<String> = value.as_array().into_iter().flatten().map(text).collect();
        names.sort();
        names
    };
    let (channels, effects) = (list(&json["channels"]), list(&json["effects"]));
    found.said = format!(
        "{verdict} {} {} [{}] {}",
        text(&json["site"]),
        text(&json["expression"]),
        channels.join(","),
        effects.join("+")
    );
    found.formula = verdict == "law";
    found.over_floor = json["error"]["extended"]["validate"]
        .as_f64()
        .zip(json["error"]["noise_floor"].as_f64())
        .map(|(error, floor)| error / floor);
    let Some(family) = family(law) else { return Ok(found) };
    found.is_law = true;
    let mut wanted: Vec<String> = family.channels.iter().map(|name| (*name).to_owned()).collect();
    wanted.sort();
    found.site = json["site"] == family.site;
    found.channels = channels == wanted;
    let all = truth["parameters"]["numbers"].as_array().into_iter().flatten().filter_map(Value::as_f64);
    let mut numbers: Numbers = [0.0; 4];
    numbers.iter_mut().zip(all).for_each(|(number, value)| *number = value);
    let log = Log::read(&folder.join("train.csv"))?;
    found.form = found.formula && found.site && is_form(json, family, &numbers, &log);
    Ok(found)
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
    let (next, all) = (AtomicUsize::new(0), Mutex::new(Vec::<(usize, Found)>::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some((number, (name, truth))) = {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    asked.get(at).map(|case| (at, *case))
                } {
                    let own = folder.join(name);
                    let said = answer::ask(&binary, &own, "discover").unwrap_or_else(|error| {
                        answer::Answer { json: Err(error.to_string()), seconds: 0.0 }
                    });
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
    let all: Vec<Found> = all.into_iter().map(|(_, found)| found).collect();
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

fn line(found: &Found) -> String {
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
fn tables(all: &[Found]) -> (String, bool) {
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
    least("form right over the visited range ≥ 60 %", &|it| it.form, 0.6);
    let named: Vec<&Found> = laws.iter().filter(|found| found.formula).copied().collect();
    let right = count(&named, &|it| it.form);
    goal("of the formulas named, those that are right", right, named.len(), true);
    let wrong = count(&others, &|it| it.formula);
    let few = wrong as f64 <= 0.02 * others.len() as f64;
    goal("a formula where nothing or a catalogue effect is hidden ≤ 2 %", wrong, others.len(), few);
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
