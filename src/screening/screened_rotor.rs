//! One rotor of a log, judged once: the rows at which its rate is held against a model, and why the others are not.
//!
//! What is measured and what is scored are two things. A rate at standstill is a measurement: it drives the body and stands in a
//! plot. But the rotor's law is not asked for it.

use std::ops::Range;

use super::channel::Judgement;
use super::left_out::{COMMANDS_MISSING, HOLES, SHORT_RUN};
use super::missing_commands::Missing;
use super::rotor_data::{LEAST_COMMAND, RotorLog};
use super::{Finding, ScreeningError};
use crate::log::Dataset;

/// One rotor of a log, and which of its rows are scored.
#[derive(Debug, Clone)]
pub struct ScreenedRotor {
    number: usize,
    data: RotorLog,
    /// Whether the log has a column of its rates.
    is_measured: bool,
    is_scored: Vec<bool>,
    /// Of each row why it is not scored, where that is known.
    why: Vec<Option<&'static str>>,
    /// Whether the rotor stands or starts at each row.
    rests: Vec<bool>,
    /// See [`ScreenedRotor::runs`].
    runs: Vec<Range<usize>>,
    /// A column that cannot be what its name says.
    refused: Option<Finding>,
    /// Columns that can hardly be what their names say.
    mistaken: Vec<Finding>,
    findings: Vec<Finding>,
}

impl ScreenedRotor {
    /// Judges rotor `number` (from 1) of a log whose channels were judged: `rates` is what was found in its rate. `None` when
    /// the log does not hold its command.
    pub(crate) fn of(log: &Dataset, number: usize, rates: &[Judgement]) -> Option<Self> {
        let (data, missing) = RotorLog::read(log, number)?;
        let is_measured = data.rate.iter().any(|rate| rate.is_finite());
        let mut this = Self {
            number,
            is_measured,
            is_scored: Vec::new(),
            why: vec![None; log.len()],
            rests: vec![false; log.len()],
            runs: Vec::new(),
            refused: None,
            mistaken: Vec::new(),
            findings: Vec::new(),
            data,
        };
        // A row has the first reason that was found.
        rates.iter().rev().for_each(|judged| this.mark(judged));
        if is_measured {
            this.look_at_columns();
        }
        this.look_at_rows(log, &missing);
        Some(this)
    }

    fn look_at_columns(&mut self) {
        for (finding, is_impossible) in self.data.mistaken() {
            if is_impossible {
                self.refused.get_or_insert(finding);
            } else {
                self.mistaken.push(finding);
            }
        }
        self.findings.extend(self.data.command_saturated());
    }

    fn look_at_rows(&mut self, log: &Dataset, missing: &Missing) {
        self.mark_unknown(log);
        let at_rest = self.data.at_rest();
        at_rest.iter().for_each(|row| self.rests[*row] = true);
        let found = [
            self.data.leave_out_starts(&at_rest),
            self.data.leave_out_hidden_transients(),
            self.data.leave_out_unmoved(),
        ];
        for judged in found.into_iter().flatten() {
            self.mark(&judged);
            self.findings.push(judged.finding);
        }
        let measured = log.column(&format!("propeller_rate_{}_rad_s", self.number)).unwrap_or_default();
        let (runs, short) = self.data.leave_out_short_runs(measured);
        short.iter().for_each(|row| self.why[*row] = Some(SHORT_RUN));
        self.runs = runs;
        self.is_scored = vec![false; log.len()];
        self.data.scored().for_each(|row| self.is_scored[row] = true);
        if missing.places > 0 && self.data.turns() {
            self.findings.push(self.data.missing(missing));
        }
    }

    /// Rows at which it is not known what the rotor was commanded, or that have no neighbours between two holes.
    fn mark_unknown(&mut self, log: &Dataset) {
        let mut is_known = vec![false; log.len()];
        self.data.segments.iter().cloned().flatten().for_each(|row| is_known[row] = true);
        for segment in log.segments() {
            let why = if segment.len() > RotorLog::FEWEST_ROWS { COMMANDS_MISSING } else { HOLES };
            for row in segment.filter(|row| !is_known[*row] && self.data.rate[*row].is_finite()) {
                self.why[row] = Some(why);
            }
        }
    }

    fn mark(&mut self, judged: &Judgement) {
        for row in judged.rows.iter().chain(&judged.biased) {
            self.why[*row] = Some(judged.finding.code);
        }
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
        self.why.get(row).copied().flatten()
    }

    /// Whether the rotor stands or starts in this row, as far as its commands say.
    #[must_use]
    pub fn rests(&self, row: usize) -> bool {
        self.rests.get(row).copied().unwrap_or(false)
    }

    /// [s] when it was commanded to turn after it had stood.
    pub fn starts(&self) -> impl Iterator<Item = f64> + '_ {
        let is_start = |row: &usize| {
            let [before, now] = [self.data.command[row - 1], self.data.command[*row]];
            before < LEAST_COMMAND && now >= LEAST_COMMAND
        };
        (1..self.data.time.len()).filter(is_start).map(|row| self.data.time[row])
    }

    /// Stretches of rows without a hole over which every command is known.
    #[must_use]
    pub fn stretches(&self) -> &[Range<usize>] {
        &self.data.segments
    }

    /// The same, joined across holes over which the command is known, without those of so few readings that they say nothing of
    /// the rotor: for who fits where a run starts.
    #[must_use]
    pub fn runs(&self) -> &[Range<usize>] {
        &self.runs
    }

    /// Columns that can hardly be what their names say.
    #[must_use]
    pub fn mistaken(&self) -> &[Finding] {
        &self.mistaken
    }

    /// What was found in it.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.refused.iter().chain(&self.mistaken).chain(&self.findings)
    }

    /// Refuses a column that cannot be what its name says.
    ///
    /// # Errors
    /// [`ScreeningError::Column`] of the first.
    pub fn refuse(&self) -> Result<(), ScreeningError> {
        self.refused.clone().map_or(Ok(()), |found| Err(ScreeningError::Column(Box::new(found))))
    }

    /// Its part of the log, made ready for a fit.
    pub(crate) fn data(&self) -> &RotorLog {
        &self.data
    }

    /// Scores no row that is not scored in the log that it is a part of: `rows` are its own in it.
    pub(crate) fn keep_to(&mut self, whole: &Self, rows: &[usize]) {
        for (row, own) in rows.iter().enumerate() {
            if self.is_scored(row) && !whole.is_scored(*own) {
                (self.data.rate[row], self.is_scored[row], self.why[row]) =
                    (f64::NAN, false, whole.reason(*own));
            }
        }
        if whole.data.voltage.is_none() {
            self.drop_battery();
        }
    }

    /// Takes the battery away.
    pub(crate) fn drop_battery(&mut self) {
        (self.data.voltage, self.data.voltage_gap) = (None, None);
    }
}
