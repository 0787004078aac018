//! The rotor block: free runs of each rotor over the stretches between holes.

use std::ops::Range;

use crate::estimation::quantile::median;
use crate::log::Dataset;
use crate::log::segments::held_throughout;
use crate::model::{Equations, Remembered, RotorInput, RotorStart, RotorTrace};
use crate::screening::rotor_data::at_standstill;
use crate::signal::ROTORS;

/// Column names of the rotors.
pub const COMMANDS: [&str; ROTORS] = ["command_1", "command_2"];
/// Column names of the rotors' rates.
pub const PROPELLER_RATES: [&str; ROTORS] = ["propeller_rate_1_rad_s", "propeller_rate_2_rad_s"];

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
    pub time: Vec<f64>,
    /// [-] missing cells held.
    pub command: Vec<f64>,
    /// [V] missing cells held; `None` when the log has none.
    pub voltage: Option<Vec<f64>>,
    /// [rad/s] not-a-number where missing.
    pub measured: Vec<f64>,
    /// Whether the sample counts.
    pub counts: Vec<bool>,
}

impl RotorRun {
    /// The inputs of a free run.
    #[must_use]
    pub fn input(&self) -> RotorInput<'_> {
        let side = if self.rotor == 0 { 1.0 } else { -1.0 };
        RotorInput { time: &self.time, command: &self.command, voltage: self.voltage.as_deref(), side }
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
        let part = |values: &[f64]| values[from..from + count].to_vec();
        Self {
            log: self.log,
            rotor: self.rotor,
            rows: self.rows.start + from..self.rows.start + from + count,
            time: part(&self.time),
            command: part(&self.command),
            voltage: self.voltage.as_deref().map(part),
            measured: part(&self.measured),
            counts: self.counts[from..from + count].to_vec(),
        }
    }

    /// [rad/s] the first measured rate.
    fn first_rate(&self) -> Option<f64> {
        self.measured.iter().copied().find(|rate| rate.is_finite())
    }
}

/// A stretch shorter than this many samples has no say.
const FEWEST_SAMPLES: usize = 5;

/// A hole is bridged when it is shorter than this share of the time for which the log holds a command.
const SHORT_HOLE: f64 = 0.1;

/// Rows over which a rotor can run freely. A hole ends them unless the command is known across it: the same on both
/// sides, and the hole short beside the time for which commands are held.
fn stretches(data: &Dataset, command: &[f64]) -> Vec<Range<usize>> {
    let time = data.time();
    let changes: Vec<f64> =
        (1..time.len()).filter(|row| command[*row] != command[row - 1]).map(|row| time[row]).collect();
    let short = SHORT_HOLE * median(changes.windows(2).map(|pair| pair[1] - pair[0])).unwrap_or(0.0);
    let mut stretches: Vec<Range<usize>> = Vec::new();
    for rows in data.segments() {
        match stretches.last_mut() {
            Some(before)
                if before.end == rows.start
                    && command[before.end - 1] == command[rows.start]
                    && time[rows.start] - time[before.end - 1] < short =>
            {
                before.end = rows.end;
            }
            _ => stretches.push(rows),
        }
    }
    stretches
}

/// The runs of every rotor whose command and rate the logs hold.
#[must_use]
pub fn rotor_runs(logs: &[Dataset]) -> Vec<RotorRun> {
    let mut runs = Vec::new();
    for (log, data) in logs.iter().enumerate() {
        for rotor in 0..ROTORS {
            let (Some(command), Some(measured)) =
                (data.column(COMMANDS[rotor]), data.column(PROPELLER_RATES[rotor]))
            else {
                continue;
            };
            let voltage = data.column("battery_voltage_v").map(held_throughout);
            let command = held_throughout(command);
            for rows in stretches(data, &command).into_iter().filter(|rows| rows.len() >= FEWEST_SAMPLES) {
                let measured = measured[rows.clone()].to_vec();
                if measured.iter().filter(|rate| rate.is_finite()).count() < FEWEST_SAMPLES {
                    continue;
                }
                let (time, command) = (data.time()[rows.clone()].to_vec(), command[rows.clone()].to_vec());
                let counts = at_standstill(&time, &command).into_iter().map(|stands| !stands).collect();
                runs.push(RotorRun {
                    log,
                    rotor,
                    voltage: voltage.as_ref().map(|voltage| voltage[rows.clone()].to_vec()),
                    time,
                    command,
                    counts,
                    measured,
                    rows,
                });
            }
        }
    }
    runs
}

