//! The rotor block: free runs of each rotor over the stretches between holes.

use std::ops::Range;
use std::sync::Arc;

use super::thresholds::THRESHOLDS;
use crate::estimation::measured_rows::MeasuredRows;
use crate::log::Cells;
use crate::model::{Equations, LagPath, Remembered, RotorInput, RotorStart, RotorTrace};
use crate::screening::ScreenedLog;
use crate::screening::rotor_data::is_one_delay;
use crate::signal::{columns, side};

/// One rotor over one stretch of one log.
#[derive(Debug, Clone)]
pub struct RotorRun {
    /// Index of the log.
    pub log: usize,
    /// Index of the rotor.
    pub rotor: usize,
    /// Its samples in the log.
    pub rows: Range<usize>,
    /// [s]
    pub time: Cells,
    /// [-] missing cells held.
    pub command: Cells,
    /// [s] from when on each was in force; `None` = from its sample on.
    pub command_from: Option<Cells>,
    /// [s] standard deviation of what is known of a dead time from when commands step.
    pub delay_unknown: f64,
    /// [s] dead time that the log's own rates say, beside the instants of its steps.
    pub delay_found: f64,
    /// [V] missing cells held; `None` when the log has none.
    pub voltage: Option<Cells>,
    /// [rad/s] not-a-number where missing.
    pub measured: Cells,
    /// Whether the sample counts.
    pub counts: Vec<bool>,
    /// Its first sample of which the rate is free in a fit: what comes before, behind a hole, does not count, and is not run through.
    pub begins: usize,
    /// [rad/s] between which that rate may be: a fit would else make up for anything by one that no rotor has, where nothing counts.
    pub begins_within: (f64, f64),
}

impl RotorRun {
    /// The inputs of a free run.
    #[must_use]
    pub fn input(&self) -> RotorInput<'_> {
        RotorInput {
            time: &self.time,
            command: &self.command,
            command_from: self.command_from.as_deref(),
            voltage: self.voltage.as_deref(),
            side: side(self.rotor),
        }
    }

    /// [s] how long after the given run this one begins; `None` where it does not go on with it.
    #[must_use]
    pub fn goes_on_after(&self, before: &Self) -> Option<f64> {
        let same = self.log == before.log && self.rotor == before.rotor;
        let hole = self.time.first()? - before.time.last()?;
        (same && hole > 0.0).then_some(hole)
    }

    /// `count` of its samples from `from` on.
    pub(crate) fn cut(&self, from: usize, count: usize) -> Self {
        let part = |values: &Cells| values.part(from..from + count);
        let (time, counts) = (part(&self.time), self.counts[from..from + count].to_vec());
        Self {
            log: self.log,
            rotor: self.rotor,
            rows: self.rows.start + from..self.rows.start + from + count,
            command: part(&self.command),
            command_from: self.command_from.as_ref().map(part),
            delay_unknown: self.delay_unknown,
            delay_found: self.delay_found,
            voltage: self.voltage.as_ref().map(part),
            measured: part(&self.measured),
            begins: first_that_counts(&time, &counts, &self.measured[from..from + count]),
            time,
            counts,
            begins_within: self.begins_within,
        }
    }

    /// One sample in `share`, in one piece that begins with a reading at the end of a level held for as long as most are, the one nearest the
    /// middle; in the middle itself where none is near. A piece that begins while the rotor still moves hides a slew limit.
    pub(crate) fn near_middle(&self, share: usize) -> Self {
        let all = self.time.len();
        let keep = (all / share).max(2).min(all);
        let (last, middle) = (all - keep, (all - keep) / 2);
        let mut levels: Vec<Range<usize>> = Vec::new();
        for level in self.command.chunk_by(|one, next| one == next) {
            let from = levels.last().map_or(0, |before| before.end);
            levels.push(from..from + level.len());
        }
        let mut lengths: Vec<usize> = levels.iter().map(Range::len).collect();
        lengths.sort_unstable();
        let long_enough = lengths.get(lengths.len() / 2).copied().unwrap_or(0).max(2);
        let is_read = |row: &usize| self.counts[*row] && self.measured[*row].is_finite();
        let of_level = |level: &Range<usize>| level.clone().rev().find(is_read);
        let ends = levels.iter().filter(|level| level.len() >= long_enough).filter_map(of_level);
        let begin = ends.filter(|end| *end <= last).min_by_key(|end| end.abs_diff(middle));
        self.cut(begin.filter(|end| end.abs_diff(middle) <= keep).unwrap_or(middle), keep)
    }

    /// Of each level the first part, in which the rotor goes there, and of the readings behind that one in so many; `rows` are still those
    /// between which they are.
    pub(crate) fn with_levels_thinned(&self) -> Self {
        let mut keep = Vec::new();
        let mut from = 0;
        for level in self.command.chunk_by(|one, next| one == next) {
            let rows = from..from + level.len();
            let on_its_way = from + (level.len() / THRESHOLDS.way_to_level).max(1);
            from = rows.end;
            keep.extend(rows.start..on_its_way);
            let readings = (on_its_way..rows.end).filter(|row| self.measured[*row].is_finite());
            keep.extend(readings.step_by(THRESHOLDS.thinned_level));
        }
        let kept = |values: &Cells| -> Cells { keep.iter().map(|row| values[*row]).collect() };
        let (time, measured) = (kept(&self.time), kept(&self.measured));
        let counts: Vec<bool> = keep.iter().map(|row| self.counts[*row]).collect();
        Self {
            rows: self.rows.clone(),
            command: kept(&self.command),
            command_from: self.command_from.as_ref().map(kept),
            voltage: self.voltage.as_ref().map(kept),
            begins: first_that_counts(&time, &counts, &measured),
            time,
            measured,
            counts,
            ..*self
        }
    }

    /// How often its command changes.
    pub(crate) fn steps(&self) -> usize {
        self.command.windows(2).filter(|pair| pair[0] != pair[1]).count()
    }

    /// Has its steps come when this dead time [s] of all logs says so, where the log's own is as near to it as one can know.
    pub(crate) fn take_delay(&mut self, common: f64) {
        let later = self.delay_found - common;
        let Some(from) = self.command_from.as_ref().filter(|_| later != 0.0) else { return };
        if is_one_delay(self.delay_found, common, self.delay_unknown) {
            self.command_from = Some(from.iter().map(|at| at + later).collect());
            self.delay_found = common;
        }
    }

    /// [rad/s] by how much the rate where it begins may differ from the first one measured there.
    pub(crate) fn departures(&self) -> (f64, f64) {
        let (lowest, highest) = self.begins_within;
        let first = self.first_rate().unwrap_or(0.0);
        (lowest - first, highest - first)
    }

    /// [rad/s] the first measured rate from where it begins.
    fn first_rate(&self) -> Option<f64> {
        self.measured.iter().skip(self.begins).copied().find(|rate| rate.is_finite())
    }
}

