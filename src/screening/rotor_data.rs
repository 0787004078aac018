//! One rotor's part of a log, made ready: commands held between samples, stretches over which all of them are known, and
//! the rates that count.

use std::borrow::Cow;
use std::ops::Range;

use super::Finding;
use super::missing_commands::{self, Missing};
use super::thresholds::THRESHOLDS;
use crate::estimation::quantile::{extremes, median};
use crate::log::dataset::is_hole;
use crate::log::segments::held_or;
use crate::log::thresholds as log_thresholds;
use crate::log::{Cells, Dataset};
use crate::signal::columns::{self, BATTERY_VOLTAGE};

/// [-] below this command a rotor may stand still; the model does not speak of starting from standstill.
pub(crate) const LEAST_COMMAND: f64 = THRESHOLDS.least_command;

/// One rotor of one log.
#[derive(Debug, Clone)]
pub(crate) struct RotorLog {
    /// The log's name.
    pub file: String,
    /// The number that the rotor's columns have.
    pub number: usize,
    /// [s]
    pub time: Cells,
    /// [-] each command held until the next.
    pub command: Cells,
    /// [s] from when on the command of each row was in force, where that is known to be before its row.
    pub command_from: Option<Cells>,
    /// [s] standard deviation of what is known of a dead time from when commands step, where that is between rows.
    pub delay_unknown: f64,
    /// [s] the dead time that was found beside these instants.
    pub delay_found: f64,
    /// [rad/s] not-a-number = not measured, or the rotor is standing or starting.
    pub rate: Cells,
    /// [V] each reading held until the next.
    pub voltage: Option<Cells>,
    /// [s] longest time between two readings of the voltage.
    pub voltage_gap: Option<(f64, f64)>,
    /// [N] not-a-number = not measured.
    pub thrust: Option<Cells>,
    /// Its stretches: segments of the log, cut where a command is not known.
    pub stretches: Vec<Range<usize>>,
    /// [s] median sampling interval.
    pub interval: f64,
    /// What is known of the voltage where it is an instrument, and not read.
    pub instrument: Option<VoltageInstrument>,
    /// The log's other rotor, where it was commanded.
    pub beside: Option<Beside>,
}

/// A rotor that draws on the same battery.
#[derive(Debug, Clone)]
pub(crate) struct Beside {
    /// [-] each command held until the next.
    pub command: Cells,
    /// [rad/s] as `RotorLog::rate`; `None` = no such column.
    pub rate: Option<Cells>,
}

/// A voltage without the noise of its reading.
#[derive(Debug, Clone, Copy)]
pub(crate) struct VoltageInstrument {
    /// [rad/s] Between two samples it moves as what follows a held command with this pole.
    pub pole: f64,
    /// [V] rms of what was read beside it.
    pub noise: f64,
}

/// The battery's voltage of a log, which all its rotors share.
pub(crate) struct HeldVoltage {
    /// [V] each reading held until the next.
    held: Cells,
    /// [s] longest time between two readings.
    gap: Option<(f64, f64)>,
}

impl HeldVoltage {
    /// `None` where the log has none.
    pub(crate) fn of(log: &Dataset) -> Option<Self> {
        let voltage = log.cells(BATTERY_VOLTAGE)?;
        Some(Self { gap: longest_gap(log.time(), &voltage), held: held_or_missing(voltage) })
    }
}

/// What the numbers of both rotors of a log add up to.
const OTHER: usize = 3;

impl Beside {
    fn of(log: &Dataset, rotor: usize) -> Option<Self> {
        let command = log.cells(&columns::command(rotor))?;
        let rate = log.cells(&columns::propeller_rate(rotor));
        Some(Self { command: held_or_missing(command), rate })
    }
}

/// Whether two dead times [s] of commands that step between rows are one, as far as such logs can say: instants and dead time are known
/// together only, and a bench has one.
pub(crate) fn is_one_delay(one: f64, other: f64, unknown: f64) -> bool {
    (one - other).abs() < THRESHOLDS.same_step_delay * unknown
}

