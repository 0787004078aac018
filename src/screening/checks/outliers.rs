//! Single readings that are no measurement: a frame with a flipped bit, half or double the speed, a spike of a gyro.
//!
//! Rotors and bodies have a memory: a true peak leaves a decay behind it, and a step leaves a new level. So an
//! outlier is a reading that lies far from all that its neighbours predict of it: from the lines between those to both
//! sides, and from the lines on through those before it and through those behind it; or from their middle, by more than
//! they are from each other. What is far is learnt from the
//! channel itself. Where commands move, what a command can do to this rotor is learnt, too.

use super::saturated::SATURATED;
use crate::estimation::finite::finite_rows;
use std::borrow::Cow;

use crate::estimation::quantile::{MEDIAN_OF_NORMAL, extremes, median, quantile, quantiles};
use crate::log::dataset::Dataset;
use crate::log::segments::held_throughout;
use crate::screening::channel::{CheckedChannel, Judgement};
use crate::screening::thresholds::THRESHOLDS;
use crate::threads::spread;

/// Readings to each side that predict one.
const SIDE: usize = THRESHOLDS.outlier_side;

/// The code: single readings far from what their neighbours predict.
pub const OUTLIERS: &str = "outliers";
/// The code: the same, too many for single glitches; they stay.
pub const TOO_MANY_OUTLIERS: &str = "too_many_outliers";

/// The outliers among what earlier checks left of a channel.
pub(crate) fn check(judged: &CheckedChannel) -> Option<Judgement> {
    // Beside an end of the range neighbours predict what cannot be read.
    if judged.is_battery() || judged.has(SATURATED) {
        return None;
    }
    let values = judged.left();
    let rows = find(judged.log, &values, judged.command);
    let first = *rows.first()?;
    let of = values.iter().filter(|value| value.is_finite()).count();
    let too_many = rows.len() as f64 > THRESHOLDS.outlier_too_many * of as f64;
    let finding = judged
        .finding(if too_many { TOO_MANY_OUTLIERS } else { OUTLIERS })
        .with("readings", of)
        .with("first_s", judged.log.time()[first])
        .with("first", values[first]);
    if too_many {
        return Some(Judgement { finding: finding.rows(rows.len()), rows: Vec::new(), biased: Vec::new() });
    }
    Some(Judgement::new(finding, rows))
}

/// The rows of the outliers among those of `values` that are finite. `command` is what moves what is measured, where that is
/// a rotor and is known.
fn find(log: &Dataset, values: &[f64], command: Option<&[f64]>) -> Vec<usize> {
    let mut left = Cow::Borrowed(values);
    let mut rows = Vec::new();
    for _ in 0..THRESHOLDS.outlier_passes {
        // What is left may be too little to look through again; what was found is.
        let Some(channel) = Neighbourhood::of(log, &left, command) else { break };
        let mut found = channel.outliers();
        drop(channel);
        if found.is_empty() {
            break;
        }
        found.iter().for_each(|row| left.to_mut()[*row] = f64::NAN);
        rows.append(&mut found);
    }
    rows.sort_unstable();
    rows
}

/// A reading with its neighbours.
struct Seen {
    row: usize,
    /// From what is predicted of it, in the channel's unit.
    distance: f64,
    /// How far the channel usually goes from one of the neighbours to the next.
    goes: f64,
    /// Rows of the first and of the last neighbour.
    reach: (usize, usize),
    /// From the middle of its neighbours, and the range of those, the most extreme one left out.
    beside: (f64, f64),
    /// Range of it and all of its neighbours, and the largest step from one of them to the next.
    moves: (f64, f64),
}

/// A channel, and what is usual in it.
struct Neighbourhood<'a> {
    log: &'a Dataset,
    values: &'a [f64],
    command: Option<&'a [f64]>,
    /// Rows with readings between two holes.
    stretches: Vec<Vec<usize>>,
    /// Of each reading that has all its neighbours, in their order, from what is predicted of it. What else is seen beside a
    /// reading is asked of few, and looked at again.
    distances: Vec<f64>,
    /// [s] between readings.
    interval: f64,
    /// Distance from what is predicted that is far.
    far: f64,
    /// Least distance of an outlier, in the channel's unit.
    least: f64,
    /// Size of the noise.
    noise: f64,
    /// Middle of the channel.
    level: f64,
}