/// A command held for so many samples is a level that was meant.
const HELD_SAMPLES: usize = 20;

/// Fewer levels than this are no experiment of levels.
const FEWEST_LEVELS: usize = 9;

/// Whether the commands are levels held for long.
#[must_use]
pub(crate) fn hold_levels(runs: &[RotorRun]) -> bool {
    let all: usize = runs.iter().map(|run| run.time.len()).sum();
    let changes = |run: &RotorRun| run.command.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let levels: usize = runs.iter().map(|run| changes(run) + 1).sum();
    levels * HELD_SAMPLES <= all && levels >= FEWEST_LEVELS
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
    let departure = locals.first().copied().unwrap_or(0.0);
    let start = RotorStart {
        rate: run.first_rate().map(|rate| rate + departure),
        slow: locals.get(1).copied().unwrap_or(0.0),
        before,
        is_first: run.rows.start == 0,
    };
    equations.simulate_rotor(&run.input(), &start, trace);
}

/// Residuals of one run over their standard deviation.
pub fn residuals(run: &RotorRun, trace: &RotorTrace, sigma: f64, out: &mut [f64]) {
    let pairs = run.measured.iter().zip(&trace.measured).zip(&run.counts);
    for (value, ((measured, simulated), counts)) in out.iter_mut().zip(pairs) {
        *value = if *counts && measured.is_finite() { (measured - simulated) / sigma } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 Hz, a command that changes at the given rows, a hole of 90 ms after the given row.
    fn log(rows: usize, changes: &[usize], hole_after: usize) -> Dataset {
        let delay = |row: usize| if row > hole_after { 0.08 } else { 0.0 };
        let time: Vec<f64> = (0..rows).map(|row| 0.01 * row as f64 + delay(row)).collect();
        let level = |row: usize| changes.iter().filter(|change| **change <= row).count();
        let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.1 * (level(row) % 2) as f64).collect();
        let mut log = Dataset::new("here", "", time).expect("time rises");
        log.insert("propeller_rate_1_rad_s", command.iter().map(|u| 1300.0 * u).collect()).expect("fits");
        log.insert("command_1", command).expect("fits");
        log
    }

    #[test]
    fn a_run_goes_on_across_a_hole_only_where_the_command_is_known() {
        let steps = [100, 300, 500, 700];
        let rows = |log: Dataset| rotor_runs(&[log]).iter().map(|run| run.rows.clone()).collect::<Vec<_>>();
        // Levels of 2 s: a hole of 90 ms inside one is bridged.
        assert_eq!(rows(log(900, &steps, 350)), std::slice::from_ref(&(0..900)));
        // The command changed in the hole, nobody knows when.
        assert_eq!(rows(log(900, &steps, 299)), [0..300, 300..900]);
        // Levels of 50 ms: in a hole of 90 ms the command may have gone and come back.
        let often: Vec<usize> = (0..180).map(|index| 5 * index).collect();
        assert_eq!(rows(log(900, &often, 352)), [0..353, 353..900]);
    }

    #[test]
    fn a_rotor_that_stands_or_starts_does_not_count() {
        let mut log = log(300, &[], 900);
        let mut command = vec![0.4; 300];
        command[..100].fill(0.0);
        log.replace("command_1", command).expect("fits");
        let counts = &rotor_runs(&[log])[0].counts;
        // At rest until 0.99 s, and half a second more.
        assert_eq!(counts.iter().position(|counts| *counts), Some(150));
        assert!(counts[150..].iter().all(|counts| *counts));
    }

    #[test]
    fn a_stretch_is_a_level_where_levels_are_held() {
        let steps: Vec<usize> = (1..10).map(|level| 100 * level).collect();
        let found = fold_stretches(&rotor_runs(&[log(1000, &steps, 2000)]), 30);
        assert!((0..1000).all(|row| found[row] == row / 100 + 1), "{found:?}");
        let often: Vec<usize> = (0..200).map(|index| 5 * index).collect();
        let cut = fold_stretches(&rotor_runs(&[log(1000, &often, 2000)]), 30);
        assert!((0..1000).all(|row| cut[row] == row * 30 / 1000));
    }
}