impl RotorLog {
    /// Rows between two holes that say nothing.
    pub(crate) const FEWEST_ROWS: usize = THRESHOLDS.fewest_rows;

    /// The part of rotor `rotor` (from 1) as it is logged, and the commands that are missing; `None` when the log does not hold
    /// its command. Without a column of rates none is measured. `voltage` is that of the log.
    pub fn read(log: &Dataset, voltage: Option<&HeldVoltage>, rotor: usize) -> Option<(Self, Missing)> {
        let command = log.cells(&columns::command(rotor))?;
        let rate = log.cells(&columns::propeller_rate(rotor));
        let mut segments = log.segments();
        for segment in &mut segments {
            // Before the first command of a stretch nobody knows what the rotor was commanded.
            segment.start = segment.clone().find(|&row| command[row].is_finite()).unwrap_or(segment.end);
        }
        segments.retain(|segment| segment.len() > Self::FEWEST_ROWS);
        let beside = OTHER.checked_sub(rotor).and_then(|other| Beside::of(log, other));
        let are_levels = are_levels(log.median_interval(), &command, beside.as_ref());
        let missing = if are_levels {
            // Whatever the pauses between them, each is known by itself.
            Missing { known: finite_runs(&command), ..Missing::default() }
        } else {
            missing_commands::find(log.time(), &command, &segments)
        };
        let fewest = if are_levels { 1 } else { 2 };
        let this = Self {
            file: log.source_name().to_owned(),
            number: rotor,
            time: log.time_cells(),
            command: held_cells(command, &segments),
            command_from: None,
            delay_unknown: 0.0,
            delay_found: 0.0,
            rate: rate.unwrap_or_else(|| vec![f64::NAN; log.len()].into()),
            voltage: voltage.map(|it| it.held.clone()),
            voltage_gap: voltage.and_then(|it| it.gap),
            thrust: log.cells(&columns::thrust(rotor)),
            stretches: missing.known.iter().filter(|known| known.len() >= fewest).cloned().collect(),
            interval: log.median_interval(),
            instrument: None,
            beside,
        };
        Some((this, missing))
    }

    /// Whether each row is a level of its own, at which the rotor has settled: points of a thrust stand, averaged or read off, with
    /// seconds between them. A log of many such rows, or one whose commands stand for many of them, is one whose time is in another unit.
    pub fn rows_are_levels(&self) -> bool {
        are_levels(self.interval, &self.command, self.beside.as_ref())
    }

    /// File and rotor, for people.
    pub fn source(&self) -> String {
        format!("{}, rotor {}", self.file, self.number)
    }

    /// A finding about this rotor in this log.
    pub(crate) fn finding(&self, code: &'static str) -> Finding {
        Finding::of_rotor(code, self.number).of(&self.file)
    }

    /// Ends the stretches of known commands before these rows, and begins new ones behind: what the rotor was
    /// commanded meanwhile is not known.
    pub(crate) fn cut(&mut self, rows: &Range<usize>) {
        let left = |stretch: &Range<usize>| {
            [stretch.start..stretch.end.min(rows.start), stretch.start.max(rows.end)..stretch.end]
        };
        let left: Vec<Range<usize>> =
            self.stretches.iter().flat_map(left).filter(|it| it.len() > 1).collect();
        self.stretches = left;
    }

    /// Stretches without holes, whether every command is known or not: for what changes slowly.
    pub fn whole(&self) -> Vec<Range<usize>> {
        let mut whole: Vec<Range<usize>> = Vec::new();
        for stretch in &self.stretches {
            let joins = |last: &Range<usize>| !(last.end - 1..stretch.start).any(|row| self.is_hole(row));
            match whole.last_mut().filter(|last| joins(last)) {
                Some(last) => last.end = stretch.end,
                None => whole.push(stretch.clone()),
            }
        }
        whole
    }

