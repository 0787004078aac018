//! The matrix as Markdown, and its place in docs/evidence/faults.md.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::bench::run_row;
use crate::fault::{Expect, ROWS, Row};
use crate::outcome::Outcome;

/// Control rates, and how many draws of each row are now at each.
pub const RATES: [(u32, u64); 2] = [(50, 20), (1000, 5)];
/// Seed of the table on the page; draw n of a row runs with this plus n.
pub const SEED: u64 = 1;

/// The first lines of a table.
const HEAD: &str = "\
| fault | found by | first sign, periods after | ends | highest command | rotors commanded, periods after |
|---|---|---|---|---|---|
";

/// All runs of a row: per rate, each draw.
pub struct RowRuns {
    pub row: &'static Row,
    pub outcomes: Vec<Vec<Outcome>>,
}

/// Flies every draw of `row`.
pub fn runs(row: &'static Row, seed: u64) -> RowRuns {
    // One draw is enough where each takes two seconds, which the recorder waits for its disk.
    let draws = |draws: u64| if row.kind == crate::fault::Kind::RecorderStuck { 1 } else { draws };
    let outcomes = RATES
        .iter()
        .map(|(rate_hz, most)| (0..draws(*most)).map(|draw| run_row(row, *rate_hz, seed + draw)).collect())
        .collect();
    RowRuns { row, outcomes }
}

/// All rows, on both processors.
pub fn matrix(seed: u64) -> Vec<RowRuns> {
    let (front, back) = ROWS.split_at(ROWS.len() / 2);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| back.iter().map(|row| runs(row, seed)).collect::<Vec<_>>());
        let mut all: Vec<RowRuns> = front.iter().map(|row| runs(row, seed)).collect();
        all.extend(other.join().expect("the other half runs"));
        all
    })
}

pub fn markdown(matrix: &[RowRuns]) -> String {
    let draws: Vec<String> =
        RATES.iter().map(|(rate_hz, draws)| format!("{draws} draws at {rate_hz} Hz")).collect();
    let mut text = format!(
        "Each row: {}, seed {SEED}. Numbers are the worst of all draws, `50 Hz · 1 kHz`.\n\n{HEAD}",
        draws.join(", ")
    );
    for runs in matrix {
        let all = || runs.outcomes.iter().flatten();
        let highest = all().fold(0.0, |most: f64, it| most.max(it.highest));
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {highest:.3} | {} |",
            runs.row.name,
            shares(all().map(found_by)),
            each_rate(runs, |it| it.first.map(|(periods, _)| periods)),
            shares(all().map(ends)),
            each_rate_of_turning(runs),
        );
    }
    text
}

fn found_by(outcome: &Outcome) -> String {
    if let (Some(_), Some((state, cause))) = (outcome.first, outcome.end)
        && !state.is_active()
    {
        return cause.to_string();
    }
    if outcome.limited {
        return "the guard's limits".to_owned();
    }
    if outcome.turning.is_some() {
        return "the ESCs' own timeout".to_owned();
    }
    if outcome.recorder_refused > 0 {
        return "the recorder, which counts".to_owned();
    }
    match outcome.first {
        Some((_, cause)) => cause.to_string(),
        None if outcome.refused.refused().iter().any(|(_, count)| *count > 0) => "counted".to_owned(),
        None => "-".to_owned(),
    }
}

fn ends(outcome: &Outcome) -> String {
    match outcome.end {
        None => "guard dead".to_owned(),
        Some((state, _)) if state.is_active() && outcome.turning.is_none() => "runs on".to_owned(),
        Some((state, _)) => state.to_string(),
    }
}

/// What the draws say, the most frequent first, with its share where they do not agree.
fn shares(words: impl Iterator<Item = String>) -> String {
    let mut counts = BTreeMap::<String, u32>::new();
    let mut total = 0;
    for word in words {
        *counts.entry(word).or_default() += 1;
        total += 1;
    }
    let mut counts: Vec<(String, u32)> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    match counts.as_slice() {
        [(word, _)] => word.clone(),
        _ => counts
            .iter()
            .map(|(word, count)| format!("{word} {count}/{total}"))
            .collect::<Vec<_>>()
            .join(", "),
    }
}

fn each_rate(runs: &RowRuns, of: impl Fn(&Outcome) -> Option<u64>) -> String {
    let worst = |outcomes: &Vec<Outcome>| {
        outcomes.iter().filter_map(&of).max().map_or_else(|| "-".to_owned(), |periods| periods.to_string())
    };
    runs.outcomes.iter().map(worst).collect::<Vec<_>>().join(" · ")
}

fn each_rate_of_turning(runs: &RowRuns) -> String {
    let worst = |outcomes: &Vec<Outcome>| {
        let stopped = outcomes.iter().filter_map(|it| it.turning).max();
        let running = outcomes.iter().filter(|it| it.turning.is_none()).count();
        match (stopped, running) {
            (None, _) => "runs on".to_owned(),
            (Some(periods), 0) => periods.to_string(),
            (Some(periods), _) => format!("{periods} or runs on"),
        }
    };
    let worst: Vec<String> = runs.outcomes.iter().map(worst).collect();
    match runs.row.expect {
        Expect::Beyond => "by the other node".to_owned(),
        _ if worst.iter().all(|it| it == "runs on") => "runs on".to_owned(),
        _ => worst.join(" · "),
    }
}

/// Flies every row `draws` times at each rate; how many runs, and what was broken in them.
pub fn check(seed: u64, draws: u64) -> (u64, Vec<String>) {
    // The recorder's row waits for its disk in every run, and draws nothing of its own.
    let rows: Vec<&Row> = ROWS.iter().filter(|row| row.kind != crate::fault::Kind::RecorderStuck).collect();
    let fly_all = |seeds: std::ops::Range<u64>| -> Vec<String> {
        let mut found = Vec::new();
        for (seed, (row, (rate_hz, _))) in seeds.flat_map(|seed| {
            rows.iter().flat_map(|row| RATES.map(|rate| (row, rate))).map(move |it| (seed, it))
        }) {
            let broken = run_row(row, rate_hz, seed).broken;
            found.extend(
                broken.iter().map(|what| format!("{} at {rate_hz} Hz, seed {seed}: {what}", row.name)),
            );
        }
        found
    };
    let middle = seed + draws / 2;
    let found = std::thread::scope(|scope| {
        let other = scope.spawn(|| fly_all(middle..seed + draws));
        let mut found = fly_all(seed..middle);
        found.extend(other.join().expect("the other half runs"));
        found
    });
    (draws * rows.len() as u64 * RATES.len() as u64, found)
}

/// The page's table: between its two lines, behind the one that says how and when it was measured.
#[cfg(test)]
pub fn in_page(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once("<!-- lockstep: written by tools/faults -->")?;
    let (written, _) = rest.split_once("<!-- end of lockstep -->")?;
    Some(written.trim().split_once("\n\n")?.1)
}
