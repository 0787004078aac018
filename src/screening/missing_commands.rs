//! Where a log does not say what the rotor was commanded.
//!
//! A command is held until the next one: that is how a log is read, and its times may be as irregular as they like.
//! But where commands come at a steady interval and one of them is missing, its row or its cell, a change that it
//! carried is seen too late or never. A lag fitted to that looks faster or slower than the rotor is. So the stretch ends
//! where the missing command was due, and a new one, from a state of its own, begins with the next command that is
//! known. Where the command is held for longer than what is missing, and is the same on both sides, nothing was missed.

use super::thresholds::THRESHOLDS;
use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{median, quantile};
use std::ops::Range;

/// What is missing between the commands of a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Missing {
    /// Stretches over which every command is known.
    pub known: Vec<Range<usize>>,
    /// Places at which a stretch had to end.
    pub places: usize,
    /// Commands that are missing there: rows that are not there, and cells that are empty.
    pub rows: usize,
    /// See `rows`.
    pub cells: usize,
    /// [s] at which commands come.
    pub interval: f64,
}

/// A command and the next one that is known.
struct Pair {
    rows: (usize, usize),
    /// Commands missing between them.
    missing: usize,
    is_same: bool,
}

/// Commands that come at an interval, two by two: of a long log they are looked at, and not laid out.
struct Pairs<'a> {
    time: &'a [f64],
    command: &'a [f64],
    /// [s]
    interval: f64,
}

impl Pairs<'_> {
    /// Of these rows, which have a command.
    fn of(&self, rows: &[usize]) -> impl Iterator<Item = Pair> {
        let Self { time, command, interval } = self;
        rows.windows(2).map(move |pair| {
            let gap = (time[pair[1]] - time[pair[0]]) / interval;
            let missing = if gap > THRESHOLDS.command_late { gap.round() as usize - 1 } else { 0 };
            let is_same = (command[pair[1]] - command[pair[0]]).abs() <= THRESHOLDS.command_same;
            Pair { rows: (pair[0], pair[1]), missing, is_same }
        })
    }
}

/// Cuts `stretches` (which hold no hole, and begin with a command) where a command is missing. `command` has
/// not-a-number in empty cells.
pub(crate) fn find(time: &[f64], command: &[f64], stretches: &[Range<usize>]) -> Missing {
    let uncut = Missing { known: stretches.to_vec(), ..Missing::default() };
    let of = |stretch: &Range<usize>| finite_rows(command, stretch.clone());
    let given: Vec<Vec<usize>> = stretches.iter().map(of).collect();
    let mut gaps = Vec::with_capacity(given.iter().map(Vec::len).sum());
    gaps.extend(given.iter().flat_map(|rows| rows.windows(2).map(|pair| time[pair[1]] - time[pair[0]])));
    let Some(interval) = steady_interval(&gaps) else { return uncut };
    let pairs = Pairs { time, command, interval };
    let change = |pair: &Pair| (command[pair.rows.1] - command[pair.rows.0]).abs();
    let jumps =
        given.iter().flat_map(|rows| pairs.of(rows)).any(|pair| change(&pair) > THRESHOLDS.command_jump);
    if !jumps || says_only_changes(&pairs, &given, stretches) {
        return uncut;
    }
    let held = shortest_hold(&pairs, &given);
    let mut missing = Missing { interval, ..Missing::default() };
    for (stretch, rows) in stretches.iter().zip(&given) {
        missing.cut(
            time,
            stretch,
            rows,
            pairs.of(rows).filter(|it| it.missing > 0 && !(it.is_same && held > it.missing)),
        );
    }
    missing
}

