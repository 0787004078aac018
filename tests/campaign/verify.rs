//! Does this plant make the development cases? Their commands, its laws, their truth: what is left over has
//! to be their noise.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::catalogue::{ENTRIES, Entry, Kind};
use crate::experiment::{Inputs, SUBSTEP};
use crate::motion::Row;
use crate::plant::{Base, Hidden};

/// The inputs and the measured rows of a development log.
fn read(path: &Path) -> Option<(Inputs, Vec<Row>)> {
    let text = fs::read_to_string(path).ok()?;
    let cells: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').map(|cell| cell.parse().ok()).collect())
        .collect();
    let kind = if text.starts_with("time_s,command_1,command_2") { Kind::Attitude } else { Kind::Actuator };
    let battery_at = if kind == Kind::Attitude { 3 } else { 2 };
    // The reading is rounded and noisy. Under constant load on the attitude bench a mean over 0.4 s is closer
    // to the battery; on the stand the load jumps, and the reading itself is.
    let half = if kind == Kind::Attitude { 20 } else { 0 };
    let voltages = (0..cells.len())
        .map(|k| {
            let window = &cells[k.saturating_sub(half)..(k + half + 1).min(cells.len())];
            let mean = window.iter().map(|row| row[battery_at]).sum::<f64>() / window.len() as f64;
            [mean, mean]
        })
        .collect();
    let commands = cells.iter().map(|c| [c[1], if kind == Kind::Attitude { c[2] } else { c[1] }]).collect();
    let rows = cells
        .iter()
        .map(|c| {
            let (rate, body_rate, angle) = match kind {
                Kind::Actuator => ([c[3]; 2], 0.0, 0.0),
                Kind::Attitude => ([c[4], c[5]], c[6], c[7]),
            };
            Row { rate, body_rate, angle, true_rate: rate, true_body_rate: body_rate }
        })
        .collect();
    Some((Inputs { kind, period: cells[1][0] - cells[0][0], commands, voltages }, rows))
}

/// Rms of what the plant leaves unexplained on one development log: rotor rate 1, and the body's rate over
/// its first 10 s (later a rounded battery reading, integrated, has walked the body away). `None` where the
/// truth is outside the catalogue.
pub fn left_over(folder: &Path, truth: &Value) -> Option<(f64, f64)> {
    let (inputs, measured) = read(&folder.join("train.csv"))?;
    let (mut base, mut hidden) = (Base::PAPER, Hidden::nothing());
    let values = |entry: &Entry| -> Option<Vec<f64>> {
        entry.parameters.iter().map(|(name, _)| truth["parameters"][name].as_f64()).collect()
    };
    match truth["effect"].as_str()? {
        "none" => {}
        "inertia_change" => base.inertia *= truth["parameters"]["ratio"].as_f64()?,
        id => {
            let entry = ENTRIES.iter().find(|entry| entry.id == id)?;
            (entry.hide)(&mut hidden, &values(entry)?);
        }
    }
    let rows = inputs.replay(&base, &hidden, SUBSTEP, None);
    let rms = |count: usize, pick: &dyn Fn(&Row) -> f64| -> f64 {
        let sum: f64 = measured.iter().zip(&rows).take(count).map(|(m, s)| (pick(m) - pick(s)).powi(2)).sum();
        (sum / count.min(rows.len()) as f64).sqrt()
    };
    Some((rms(usize::MAX, &|row| row.rate[0]), rms(1_000, &|row| row.body_rate)))
}
