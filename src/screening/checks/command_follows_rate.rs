//! A command that a controller makes from the rate beside it. Then the rate goes before the command as well as behind it, and what looks
//! like a lag or a falling curve may be the controller's.
//!
//! An experiment's command knows nothing of the noise of a sensor, nor of the load. So beside the last commands and the last rates,
//! which both may depend on, what is new in the rate must not go with what is new in the command. A controller of the speed lowers it by
//! what the rate has too much of. (A rotor answers the other way: more for a greater command.)

use nalgebra::{DMatrix, DVector};

use crate::estimation::dependent_columns::coefficients;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median};
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

/// Rows of readings that follow each other.
type Readings = [usize; BEFORE + LATEST + 1];

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
    for segment in &data.segments {
        let known: Vec<usize> = segment.clone().filter(|row| data.rate[*row].is_finite()).collect();
        let all = known.windows(BEFORE + LATEST + 1).step_by(share);
        found.extend(all.filter_map(|rows| Readings::try_from(rows).ok()));
    }
    let spans = found.iter().map(|rows| data.time[rows[BEFORE + LATEST]] - data.time[rows[0]]);
    let usual = median(spans).unwrap_or(0.0);
    found
        .retain(|rows| data.time[rows[BEFORE + LATEST]] - data.time[rows[0]] < THRESHOLDS.gap_factor * usual);
    found
}

/// Share of the readings before which the command moved.
fn share_moved(data: &RotorLog, pasts: &[Readings]) -> f64 {
    let moved = pasts.iter().filter(|rows| data.command[rows[BEFORE]] != data.command[rows[BEFORE - 1]]);
    moved.count() as f64 / pasts.len() as f64
}

/// By how much what is new in the rate goes with what is new in the command beside it, or so many readings `later`. Steps of a setpoint,
/// and what a line leaves of their transients, are taken out: a few of them would speak for all.
fn correlation(data: &RotorLog, pasts: &[Readings], later: usize) -> Option<f64> {
    let known = 1 + 2 * BEFORE + later;
    let row = |rows: &Readings| -> Vec<f64> {
        let rates = rows[..BEFORE].iter().map(|row| data.rate[*row]);
        // With a later command those up to it are known, too.
        let commands = rows[..BEFORE + later].iter().map(|row| data.command[*row]);
        std::iter::once(1.0).chain(rates).chain(commands).collect()
    };
    let design = DMatrix::from_row_iterator(pasts.len(), known, pasts.iter().flat_map(row));
    let of = |values: &[f64], place: usize| {
        DVector::from_iterator(pasts.len(), pasts.iter().map(|rows| values[rows[place]]))
    };
    let both = [of(&data.rate, BEFORE), of(&data.command, BEFORE + later)];
    // What is new in a column without noise is the rounding of its digits, and how a curve bends.
    let least = [&data.rate[..], &data.command[..]].map(|values| {
        let known = values.iter().copied().filter(|value| value.is_finite());
        let (low, high) =
            known.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it), high.max(it)));
        THRESHOLDS.loop_news * (high - low)
    });
    let mut kept: Vec<usize> = (0..pasts.len()).collect();
    let mut found = f64::NAN;
    for _ in 0..THRESHOLDS.loop_passes {
        let of_kept = design.select_rows(&kept);
        let new = both.each_ref().map(|y| Some(y - &design * coefficients(&of_kept, &y.select_rows(&kept))?));
        let [Some(rate), Some(command)] = new else { return None };
        let most = [&rate, &command].map(|new| {
            let usual = median(new.iter().map(|value| value.abs())).unwrap_or(0.0) / MEDIAN_OF_NORMAL;
            THRESHOLDS.loop_clip * usual
        });
        if most.iter().zip(least).any(|(most, least)| *most < THRESHOLDS.loop_clip * least) {
            return None;
        }
        kept.clear();
        kept.extend((0..pasts.len()).filter(|at| rate[*at].abs() < most[0] && command[*at].abs() < most[1]));
        if kept.len() < THRESHOLDS.new_fewest / 2 {
            return None;
        }
        let over = |a: &DVector<f64>, b: &DVector<f64>| kept.iter().map(|at| a[*at] * b[*at]).sum::<f64>();
        found = over(&rate, &command) / (over(&rate, &rate) * over(&command, &command)).sqrt();
    }
    found.is_finite().then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// A number from -1 to 1 that no neighbour's tells of.
    fn noise(row: usize, of: u64) -> f64 {
        let mixed = (row as u64 ^ of << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// 40 s at 50 Hz of a rotor of 9 1/s that is read with noise of 4 rad/s; `next(row, command, read)` is the command of a row.
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
        let time = (0..2000).map(|row| 0.02 * f64::from(row)).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        log.insert("command_1", commands).expect("fits");
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
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
