//! Commands that step between two rows: whoever writes rows on a clock of his own shows a step in the first row behind it.
//!
//! Held from that row on, a command comes half a row too late on average, and by another part of a row at each step: a rotor seems faster
//! than it is, and something to be missing. Whether a log is of that kind its rates say: when they answered to each step is
//! spread evenly over the interval before its row, and nothing else explains the spread. Then each step is taken to have happened
//! when the rates say it did, and a command that moves from row to row half a row before.

use crate::estimation::step_instants::{Hold, Instants, Stepped};
use crate::screening::channel::Judgement;
use crate::screening::channel_noise::ChannelNoise;
use crate::screening::rotor::CheckedRotor;
use crate::screening::rotor_data::RotorLog;
use crate::screening::thresholds::THRESHOLDS;

/// [intervals²] variance of instants that are spread evenly over their interval.
const EVEN: f64 = 1.0 / 12.0;

/// Finds out when commands stepped. Left out are rows that hang on a step whose instant they do not say.
pub(crate) fn check(rotor: &mut CheckedRotor) -> Option<Judgement> {
    if !rotor.is_measured() {
        return None;
    }
    let data = &mut rotor.data;
    let noise = ChannelNoise::of(data.rate.iter().copied()).in_signal(&data.rate, &data.stretches);
    // However much better they are than steps at rows: what leaves more than noise does not explain what the rotor did.
    let most_left = THRESHOLDS.most_left_of_steps * noise;
    let elsewhere = rotor.steps_elsewhere;
    let fewest = if elsewhere { THRESHOLDS.fewest_steps_elsewhere } else { THRESHOLDS.fewest_between_steps };
    let instants = data.step_instants(fewest, most_left).filter(|it| step_between_rows(it, elsewhere))?;
    data.set_steps(&instants);
    let unknown: Vec<usize> =
        instants.unknown.iter().copied().filter(|row| data.rate[*row].is_finite()).collect();
    unknown.iter().for_each(|row| data.rate[*row] = f64::NAN);
    let finding = data.finding("steps_between_rows").with("steps", instants.steps.len());
    let finding = finding.with("interval_s", data.interval);
    let finding = finding.with("known_to_s", instants.deviation() * data.interval);
    Some(Judgement::new(finding.with("delay_known_to_s", data.delay_unknown), unknown))
}

/// Whether steps happened between rows. Where they do `elsewhere`, in another log of the bench, they need not be spread evenly: few
/// steps say nothing of that.
fn step_between_rows(found: &Instants, elsewhere: bool) -> bool {
    let known = found.deviation().powi(2);
    // What even instants, each known to its error, scatter by.
    let expected = EVEN - known;
    let least = THRESHOLDS.even_spread * (1.0 + known / EVEN);
    // Instants that want to be beyond their interval stand at its ends: more than even ones do is a law that was not known. (The
    // variance of even ones is known to √(0.8 / n) of itself.)
    let chance =
        THRESHOLDS.widest_spread_errors * (THRESHOLDS.even_variance_error / found.steps.len() as f64).sqrt();
    let is_within = found.spread() < expected * (1.0 + chance);
    // What the rates cannot tell from chance they do not say.
    let is_spread = elsewhere || found.unexplained_variance() > least * expected;
    let is_even = expected > THRESHOLDS.telling_spread && is_within && is_spread;
    // Rates that do not answer the command say nothing of when it stepped.
    found.answered.abs() > THRESHOLDS.answered_steps
        && found.over_rows > THRESHOLDS.between_rows_evidence
        && found.over_lead > THRESHOLDS.logged_late_evidence
        && is_even
}

impl RotorLog {
    fn step_instants(&self, fewest: usize, most_left: f64) -> Option<Instants> {
        if !Stepped::may_step(self.stretches.iter().map(|rows| &self.command[rows.clone()]), fewest) {
            return None;
        }
        let mut stretches: Vec<Vec<Hold>> = Vec::new();
        for rows in &self.stretches {
            let mut holds: Vec<Hold> = Vec::new();
            for row in rows.clone() {
                match holds.last_mut().filter(|hold| hold.input == self.command[row]) {
                    Some(hold) => hold.end = row + 1,
                    None => holds.push(Hold { from: row, end: row + 1, input: self.command[row] }),
                }
            }
            stretches.push(holds);
        }
        let (time, output) = (&self.time[..], &self.rate[..]);
        let other = self.voltage.as_deref();
        let stepped = Stepped { time, output, other, stretches: &stretches, interval: self.interval };
        stepped.instants(fewest, most_left)
    }

    /// Takes each command from when its step happened, and what moves without a step that was looked at half a row early.
    fn set_steps(&mut self, instants: &Instants) {
        let mut from = self.time.to_vec();
        let mut steps = instants.steps.iter().peekable();
        for row in self.stretches.iter().flat_map(|rows| rows.clone().skip(1)) {
            while steps.peek().is_some_and(|step| step.row < row) {
                steps.next();
            }
            if self.command[row] != self.command[row - 1] {
                let known = steps.peek().filter(|step| step.row == row);
                let ahead = known.map_or(0.5, |step| step.ahead);
                from[row] -= ahead * (self.time[row] - self.time[row - 1]);
            }
        }
        // Instants are half a row early on average if the logger's clock has nothing to do with the commands': nobody has said so.
        self.delay_unknown = (self.interval * EVEN.sqrt()).hypot(instants.delay_deviation);
        self.delay_found = instants.delay;
        self.command_from = Some(from.into());
    }
}

