//! A command that a controller makes from the rate beside it. Then the rate goes before the command as well as behind it, and what looks
//! like a lag or a falling curve may be the controller's.
//!
//! An experiment's command knows nothing of the noise of a sensor, nor of the load. So beside the last commands and the last rates,
//! what is new in the rate must not go with what is new in the command beside the last commands alone: of those the rates' noise is no
//! part. A controller of the speed lowers it by what the rate has too much of. (A rotor answers the other way: more for a greater
//! command.)
//!
//! What a line does not follow of a smooth command, or of a rotor's curve, is new, too, and goes slowly: second differences of what is
//! new have the noise and none of that. A row that comes late has more of both where they rise, and the next one less: so it is known
//! when the rows came.

use crate::estimation::dependent_columns::DesignRows;
use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, extremes, median};
use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::RotorLog;
use crate::screening::thresholds::THRESHOLDS;

/// The code: a command that is made from the rate.
pub const COMMAND_FOLLOWS_RATE: &str = "command_follows_rate";

/// Readings before one that both may depend on.
const BEFORE: usize = THRESHOLDS.new_before;
/// Readings later by which a controller answers, at the most.
const LATEST: usize = THRESHOLDS.loop_latest;

/// What is new is looked at in so many readings in a row, whose second difference is taken.
const NEW: usize = 3;
const READINGS: usize = BEFORE + LATEST + NEW;

/// Rows of readings that follow each other.
type Readings = [usize; READINGS];

/// Says it; nothing is left out.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let data = &rotor.data;
    let pasts = pasts(data);
    if pasts.len() < THRESHOLDS.new_fewest || share_moved(data, &pasts) < THRESHOLDS.loop_moves {
        return None;
    }
    let correlation = (0..=LATEST).filter_map(|later| correlation(data, &pasts, later)).reduce(f64::min)?;
    let finding =
        data.finding(COMMAND_FOLLOWS_RATE).with("correlation", correlation).with("readings", pasts.len());
    (correlation < THRESHOLDS.loop_correlation).then(|| Judgement::new(finding, Vec::new()))
}

/// Readings in a row without a hole: those before one, it, and the next ones.
fn pasts(data: &RotorLog) -> Vec<Readings> {
    let share = data.scored().count().div_ceil(THRESHOLDS.new_most).max(1);
    let mut found = Vec::new();
    for stretch in &data.stretches {
        let known: Vec<usize> = finite_rows(&data.rate, stretch.clone());
        let all = known.windows(READINGS).step_by(share);
        found.extend(all.filter_map(|rows| Readings::try_from(rows).ok()));
    }
    let spans = found.iter().map(|rows| data.time[rows[READINGS - 1]] - data.time[rows[0]]);
    let usual = median(spans).unwrap_or(0.0);
    found.retain(|rows| data.time[rows[READINGS - 1]] - data.time[rows[0]] < THRESHOLDS.gap_factor * usual);
    found
}

/// Share of the readings before which the command moved.
fn share_moved(data: &RotorLog, pasts: &[Readings]) -> f64 {
    let moved = pasts.iter().filter(|rows| data.command[rows[BEFORE]] != data.command[rows[BEFORE - 1]]);
    moved.count() as f64 / pasts.len() as f64
}

/// What is known before each of these readings: of the command `later` readings behind the `first` of them, and `with_rates`, of its rate,
/// too.
fn known(data: &RotorLog, pasts: &[Readings], first: usize, later: usize, with_rates: bool) -> DesignRows {
    let span = BEFORE + later;
    // With a later command those up to it are known, too. A part is its readings, and how late each of the rows came.
    let columns = 1 + span + span + if with_rates { BEFORE + span } else { 0 };
    let mut known = DesignRows::new(columns, pasts.len());
    let mut row = Vec::with_capacity(columns);
    for rows in pasts {
        let rows = &rows[first..first + span + 1];
        row.clear();
        row.push(1.0);
        let mut take = |column: &[f64], readings: usize| {
            let slope = column[rows[BEFORE - 1]] - column[rows[0]];
            row.extend(rows[..readings].iter().map(|row| column[*row]));
            let late = |at: usize| (data.time[rows[at + 1]] - data.time[rows[at]]) / data.interval - 1.0;
            row.extend((0..span).map(|at| late(at) * slope));
        };
        take(&data.command, span);
        if with_rates {
            take(&data.rate, BEFORE);
        }
        known.push(&row);
    }
    known
}

