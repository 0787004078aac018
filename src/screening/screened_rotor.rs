//! One rotor of a log, judged once: the rows at which its rate is held against a model, and why the others are not.
//!
//! What is measured and what is scored are two things. A rate at standstill is a measurement: it drives the body and stands in a
//! plot. But the rotor's law is not asked for it.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::Finding;
use super::channel::Judgement;
use super::checks;
use super::left_out::{COMMANDS_MISSING, HOLES, LeftOut, SHORT_RUN};
use super::quantized_voltage;
use super::rotor::CheckedRotor;
use super::rotor_data::{HeldVoltage, RotorLog};
use super::suspicion::{Stops, Suspicion};
use crate::log::{Cells, Dataset};

/// One rotor of a log, and which of its rows are scored.
#[derive(Debug, Clone)]
pub struct ScreenedRotor {
    number: usize,
    data: RotorLog,
    /// Whether the log has a column of its rates.
    is_measured: bool,
    is_scored: Vec<bool>,
    /// Of each row why it is not scored, where that is known.
    why: LeftOut,
    /// Whether the rotor stands or starts at each row.
    rests: Vec<bool>,
    /// See [`ScreenedRotor::starts`].
    starts: Vec<f64>,
    /// See [`ScreenedRotor::runs`].
    runs: Vec<Range<usize>>,
    /// Columns that can hardly be what their names say, what stops most first.
    suspicions: Vec<Suspicion>,
    findings: Vec<Finding>,
    /// See [`ScreenedRotor::voltage`]: of a reading in coarse steps, once somebody asks.
    seen_through: Arc<OnceLock<Option<Cells>>>,
}

impl ScreenedRotor {
    /// Judges rotor `number` (from 1) of a log whose channels were judged: `rates` is what was found in its rate, `voltage` that of
    /// the log, and `steps_elsewhere` whether its commands step between rows in another log of the bench. `None` when the log does not
    /// hold its command.
    pub(crate) fn of(
        log: &Dataset,
        voltage: Option<&HeldVoltage>,
        number: usize,
        rates: &[Judgement],
        steps_elsewhere: bool,
    ) -> Option<Self> {
        let mut rotor = CheckedRotor { steps_elsewhere, ..CheckedRotor::read(log, voltage, number)? };
        let mut why = vec![None; log.len()];
        // A row has the first reason that was found.
        rates.iter().rev().for_each(|judged| mark(&mut why, judged));
        let suspicions = look_at_columns(&rotor);
        mark_unknown(&mut why, log, &rotor.data);
        let mut findings = Vec::new();
        for judged in checks::ROTOR.iter().filter_map(|check| check(&mut rotor)) {
            mark(&mut why, &judged);
            findings.push(judged.finding);
        }
        let mut rests = vec![false; log.len()];
        rotor.at_rest.iter().for_each(|row| rests[*row] = true);
        let (runs, short) = rotor.data.split_runs(rotor.measured);
        for row in short {
            (rotor.data.rate[row], why[row]) = (f64::NAN, Some(SHORT_RUN));
        }
        let mut is_scored = vec![false; log.len()];
        rotor.data.scored().for_each(|row| is_scored[row] = true);
        let (is_measured, starts, data) = (rotor.is_measured(), rotor.starts, rotor.data);
        let why = LeftOut::of(why.into_iter());
        let seen_through = Arc::default();
        Some(Self {
            number,
            data,
            is_measured,
            is_scored,
            why,
            rests,
            starts,
            runs,
            suspicions,
            findings,
            seen_through,
        })
    }

    /// Its number in the columns' names, from 1.
    #[must_use]
    pub fn number(&self) -> usize {
        self.number
    }

    /// Whether it was ever commanded to turn.
    #[must_use]
    pub fn turns(&self) -> bool {
        self.data.turns()
    }