impl<'a> Neighbourhood<'a> {
    fn of(log: &'a Dataset, values: &'a [f64], command: Option<&'a [f64]>) -> Option<Self> {
        let time = log.time();
        let stretches: Vec<Vec<usize>> =
            log.segments().into_iter().map(|rows| finite_rows(values, rows)).collect();
        let pairs = || stretches.iter().flat_map(|rows| rows.windows(2));
        let interval = median(pairs().map(|pair| time[pair[1]] - time[pair[0]]))?;
        let step = pairs().map(|pair| (values[pair[1]] - values[pair[0]]).abs()).filter(|step| *step > 0.0);
        let step = step.fold(f64::INFINITY, f64::min);
        let distances = distances(time, values, &stretches);
        if distances.len() < THRESHOLDS.outlier_fewest || !step.is_finite() {
            return None;
        }
        let (low, high) = THRESHOLDS.outlier_range;
        let all = stretches.iter().flatten().map(|row| values[*row]);
        let [low, level, high] = quantiles(all, [low, 0.5, high])?;
        let range = high - low;
        let [usual, times] =
            [0, 1].map(|part| THRESHOLDS.outlier_usual.map(|it| if part == 0 { it.0 } else { it.1 }));
        let usual = quantiles(distances.iter().copied(), usual).into_iter().flatten();
        let bends = stretches.iter().flat_map(|rows| rows.windows(3)).map(|three| {
            let [before, here, after] = [0, 1, 2].map(|at| values[three[at]]);
            (before - 2.0 * here + after).abs()
        });
        Some(Self {
            far: usual.zip(times).map(|(usual, times)| times * usual).sum(),
            least: (THRESHOLDS.outlier_of_range * range)
                .max(THRESHOLDS.outlier_of_level * level.abs())
                .max(THRESHOLDS.outlier_steps * step),
            // The median of the size of a normal variable, and the size of a second difference.
            noise: median(bends)? / (MEDIAN_OF_NORMAL * f64::sqrt(6.0)),
            log,
            values,
            command,
            distances,
            interval,
            level,
            stretches,
        })
    }

    /// What is seen beside each reading that has all its neighbours, and is farther than `least` from what is predicted.
    fn farther(&self, least: f64) -> impl Iterator<Item = Seen> + '_ {
        let windows = self.stretches.iter().flat_map(|rows| rows.windows(2 * SIDE + 1));
        let far = windows.zip(&self.distances).filter(move |(_, distance)| **distance > least);
        far.map(|(rows, _)| seen(self.log.time(), self.values, rows))
    }

    fn outliers(&self) -> Vec<usize> {
        let far = |seen: &Seen| seen.distance > self.far + self.least + seen.goes;
        let far: Vec<Seen> = self.farther(self.far + self.least).filter(far).collect();
        if far.is_empty() {
            return Vec::new();
        }
        let outliers: Vec<Seen> = match self.command {
            Some(command) => {
                let moves = Moves::of(self, command);
                far.into_iter().filter(|seen| !moves.explain(self, seen)).collect()
            }
            None => {
                let alone = |seen: &Seen| {
                    let (beside, range) = seen.beside;
                    seen.distance > self.far + self.least + THRESHOLDS.outlier_goes * seen.goes
                        && beside
                            > THRESHOLDS.outlier_beside_range * range
                                + THRESHOLDS.outlier_beside_noise * self.noise
                };
                far.into_iter()
                    .filter(|_| self.interval <= THRESHOLDS.outlier_too_slow)
                    .filter(alone)
                    .collect()
            }
        };
        outliers.into_iter().map(|seen| seen.row).collect()
    }
}

/// What the commands of a rotor do to what is measured of it.
struct Moves {
    /// [-] each command held until the next.
    command: Vec<f64>,
    /// Distance from what is predicted, for each unit of the command's range around a reading, that is the most it does;
    /// `None` where commands hardly ever moved, or the rotor goes all of the way from one reading to the next.
    most: Option<f64>,
    /// Change of the channel for a unit of the command that is more than any.
    steepest: f64,
}

impl Moves {
    fn of(channel: &Neighbourhood, command: &[f64]) -> Self {
        let command = held_throughout(command);
        let middle = median(command.iter().copied()).unwrap_or(0.0);
        let steepest = THRESHOLDS.outlier_steepest * channel.level.abs()
            / middle.abs().max(THRESHOLDS.outlier_least_command);
        let mut moves = Self { command, most: None, steepest };
        // Of those that answer to a command: the distance for each unit of it, and of large moves how much comes at once.
        let (mut for_each_unit, mut at_once) = (Vec::new(), Vec::new());
        for seen in channel.farther(f64::NEG_INFINITY) {
            let commanded = moves.around(channel, &seen);
            if commanded > 0.0 {
                for_each_unit.push(seen.distance / commanded);
                let (range, step) = seen.moves;
                at_once.extend((range > channel.far + channel.least).then(|| step / range));
            }
        }
        let is_fast = median(at_once).is_none_or(|all| all > THRESHOLDS.outlier_at_once);
        let enough = for_each_unit.len() >= THRESHOLDS.outlier_commands && !is_fast;
        let usual = quantile(for_each_unit, THRESHOLDS.outlier_commands_usual);
        moves.most = usual.filter(|_| enough).map(|usual| THRESHOLDS.outlier_commands_most * usual);
        moves
    }