impl Missing {
    fn cut(
        &mut self,
        time: &[f64],
        stretch: &Range<usize>,
        given: &[usize],
        pairs: impl Iterator<Item = Pair>,
    ) {
        // Rows behind a command are still its own until the next one is due.
        let until_due = |row: usize, end: usize| {
            (row..end)
                .take_while(|&at| time[at] - time[row] <= THRESHOLDS.command_due * self.interval)
                .last()
                .unwrap_or(row)
                + 1
        };
        let mut start = stretch.start;
        let mut known = Vec::new();
        for pair in pairs {
            let (before, after) = pair.rows;
            known.push(start..until_due(before, after));
            start = after;
            let empty = (after - before - 1).min(pair.missing);
            (self.places, self.cells) = (self.places + 1, self.cells + empty);
            self.rows += pair.missing - empty;
        }
        let last = given.last().copied().unwrap_or(start);
        let end = until_due(last, stretch.end);
        if end < stretch.end {
            (self.places, self.cells) = (self.places + 1, self.cells + stretch.end - end);
        }
        known.push(start..end);
        self.known.append(&mut known);
    }
}

/// [s] the interval at which commands come; `None` where they come at none. Stamps in whole milliseconds are all multiples of one:
/// most commands must come after the interval itself.
fn steady_interval(gaps: &[f64]) -> Option<f64> {
    if gaps.len() < THRESHOLDS.command_fewest {
        return None;
    }
    let quartile = quantile(gaps.iter().copied(), THRESHOLDS.command_quantile)?;
    let interval = median(
        gaps.iter()
            .copied()
            .filter(|gap| (THRESHOLDS.command_early..THRESHOLDS.command_late).contains(&(gap / quartile))),
    )?;
    let near = |gap: &&f64| {
        let times = *gap / interval;
        times > 0.5 && (times - times.round()).abs() <= THRESHOLDS.command_near
    };
    let count = gaps.len() as f64;
    let itself = gaps.iter().filter(|gap| (**gap / interval).round() == 1.0).count() as f64;
    (gaps.iter().filter(near).count() as f64 >= THRESHOLDS.command_steady * count
        && itself >= THRESHOLDS.command_itself * count)
        .then_some(interval)
}

/// Whether cells are empty because a log says a command only when it changes: then every command differs from the one
/// before, and most do not follow at once.
fn says_only_changes(pairs: &Pairs, given: &[Vec<usize>], stretches: &[Range<usize>]) -> bool {
    let command = pairs.command;
    let empty = stretches.iter().flat_map(Clone::clone).any(|row| !command[row].is_finite());
    let all = || given.iter().flat_map(|rows| pairs.of(rows));
    let differ = all().filter(|pair| command[pair.rows.0] != command[pair.rows.1]).count();
    let at_once = all().filter(|pair| pair.missing == 0).count();
    let count = all().count() as f64;
    empty
        && differ as f64 > THRESHOLDS.command_differs * count
        && (at_once as f64) < THRESHOLDS.command_at_once * count
}