/// The runs of every rotor whose command and rate the logs hold: free runs go on across a hole where the command is known.
#[must_use]
pub fn rotor_runs(logs: &[ScreenedLog]) -> Vec<RotorRun> {
    let mut runs = Vec::new();
    for (log, screened) in logs.iter().enumerate() {
        for judged in screened.rotors() {
            let rotor = judged.number() - 1;
            let rates = columns::propeller_rate(judged.number());
            let Some(rates) = screened.dataset().cells(&rates) else { continue };
            let data = judged.data();
            for rows in judged.runs().iter().cloned() {
                let time = data.time.part(rows.clone());
                let counts: Vec<bool> = rows.clone().map(|row| judged.is_scored(row)).collect();
                runs.push(RotorRun {
                    log,
                    rotor,
                    voltage: judged.voltage().map(|voltage| voltage.part(rows.clone())),
                    command: data.command.part(rows.clone()),
                    command_from: data.command_from.as_ref().map(|from| from.part(rows.clone())),
                    delay_unknown: data.delay_unknown,
                    delay_found: data.delay_found,
                    begins: first_that_counts(&time, &counts, &rates[rows.clone()]),
                    begins_within: plausible_rates(&rates[rows.clone()]),
                    time,
                    counts,
                    measured: rates.part(rows.clone()),
                    rows,
                });
            }
        }
    }
    runs
}

/// The first sample that counts and was measured, where it comes soon; else the first one: the rotor may have stood until then.
fn first_that_counts(time: &[f64], counts: &[bool], measured: &[f64]) -> usize {
    let first = counts.iter().zip(measured).position(|(counts, rate)| *counts && rate.is_finite());
    let soon = |first: &usize| time[*first] - time[0] <= THRESHOLDS.longest_uncounted_start_s;
    first.filter(soon).unwrap_or(0)
}

/// [rad/s] between which a rotor's rate may be where its run begins: at rest, or twice the greatest measured.
fn plausible_rates(measured: &[f64]) -> (f64, f64) {
    let finite = measured.iter().copied().filter(|rate| rate.is_finite());
    finite.fold((0.0, 0.0), |(lowest, highest), rate| ((2.0 * rate).min(lowest), (2.0 * rate).max(highest)))
}

/// The rows of the residuals of these runs in which a rate was measured.
pub(crate) fn measured_rows(runs: &[RotorRun], units: &[Range<usize>]) -> Option<Arc<MeasuredRows>> {
    MeasuredRows::of(runs.iter().flat_map(|run| run.measured.iter().map(|rate| rate.is_finite())), units)
}