#[cfg(test)]
mod tests {
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;
    use crate::screening::same_bench::of_one_bench;

    /// [s] of the rows.
    const ROW: f64 = 0.02;

    /// 60 s of a lag with a pole of 12 rad/s whose command steps each 0.5 to 0.9 s, `placed` says when; and when each step happened.
    fn log(placed: impl Fn(f64) -> f64) -> (ScreenedLog, Vec<f64>) {
        let (log, steps) = made(placed, 0.0, 0.0);
        (log.into(), steps)
    }

    /// The same; its rotor obeys `late` [s], and its battery gives way by `sag` [V] from the least command to the greatest, by and by.
    fn made(placed: impl Fn(f64) -> f64, late: f64, sag: f64) -> (Dataset, Vec<f64>) {
        const POLE: f64 = 12.0;
        const BATTERY_POLE: f64 = 4.0;
        let hash = |at: usize| (at as f64 * 12.9898).sin().mul_add(43_758.547, 0.0).rem_euclid(1.0);
        let (mut steps, mut at) = (Vec::new(), 0.3);
        while at < 60.0 {
            steps.push((placed(at), 0.3 + 0.3 * hash(3 * steps.len() + 1)));
            at += 0.5 + 0.4 * hash(7 * steps.len() + 2);
        }
        let goal = |command: f64, volts: f64| 1_250.0 * command + 40.0 * (volts - 12.4);
        // Rate and voltage some time behind a step to this command.
        let after = |command: f64, [rate, volts]: [f64; 2], span: f64| {
            let settled = 12.4 - sag * (command - 0.3) / 0.3;
            let above = (volts - settled) * (-BATTERY_POLE * span).exp();
            let slow = 40.0 * POLE / (POLE - BATTERY_POLE);
            let fast = rate - goal(command, settled) - slow * (volts - settled);
            let rate = goal(command, settled) + slow * above + fast * (-POLE * span).exp();
            [rate, settled + above]
        };
        let (mut state, mut since, mut target) = ([500.0, 12.4], 0.0, 0.4);
        let (mut commands, mut rates, mut voltage) = (Vec::new(), Vec::new(), Vec::new());
        let mut next = steps.iter().peekable();
        let time: Vec<f64> = (0..3_000).map(|row| ROW * row as f64).collect();
        for (row, now) in time.iter().enumerate() {
            while let Some((at, to)) = next.next_if(|step| step.0 + late <= *now + 1e-9) {
                state = after(target, state, at + late - since);
                (since, target) = (at + late, *to);
            }
            let command = steps.iter().rfind(|step| step.0 <= *now + 1e-9).map_or(0.4, |step| step.1);
            let [rate, volts] = after(target, state, now - since);
            commands.push(command);
            voltage.push(volts);
            let noise = 2.0 * (hash(row) + hash(row + 5_000) - 1.0);
            rates.push(rate + noise);
        }
        let mut log = Dataset::new("here", "", time).expect("time rises");
        log.insert("command_1", commands).expect("fits");
        log.insert("propeller_rate_1_rad_s", rates).expect("fits");
        if sag > 0.0 {
            log.insert("battery_voltage_v", voltage).expect("fits");
        }
        (log, steps.into_iter().map(|step| step.0).collect())
    }