    /// [-] range of the commands that a reading and its neighbours may answer to.
    fn around(&self, channel: &Neighbourhood, seen: &Seen) -> f64 {
        let time = channel.log.time();
        let since = time[seen.reach.0] - THRESHOLDS.outlier_answers;
        let first = time.partition_point(|time| *time < since);
        let answered = &self.command[first..=seen.reach.1];
        let (low, high) = extremes(answered.iter().copied());
        high - low
    }

    /// Whether the commands can have done it: it is no more than they usually do, or they hardly moved before, and could.
    fn explain(&self, channel: &Neighbourhood, seen: &Seen) -> bool {
        let range = self.around(channel, seen);
        let usual = self.most.map_or(f64::INFINITY, |most| most * range);
        let possible = self.steepest * range;
        range > 0.0 && seen.distance <= usual + channel.least && seen.beside.0 <= possible + channel.least
    }
}

/// Of each reading that has all its neighbours, how far it is from what they predict.
fn distances(time: &[f64], values: &[f64], stretches: &[Vec<usize>]) -> Vec<f64> {
    /// Windows of a piece of work: some milliseconds.
    const PIECE: usize = 1 << 16;
    let pieces: Vec<&[usize]> = stretches
        .iter()
        .flat_map(|rows| {
            let windows = rows.len().saturating_sub(2 * SIDE);
            (0..windows).step_by(PIECE).map(move |from| &rows[from..(from + PIECE).min(windows) + 2 * SIDE])
        })
        .collect();
    let of_piece = |rows: &&[usize]| -> Vec<f64> {
        rows.windows(2 * SIDE + 1).map(|rows| beside(time, values, rows).0).collect()
    };
    spread(&pieces, of_piece).concat()
}

/// How far the middle one of `rows` is from what the others predict; from their middle, and the range of those, the most extreme
/// one left out.
fn beside(time: &[f64], values: &[f64], rows: &[usize]) -> (f64, (f64, f64)) {
    let row = rows[SIDE];
    let line = |from: usize, to: usize| {
        let (from, to) = (rows[from], rows[to]);
        let share = (time[row] - time[from]) / (time[to] - time[from]);
        values[from] + share * (values[to] - values[from])
    };
    let [near, next] = [(SIDE - 1, SIDE + 1), (SIDE - 2, SIDE + 2)];
    let predicted = [line(near.0, near.1), line(next.0, next.1), line(next.0, near.0), line(near.1, next.1)];
    let nearest = predicted.iter().map(|value| (values[row] - value).abs()).fold(f64::INFINITY, f64::min);
    // In place: this is asked of every reading.
    let mut others: [f64; 2 * SIDE] = std::array::from_fn(|at| values[rows[at + usize::from(at >= SIDE)]]);
    others.sort_unstable_by(f64::total_cmp);
    // The most extreme one is at one of the ends.
    let low_end = others[SIDE] - others[0] > others[2 * SIDE - 1] - others[SIDE - 1];
    let kept = if low_end { &others[1..] } else { &others[..2 * SIDE - 1] };
    let beside = ((values[row] - kept[kept.len() / 2]).abs(), kept[kept.len() - 1] - kept[0]);
    // Beside another outlier the lines through that lead to nowhere, and its neighbours' middle still says something.
    (nearest.max(beside.0 - beside.1), beside)
}

/// The middle one of `rows` beside the others.
fn seen(time: &[f64], values: &[f64], rows: &[usize]) -> Seen {
    let (distance, beside) = beside(time, values, rows);
    let step = |from: usize, to: usize| (values[rows[to]] - values[rows[from]]).abs();
    let steps: [f64; 2 * SIDE - 1] = std::array::from_fn(|at| match at + 1 {
        before if before < SIDE => step(at, at + 1),
        SIDE => 0.5 * step(SIDE - 1, SIDE + 1),
        _ => step(at + 1, at + 2),
    });
    let goes = sorted(steps)[SIDE - 1];
    let all = rows.iter().map(|row| values[*row]);
    let (low, high) = extremes(all);
    let largest = (0..2 * SIDE).map(|at| step(at, at + 1)).fold(0.0, f64::max);
    Seen {
        row: rows[SIDE],
        distance,
        goes,
        reach: (rows[0], rows[2 * SIDE]),
        beside,
        moves: (high - low, largest),
    }
}

fn sorted<const N: usize>(mut values: [f64; N]) -> [f64; N] {
    values.sort_by(f64::total_cmp);
    values
}