/// Whether the commands are levels held for long.
#[must_use]
pub(crate) fn hold_levels(runs: &[RotorRun]) -> bool {
    let all: usize = runs.iter().map(|run| run.time.len()).sum();
    let changes = |run: &RotorRun| run.command.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let levels: usize = runs.iter().map(|run| changes(run) + 1).sum();
    levels * THRESHOLDS.held_samples <= all && levels >= THRESHOLDS.fewest_levels
}

/// To which stretch each sample of the runs belongs, counted on over all of them: where commands are held for long, a
/// stretch goes from one change to the next, so that a validation level is a level unseen; else `stretches` of one length.
#[must_use]
pub(crate) fn fold_stretches(runs: &[RotorRun], stretches: usize) -> Vec<usize> {
    if !hold_levels(runs) {
        let all: usize = runs.iter().map(|run| run.time.len()).sum();
        return (0..all).map(|index| index * stretches / all.max(1)).collect();
    }
    let mut stretch = 0;
    let mut all = Vec::new();
    for run in runs {
        for row in 0..run.command.len() {
            stretch += usize::from(row == 0 || run.command[row] != run.command[row - 1]);
            all.push(stretch);
        }
    }
    all
}

/// Simulates one run from its local start: departures of the rate and of slow states.
pub fn simulate(
    equations: &Equations,
    run: &RotorRun,
    before: Option<Remembered>,
    locals: &[f64],
    trace: &mut RotorTrace,
) {
    equations.simulate_rotor(&run.input(), &start(run, before, locals), trace);
}

fn start(run: &RotorRun, before: Option<Remembered>, locals: &[f64]) -> RotorStart {
    let departure = locals.first().copied().unwrap_or(0.0);
    RotorStart {
        rate: run.first_rate().map(|rate| rate + departure),
        rate_holds_until: run.time.get(run.begins).copied().filter(|_| run.begins > 0),
        slow: locals.get(1).copied().unwrap_or(0.0),
        before,
        is_first: run.rows.start == 0,
    }
}

/// The path of one run; `None` where its rotor is more than a first-order lag.
pub(crate) fn lag_path(equations: &Equations, run: &RotorRun) -> Option<LagPath> {
    equations.lag_path(&run.input(), &start(run, None, &[]))
}