    /// Whether a hole follows this row.
    pub(crate) fn is_hole(&self, row: usize) -> bool {
        is_hole(self.time[row + 1] - self.time[row], self.interval)
    }

    /// Whether this rotor and another one share the cells of a battery's reading and of each other's rates.
    pub(crate) fn reads_battery_with(&self, other: &Self) -> bool {
        let is_same = |one: Option<&Cells>, other: Option<&Cells>| {
            one.zip(other).is_some_and(|(one, other)| std::ptr::eq(&one[..], &other[..]))
        };
        let beside = |rotor: &'_ Self| rotor.beside.as_ref().and_then(|beside| beside.rate.clone());
        is_same(self.voltage.as_ref(), other.voltage.as_ref())
            && is_same(Some(&self.rate), beside(other).as_ref())
            && is_same(beside(self).as_ref(), Some(&other.rate))
    }

    /// The first `rows` rows.
    pub fn head(&self, rows: usize) -> Self {
        let mut head = self.clone();
        let columns = [&mut head.time, &mut head.command, &mut head.rate];
        let optional = [&mut head.voltage, &mut head.thrust, &mut head.command_from].into_iter().flatten();
        let beside = head.beside.as_mut().map(|it| std::iter::once(&mut it.command).chain(&mut it.rate));
        let columns = columns.into_iter().chain(optional).chain(beside.into_iter().flatten());
        columns.for_each(|column| *column = column.part(0..rows));
        head.stretches.iter_mut().for_each(|stretch| stretch.end = stretch.end.min(rows));
        head.stretches.retain(|stretch| stretch.start < stretch.end);
        head
    }

