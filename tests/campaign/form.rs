//! Whether a formula is the hidden law: by what both add over the range that a log visits, and not by how it is written.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;

use nalgebra::{DMatrix, DVector};
use rotorbench::effect::{Expression, Point};
use serde_json::Value;

use crate::laws::{Family, Numbers, Seen};

/// Share of the hidden law over the visited range by which a formula may differ from it, rms.
pub const SAME: f64 = 0.15;
/// One row in so many is looked at.
const ROWS: usize = 7;

/// Columns of a log by name.
pub struct Log(BTreeMap<String, Vec<f64>>);

impl Log {
    pub fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        Self::read_every(path, ROWS)
    }

    /// One row in so many.
    pub fn read_every(path: &Path, rows: usize) -> Result<Self, Box<dyn Error>> {
        let text = fs::read_to_string(path)?;
        let mut lines = text.lines();
        let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        for line in lines.step_by(rows) {
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
pub fn is_form(answer: &Value, family: &Family, numbers: &Numbers, log: &Log) -> bool {
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

/// Share of the rows in which a relay's level may be the other one: noise of the angle, and thresholds between two commands.
const OTHER_LEVEL: f64 = 0.05;

/// Whether the answer's formula is a relay over `column` that adds what the hidden one adds: half the distance of the levels, the
/// middle of its places, and half of what lies between these.
pub fn is_relay(answer: &Value, numbers: &[f64], log: &Log, column: &str) -> bool {
    let number = |name: &str| answer["parameters"][name]["value"].as_f64();
    let said = (number("k"), number("b"), number("a"));
    let (&[size, middle, half], (Some(k), Some(b), Some(a))) = (numbers, said) else { return false };
    if answer["forms"] != serde_json::json!(["relay"]) {
        return false;
    }
    let [hidden, found] = [(middle, half), (b, a.abs())].map(|(middle, half)| {
        let mut level = (log.at(column, 0) - middle).signum();
        let rows = (0..log.rows()).map(|row| {
            let beyond = log.at(column, row) - middle;
            level = if beyond.abs() > half { beyond.signum() } else { level };
            level
        });
        rows.collect::<Vec<f64>>()
    });
    let others = hidden.iter().zip(&found).filter(|(hidden, found)| hidden != found).count();
    (k / size - 1.0).abs() <= SAME && others as f64 <= OTHER_LEVEL * log.rows() as f64
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::laws::family;

    /// A swing of 0.4 rad.
    fn log() -> Log {
        let time: Vec<f64> = (0..900).map(|row| 0.01 * f64::from(row)).collect();
        let columns = [
            ("body_angle_rad", time.iter().map(|t| 0.4 * (3.0 * t).sin()).collect()),
            ("propeller_rate_1_rad_s", time.iter().map(|t| 617.0 + 30.0 * (7.0 * t).sin()).collect()),
            ("propeller_rate_2_rad_s", time.iter().map(|t| 617.0 - 20.0 * (5.0 * t).sin()).collect()),
            ("time_s", time),
        ];
        Log(columns.into_iter().map(|(name, values)| (name.to_owned(), values)).collect())
    }

    fn answer(expression: &str, parameters: &[(&str, f64)]) -> Value {
        let numbers = parameters.iter().map(|(name, value)| ((*name).to_owned(), json!({"value": value})));
        json!({"expression": expression, "parameters": Value::Object(numbers.collect())})
    }

    #[test]
    fn a_formula_is_right_by_what_it_adds_and_not_by_how_it_is_written() {
        let stops = family("end stops").unwrap();
        let numbers = [5.0, 0.3, 0.0, 0.0];
        let is_right = |said: Value| is_form(&said, stops, &numbers, &log());
        let written = "k*signum(body_angle)*max(abs(body_angle)-a,0)";
        assert!(is_right(answer(written, &[("a", 0.3), ("k", -5.0)])));
        let ramps = "k*max(body_angle-a,0)-k*max(-body_angle-a,0)";
        assert!(is_right(answer(ramps, &[("a", 0.301), ("k", -5.1)])));
        assert!(!is_right(answer(written, &[("a", 0.3), ("k", -4.0)])), "a fifth too weak");
        assert!(!is_right(answer("k*body_angle", &[("k", -0.4)])));
        assert!(!is_right(answer("k*body_angle^", &[("k", -0.4)])), "no formula");
        // What the inertia takes up makes no difference.
        let torque =
            "k*signum(body_angle)*max(abs(body_angle)-a,0)+q*(propeller_rate_1^2-propeller_rate_2^2)";
        assert!(is_right(answer(torque, &[("a", 0.3), ("k", -5.0), ("q", 1e-6)])));
    }

    #[test]
    fn a_relay_is_right_by_its_levels_and_where_they_change() {
        let hidden = [0.05, 0.02, 0.1];
        let is_right = |k: f64, b: f64, a: f64| {
            let mut said = answer("k*relay(body_angle-b,a)", &[("k", k), ("b", b), ("a", a)]);
            said["forms"] = json!(["relay"]);
            is_relay(&said, &hidden, &log(), "body_angle_rad")
        };
        assert!(is_right(0.05, 0.02, 0.1) && is_right(0.052, 0.021, -0.101));
        assert!(!is_right(0.04, 0.02, 0.1), "a fifth too weak");
        assert!(!is_right(0.05, 0.02, 0.2), "it changes later");
        assert!(!is_relay(&answer("k", &[("k", 0.05)]), &hidden, &log(), "body_angle_rad"), "no relay");
    }
}
