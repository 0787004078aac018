//! Long logs: what is missing is searched for on a few long stretches in which most moves. The final fit, the errors and the standard
//! errors are of all rows, and a finding says which rows the search saw.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::thresholds::THRESHOLDS;
use crate::log::Dataset;
use crate::screening::{Finding, ScreenedLog};
use crate::signal::columns;

/// The stretches that a search goes over.
pub(crate) struct Stretches {
    /// Of the logs fitted on.
    pub train: Vec<ScreenedLog>,
    /// Of the held-out logs.
    pub validate: Vec<ScreenedLog>,
    /// One finding for each log of which a part is seen.
    pub findings: Vec<Finding>,
}

impl Stretches {
    /// Those of long logs; `None` where a search on all rows takes no time worth speaking of: up to twice `rows`.
    pub fn of(train: &[ScreenedLog], validate: &[ScreenedLog], rows: usize) -> Option<Self> {
        let is_long = [train, validate].into_iter().any(|logs| count(logs) > 2 * rows);
        if !is_long {
            return None;
        }
        let mut findings = Vec::new();
        let mut cut = |logs: &[ScreenedLog]| -> Vec<ScreenedLog> {
            let all = count(logs);
            let wanted = rows.max(all / THRESHOLDS.searched_share).min(THRESHOLDS.most_searched_rows);
            if all <= 2 * rows {
                return logs.to_vec();
            }
            logs.iter()
                .map(|log| {
                    let own = wanted * log.raw().len() / all;
                    let stretches = most_moved(log, own / THRESHOLDS.searched_stretches);
                    let part = log.of_rows(&stretches);
                    findings.push(finding(log, &stretches, part.raw().len()));
                    part
                })
                .collect()
        };
        let (train, validate) = (cut(train), cut(validate));
        Some(Self { train, validate, findings })
    }
}

fn count(logs: &[ScreenedLog]) -> usize {
    logs.iter().map(|log| log.raw().len()).sum()
}

fn finding(log: &ScreenedLog, stretches: &[Range<usize>], rows: usize) -> Finding {
    let time = log.raw().time();
    let at = |row: fn(&Range<usize>) -> usize| -> Vec<f64> {
        stretches.iter().filter_map(|stretch| time.get(row(stretch)).copied()).collect()
    };
    let found = Finding::new("searched_on_stretches", "").of(log.source_name()).rows(rows);
    let found = found.with("rows_searched", rows).with("rows_fitted", log.raw().len());
    found.with("from_s", at(|stretch| stretch.start)).with("to_s", at(|stretch| stretch.end - 1))
}

/// In each part of a log, the parts as many as there are stretches, the `length` rows in which most moves: what changes over a log
/// has its chance in each.
fn most_moved(log: &ScreenedLog, length: usize) -> Vec<Range<usize>> {
    let all = log.raw().len();
    let length = length.max(2).min(all);
    let parts = THRESHOLDS.searched_stretches;
    let windows_of = |part: usize| -> Vec<Range<usize>> {
        let part = part * all / parts..(part + 1) * all / parts;
        let length = length.min(part.len());
        let step = (length / THRESHOLDS.stretch_steps).max(1);
        (part.start..=part.end - length).step_by(step).map(|start| start..start + length).collect()
    };
    let windows: Vec<Vec<Range<usize>>> = (0..parts).map(windows_of).collect();
    let motion = Motion::of(log, windows.iter().flatten());
    let best_of = |windows: &Vec<Range<usize>>| {
        let moved = windows.iter().map(|window| (motion.over(window), window));
        // The first of those in which as much moves.
        let best = moved.reduce(|best, other| if other.0 > best.0 { other } else { best });
        best.map(|(_, window)| window.clone())
    };
    let mut stretches: Vec<Range<usize>> = windows.iter().filter_map(best_of).collect();
    // Two that touch are one.
    stretches.dedup_by(|next, before| {
        let touches = before.end == next.start;
        if touches {
            before.end = next.end;
        }
        touches
    });
    stretches
}