    /// Rows that have both a command and a scored rate.
    pub fn scored(&self) -> impl Iterator<Item = usize> + '_ {
        self.stretches.iter().cloned().flatten().filter(|&row| self.rate[row].is_finite())
    }

    /// [s] from when on the command of each of these rows was in force; `None` where that is their time.
    pub fn command_from(&self, rows: &Range<usize>) -> Option<&[f64]> {
        self.command_from.as_ref().map(|from| &from[rows.clone()])
    }

    /// The same beside a model with this dead time [s] of the commands.
    pub fn command_from_beside(&self, delay: f64, rows: &Range<usize>) -> Option<Cow<'_, [f64]>> {
        let (from, later) = (self.command_from(rows)?, self.instants_later(delay));
        Some(if later == 0.0 { Cow::Borrowed(from) } else { from.iter().map(|at| at + later).collect() })
    }

    /// [s] by how much later commands were in force beside a model with this dead time: where the log's own is as near to it as one can
    /// know, it is the model's, and instants are those that make the same of the rates.
    pub fn instants_later(&self, delay: f64) -> f64 {
        if is_one_delay(delay, self.delay_found, self.delay_unknown) { self.delay_found - delay } else { 0.0 }
    }

    /// Whether it was ever commanded to turn.
    pub fn turns(&self) -> bool {
        bounds(&self.command).1 >= LEAST_COMMAND
    }

    /// Rows at which the rotor stands or starts, also behind a hole: the model has no law for that. Where the rate is measured, it
    /// says so: an ESC that idles at a command of nearly nothing never stands, and a rotor that has not started yet stands at one
    /// that would turn it.
    pub(crate) fn at_rest(&self) -> Vec<usize> {
        let standing = THRESHOLDS.standing_share * bounds(&self.rate).1;
        let stands = |row: usize| self.rate[row] <= standing;
        let low = |row: &usize| self.command[*row] < LEAST_COMMAND;
        let rows = || self.whole().into_iter().flatten();
        let is_measured = |row: &usize| self.rate[*row].is_finite();
        if rows().any(|row| low(&row)) && !rows().filter(low).any(|row| !is_measured(&row) || stands(row)) {
            return Vec::new();
        }
        let coasts = self.coasts();
        let mut waiting_until = f64::NEG_INFINITY;
        let is_coasting = |row: usize| holds(&coasts, row);
        let mut rests = |row: &usize| {
            let has_not_started = standing > 0.0 && self.time[*row] <= waiting_until && stands(*row);
            if (low(row) && !is_coasting(*row)) || has_not_started {
                waiting_until = self.time[*row] + THRESHOLDS.starting;
            }
            self.time[*row] <= waiting_until
        };
        rows().filter(|row| rests(row)).collect()
    }

    /// [s] when it was commanded to turn after it had stood.
    pub(crate) fn starts(&self) -> Vec<f64> {
        let coasts = self.coasts();
        let is_start = |row: &usize| {
            let [before, now] = [self.command[row - 1], self.command[*row]];
            before < LEAST_COMMAND && now >= LEAST_COMMAND && !holds(&coasts, row - 1)
        };
        (1..self.time.len()).filter(is_start).map(|row| self.time[row]).collect()
    }

    /// Runs of low commands under which the rotor coasts: by all its readings, the last of them right before the command comes back, and
    /// the first behind that, it never came to rest. Behind a hole nobody knows.
    fn coasts(&self) -> Vec<Range<usize>> {
        let low = |row: usize| self.command[row] < LEAST_COMMAND;
        let whole = self.whole();
        let running = whole.iter().cloned().flatten().filter(|row| !low(*row)).map(|row| self.rate[row]);
        let Some(typical) = median(running.filter(|rate| *rate > 0.0)) else { return Vec::new() };
        let turns = |rate: f64| rate > THRESHOLDS.rested_share * typical;
        let is_known = |row: &usize| self.rate[*row].is_finite();
        let mut coasts = Vec::new();
        for segment in &whole {
            let mut row = segment.start;
            while row < segment.end {
                let (begin, is_low) = (row, low(row));
                row = (begin..segment.end).find(|row| low(*row) != is_low).unwrap_or(segment.end);
                let next = (row..segment.end).find(is_known).filter(|next| is_low && turns(self.rate[*next]));
                let is_read = (begin.max(row.saturating_sub(2))..row).any(|row| is_known(&row));
                let mut known = (begin..row).filter(is_known);
                if next.is_some() && is_read && known.all(|row| turns(self.rate[row])) {
                    coasts.push(begin..row);
                }
            }
        }
        coasts
    }
}

/// Whether a row lies in one of these runs, which ascend.
fn holds(runs: &[Range<usize>], row: usize) -> bool {
    let at = runs.partition_point(|run| run.end <= row);
    runs.get(at).is_some_and(|run| run.contains(&row))
}

/// Smallest and largest finite value; (0, 0) of none.
pub(crate) fn bounds(values: &[f64]) -> (f64, f64) {
    let (low, high) = extremes(values.iter().copied());
    if low > high { (0.0, 0.0) } else { (low, high) }
}

/// See [`RotorLog::rows_are_levels`], of rows with these commands that are `interval` [s] apart, and those of the rotor beside.
fn are_levels(interval: f64, command: &[f64], beside: Option<&Beside>) -> bool {
    if interval <= THRESHOLDS.slowest_samples || command.len() > THRESHOLDS.most_levels {
        return false;
    }
    let other = |row: usize| beside.map_or(0.0, |beside| beside.command[row]);
    let known: Vec<[f64; 2]> =
        (0..command.len()).map(|row| [command[row], other(row)]).filter(|it| it[0].is_finite()).collect();
    let changes = known.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // Rows that somebody called levels, and a command that never changes, are levels, whatever the time.
    interval == log_thresholds::THRESHOLDS.level_period
        || changes == 0
        || command.len() <= THRESHOLDS.rows_of_a_level * (changes + 1)
}

