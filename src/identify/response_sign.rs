//! Which way a rotor's rate goes right behind a change of its command: what no controller, no battery and no other rotor can turn round.

use super::thresholds::THRESHOLDS;
use crate::screening::rotor_data::RotorLog;

/// Whether the rate goes down right behind a command that went up. Only the change from one row to the next is asked about: what a
/// controller makes of the rate itself comes slower than that, and a change over many rows goes along with what was before it.
pub(crate) fn answers_downwards(rotor: &RotorLog) -> bool {
    let rows = ((THRESHOLDS.answer_span / rotor.interval).round() as usize).max(1);
    let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
    for segment in rotor.segments.iter().filter(|segment| segment.len() > rows + 1) {
        for row in segment.start + 1..segment.end - rows {
            let change = rotor.command[row] - rotor.command[row - 1];
            let product = change * (rotor.rate[row + rows] - rotor.rate[row]);
            if product.is_finite() {
                sum += product;
                squares += product * product;
            }
        }
    }
    sum < -THRESHOLDS.answer_errors * squares.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// 50 Hz for 20 s of a rotor of 12 1/s. Its commands change each 0.3 s, or, `governed`, are what a controller makes of a load that
    /// comes and goes; `sign` is that of the column.
    fn answers(governed: bool, sign: f64) -> bool {
        let (mut rate, mut command, mut commands, mut rates) = (600.0, 0.5, Vec::new(), Vec::new());
        for row in 0..1000_usize {
            let load = if governed { 90.0 * (row as f64 * 0.05).sin() } else { 0.0 };
            command = if governed {
                command - 2e-4 * (rate - 600.0)
            } else {
                0.3 + 0.1 * ((row / 15 * 7) % 5) as f64
            };
            commands.push(command);
            rates.push(if sign > 0.0 { rate } else { 1500.0 - rate });
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
        assert!(!answers(false, 1.0));
        assert!(answers(false, -1.0), "the column counts the other way round");
        assert!(!answers(true, 1.0), "it falls where the command rises, and before that");
    }
}
