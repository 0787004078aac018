//! A rate that is read later than the thrust beside it.
//!
//! A rotor's thrust follows its rate at once, f = c ω², [LPC16] Eq. (11). A load cell may be late, by its own filter; early it cannot
//! be. So where the thrust goes with the rate of a later row, the rate was read late, by that much and whatever the load cell is late
//! itself. From command to rate that looks like a rotor that is commanded late, and here the two are kept apart.

use std::ops::Range;

use crate::estimation::moments::squares_about_mean;
use crate::screening::channel::Judgement;
use crate::screening::readings::bridged;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::RotorLog;
use crate::screening::thresholds::THRESHOLDS;

/// The code: a rate that comes after the thrust that it makes.
pub const RATE_BEHIND_THRUST: &str = "rate_behind_thrust";

/// Parts of a log, each of which is left out in turn for the error of what is found.
const PARTS: usize = THRESHOLDS.late_parts;

/// Says it; nothing is left out.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    let data = &rotor.data;
    let lags = lags(data.interval);
    let parts = parts(data, &lags)?;
    let all = |lag: usize| parts.iter().fold(Sums::default(), |sum, part| sum.and(&part[lag], 1.0));
    let (late, left) = best(&lags, all)?;
    let at_once = all(lags.iter().position(|lag| *lag == 0.0)?).unexplained()?;
    if late < THRESHOLDS.late_rate_s || left > THRESHOLDS.late_error_left * at_once {
        return None;
    }
    let without = parts.iter().map(|part| best(&lags, |lag| all(lag).and(&part[lag], -1.0)));
    let without = without.map(|found| found.map(|(late, _)| late)).collect::<Option<Vec<f64>>>()?;
    // The jackknife's.
    let (_, spread) = squares_about_mean(without.iter().copied());
    let error = (spread * (PARTS - 1) as f64 / PARTS as f64).sqrt();
    let finding = data.finding(RATE_BEHIND_THRUST).with("late_s", late).with("standard_error_s", error);
    (late > THRESHOLDS.late_errors * error).then(|| Judgement::new(finding, Vec::new()))
}

/// [s] how late the rate may be read, in steps of half a row, and as many steps on the other side.
fn lags(interval: f64) -> Vec<f64> {
    let (longest, steps) = THRESHOLDS.late_span;
    let step = (0.5 * interval).max(longest / steps);
    let most = (longest / step).floor() as i32;
    (-most..=most).map(|at| f64::from(at) * step).collect()
}

/// Sums of a straight line of thrusts over squared rates.
#[derive(Debug, Clone, Copy, Default)]
struct Sums([f64; 6]);

impl Sums {
    fn of(thrust: f64, square: f64) -> Self {
        Self([1.0, thrust, square, thrust * thrust, square * square, thrust * square])
    }

    fn and(self, other: &Self, times: f64) -> Self {
        Self(std::array::from_fn(|at| self.0[at] + times * other.0[at]))
    }

    /// [-] share of the thrust's variance that the line leaves; `None` where it does not rise, or nothing varies.
    fn unexplained(&self) -> Option<f64> {
        let [count, thrust, square, thrusts, squares, both] = self.0;
        let of = |product: f64, one: f64, other: f64| product - one * other / count;
        let (thrusts, squares) = (of(thrusts, thrust, thrust), of(squares, square, square));
        let both = of(both, thrust, square);
        (thrusts > 0.0 && squares > 0.0 && both > 0.0).then(|| 1.0 - both * both / (thrusts * squares))
    }
}

/// Of each part of the log the sums at each lag, over rows that have a rate at all of them; thrusts and rates in units of their
/// greatest ones. `None` of a log with too few such rows.
fn parts(data: &RotorLog, lags: &[f64]) -> Option<Vec<Vec<Sums>>> {
    let thrust = data.thrust.as_deref()?;
    let rate = bridged(&data.time, &data.rate);
    let greatest = |values: &[f64]| values.iter().copied().filter(|it| it.is_finite()).fold(0.0, f64::max);
    let (most_thrust, most_rate) = (greatest(thrust), greatest(&rate));
    let measured: Vec<(usize, &Range<usize>)> = data
        .stretches
        .iter()
        .flat_map(|stretch| stretch.clone().map(move |row| (row, stretch)))
        .filter(|(row, _)| thrust[*row].is_finite() && rate[*row].is_finite())
        .collect();
    let every = measured.len().div_ceil(THRESHOLDS.late_most_rows).max(1);
    let mut parts = vec![vec![Sums::default(); lags.len()]; PARTS];
    let mut count = 0;
    for at in (0..measured.len()).step_by(every) {
        let (row, stretch) = measured[at];
        let square = |lag: &f64| {
            let rate = rate_at(&data.time, &rate, stretch, data.time[row] + lag)? / most_rate;
            Some(rate * rate)
        };
        if let Some(squares) = lags.iter().map(square).collect::<Option<Vec<f64>>>() {
            count += 1;
            let part = &mut parts[at * PARTS / measured.len()];
            for (sums, square) in part.iter_mut().zip(squares) {
                *sums = sums.and(&Sums::of(thrust[row] / most_thrust, square), 1.0);
            }
        }
    }
    (count >= THRESHOLDS.late_fewest_rows).then_some(parts)
}