/// Stretches of rows that have a value.
fn finite_runs(values: &[f64]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for row in (0..values.len()).filter(|row| values[*row].is_finite()) {
        match runs.last_mut().filter(|last| last.end == row) {
            Some(last) => last.end = row + 1,
            None => runs.push(row..row + 1),
        }
    }
    runs
}

/// Each value held over missing cells, inside each stretch only.
pub(crate) fn held<'a>(values: &'a [f64], segments: &[Range<usize>]) -> Cow<'a, [f64]> {
    let rows = || segments.iter().flat_map(|segment| segment.clone().skip(1));
    let mut held = Cow::Borrowed(values);
    for row in rows().filter(|row| !values[*row].is_finite()) {
        let held = held.to_mut();
        held[row] = held[row - 1];
    }
    held
}

/// The same of cells that others hold, too.
fn held_cells(cells: Cells, segments: &[Range<usize>]) -> Cells {
    match held(&cells, segments) {
        Cow::Owned(held) => held.into(),
        Cow::Borrowed(_) => cells,
    }
}

/// Each value held over missing cells of the whole column; leading ones hold the first. A column without a value stays without.
fn held_or_missing(values: Cells) -> Cells {
    if values.iter().all(|value| value.is_finite()) { values } else { held_or(&values, f64::NAN).into() }
}

/// [s] the longest time in which a column has no reading: from the last before, or the log's begin, to the next, or its end.
fn longest_gap(time: &[f64], values: &[f64]) -> Option<(f64, f64)> {
    let (first, last) = (*time.first()?, *time.last()?);
    let known = (0..values.len()).filter(|row| values[*row].is_finite()).map(|row| time[row]);
    let ends: Vec<f64> = std::iter::once(first).chain(known).chain(std::iter::once(last)).collect();
    let gaps = ends.windows(2).map(|pair| (pair[0], pair[1]));
    gaps.max_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)))
}

#[cfg(test)]
mod tests {
    use super::super::excitation::SteadyCommand;
    use super::*;
    use crate::screening::ScreenedLog;
    use crate::screening::suspicion::{Stops, Suspicion};

    fn log(command: impl Fn(f64) -> f64, seconds: f64) -> Dataset {
        let time: Vec<f64> = (0..(seconds * 50.0) as usize).map(|k| k as f64 * 0.02).collect();
        let u: Vec<f64> = time.iter().map(|&t| command(t)).collect();
        let rate: Vec<f64> = u.iter().map(|u| 1400.0 * u).collect();
        Dataset::made(time, [("command_1", u), ("propeller_rate_1_rad_s", rate)])
    }

    fn rotor(log: &Dataset) -> (RotorLog, Vec<Finding>) {
        let screened = ScreenedLog::of(log);
        let rotor = screened.rotor(1).unwrap();
        (rotor.data().clone(), rotor.findings().cloned().collect())
    }

    #[test]
    fn levels_ramps_and_jumps_are_kept_apart() {
        let staircase = log(|t| 0.3 + 0.1 * (t / 20.0).floor(), 60.0);
        let kinds: Vec<SteadyCommand> = rotor(&staircase).0.steady().iter().map(|part| part.0).collect();
        assert_eq!(kinds, [SteadyCommand::Constant; 3]);
        assert_eq!(rotor(&staircase).0.jumps().len(), 2);
        let ramp = log(|t| 0.3 + 0.01 * t, 30.0);
        assert_eq!(rotor(&ramp).0.steady(), [(SteadyCommand::Ramp, 0..1500)]);
        let binary = log(|t| 0.4 + 0.1 * f64::from((t * 1.7).sin() > 0.0), 60.0);
        assert!(rotor(&binary).0.steady().is_empty());
        assert!(rotor(&binary).0.jumps().len() > 20);
    }

