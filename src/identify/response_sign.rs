//! Which way a rotor's rate goes right behind a change of its command: what no controller, no battery and no other rotor can turn round.

use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median};
use crate::screening::rotor_data::RotorLog;

/// Whether the rate goes down right behind a command that went up. Only the change from one row to the next is asked about: what a
/// controller makes of the rate itself comes slower than that, and a change over many rows goes along with what was before it.
///
/// By chance the products of change and answer are as often positive as negative. Where the command mostly stands still, that
/// shows besides by how much the rate changes then: so a few steps are enough.
pub(crate) fn answers_downwards(rotor: &RotorLog) -> bool {
    let rows = ((THRESHOLDS.answer_span / rotor.interval).round() as usize).max(1);
    let (mut sum, mut squares, mut changes) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut still = Vec::new();
    for stretch in rotor.stretches.iter().filter(|stretch| stretch.len() > rows + 1) {
        // The last row whose command changed.
        let mut changed = stretch.start;
        for row in stretch.start + 1..stretch.end - rows {
            let change = rotor.command[row] - rotor.command[row - 1];
            let answer = rotor.rate[row + rows] - rotor.rate[row];
            changed = if change == 0.0 { changed } else { row };
            let product = change * answer;
            if product.is_finite() {
                sum += product;
                squares += product * product;
                changes += change * change;
                let stands = row - changed >= rows && rotor.command[row + rows] == rotor.command[row];
                still.extend(stands.then_some(answer.abs()));
            }
        }
    }
    let is_beyond = |error: f64| sum < -THRESHOLDS.answer_errors * error;
    let agree = sum * sum >= THRESHOLDS.answers_agree * squares;
    let is_quiet = still.len() >= THRESHOLDS.answers_still;
    let usual = median(still).filter(|_| is_quiet && agree).map(|usual| usual / MEDIAN_OF_NORMAL);
    is_beyond(squares.sqrt()) || usual.is_some_and(|usual| is_beyond(usual * changes.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// 50 Hz for 20 s of a rotor with a pole of 12 rad/s. Its commands change after so many rows, or, `governed`, are what a controller makes of a load
    /// that comes and goes; `sign` is that of the column.
    fn answers(governed: bool, sign: f64, hold: usize) -> bool {
        let (mut rate, mut command, mut commands, mut rates) = (600.0, 0.5, Vec::new(), Vec::new());
        for row in 0..1000_usize {
            let load = if governed { 90.0 * (row as f64 * 0.05).sin() } else { 0.0 };
            command = if governed {
                command - 2e-4 * (rate - 600.0)
            } else {
                0.3 + 0.1 * ((row / hold * 7) % 5) as f64
            };
            commands.push(command);
            let read = rate + f64::from((row * 37 % 11) as u32) - 5.0;
            rates.push(if sign > 0.0 { read } else { 1500.0 - read });
            // Ten steps of Euler a row: nothing here is integrated as the program does.
            for _ in 0..10 {
                rate += 0.002 * 12.0 * (1200.0 * command - load - rate);
            }
        }
        let time = (0..1000).map(|row| 0.02 * f64::from(row)).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        log.insert("command_1", commands).expect("fits");
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
        answers_downwards(ScreenedLog::of(&log).rotor(1).expect("a rotor").data())
    }

    #[test]
    fn what_a_controller_takes_back_is_no_wrong_sign() {
        for hold in [15, 200] {
            assert!(!answers(false, 1.0, hold));
            assert!(answers(false, -1.0, hold), "the column counts the other way round: {hold}");
        }
        assert!(!answers(true, 1.0, 15), "it falls where the command rises, and before that");
    }

    #[test]
    fn one_change_tells_nothing() {
        assert!(!answers(false, -1.0, 600));
    }
}