    /// [rows] rms of how far the instants of these steps are from when they were obeyed.
    fn off_by(log: &ScreenedLog, steps: &[f64], obeyed: &[f64]) -> f64 {
        let data = log.rotor(1).expect("a rotor").data();
        let from = data.command_from_beside(0.0, &(0..data.time.len())).expect("known");
        let changes = (1..from.len()).filter(|row| data.command[*row] != data.command[row - 1]);
        let off = |row: usize| {
            let step = steps.iter().rposition(|at| *at <= data.time[row] + 1e-9).expect("one of them");
            (from[row] - obeyed[step]) / ROW
        };
        let squares: Vec<f64> = changes.map(|row| off(row).powi(2)).collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    fn said(log: &ScreenedLog) -> Option<&crate::screening::Finding> {
        log.rotor_findings().find(|it| it.code == "steps_between_rows")
    }

    #[test]
    fn each_step_is_put_where_the_rates_say_that_it_was() {
        let (log, steps) = log(|at| at);
        let finding = said(&log).expect("found");
        assert!(finding.count("steps") > 70, "{finding}");
        let data = log.rotor(1).expect("a rotor").data();
        let from = data.command_from.as_deref().expect("known");
        let rms = off_by(&log, &steps, &steps);
        // Noise of 0.8 rad/s beside steps of some 125: 0.03 rows, and a row's half where a step is too small to be seen. Held from its
        // row on, each is off by 0.58 rows.
        assert!(rms < 0.12, "{rms} rows");
        assert!(
            (0..3_000).all(|row| from[row] <= data.time[row] && (row == 0 || from[row] > data.time[row - 1]))
        );
        // A part knows what the whole does.
        let part = log.of_rows(std::slice::from_ref(&(1_000..1_400)));
        let data = part.rotor(1).expect("a rotor").data();
        assert_eq!(data.command_from.as_deref(), Some(&from[1_000..1_400]));
    }

    /// Beside a model without a dead time, one that nobody can tell from none goes into the instants.
    #[test]
    fn a_dead_time_is_none_up_to_half_a_row() {
        for (rows_late, of_them) in [(0.2, 0.0), (0.5, 0.0), (1.4, 1.4)] {
            let (log, steps) = made(|at| at, ROW * rows_late, 0.0);
            let log = ScreenedLog::from(log);
            let data = log.rotor(1).expect("a rotor").data();
            let found = data.delay_found / ROW;
            assert!((found - rows_late).abs() < 0.1, "{rows_late}: {found}");
            // As well as without one.
            let obeyed: Vec<f64> = steps.iter().map(|at| at + ROW * (rows_late - of_them)).collect();
            let rms = off_by(&log, &steps, &obeyed);
            assert!(rms < 0.12, "{rows_late}: {rms} rows");
            // Beside a model whose dead time is as near as one can know, the steps come when that says so.
            let rows = 0..3_000;
            let beside = |delay: f64| data.command_from_beside(delay, &rows).expect("known");
            let moved =
                |delay: f64| (beside(delay)[500] - data.command_from(&rows).expect("known")[500]) / ROW;
            assert!((moved(data.delay_found + 0.3 * ROW) + 0.3).abs() < 1e-9);
            assert_eq!(moved(data.delay_found + 0.9 * ROW), 0.0, "another bench");
        }
    }

    /// What the battery does to the rate behind a step, a fifth of what the step does, says nothing of when it came.
    #[test]
    fn a_battery_that_gives_way_moves_no_step() {
        let (log, steps) = made(|at| at, 0.0, 2.0);
        let log = ScreenedLog::from(log);
        let rms = off_by(&log, &steps, &steps);
        assert!(rms < 0.12, "{rms} rows");
    }

    /// The last step, behind which the log ends before its level is known.
    #[test]
    fn rows_behind_a_step_that_cannot_be_placed_are_left_out() {
        let (log, _) = made(|at| at, 0.0, 0.0);
        let commands = log.column("command_1").expect("there");
        let last = (1..3_000).rfind(|row| commands[*row] != commands[row - 1]).expect("one");
        let log = ScreenedLog::from(log.of_rows(std::slice::from_ref(&(0..last + 3))));
        let data = log.rotor(1).expect("a rotor").data();
        assert!(said(&log).is_some_and(|finding| finding.rows == 3), "{:?}", said(&log));
        assert!(data.rate[last..].iter().all(|rate| rate.is_nan()) && data.rate[last - 1].is_finite());
    }

    /// What a short log cannot say by itself a longer one of the same bench says; where its steps are at their rows, they stay there.
    #[test]
    fn few_steps_are_enough_beside_another_log() {
        let rows = |at: f64| (at / ROW).ceil() * ROW;
        let [between, at_rows] = [made(|at| at, 0.0, 0.0).0, made(rows, 0.0, 0.0).0];
        let short = |log: &Dataset| ScreenedLog::from(log.of_rows(std::slice::from_ref(&(0..200))));
        let alone = [ScreenedLog::from(between.clone()), short(&between), short(&at_rows)];
        assert_eq!([0, 1, 2].map(|log: usize| said(&alone[log]).is_some()), [true, false, false]);
        let together = of_one_bench(&alone);
        assert_eq!([0, 1, 2].map(|log: usize| said(&together[log]).is_some()), [true, true, false]);
        let steps = said(&together[1]).map(|finding| finding.count("steps"));
        assert!(steps.is_some_and(|steps| (3..10).contains(&steps)), "{steps:?}");
    }

    /// Nothing is moved where commands are what their rows say: at the row, late by a dead time, or logged a row too late.
    #[test]
    fn steps_at_rows_stay_there() {
        let rows = |at: f64| (at / ROW).ceil() * ROW;
        for late in [0.0, 0.013, 0.03, -ROW] {
            let (mut log, _) = log(|at| rows(at) + late);
            if late > 0.0 {
                // What the rotor obeys, later than it was sent.
                let sent = self::log(rows).0.dataset().column("command_1").expect("there").to_vec();
                let mut raw = log.dataset().clone();
                raw.replace("command_1", sent).expect("fits");
                log = raw.into();
            }
            if late < 0.0 {
                let mut raw = log.dataset().clone();
                let mut logged = raw.column("command_1").expect("there").to_vec();
                logged.rotate_right(1);
                raw.replace("command_1", logged).expect("fits");
                log = raw.into();
            }
            assert!(said(&log).is_none(), "{late}: {:?}", said(&log));
            assert!(log.rotor(1).expect("a rotor").data().command_from.is_none());
        }
    }
}