    #[test]
    fn small_moves_are_counted_and_slow_ramps_are_not() {
        let moves = |command: &dyn Fn(f64) -> f64| rotor(&log(command, 60.0)).0.quick_moves(0.002);
        // One corner every two seconds, of 0.03 1/s: 0.0015 of a command in half of 0.1 s.
        assert_eq!(moves(&|t| 0.4 + 0.015 * (t.rem_euclid(4.0) - 2.0).abs()), 0);
        assert_eq!(moves(&|t| 0.4 + 0.05 * (0.5 * t).sin()), 0);
        // 0.006 a quarter second after the other.
        let binary =
            moves(&|t| 0.4 + 0.003 * if ((t * 4.0) as usize).is_multiple_of(2) { 1.0 } else { -1.0 });
        assert!((230..=240).contains(&binary), "{binary} of 239");
    }

    #[test]
    fn standstill_is_left_out_and_found() {
        let (rotor, warnings) = rotor(&log(|t| if t < 5.0 { 0.0 } else { 0.5 }, 20.0));
        assert!(rotor.scored().all(|row| rotor.time[row] > 5.4));
        assert!(warnings.iter().any(|it| it.code == "standstill_left_out" && it.rows == 275), "{warnings:?}");
    }

    /// Half a second at 2 ms: a binary signal between nothing and half, a rotor that follows with `pole` [rad/s], and rests before.
    fn binary(pole: f64) -> Dataset {
        let command = |row: usize| match row {
            ..100 => 0.0,
            _ if row / 10 * 7 % 4 < 2 => 0.5,
            _ => 0.0,
        };
        let mut rate = 0.0;
        let rates = (0..2_000).map(|row| {
            rate += (1_000.0 * command(row) - rate) * (1.0 - (-0.002 * pole).exp());
            rate
        });
        let rates = rates.collect();
        let time = (0..2_000).map(|row| 0.002 * row as f64).collect();
        let commands = (0..2_000).map(command).collect();
        Dataset::made(time, [("command_1", commands), ("propeller_rate_1_rad_s", rates)])
    }

    /// Under a command of nothing that comes back while it still turns it coasts: that is an answer to a known command.
    #[test]
    fn a_rotor_that_never_came_to_rest_does_not_start() {
        let (coasting, warnings) = rotor(&binary(16.0));
        let left = 2_000 - coasting.scored().count();
        assert!((100..=365).contains(&left), "{left}, of the first start: {warnings:?}");
        let low = coasting.scored().filter(|row| coasting.command[*row] == 0.0).count();
        assert!(low > 700, "{low} where it coasts");
        let screened = ScreenedLog::of(&binary(16.0));
        assert_eq!(screened.rotor(1).unwrap().starts().count(), 1);
        // One that has come to rest within each pause starts again each time.
        let (standing, warnings) = rotor(&binary(400.0));
        assert_eq!(standing.scored().count(), 0, "{warnings:?}");
    }

    /// In the hole the rotor was commanded to turn: behind it it is starting, until half a second after it stood.
    #[test]
    fn a_rotor_that_starts_in_a_hole_is_starting_behind_it() {
        let whole = log(|t| if t < 5.0 { 0.0 } else { 0.5 }, 20.0);
        let time: Vec<f64> = whole.time().iter().map(|t| if *t < 5.0 { *t } else { t + 0.2 }).collect();
        let mut log = Dataset::new("log.csv", "", time).unwrap();
        for name in ["command_1", "propeller_rate_1_rad_s"] {
            log.insert(name, whole.column(name).unwrap().to_vec()).unwrap();
        }
        assert_eq!(log.holes().len(), 1);
        let (rotor, warnings) = rotor(&log);
        let first = rotor.scored().map(|row| rotor.time[row]).next().unwrap();
        assert!((5.48..5.51).contains(&first), "{first}: {warnings:?}");
    }