    /// Whether any of its rates is a measurement.
    #[must_use]
    pub fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// Rows at which its rate is held against a model.
    pub fn scored(&self) -> impl Iterator<Item = usize> + '_ {
        self.data.scored()
    }

    /// Whether its rate is held against a model in this row.
    #[must_use]
    pub fn is_scored(&self, row: usize) -> bool {
        self.is_scored.get(row).copied().unwrap_or(false)
    }

    /// Why it is not: a code; `None` of a row that is scored, and of one whose cell is empty.
    #[must_use]
    pub fn reason(&self, row: usize) -> Option<&'static str> {
        self.why.reason(row)
    }

    /// Whether the rotor stands or starts in this row, as far as its commands say.
    #[must_use]
    pub fn rests(&self, row: usize) -> bool {
        self.rests.get(row).copied().unwrap_or(false)
    }

    /// [s] when it was commanded to turn after it had stood.
    pub fn starts(&self) -> impl Iterator<Item = f64> + '_ {
        self.starts.iter().copied()
    }

    /// Stretches of rows without a hole over which every command is known.
    #[must_use]
    pub fn stretches(&self) -> &[Range<usize>] {
        &self.data.stretches
    }

    /// The same, joined across holes over which the command is known, without those of so few readings that they say nothing of
    /// the rotor: for who fits where a run starts.
    #[must_use]
    pub fn runs(&self) -> &[Range<usize>] {
        &self.runs
    }

    /// Columns that can hardly be what their names say.
    pub(crate) fn suspicions(&self) -> &[Suspicion] {
        &self.suspicions
    }

    /// Whether a column of it cannot be what its name says.
    pub(crate) fn stops_fits(&self) -> bool {
        self.suspicions.iter().any(|it| it.stops == Stops::Fits)
    }

    /// What was found in it.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.suspicions.iter().map(|it| &it.finding).chain(&self.findings)
    }

    /// Its part of the log, made ready for a fit.
    pub(crate) fn data(&self) -> &RotorLog {
        &self.data
    }

    /// [V] What its battery has, each reading held until the next; of one that is read in coarse steps, what it steps over.
    pub(crate) fn voltage(&self) -> Option<&Cells> {
        let read = self.data.voltage.as_ref()?;
        let seen =
            self.seen_through.get_or_init(|| quantized_voltage::seen_through(&self.data).map(Cells::from));
        Some(seen.as_ref().unwrap_or(read))
    }

    /// Takes what another rotor of the log sees behind a coarse reading, once either asks: both draw on one battery, and where they know
    /// the same of each other it is the same.
    pub(crate) fn see_through_as(&mut self, other: &Self) {
        if self.data.reads_battery_with(&other.data) {
            self.seen_through = Arc::clone(&other.seen_through);
        }
    }

    /// Scores no row that is not scored in the log that it is a part of: `rows` are its own in it.
    pub(crate) fn keep_to(&mut self, whole: &Self, rows: &[usize]) {
        let is_lost = |row: usize, own: usize| self.is_scored(row) && !whole.is_scored(own);
        let lost = |(row, own): (usize, &usize)| is_lost(row, *own).then_some(row);
        let lost: Vec<usize> = rows.iter().enumerate().filter_map(lost).collect();
        if !lost.is_empty() {
            let why = |(row, own): (usize, &usize)| {
                if is_lost(row, *own) { whole.reason(*own) } else { self.reason(row) }
            };
            self.why = LeftOut::of(rows.iter().enumerate().map(why));
        }
        for row in lost {
            (self.data.rate[row], self.is_scored[row]) = (f64::NAN, false);
        }
        self.data.delay_unknown = whole.data.delay_unknown;
        self.data.delay_found = whole.data.delay_found;
        let from = whole.data.command_from.as_ref();
        self.data.command_from = from.map(|from| rows.iter().map(|row| from[*row]).collect());
        match whole.voltage() {
            None => self.drop_battery(),
            // The whole log says more of a reading in steps than a part.
            Some(_) => {
                let of_rows = |volts: &Cells| rows.iter().map(|row| volts[*row]).collect::<Cells>();
                let seen = whole.seen_through.get().and_then(Option::as_ref).map(of_rows);
                self.seen_through = Arc::new(OnceLock::from(seen));
            }
        }
    }

    /// Takes the battery away.
    pub(crate) fn drop_battery(&mut self) {
        (self.data.voltage, self.data.voltage_gap) = (None, None);
        self.seen_through = Arc::default();
    }
}

/// Columns that can hardly be what their names say; of those that cannot be the first is enough. Of a rotor that nobody measured
/// nothing is asked.
fn look_at_columns(rotor: &CheckedRotor) -> Vec<Suspicion> {
    let suspicions = checks::ROTOR_COLUMNS.iter().filter_map(|check| check(&rotor.data));
    let (impossible, hardly): (Vec<Suspicion>, Vec<Suspicion>) =
        suspicions.filter(|_| rotor.is_measured()).partition(|it| it.stops == Stops::Fits);
    impossible.into_iter().take(1).chain(hardly).collect()
}

/// Rows at which it is not known what the rotor was commanded, or that have no neighbours between two holes.
fn mark_unknown(why: &mut [Option<&'static str>], log: &Dataset, rotor: &RotorLog) {
    let mut is_known = vec![false; log.len()];
    rotor.stretches.iter().cloned().flatten().for_each(|row| is_known[row] = true);
    for segment in log.segments() {
        let code = if segment.len() > RotorLog::FEWEST_ROWS { COMMANDS_MISSING } else { HOLES };
        for row in segment.filter(|row| !is_known[*row] && rotor.rate[*row].is_finite()) {
            why[row] = Some(code);
        }
    }
}

fn mark(why: &mut [Option<&'static str>], judged: &Judgement) {
    for row in judged.rows.iter().chain(&judged.biased) {
        why[*row] = Some(judged.finding.code);
    }
}