/// How much moves in some windows: of what excites the model, over its variance.
struct Motion(Vec<Sums>);

/// Counts, sums and sums of squares up to the rows at which windows begin and end, and of all.
struct Sums {
    up_to: BTreeMap<usize, [f64; 3]>,
    all: [f64; 3],
}

impl Motion {
    fn of<'a>(log: &ScreenedLog, windows: impl Iterator<Item = &'a Range<usize>>) -> Self {
        let ends: BTreeSet<usize> = windows.flat_map(|window| [window.start, window.end]).collect();
        let scored = log.rotors().map(|rotor| {
            let command = &rotor.data().command;
            let rows = command.iter().enumerate();
            Sums::of(&ends, rows.map(|(row, value)| if rotor.is_scored(row) { *value } else { f64::NAN }))
        });
        let data: &Dataset = log.dataset();
        let of_body =
            [columns::TORQUE_COMMAND, columns::BODY_RATE].into_iter().filter_map(|name| data.column(name));
        Self(scored.chain(of_body.map(|values| Sums::of(&ends, values.iter().copied()))).collect())
    }

    fn over(&self, rows: &Range<usize>) -> f64 {
        self.0.iter().map(|sums| sums.over(rows)).sum()
    }
}

impl Sums {
    fn of(ends: &BTreeSet<usize>, values: impl Iterator<Item = f64>) -> Self {
        let mut up_to = BTreeMap::new();
        let mut sum = [0.0; 3];
        let mut ends = ends.iter().copied().peekable();
        for (row, value) in values.enumerate() {
            up_to.extend(ends.next_if_eq(&row).map(|row| (row, sum)));
            if value.is_finite() {
                sum = [sum[0] + 1.0, sum[1] + value, sum[2] + value * value];
            }
        }
        up_to.extend(ends.map(|row| (row, sum)));
        Self { up_to, all: sum }
    }

    /// Sum of squares about the mean of these rows, over the variance of all.
    fn over(&self, rows: &Range<usize>) -> f64 {
        let about_mean = |from: [f64; 3], to: [f64; 3]| {
            let [count, sum, squares] = [0, 1, 2].map(|at| to[at] - from[at]);
            if count > 0.0 { (squares - sum * sum / count).max(0.0) } else { 0.0 }
        };
        let (Some(first), Some(last)) = (self.up_to.get(&rows.start), self.up_to.get(&rows.end)) else {
            return 0.0;
        };
        let all = about_mean([0.0; 3], self.all);
        let own = about_mean(*first, *last);
        if all > 0.0 { own * self.all[0] / all } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of 1000 rows that moves in rows 600 to 800 most, and in its first half in rows 100 to 200.
    #[test]
    fn the_search_sees_where_most_moves_in_each_part_of_a_log() {
        let time: Vec<f64> = (0..1000).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("a.csv", "", time).expect("time rises");
        let moved = |row: i32| match row {
            100..200 => 0.05,
            600..800 => 0.1,
            _ => 0.01,
        };
        let command: Vec<f64> = (0..1000).map(|row| 0.5 + moved(row) * f64::from(row / 5 % 2)).collect();
        let rates = command.iter().map(|command| 1200.0 * command).collect();
        log.insert("command_1", command).expect("fits");
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
        let logs = [ScreenedLog::from(log)];
        assert!(Stretches::of(&logs, &[], 500).is_none(), "short enough for all of it");
        let found = Stretches::of(&logs, &[], 300).expect("long");
        let said = &found.findings[0];
        assert_eq!((said.count("rows_searched"), said.count("rows_fitted")), (300, 1000), "{said}");
        let (from, to) = (said.numbers("from_s"), said.numbers("to_s"));
        assert!(from[0] <= 1.0 && to[0] >= 1.95, "{said}");
        assert!(from[1] >= 5.95 && to[1] <= 8.0, "{said}");
        assert_eq!(found.train[0].raw().len(), 300);
        assert_eq!(found.train[0].raw().holes().len(), 1, "what lies between is a hole");
    }
}
