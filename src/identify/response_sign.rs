//! Which way a rotor's rate goes right behind a change of its command: what no controller, no battery and no other rotor can turn round.

use super::thresholds::THRESHOLDS;
use crate::screening::rotor_data::RotorLog;

/// Whether the rate goes down behind a command that went up, and does not merely go before one that comes down.
pub(crate) fn answers_downwards(rotor: &RotorLog) -> bool {
    let rows = ((THRESHOLDS.answer_span / rotor.interval).round() as usize).max(1);
    let (mut behind, mut before) = (0.0, 0.0);
    for segment in rotor.segments.iter().filter(|segment| segment.len() > 2 * rows) {
        for row in segment.start + rows..segment.end - rows {
            let change = |values: &[f64], from: usize| values[from + rows] - values[from];
            let (was, is) = (row - rows, row);
            let pair = |command: usize, rate: usize| {
                let product = change(&rotor.command, command) * change(&rotor.rate, rate);
                if product.is_finite() { product } else { 0.0 }
            };
            behind += pair(was, is);
            before += pair(is, was);
        }
    }
    behind < 0.0 && behind.abs() > THRESHOLDS.answer_behind * before.min(0.0).abs()
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
