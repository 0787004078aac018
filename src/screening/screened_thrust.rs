//! The thrust of one rotor, judged once: the rows at which it is held against the thrust curve, and why the others are not.
//!
//! The curve f = c ω², [LPC16] Eq. (11), asks for the rate that the rotor had, and for nothing else: what it was commanded does
//! not matter, nor whether its rate answered. So a row is scored where thrust and rate were measured, under whatever command.
//! Where the two come in turns, the rate lies on a straight line between its readings. In a transient behind a hole of the rows
//! readings are older than their rows say, each by its own: rate and thrust are not of one moment there. At standstill there is no thrust and
//! no curve: zero from zero says nothing of c, and as many such rows as one likes would make any curve look good.

use std::borrow::Cow;

use super::checks::transient_behind_hole::TRANSIENT_BEHIND_HOLE;
use super::left_out::{LeftOut, ROTOR_RATE_MISSING, STANDSTILL};
use super::readings;
use super::screened_rotor::ScreenedRotor;
use super::thresholds::THRESHOLDS;
use crate::log::Dataset;
use crate::signal::columns;

/// The thrust of one rotor of a log, and which of its rows are scored.
#[derive(Debug, Clone)]
pub struct ScreenedThrust {
    number: usize,
    columns: [String; 2],
    /// Whether the rate comes between the thrusts: it lies on lines.
    in_turns: bool,
    left_out: LeftOut,
}

impl ScreenedThrust {
    /// Judges the thrust of rotor `number` (from 1) in a log whose channels were judged; `None` when it or the rate is not
    /// there. `rotor` is what is known of its commands.
    pub(crate) fn of(log: &Dataset, number: usize, rotor: Option<&ScreenedRotor>) -> Option<Self> {
        let columns = [columns::thrust(number), columns::propeller_rate(number)];
        let (thrust, rate) = (log.column(&columns[0])?, log.column(&columns[1])?);
        let lines = readings::bridged(log.time(), rate);
        let of_rotor = |row: usize| {
            let rotor = rotor?;
            let is_hidden = rotor.reason(row) == Some(TRANSIENT_BEHIND_HOLE);
            if rotor.rests(row) { Some(STANDSTILL) } else { is_hidden.then_some(TRANSIENT_BEHIND_HOLE) }
        };
        let measured = || (0..log.len()).filter(|row| thrust[*row].is_finite() && of_rotor(*row).is_none());
        let with = |rate: &[f64]| measured().filter(|row| rate[*row].is_finite()).count();
        let in_turns = THRESHOLDS.thrust_in_turns * with(rate) < with(&lines);
        let known = if in_turns { &lines[..] } else { rate };
        let why = (0..log.len()).map(|row| {
            let is_known = known[row].is_finite();
            let why = of_rotor(row).or((!is_known).then_some(ROTOR_RATE_MISSING));
            why.filter(|_| thrust[row].is_finite())
        });
        let left_out = LeftOut::of(why);
        Some(Self { number, columns, in_turns, left_out })
    }

    /// Scores no row that is not scored in the log that it is a part of: `rows` are its own in it.
    pub(crate) fn keep_to(&mut self, whole: &Self, rows: &[usize]) {
        self.left_out = self.left_out.and_of(&whole.left_out, rows);
    }

    /// The rotor's number in the columns' names, from 1.
    #[must_use]
    pub fn number(&self) -> usize {
        self.number
    }

    /// Why a row is not scored: a code; `None` of one that is, and of one whose thrust is empty.
    #[must_use]
    pub fn reason(&self, row: usize) -> Option<&'static str> {
        self.left_out.reason(row)
    }

    /// [N] the thrust in `log`, the one that was judged; not-a-number where it is not scored.
    pub(crate) fn scored<'a>(&self, log: &'a Dataset) -> Cow<'a, [f64]> {
        self.left_out.blank(log.column(&self.columns[0]).unwrap_or_default())
    }

    /// [rad/s] the rate that it goes with.
    pub(crate) fn rate<'a>(&self, log: &'a Dataset) -> Cow<'a, [f64]> {
        let rate = log.column(&self.columns[1]).unwrap_or_default();
        if self.in_turns { readings::bridged(log.time(), rate) } else { Cow::Borrowed(rate) }
    }
}

#[cfg(test)]
mod tests {
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// A rotor that is stopped for rows 100 to 149; thrust in every row but `without`, the rate in those of `has_rate`.
    fn log(has_rate: impl Fn(usize) -> bool, without: usize) -> ScreenedLog {
        let time: Vec<f64> = (0..400).map(|row| 0.01 * f64::from(row)).collect();
        let mut log = Dataset::new("log.csv", "", time).expect("time rises");
        let command =
            |row: usize| if (100..150).contains(&row) { 0.0 } else { 0.4 + 0.1 * (row / 10 % 2) as f64 };
        let rate = |row: usize| if has_rate(row) { 1300.0 * command(row) } else { f64::NAN };
        let thrust =
            |row: usize| if row == without { f64::NAN } else { 1e-5 * (1300.0 * command(row)).powi(2) };
        for (name, value) in [
            ("command_1", &command as &dyn Fn(usize) -> f64),
            ("propeller_rate_1_rad_s", &rate),
            ("thrust_1_n", &thrust),
        ] {
            log.insert(name, (0..400).map(value).collect()).expect("fits");
        }
        log.into()
    }

    #[test]
    fn thrust_is_scored_where_it_and_the_rate_of_a_turning_rotor_were_measured() {
        let log = log(|row| !(200..210).contains(&row), 300);
        let thrust = log.thrust(1).expect("measured");
        assert_eq!(
            [99, 120, 205, 300].map(|row| thrust.reason(row)),
            [None, Some("standstill_left_out"), Some("rotor_rate_missing"), None]
        );
        let scored = thrust.scored(log.dataset());
        // 50 rows at rest, 50 more until it has started.
        assert_eq!(scored.iter().filter(|it| it.is_finite()).count(), 400 - 100 - 10 - 1);
    }

    #[test]
    fn where_rates_come_between_the_thrusts_they_lie_on_lines() {
        let log = log(|row| row % 3 == 1, 999);
        let thrust = log.thrust(1).expect("measured");
        assert_eq!([204, 205, 399].map(|row| thrust.reason(row)), [None, None, Some("rotor_rate_missing")]);
        assert!(thrust.rate(log.dataset())[204].is_finite());
    }
}
