//! Holes in the rows behind a step of the command: a logger that stalls just then.
//!
//! When a command took effect that changed in a hole, or just before it, the rows do not say: the row that carries it and the
//! first one behind the hole may be older or younger than their stamps. Taken at their word, such rows make a delay look like
//! a rotor that cannot move faster. So the run ends where the command changed, or with the hole, if the rates were seen to answer
//! before it; and a new one begins when the transient is over, for what it started from no longer matters then. How long that
//! takes the log's other steps say. Where commands change before a rotor settles, nothing would be left: such logs are taken as
//! they are.

use std::ops::Range;

use crate::estimation::quantile::{median, median_step, quantile};
use crate::screening::channel::Judgement;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::{LEAST_COMMAND, RotorLog};
use crate::screening::thresholds::THRESHOLDS;

/// The code: rows behind a hole whose transient nobody saw begin.
pub const TRANSIENT_BEHIND_HOLE: &str = "transient_behind_hole";

/// How long rates take to settle behind a step.
struct Settling {
    /// [s]
    time: f64,
    /// Steps without a hole that say so; none = the threshold.
    steps: usize,
}

/// Takes transients whose begin a hole hid out of the score, and out of the stretches.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    // Of rows that are levels each the pauses between them are no holes.
    if rotor.data.rows_are_levels() { None } else { rotor.data.leave_out_hidden_transients() }
}

impl RotorLog {
    fn leave_out_hidden_transients(&mut self) -> Option<Judgement> {
        let holes: Vec<usize> =
            (0..self.time.len().saturating_sub(1)).filter(|row| self.is_hole(*row)).collect();
        let steps = self.steps();
        let held = median_step(steps.iter().map(|row| self.time[*row]));
        let held = held.filter(|_| !holes.is_empty())?;
        let settling = self.settling(&steps, &holes);
        if held < THRESHOLDS.transient_held * settling.time {
            return None;
        }
        let hidden: Vec<Range<usize>> =
            holes.iter().filter_map(|hole| self.hidden(*hole, &steps, settling.time)).collect();
        let measured = |row: &usize| self.rate[*row].is_finite();
        let mut left: Vec<usize> = hidden.iter().cloned().flatten().filter(measured).collect();
        left.sort_unstable();
        left.dedup();
        left.iter().for_each(|row| self.rate[*row] = f64::NAN);
        hidden.iter().for_each(|rows| self.cut(rows));
        let finding = self.finding(TRANSIENT_BEHIND_HOLE).with("holes", hidden.len());
        let finding = finding.with("settled_s", settling.time).with("steps", settling.steps);
        (!left.is_empty()).then(|| Judgement::new(finding, left))
    }

    /// Rows from which on the command is another one.
    fn steps(&self) -> Vec<usize> {
        let differs = |row: &usize| (self.command[*row] - self.command[row - 1]).abs() > THRESHOLDS.jump;
        (1..self.time.len()).filter(differs).collect()
    }

    /// Rows of the transient that the hole behind row `before` hides; `None` where rates had settled, or nothing changed.
    fn hidden(&self, before: usize, steps: &[usize], settling: f64) -> Option<Range<usize>> {
        let after = before + 1;
        let step = *steps[..steps.partition_point(|step| *step <= after)].last()?;
        if step < after && self.time[before] - self.time[step] > settling {
            return None;
        }
        let over = self.over(after, steps, settling);
        let had_begun = step < after && self.moved(step - 1, before, over);
        Some(if had_begun { after } else { step }..over)
    }

    /// The row from which a transient that begins at the latest in row `after` is over. A step meanwhile is not cut in two: the
    /// run starts behind the row that carries it, by when it is under way.
    fn over(&self, after: usize, steps: &[usize], settling: f64) -> usize {
        let mut end = self.time[after] + settling;
        let later = &steps[steps.partition_point(|step| *step <= after)..];
        for step in later {
            if self.time[*step] > end {
                break;
            }
            end = end.max(self.time[*step] + THRESHOLDS.transient_under_way);
        }
        // Less than any row is away from the next, and more than sums of stamps are rounded by.
        self.time.partition_point(|time| *time < end - 1e-6)
    }

    /// Whether the rate went on its way from row `from` to row `to`, as far as it is known where it went until row `over`.
    fn moved(&self, from: usize, to: usize, over: usize) -> bool {
        let near = |row: usize| {
            let rows = row.saturating_sub(THRESHOLDS.transient_rows)..=row;
            rows.rev().map(|row| self.rate[row]).find(|rate| rate.is_finite())
        };
        let (Some(start), Some(now), Some(end)) = (near(from), near(to), near(over.min(self.time.len() - 1)))
        else {
            return false;
        };
        (now - start) / (end - start) > THRESHOLDS.transient_begun
    }