/// Simulates one run the same way, along its path where that is known, and writes its residuals over their standard deviation; what the
/// next one remembers of it.
pub(crate) fn residuals(
    equations: &Equations,
    (run, path): (&RotorRun, Option<&LagPath>),
    before: Option<Remembered>,
    (locals, sigma): (&[f64], f64),
    out: &mut [f64],
) -> Remembered {
    let start = start(run, before, locals);
    let end = match path {
        Some(path) => {
            equations.readings_along(path, &start, out);
            Remembered::default()
        }
        None => equations.rotor_readings(&run.input(), &start, out),
    };
    for ((value, measured), counts) in out.iter_mut().zip(run.measured.iter()).zip(&run.counts) {
        *value = if *counts && measured.is_finite() { (measured - *value) / sigma } else { 0.0 };
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::screening::tests::log_with_hole as log;

    #[test]
    fn a_rotor_that_stands_or_starts_does_not_count() {
        let mut log = log(300, &[], 900);
        let mut command = vec![0.4; 300];
        command[..100].fill(0.0);
        let rates = command.iter().map(|command| 1300.0 * command).collect();
        log.replace("command_1", command).expect("fits");
        log.replace("propeller_rate_1_rad_s", rates).expect("fits");
        let counts = &rotor_runs(&[log.into()])[0].counts;
        // At rest until 0.99 s, and half a second more.
        assert_eq!(counts.iter().position(|counts| *counts), Some(150));
        assert!(counts[150..].iter().all(|counts| *counts));
    }

    #[test]
    fn a_stretch_is_a_level_where_levels_are_held() {
        let steps: Vec<usize> = (1..10).map(|level| 100 * level).collect();
        let found = fold_stretches(&rotor_runs(&[log(1000, &steps, 2000).into()]), 30);
        assert!((0..1000).all(|row| found[row] == row / 100 + 1), "{found:?}");
        let often: Vec<usize> = (0..200).map(|index| 5 * index).collect();
        let cut = fold_stretches(&rotor_runs(&[log(1000, &often, 2000).into()]), 30);
        assert!((0..1000).all(|row| cut[row] == row * 30 / 1000));
    }

    /// A third of 900 rows begins at the end of a level as long as most; of a command that is never held in the middle.
    #[test]
    fn a_part_near_the_middle_begins_at_rest() {
        let begins = |command: &dyn Fn(usize) -> f64, is_read: &dyn Fn(usize) -> bool| {
            let mut run = rotor_runs(&[log(900, &[], 900).into()]).remove(0);
            run.command = (0..900).map(command).collect();
            run.counts = (0..900).map(is_read).collect();
            let part = run.near_middle(3);
            assert_eq!(part.time.len(), 300);
            part.rows.start
        };
        let levels = |row: usize| 0.5 + 0.01 * (row / 40 % 2) as f64;
        assert_eq!(begins(&levels, &|_| true), 319);
        // A level that a short one cuts in two is two short ones.
        let cut = |row: usize| if (300..303).contains(&row) { 0.8 } else { levels(row) };
        assert_eq!(begins(&cut, &|_| true), 279);
        assert_eq!(begins(&levels, &|row| row % 10 == 4), 314, "the last reading before the step");
        assert_eq!(begins(&levels, &|row| row < 250), 249, "behind it nothing counts");
        assert_eq!(begins(&|row| 0.5 + 0.1 * (row as f64 / 20.0).sin(), &|_| true), 300);
        assert_eq!(begins(&|_| 0.5, &|_| true), 300, "its only level ends too late");
        // Nine rows at rest, and a long ramp.
        let mut run = rotor_runs(&[log(900, &[], 900).into()]).remove(0);
        run.command = (0..900).map(|row: usize| 0.5 + 1e-4 * row.saturating_sub(8) as f64).collect();
        assert_eq!(run.near_middle(9).rows, 400..500, "too far away");
    }

    /// Of ten levels of a hundred rows, of which every second one has a reading: the first 25, and every sixteenth behind them.
    #[test]
    fn a_level_is_thinned_behind_the_way_to_it() {
        let steps: Vec<usize> = (1..10).map(|level| 100 * level).collect();
        let mut run = rotor_runs(&[log(1000, &steps, 2000).into()]).remove(0);
        let one_in_two = |(row, it): (usize, &f64)| if row % 2 == 0 { f64::NAN } else { *it };
        run.measured = run.measured.iter().enumerate().map(one_in_two).collect();
        run.voltage = Some((0..1000).map(f64::from).collect());
        run.counts[..10].fill(false);
        run.command_from = Some(run.time.iter().map(|at| at - 0.003).collect());
        let keeps = |row: usize| row % 100 < 25 || row % 100 % 16 == 25 % 16;
        let kept: Vec<usize> = (0..1000).filter(|row| keeps(*row)).collect();
        let thinned = run.with_levels_thinned();
        let rows: Vec<usize> =
            thinned.voltage.iter().flat_map(|it| it.iter().map(|row| *row as usize)).collect();
        assert_eq!((rows, thinned.begins), (kept.clone(), 11), "the first that counts and has a reading");
        let from = thinned.command_from.as_ref().expect("kept");
        assert!(kept.iter().enumerate().all(|(at, row)| from[at] == run.time[*row] - 0.003));
        for (at, row) in kept.iter().enumerate() {
            assert_eq!(
                (thinned.time[at], thinned.command[at], thinned.measured[at].to_bits(), thinned.counts[at]),
                (run.time[*row], run.command[*row], run.measured[*row].to_bits(), run.counts[*row])
            );
        }
    }

    /// What does not count where a run begins, as behind a hole, tells nothing of its rate, and the run begins where it does.
    #[test]
    fn a_run_begins_where_it_counts() {
        let mut run = rotor_runs(&[log(300, &[], 900).into()]).remove(0);
        assert_eq!((run.begins, start(&run, None, &[]).rate_holds_until), (0, None));
        let time: Vec<f64> = run.time.to_vec();
        let mut counts = vec![true; 300];
        counts[..12].fill(false);
        assert_eq!(first_that_counts(&time, &counts, &run.measured), 12);
        counts[..40].fill(false);
        assert_eq!(first_that_counts(&time, &counts, &run.measured), 0, "0.4 s: it may have stood");
        counts.fill(false);
        assert_eq!(first_that_counts(&time, &counts, &run.measured), 0);
        run.begins = 12;
        let begun = start(&run, None, &[7.0]);
        assert_eq!(begun.rate_holds_until, Some(time[12]));
        assert_eq!(begun.rate, Some(run.measured[12] + 7.0));
        run.counts[..12].fill(false);
        assert_eq!(run.cut(5, 100).begins, 7);
        assert_eq!(run.cut(50, 100).begins, 0);
        run.measured =
            run.measured.iter().enumerate().map(|(row, it)| if row < 14 { f64::NAN } else { *it }).collect();
        assert_eq!(run.cut(5, 100).begins, 9, "the first that was measured, too");
    }

    #[test]
    fn no_run_begins_with_a_rate_that_no_rotor_has() {
        let run = rotor_runs(&[log(300, &[], 900).into()]).remove(0);
        let greatest = run.measured.iter().copied().fold(0.0, f64::max);
        assert!(greatest > 0.0);
        let first = run.measured[0];
        assert_eq!(run.departures(), (-first, 2.0 * greatest - first));
    }
}