/// What is new in one column from one reading to the next.
struct News {
    /// What is known before each reading, and what is read, of [`NEW`] readings in a row.
    readings: [(DesignRows, Vec<f64>); NEW],
    /// What must be new: less is the rounding of its digits.
    least: f64,
}

impl News {
    /// Of what a line through these readings leaves of all: for each the greatest of its row, in their usual size, and the second
    /// difference. `None` where nothing is new.
    fn of(&self, kept: &[usize]) -> Option<Vec<(f64, f64)>> {
        let (known, read) = &self.readings[0];
        let line = known.coefficients(read, kept)?;
        let left = |(known, read): &(DesignRows, Vec<f64>)| -> Vec<f64> {
            read.iter().enumerate().map(|(at, read)| read - known.value(at, &line)).collect()
        };
        let new = self.readings.each_ref().map(left);
        let usual = median(new[0].iter().map(|value| value.abs()))? / MEDIAN_OF_NORMAL;
        let greatest = |at: usize| new.iter().map(|new| new[at].abs() / usual).fold(0.0, f64::max);
        let bend = |at: usize| new[0][at] - 2.0 * new[1][at] + new[2][at];
        (usual >= self.least).then(|| (0..read.len()).map(|at| (greatest(at), bend(at))).collect())
    }
}