    /// How long rates take to settle, by the steps in sight; the threshold where there are none.
    fn settling(&self, steps: &[usize], holes: &[usize]) -> Settling {
        let ends = steps.iter().skip(1).copied().chain([self.time.len()]);
        let seen = steps.iter().zip(ends).filter_map(|(step, next)| self.settles(*step..next, holes));
        let times: Vec<f64> = seen.collect();
        let usual = quantile(times.iter().copied(), THRESHOLDS.transient_usual);
        Settling { time: usual.unwrap_or(THRESHOLDS.transient), steps: times.len() }
    }

    /// [s] until the rate stays near its level behind the step to a command that is held over `rows`; `None` where that is not
    /// seen, or the rotor stands or starts.
    fn settles(&self, rows: Range<usize>, holes: &[usize]) -> Option<f64> {
        let since = |row: usize| self.time[row] - self.time[rows.start];
        let end = rows.clone().find(|row| since(*row) > THRESHOLDS.transient_seen)?;
        let turns = |row: usize| self.command[row] >= LEAST_COMMAND;
        let hole = holes.get(holes.partition_point(|hole| *hole < rows.start - 1));
        let is_whole = hole.is_none_or(|hole| *hole >= end);
        if !(is_whole && turns(rows.start - 1) && turns(rows.start)) {
            return None;
        }
        let measured = || (rows.start..end).filter(|row| self.rate[*row].is_finite());
        let late =
            measured().filter(|row| since(*row) > THRESHOLDS.transient_late * THRESHOLDS.transient_seen);
        let level = median(late.clone().map(|row| self.rate[row]))?;
        let scatter = median(late.map(|row| (self.rate[row] - level).abs()))?;
        let from =
            self.rate[..rows.start].iter().rev().take(THRESHOLDS.transient_rows).find(|it| it.is_finite())?;
        let near =
            (THRESHOLDS.transient_near * (level - from).abs()).max(THRESHOLDS.transient_scatter * scatter);
        let away = measured().rfind(|row| (self.rate[*row] - level).abs() > near);
        let settled = away.map_or(0.0, since) + self.interval;
        // Away until late: it does not settle in sight.
        (settled < THRESHOLDS.transient_late * THRESHOLDS.transient_seen).then_some(settled)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// 100 Hz, two levels in turn that change at these rows, a rotor that goes 1/5 of its way in each row, and holes of 90 ms
    /// behind these rows.
    fn log(changes: &[usize], holes: &[usize]) -> ScreenedLog {
        let rows = 1000;
        let hidden = |row: usize| holes.iter().filter(|hole| **hole < row).count();
        let time = (0..rows).map(|row| 0.01 * row as f64 + 0.08 * hidden(row) as f64).collect();
        let level = |row: usize| changes.iter().filter(|change| **change <= row).count();
        let command: Vec<f64> = (0..rows).map(|row| 0.3 + 0.2 * (level(row) % 2) as f64).collect();
        let mut rate = 390.0;
        let follow = |command: &f64| {
            let shown = rate;
            rate += 0.2 * (1300.0 * command - rate);
            shown
        };
        let rates = command.iter().map(follow).collect();
        Dataset::made(time, [("propeller_rate_1_rad_s", rates), ("command_1", command)]).into()
    }

    const CHANGES: [usize; 5] = [100, 250, 450, 600, 800];

    /// What is left out of the score as hidden, and where runs start.
    fn judged(log: &ScreenedLog) -> (Vec<usize>, Vec<Range<usize>>) {
        let rotor = log.rotor(1).expect("a rotor");
        let left = (0..1000).filter(|row| rotor.reason(*row) == Some(TRANSIENT_BEHIND_HOLE));
        assert!((0..1000).all(|row| rotor.is_scored(row) != (rotor.reason(row).is_some())));
        (left.collect(), rotor.data().run_stretches())
    }

    /// Rates come within 3 % of a step's way in 16 rows behind the first that answers: 0.8^16 = 0.028.
    #[test]
    fn a_transient_whose_begin_a_hole_hid_is_left_out() {
        let log = log(&CHANGES, &[100]);
        let (left, runs) = judged(&log);
        assert_eq!(left, (100..117).collect::<Vec<_>>());
        assert_eq!(runs, [0..100, 117..1000]);
        let finding = log.rotor_findings().find(|it| it.code == TRANSIENT_BEHIND_HOLE).expect("found");
        assert_eq!((finding.rows, finding.count("holes"), finding.count("steps")), (17, 1, 4));
        assert!((finding.number("settled_s") - 0.16).abs() < 1e-9, "{finding}");
        // Of five jumps four can be used, and the hole is why one cannot.
        let data = log.rotor(1).expect("a rotor").data();
        assert_eq!((data.all_jumps(), data.jumps().len()), ((5, 1), 4));
    }

    #[test]
    fn a_command_that_changed_in_a_hole_is_one_too() {
        let (left, runs) = judged(&log(&CHANGES, &[99]));
        assert_eq!((left, runs), ((100..116).collect(), vec![0..100, 116..1000]));
    }

    /// The rates answered before the hole: what they did then counts.
    #[test]
    fn an_answer_seen_before_the_hole_stays() {
        let (left, runs) = judged(&log(&CHANGES, &[105]));
        assert_eq!((left, runs), ((106..122).collect(), vec![0..106, 122..1000]));
    }

    /// A step within the transient: the run starts when it is under way, not where it is sent.
    #[test]
    fn a_step_meanwhile_is_not_cut_in_two() {
        let changes = [100, 112, 300, 450, 600, 800];
        let (left, runs) = judged(&log(&changes, &[100]));
        assert_eq!((left, runs), ((100..122).collect(), vec![0..100, 122..1000]));
    }

    #[test]
    fn holes_elsewhere_hide_nothing() {
        for hole in [50, 130, 220] {
            let (left, runs) = judged(&log(&CHANGES, &[hole]));
            assert_eq!((left, runs.as_slice()), (vec![], std::slice::from_ref(&(0..1000))), "{hole}");
        }
        // Commands change before the rotor settles: nothing would be left.
        let often: Vec<usize> = (1..100).map(|index| 10 * index).collect();
        let (left, runs) = judged(&log(&often, &[100, 300]));
        assert_eq!((left, runs), (vec![], vec![0..101, 101..301, 301..1000]));
    }

    /// Every step has its hole: the threshold says how long rates take.
    #[test]
    fn without_a_step_in_sight_the_threshold_holds() {
        let log = log(&CHANGES, &CHANGES);
        let (left, _) = judged(&log);
        assert_eq!(
            left.iter().filter(|row| **row < 250).copied().collect::<Vec<_>>(),
            (100..126).collect::<Vec<_>>()
        );
        let finding = log.rotor_findings().find(|it| it.code == TRANSIENT_BEHIND_HOLE).expect("found");
        assert_eq!((finding.count("steps"), finding.number("settled_s")), (0, THRESHOLDS.transient));
    }

    /// Nobody saw when the transient behind it began. A part that begins in the transient has no hole, and would take it for a
    /// rotor that comes from elsewhere.
    #[test]
    fn a_part_that_begins_behind_a_hole_knows_of_it_of_rate_and_thrust() {
        let mut log = log(&CHANGES, &[449]).dataset().clone();
        let rates = log.column("propeller_rate_1_rad_s").expect("there");
        let thrusts = rates.iter().map(|rate| 3e-6 * rate * rate).collect();
        log.insert("thrust_1_n", thrusts).expect("as long");
        let stretch = 455..550;
        let alone = ScreenedLog::from(log.of_rows(std::slice::from_ref(&stretch)));
        let whole = ScreenedLog::from(log);
        let part = whole.of_rows(std::slice::from_ref(&stretch));
        let hidden = |log: &ScreenedLog, rows: Range<usize>| {
            let (rotor, thrust) = (log.rotor(1).expect("a rotor"), log.thrust(1).expect("its thrust"));
            let count = |reason: &dyn Fn(usize) -> Option<&'static str>| {
                rows.clone().filter(|row| reason(*row) == Some(TRANSIENT_BEHIND_HOLE)).count()
            };
            [count(&|row| rotor.reason(row)), count(&|row| thrust.reason(row))]
        };
        let in_whole = hidden(&whole, stretch.clone());
        assert!(in_whole.iter().all(|rows| *rows > 2), "{in_whole:?}");
        assert_eq!(hidden(&part, 0..stretch.len()), in_whole);
        assert_eq!(hidden(&alone, 0..stretch.len()), [0, 0], "alone it cannot be known");
    }
}
