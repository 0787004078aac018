//! How quickly a rotor follows its command, read off its own rates: from one reading behind a step of the command to the next a first-order
//! lag goes always the same share of what is left of its way. So a reading or two on the way are enough, and no law is fitted.

use std::ops::Range;

use super::rotor_data::RotorLog;
use super::thresholds::THRESHOLDS;
use crate::estimation::moments::{deviation, mean};
use crate::log::dataset::is_hole;

/// What the rates do behind the steps of a log.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Rise {
    /// Steps behind which the rate plainly came to rest.
    pub steps: usize,
    /// Those of them with a reading on the way.
    pub on_the_way: usize,
    /// [rad/s] the pole that the readings on the way speak of; `None` where too few steps have one.
    pub pole: Option<f64>,
}

/// Sums over pairs of readings, the first of them on the way: what was left of the way.
#[derive(Default)]
struct Left {
    squares: f64,
    products: f64,
}

impl RotorLog {
    /// How quickly this rotor follows, as far as its rates say, which come `interval` [s] apart.
    pub(crate) fn rise(&self, interval: f64) -> Rise {
        let (mut rise, mut left) = (Rise::default(), Left::default());
        for jump in self.jumps() {
            let Some(pairs) = self.stretch_of(jump).and_then(|rows| self.left_behind(jump, &rows, interval))
            else {
                continue;
            };
            rise.steps += 1;
            rise.on_the_way += usize::from(!pairs.is_empty());
            for [now, next] in pairs {
                left.squares += now * now;
                left.products += now * next;
            }
        }
        if rise.on_the_way >= THRESHOLDS.fewest_rises {
            let share = (left.products / left.squares).max(f64::MIN_POSITIVE);
            rise.pole = Some(-share.ln() / interval);
        }
        rise
    }

    fn stretch_of(&self, row: usize) -> Option<Range<usize>> {
        self.stretches.iter().find(|rows| rows.contains(&row)).cloned()
    }

    /// Pairs of neighbouring readings behind a jump, the first of them on the way to the new level: what was left of it at each [rad/s].
    /// `None` where the rate does not plainly come to rest there.
    fn left_behind(&self, jump: usize, within: &Range<usize>, interval: f64) -> Option<Vec<[f64; 2]>> {
        let is_same = |row: usize, as_in: usize| (self.command[row] - self.command[as_in]).abs() < 1e-6;
        let is_read = |row: &usize| self.rate[*row].is_finite();
        let behind = (jump + 1..within.end).take_while(|row| is_same(*row, jump + 1)).filter(is_read);
        let behind: Vec<usize> = behind.collect();
        let before = (within.start..=jump).rev().take_while(|row| is_same(*row, jump)).find(is_read);
        let end = behind
            .len()
            .checked_sub(THRESHOLDS.readings_at_rest.max(behind.len() / THRESHOLDS.level_ends))?;
        let rates: Vec<f64> = behind.iter().map(|row| self.rate[*row]).collect();
        let to = mean(&rates[end..]);
        // Of a start nobody knows the rate before: it was none.
        let way = before.map_or(to, |row| to - self.rate[row]).abs();
        let scatter = deviation(rates[end..].iter().copied());
        let half = rates[end / 2..end].iter().map(|rate| (rate - to).abs()).fold(0.0, f64::max);
        let share = THRESHOLDS.share_on_the_way;
        if end < 2 || way <= THRESHOLDS.plain_rise * scatter || half > share.0 * way {
            return None;
        }
        let least = (share.0 * way).max(THRESHOLDS.plain_rise * scatter);
        let is_on_way = |at: &usize| {
            let left = (rates[*at] - to).abs();
            let is_next = !is_hole(self.time[behind[at + 1]] - self.time[behind[*at]], interval);
            left > least && is_next && (before.is_none() || left < share.1 * way)
        };
        let pairs = (0..end).filter(is_on_way).map(|at| [rates[at] - to, rates[at + 1] - to]);
        Some(pairs.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Levels of 6 s, read at 4 Hz, that a rotor follows with this pole [rad/s]; the commands come between the readings.
    fn rotor(pole: f64) -> RotorLog {
        let command = |time: f64| 0.2 + 0.1 * f64::from(((time + 0.13) / 6.07) as u32 * 7 % 5);
        let (mut rate, mut rates) = (200.0, Vec::new());
        for row in 0..800_u32 {
            rates.push(rate + f64::from(row * 37 % 11) * 0.05);
            for fine in 0..250 {
                let steady = 1_000.0 * command(0.25 * f64::from(row) + 0.001 * f64::from(fine));
                rate += (steady - rate) * (1.0 - (-0.001 * pole).exp());
            }
        }
        let time: Vec<f64> = (0..800).map(|row| 0.25 * f64::from(row)).collect();
        let commands = time.iter().map(|time| command(*time)).collect();
        let log = Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)]);
        RotorLog::clone(ScreenedLog::from(log).rotor(1).expect("a rotor").data())
    }

    #[test]
    fn readings_on_the_way_say_how_quickly_a_rotor_follows() {
        for pole in [2.0, 6.0] {
            let rise = rotor(pole).rise(0.25);
            let seen = rise.pole.expect("several readings within each rise");
            assert!((seen / pole - 1.0).abs() < 0.1, "{seen} of {pole}: {rise:?}");
            assert!(rotor(pole).too_seldom(16.0).is_none(), "its own rates decide");
        }
        let fast = rotor(16.0);
        assert!(fast.rise(0.25).pole.is_none_or(|seen| seen > 10.0), "{:?}", fast.rise(0.25));
        let found = fast.too_seldom(16.0).expect("over within a reading");
        assert!(found.count("steps") >= 20, "{found:?}");
    }
}