    /// A machine of more rotors than a bench: each is judged.
    #[test]
    fn every_rotor_of_a_log_is_judged() {
        let mut four = log(|t| 0.4 + 0.1 * f64::from((t * 1.7).sin() > 0.0), 20.0);
        for (name, like) in [("command_4", "command_1"), ("propeller_rate_4_rad_s", "propeller_rate_1_rad_s")]
        {
            let mut values = four.column(like).unwrap().to_vec();
            if name != "command_4" {
                values[300] = 0.0;
            }
            four.insert(name, values).unwrap();
        }
        let screened = ScreenedLog::of(&four);
        assert_eq!(screened.rotors().map(|rotor| rotor.number()).collect::<Vec<_>>(), [1, 4]);
        let fourth = screened.rotor(4).unwrap();
        assert_eq!((fourth.reason(300), fourth.scored().count()), (Some("rate_dropout"), 999));
    }

    /// Of a long log each copy of a column is one too many.
    #[test]
    fn rotors_share_the_columns_of_their_log() {
        let mut both = log(|t| 0.4 + 0.1 * f64::from((t * 1.7).sin() > 0.0), 20.0);
        for (name, like) in [("command_2", "command_1"), ("propeller_rate_2_rad_s", "propeller_rate_1_rad_s")]
        {
            let values = both.column(like).unwrap().to_vec();
            both.insert(name, values).unwrap();
        }
        let volts = (0..both.len()).map(|row| 12.5 - 2e-4 * row as f64).collect();
        both.insert("battery_voltage_v", volts).unwrap();
        let screened = ScreenedLog::of(&both);
        let column = |name: &str| both.column(name).unwrap().as_ptr();
        for (rotor, other) in [(1, 2), (2, 1)] {
            let data = screened.rotor(rotor).unwrap().data();
            let of = |number: usize| [format!("command_{number}"), format!("propeller_rate_{number}_rad_s")];
            assert_eq!(data.time.as_ptr(), both.time().as_ptr());
            assert_eq!([&data.command, &data.rate].map(|it| it.as_ptr()), of(rotor).map(|it| column(&it)));
            let beside = data.beside.as_ref().unwrap();
            let rate = beside.rate.as_ref().unwrap();
            assert_eq!([&beside.command, rate].map(|it| it.as_ptr()), of(other).map(|it| column(&it)));
            assert_eq!(data.voltage.as_ref().unwrap().as_ptr(), column("battery_voltage_v"));
        }
    }

    #[test]
    fn wrong_units_are_found() {
        let (_, warnings) = rotor(&log(|t| 0.9 + 0.01 * t, 20.0));
        assert!(warnings.iter().any(|it| it.code == "command_out_of_range"), "{warnings:?}");
        let mut fast = log(|_| 0.5, 20.0);
        fast.replace("propeller_rate_1_rad_s", vec![6000.0; 1000]).unwrap();
        let (_, warnings) = rotor(&fast);
        assert!(warnings.iter().any(|it| it.code == "rate_too_fast"), "{warnings:?}");
        let impossible = ScreenedLog::of(&log(|t| 1000.0 + t, 20.0));
        let found: Vec<Suspicion> = impossible.suspicions(&[1]).collect();
        assert_eq!((found[0].finding.code, found[0].stops), ("command_out_of_range", Stops::Fits));
    }

    #[test]
    fn commands_are_held_over_missing_cells_but_not_over_holes() {
        let mut time: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.02).collect();
        time.extend((0..100).map(|k| 10.0 + f64::from(k) * 0.02));
        let mut u = vec![f64::NAN; 200];
        u[0] = 0.4;
        u[120] = 0.6;
        let mut log = Dataset::made(time, [("command_1", u)]);
        log.insert("propeller_rate_1_rad_s", vec![500.0; 200]).unwrap();
        let (rotor, _) = rotor(&log);
        assert_eq!(rotor.stretches, [0..100, 120..200]);
        assert_eq!((rotor.command[99], rotor.command[199]), (0.4, 0.6));
    }
}