/// Intervals for which a command is held at least, as far as it shows; the greatest number where it never changes twice.
fn shortest_hold(pairs: &Pairs, given: &[Vec<usize>]) -> usize {
    let mut shortest = usize::MAX;
    for rows in given {
        // `None` until a change was seen with nothing missing since.
        let mut held = None;
        for pair in pairs.of(rows) {
            held = match (pair.missing, pair.is_same) {
                (0, true) => held.map(|held| held + 1),
                (0, false) => {
                    shortest = held.map_or(shortest, |held| shortest.min(held));
                    Some(1)
                }
                _ => None,
            };
        }
    }
    shortest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 rows, 20 ms apart, and what `command` says at each.
    fn grid(command: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
        (0..400).map(|row| (row as f64 * 0.02, command(row))).unzip()
    }

    fn without(rows: &[usize], log: &(Vec<f64>, Vec<f64>)) -> (Vec<f64>, Vec<f64>) {
        let kept = (0..log.0.len()).filter(|row| !rows.contains(row));
        kept.map(|row| (log.0[row], log.1[row])).unzip()
    }

    fn found((time, command): &(Vec<f64>, Vec<f64>)) -> Missing {
        find(time, command, std::slice::from_ref(&(0..time.len())))
    }

    /// Two levels, each for `slots` rows at the least.
    fn binary(slots: usize) -> impl Fn(usize) -> f64 {
        move |row| if (row / slots).wrapping_mul(2_654_435_761) >> 7 & 1 == 1 { 0.5 } else { 0.4 }
    }

    #[test]
    fn a_missing_row_ends_a_stretch_unless_nothing_can_have_happened() {
        let fast = grid(binary(1));
        assert_eq!(found(&fast).known, vec![0..400], "nothing is missing");
        let missing = found(&without(&[100, 200, 201], &fast));
        assert_eq!(missing.known, [0..100, 100..199, 199..397]);
        assert_eq!((missing.places, missing.rows, missing.cells), (2, 3, 0));
        // Held for five rows at least: a row that is missing within a level hides nothing, one at a change does.
        let slow = grid(binary(5));
        let change = (100..300).find(|&row| slow.1[row] != slow.1[row - 1] && row % 5 == 0).unwrap();
        assert_eq!(found(&without(&[change + 2], &slow)).known, vec![0..399]);
        assert_eq!(found(&without(&[change], &slow)).known, [0..change, change..399]);
        // A ramp has no jumps, and constant levels neither.
        assert_eq!(found(&without(&[50, 51], &grid(|row| 0.3 + 0.001 * row as f64))).places, 0);
    }

    #[test]
    fn an_empty_cell_ends_a_stretch_behind_the_row_in_which_it_stands() {
        let mut log = grid(binary(1));
        log.1[100] = f64::NAN;
        // What is measured in row 100 still answers to the command of row 99.
        let missing = found(&log);
        assert_eq!(missing.known, [0..101, 101..400]);
        assert_eq!((missing.places, missing.rows, missing.cells), (1, 0, 1));
        // Commands that end before the log does.
        log.1[100] = 0.5;
        log.1[380..].fill(f64::NAN);
        let missing = found(&log);
        assert_eq!((missing.known.last(), missing.places, missing.cells), (Some(&(0..381)), 1, 19));
    }

    #[test]
    fn commands_that_come_more_seldom_than_rows_or_only_when_they_change_are_held() {
        let seldom = grid(|row| if row % 4 == 0 { binary(4)(row) } else { f64::NAN });
        assert_eq!(found(&seldom).known, vec![0..400]);
        // One of them is missing, with the three rows behind it.
        let mut lost = seldom.clone();
        lost.1[200] = f64::NAN;
        assert_eq!(found(&lost).known, [0..201, 204..400]);
        let whole = grid(binary(1));
        let mut changes = whole.clone();
        (1..400).filter(|&row| whole.1[row] == whole.1[row - 1]).for_each(|row| changes.1[row] = f64::NAN);
        assert_eq!(found(&changes).known, vec![0..400]);
    }

    /// A logger that writes two rows at a time, stamped in whole milliseconds: all gaps are multiples of the shortest.
    #[test]
    fn rows_in_pairs_are_no_missing_rows() {
        let (mut time, command) = grid(binary(1));
        for (row, time) in time.iter_mut().enumerate() {
            *time = 0.001 * (17 * (row / 2) + row % 2 + (row / 7) % 3) as f64;
        }
        assert_eq!(found(&(time, command)).known, vec![0..400]);
    }

    #[test]
    fn irregular_times_are_no_missing_rows() {
        let (mut time, command) = grid(binary(1));
        // From half an interval to one and a half, as a hash has it.
        let share = |row: usize| (row.wrapping_mul(2_654_435_761) >> 9 & 1023) as f64 / 1023.0;
        let mut now = 0.0;
        for (row, time) in time.iter_mut().enumerate() {
            now += 0.02 * (0.5 + share(row));
            *time = now;
        }
        assert_eq!(found(&(time, command)).known, vec![0..400]);
    }
}
