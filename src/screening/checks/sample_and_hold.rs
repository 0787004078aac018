//! Telemetry slower than the rows: a logger that writes each reading again until the next one comes.
//!
//! A cell equal to the last digit to the one before may be many things: a coarse reading of something that hardly moves,
//! a rotor that stands, a level at which everything has settled. So it is asked how long readings stand *while the signal
//! moves*: by many steps of the reading into a run of equal cells, and by many out of it. Of fresh readings nearly all
//! such runs are one cell long; of held ones they have the length that telemetry and rows give them.

use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{distinct, median_step};
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::thresholds::THRESHOLDS;

/// The code: readings that are written again until the next one comes.
pub const SAMPLE_AND_HOLD: &str = "sample_and_hold";

/// How often readings come.
struct ReadingRate {
    /// Fewest and most rows in which a reading usually stands while the signal moves.
    stands_in: [usize; 2],
    /// [s] from one reading to the next, on average.
    interval: f64,
}

/// Equal cells in a row: their rows, and what they read.
struct Run {
    rows: Vec<usize>,
    value: f64,
}

/// Rows that repeat a reading; `None` where each cell is a reading of its own.
pub(crate) fn check(channel: &CheckedChannel) -> Option<Judgement> {
    if channel.is_battery() {
        return None;
    }
    let (log, values) = (channel.log, channel.left());
    let (interval, segments) = (log.median_interval(), log.segments());
    // Of most logs this is all: no run is made.
    let (cells, equal) = segments.iter().map(|rows| repeated(&values[rows.clone()])).fold((0, 0), add);
    if interval >= THRESHOLDS.hold_too_slow || (equal as f64) < THRESHOLDS.hold_fewest_equal * cells as f64 {
        return None;
    }
    let stretches: Vec<Vec<Run>> =
        segments.into_iter().map(|rows| runs(&values, rows)).filter(|runs| !runs.is_empty()).collect();
    let each = || stretches.iter().flatten();
    let rate = reading_rate(&in_motion(log.time(), &stretches, &Steps::of(&values)))?;
    let rows = each().flat_map(|run| behind(&run.rows, rate.stands_in[1])).collect();
    let finding = channel
        .finding(SAMPLE_AND_HOLD)
        .with("least_rows", rate.stands_in[0])
        .with("most_rows", rate.stands_in[1])
        .with("interval_s", rate.interval)
        .with("log_interval_s", interval);
    Some(Judgement::new(finding, rows))
}

/// How many readings there are, and how many of them equal the one before.
fn repeated(values: &[f64]) -> (usize, usize) {
    let mut last = f64::NAN;
    let known = values.iter().filter(|value| value.is_finite());
    known
        .fold((0, 0), |sum, value| add(sum, (1, usize::from(std::mem::replace(&mut last, *value) == *value))))
}

fn add(one: (usize, usize), other: (usize, usize)) -> (usize, usize) {
    (one.0 + other.0, one.1 + other.1)
}

/// Rows of a run that hold no reading of their own, of a telemetry that has a new one in every `most` rows at least. A run
/// that is longer is a level: there the first of so many is one, as long as the level goes on behind them; of less a reading
/// may have come to be equal by chance, and what its rows hold is old.
fn behind(rows: &[usize], most: usize) -> impl Iterator<Item = usize> + '_ {
    let is_reading =
        move |place: usize| place == 0 || place.is_multiple_of(most) && place + most <= rows.len();
    rows.iter().enumerate().filter(move |(place, _)| !is_reading(*place)).map(|(_, row)| *row)
}

fn runs(values: &[f64], rows: std::ops::Range<usize>) -> Vec<Run> {
    let known: Vec<usize> = finite_rows(values, rows);
    let equal = known.chunk_by(|a, b| values[*a] == values[*b]);
    equal.map(|rows| Run { rows: rows.to_vec(), value: values[rows[0]] }).collect()
}

/// The values that a channel takes, ascending: how fine its reading is.
struct Steps(Vec<f64>);

impl Steps {
    fn of(values: &[f64]) -> Self {
        Self(distinct(values))
    }

    /// From one value to the next, near `value`: the median over some of them, for a period that is counted in ticks shows
    /// a fast rotor's rate more coarsely than a slow one's.
    fn near(&self, value: f64) -> f64 {
        let at = self.0.partition_point(|other| *other < value);
        let near = at.saturating_sub(THRESHOLDS.hold_neighbours)
            ..(at + THRESHOLDS.hold_neighbours + 1).min(self.0.len());
        median_step(self.0[near].iter().copied()).unwrap_or(f64::INFINITY)
    }
}

/// Lengths of the runs into and out of which the signal moves by many steps, in the log's order, with the time [s] until
/// the next.
fn in_motion(time: &[f64], stretches: &[Vec<Run>], steps: &Steps) -> Vec<(usize, f64)> {
    let triples = stretches.iter().flat_map(|runs| runs.windows(3));
    let moving = triples.filter(|three| {
        let (before, here, after) = (three[0].value, three[1].value, three[2].value);
        let far = THRESHOLDS.hold_steps * steps.near(here);
        (here - before).abs() >= far && (after - here).abs() >= far
    });
    moving.map(|three| (three[1].rows.len(), time[three[2].rows[0]] - time[three[1].rows[0]])).collect()
}

/// How often telemetry comes, in rows; `None` where it comes in each, or there is none.
fn reading_rate(runs: &[(usize, f64)]) -> Option<ReadingRate> {
    let lengths: &Vec<usize> = &runs.iter().map(|run| run.0).collect();
    if lengths.len() < THRESHOLDS.hold_fewest_runs {
        return None;
    }
    let longest = lengths.iter().copied().max()?;
    let count = |least: usize| lengths.iter().filter(|length| (least..=least + 1).contains(*length)).count();
    let least = (1..=longest).max_by_key(|least| (count(*least), *least))?;
    let common = |lengths: &[usize]| -> Vec<usize> {
        lengths.iter().copied().filter(|length| (least..=least + 1).contains(length)).collect()
    };
    let held = |lengths: &[usize]| {
        common(lengths).iter().filter(|length| **length > 1).count() as f64 / lengths.len() as f64
    };
    let usual = common(lengths);
    let everywhere = lengths
        .chunks(lengths.len().div_ceil(THRESHOLDS.hold_parts))
        .all(|part| held(part) >= THRESHOLDS.hold_longer_everywhere);
    if (usual.len() as f64) < THRESHOLDS.hold_common * lengths.len() as f64
        || held(lengths) < THRESHOLDS.hold_longer
        || !everywhere
    {
        return None;
    }
    let share = |length: usize| usual.iter().filter(|it| **it == length).count() as f64 / usual.len() as f64;
    let stands_in = match (share(least), share(least + 1)) {
        (short, _) if short >= THRESHOLDS.hold_usual => [least, least],
        (_, long) if long >= THRESHOLDS.hold_usual => [least + 1, least + 1],
        _ => [least, least + 1],
    };
    let spans = runs.iter().filter(|run| (least..=least + 1).contains(&run.0)).map(|run| run.1);
    Some(ReadingRate { stands_in, interval: spans.sum::<f64>() / usual.len() as f64 })
}