/// [rad/s] the rate at a time between two rows of a stretch, on the straight line between them.
fn rate_at(time: &[f64], rate: &[f64], stretch: &Range<usize>, at: f64) -> Option<f64> {
    let behind = stretch.start + time[stretch.clone()].partition_point(|time| *time < at);
    if behind == stretch.end || behind == stretch.start {
        return None;
    }
    let before = behind - 1;
    let share = (at - time[before]) / (time[behind] - time[before]);
    let found = rate[before] + share * (rate[behind] - rate[before]);
    found.is_finite().then_some(found)
}

/// [s] the lag that leaves least, between its neighbours on a parabola, and what it leaves; `None` at the end of the lags.
fn best(lags: &[f64], sums: impl Fn(usize) -> Sums) -> Option<(f64, f64)> {
    let left = (0..lags.len()).map(|lag| sums(lag).unexplained()).collect::<Option<Vec<f64>>>()?;
    let least = (0..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
    let (before, behind) = (left.get(least.checked_sub(1)?)?, left.get(least + 1)?);
    let bend = before - 2.0 * left[least] + behind;
    let aside = if bend > 0.0 { 0.5 * (before - behind) / bend } else { 0.0 };
    Some((lags[least] + aside * (lags[1] - lags[0]), left[least]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::tests::noise_of as noise;

    /// 40 s at 100 Hz of a rotor with a pole of 12 rad/s whose rate is read `late` and whose thrust is read `cell` [ms] after it is, by a noise of
    /// `rough` [N]; a reading every `every` rows.
    fn found(late: usize, cell: usize, rough: f64, every: usize) -> Option<(f64, f64)> {
        let command = |ms: usize| 0.3 + 0.1 * ((ms / 400 * 7 % 5) as f64);
        let mut rates = vec![0.0];
        for ms in 1..40_000 {
            let rate = rates[ms - 1];
            rates.push(rate + 0.001 * 12.0 * (1100.0 * command(ms) - rate));
        }
        let at = |row: usize, ago: usize| rates[(10 * row).saturating_sub(ago)];
        let rows = || 0..4000_usize;
        let mut log =
            Dataset::new("log.csv", "", rows().map(|row| 0.01 * row as f64).collect()).expect("rises");
        let read = |row: usize| {
            if row.is_multiple_of(every) { at(row, late) + 2.0 * noise(row, 1) } else { f64::NAN }
        };
        let force = |row: usize| 1.5e-5 * at(row, cell).powi(2) + rough * noise(row, 2);
        log.insert("command_1", rows().map(|row| command(10 * row)).collect()).expect("fits");
        log.insert("propeller_rate_1_rad_s", rows().map(read).collect()).expect("fits");
        log.insert("thrust_1_n", rows().map(force).collect()).expect("fits");
        let log = ScreenedLog::of(&log);
        let found = log.rotor(1).expect("a rotor").findings().find(|it| it.code == RATE_BEHIND_THRUST);
        found.map(|it| (it.number("late_s"), it.number("standard_error_s")))
    }

    #[test]
    fn a_rate_that_is_read_late_is_seen_beside_a_load_cell() {
        for (late, cell, rough, every) in
            [(25, 0, 0.05, 1), (60, 0, 0.05, 1), (40, 15, 0.05, 1), (12, 0, 0.02, 1), (45, 0, 0.05, 5)]
        {
            let (found, error) = found(late, cell, rough, every).expect("late");
            let true_s = 1e-3 * (late - cell) as f64;
            // Between readings the rate bends away from a line, by a twentieth of their interval on the way to a new level.
            let bend = 0.05 * 0.01 * every as f64;
            assert!((found - true_s).abs() < bend + 3.0 * error + 5e-4, "{late} {cell}: {found} ± {error}");
        }
    }

    #[test]
    fn a_rate_in_time_or_a_late_load_cell_is_none() {
        for (late, cell, rough) in [(0, 0, 0.05), (0, 0, 1.0), (0, 30, 0.05), (20, 20, 0.05), (3, 0, 0.02)] {
            assert_eq!(found(late, cell, rough, 1), None, "{late} {cell} {rough}");
        }
    }
}