/// By how much what is new in the rate goes with what is new in the command beside it, or so many readings `later`. Steps of a setpoint,
/// and what a line leaves of their transients, are taken out: a few of them would speak for all.
fn correlation(data: &RotorLog, pasts: &[Readings], later: usize) -> Option<f64> {
    let all: [usize; NEW] = std::array::from_fn(|first| first);
    let news = |with_rates: bool, column: &[f64], place: usize| {
        let read = |first: usize| pasts.iter().map(|rows| column[rows[first + place]]).collect();
        let readings = all.map(|first| (known(data, pasts, first, later, with_rates), read(first)));
        let (low, high) = extremes(column.iter().copied());
        News { readings, least: THRESHOLDS.loop_news * (high - low) }
    };
    let both = [news(true, &data.rate, BEFORE), news(false, &data.command, BEFORE + later)];
    let mut kept: Vec<usize> = (0..pasts.len()).collect();
    let mut found = f64::NAN;
    for _ in 0..THRESHOLDS.loop_passes {
        let [rate, command] = [both[0].of(&kept)?, both[1].of(&kept)?];
        let is_plain = |at: &usize| rate[*at].0.max(command[*at].0) < THRESHOLDS.loop_clip;
        kept = (0..pasts.len()).filter(is_plain).collect();
        if kept.len() < THRESHOLDS.new_fewest / 2 {
            return None;
        }
        let over =
            |a: &[(f64, f64)], b: &[(f64, f64)]| kept.iter().map(|at| a[*at].1 * b[*at].1).sum::<f64>();
        found = over(&rate, &command) / (over(&rate, &rate) * over(&command, &command)).sqrt();
    }
    found.is_finite().then_some(found)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::noise_of as noise;
    use crate::signal::columns::PROPELLER_RATES;

    /// 2,000 rows at 64 Hz of a rotor that is read with noise of 4 rad/s; `next(row, command, read)` is the command of a row.
    fn found(next: impl Fn(usize, f64, f64) -> f64) -> Option<f64> {
        let (mut rate, mut load, mut command) = (600.0, 0.0, 0.5);
        let (mut commands, mut rates) = (Vec::new(), Vec::new());
        for row in 0..2000 {
            let read = rate + 4.0 * noise(row, 1);
            command = next(row, command, read);
            commands.push(command);
            rates.push(read);
            load += 0.02 * (40.0 * noise(row / 10, 2) - load);
            // Ten steps of Euler a row.
            for _ in 0..10 {
                rate += 0.002 * 9.0 * (1200.0 * command - load - rate);
            }
        }
        // Exact in binary: no row is late by any rounding, and columns of how late rows came are zero.
        said((0..2000).map(|row| f64::from(row) / 64.0).collect(), commands, rates)
    }

    /// The correlation that is said of a log.
    fn said(time: Vec<f64>, commands: Vec<f64>, rates: Vec<f64>) -> Option<f64> {
        let log = Dataset::made(time, [("command_1", commands), (PROPELLER_RATES[0], rates)]);
        let log = ScreenedLog::of(&log);
        let found = log.rotor(1).expect("a rotor").findings().find(|it| it.code == COMMAND_FOLLOWS_RATE);
        found.map(|it| it.number("correlation"))
    }

    #[test]
    fn a_speed_controller_is_seen_with_and_without_steps_of_its_setpoint() {
        for (amplitude, late) in [(0.0, 0), (80.0, 0), (80.0, 1), (80.0, 2)] {
            let setpoint = |row: usize| 600.0 + amplitude * f64::from((row / 100 * 7 % 5) as u32);
            let reads = std::cell::RefCell::new(vec![600.0; late]);
            let integral = std::cell::Cell::new(0.5);
            let governed = found(|row, _, read| {
                let mut reads = reads.borrow_mut();
                reads.push(read);
                let error = setpoint(row) - reads.remove(0);
                integral.set(integral.get() + 1e-4 * error);
                (integral.get() + 3e-4 * error).clamp(0.05, 1.0)
            });
            assert!(governed.is_some_and(|it| it < -0.6), "{amplitude} {late}: {governed:?}");
        }
    }

    /// 30 s at 100 Hz of a rotor that is read with some noise under a sum of sines, as an attitude bench's torque is made.
    #[test]
    fn a_smooth_command_is_not_made_from_the_noise_of_the_rate() {
        for (sines, amplitude) in [(4, 0.012), (7, 0.008), (12, 0.005)] {
            let wave = |row: usize| -> f64 {
                let sine =
                    |of: usize| (0.01 * row as f64 * (1.1 + 1.37 * of as f64) + of as f64 * of as f64).sin();
                0.45 + amplitude * (0..sines).map(sine).sum::<f64>()
            };
            let (mut rate, mut commands, mut rates) = (540.0, Vec::new(), Vec::new());
            for row in 0..3000 {
                commands.push((wave(row) * 1e7).round() / 1e7);
                rates.push(rate + 2.6 * noise(row, 1));
                (0..10).for_each(|_| rate += 0.001 * 16.0 * (1200.0 * wave(row) - rate));
            }
            let time = (0..3000).map(|row| 0.01 * f64::from(row)).collect();
            assert_eq!(said(time, commands, rates), None, "{sines}");
        }
    }

    /// 60 s of a chirp whose command is that of the moment at which its row comes, up to so much late [s]; `known`: the log says when.
    #[test]
    fn rows_that_come_late_make_no_controller() {
        for (late, known) in [(0.004, true), (0.004, false), (0.012, true), (0.012, false)] {
            let stamp = |row: usize| {
                0.02 * row as f64 + late * (0.5 + 0.5 * noise(row, 5)) * f64::from(u8::from(row > 0))
            };
            let at = |time: f64| 0.5 + 0.12 * (TAU * time * (0.1 + 1.9 / 120.0 * time)).sin();
            let (mut rate, mut commands, mut rates) = (at(0.0) * 1200.0, Vec::new(), Vec::new());
            for row in 0..3000 {
                let command = at(stamp(row));
                commands.push(command);
                rates.push(rate + noise(row, 1));
                // Ten steps of Euler a row.
                let step = (stamp(row + 1) - stamp(row)) / 10.0;
                (0..10).for_each(|_| rate += step * 14.0 * (1200.0 * command - rate));
            }
            let time = |row: usize| if known { stamp(row) } else { 0.02 * row as f64 };
            assert_eq!(said((0..3000).map(time).collect(), commands, rates), None, "{late} {known}");
        }
    }

    #[test]
    fn no_experiment_follows_what_is_new_in_the_rate() {
        let wave = |row: usize| 0.5 + 0.1 * (0.02 * row as f64 * (0.5 + 2e-4 * row as f64)).sin();
        let commands: [&dyn Fn(usize) -> f64; 5] = [
            &|row| 0.3 + 0.1 * f64::from((row / 15 * 7 % 5) as u32),
            &|row| 0.3 + 2e-4 * row as f64,
            &wave,
            &|row| 0.5 + 0.05 * noise(row, 3),
            &|row| (wave(row) * 1000.0).round() / 1000.0,
        ];
        for command in commands {
            assert_eq!(found(|row, _, _| command(row)), None);
        }
    }
}
