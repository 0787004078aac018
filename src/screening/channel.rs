//! One channel of a log as the checks see it: its cells, what moves it, and what earlier checks found in it.

use std::borrow::Cow;
use std::ops::Range;

use super::Finding;
use crate::log::Dataset;
use crate::log::signals::{of_rotor, rotor_of};
use crate::signal;
use crate::signal::columns::{self, BATTERY_VOLTAGE, BODY_ANGLE, BODY_RATE, TORQUE_COMMAND};

/// Columns of the body.
pub(super) const OF_BODY: [&str; 3] = [BODY_RATE, BODY_ANGLE, TORQUE_COMMAND];

/// [rad/s] the measured rates of both rotors of a bench.
pub(super) fn rates_of_both(log: &Dataset) -> [Option<&[f64]>; signal::ROTORS] {
    std::array::from_fn(|rotor| log.column(columns::PROPELLER_RATES[rotor]))
}

/// Channels of a log that are looked at, those of every rotor beside each other: what is measured, and what a fit rests on.
/// Commands and a supply's setting may well be held.
pub(crate) fn screened(log: &Dataset) -> Vec<&str> {
    let place = |name: &str| {
        let rotor = rotor_of(name);
        let of_first = rotor.and_then(|_| of_rotor(name, 1));
        let known = of_first.as_deref().unwrap_or(name);
        let mut channels = signal::Channel::IN_LOG.iter();
        let place = channels.position(|it| it.column() == known && it.sensor().row().is_screened)?;
        Some((place, rotor))
    };
    let mut found: Vec<_> = log.names().filter_map(|name| Some((place(name)?, name))).collect();
    found.sort_unstable();
    found.into_iter().map(|(_, name)| name).collect()
}

/// What a check found, and the rows it is about.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// What, and how many rows.
    pub finding: Finding,
    /// Rows whose cells are no measurements, from 0, ascending.
    pub rows: Vec<usize>,
    /// Rows beside them that are biased by the same cause, and are left out, too.
    pub biased: Vec<usize>,
}

impl Judgement {
    /// Rows that are left out, and nothing beside them.
    pub(crate) fn new(finding: Finding, rows: Vec<usize>) -> Self {
        Self { finding: finding.rows(rows.len()), rows, biased: Vec::new() }
    }

    /// The same of a part of the log: of these stretches, which ascend. `None` where what was found lies outside them.
    pub(crate) fn of_rows(&self, stretches: &[Range<usize>]) -> Option<Self> {
        let starts: Vec<usize> = stretches
            .iter()
            .scan(0, |rows, stretch| Some(std::mem::replace(rows, *rows + stretch.len())))
            .collect();
        let place = |row: &usize| {
            let at = stretches.partition_point(|stretch| stretch.end <= *row);
            let stretch = stretches.get(at).filter(|stretch| stretch.contains(row))?;
            Some(starts[at] + row - stretch.start)
        };
        let within = |rows: &[usize]| -> Vec<usize> { rows.iter().filter_map(place).collect() };
        let (rows, biased) = (within(&self.rows), within(&self.biased));
        let concerns_rows = !(self.rows.is_empty() && self.biased.is_empty());
        if concerns_rows && rows.is_empty() && biased.is_empty() {
            return None;
        }
        let finding = self.finding.clone();
        let finding = if self.rows.is_empty() { finding } else { finding.rows(rows.len()) };
        Some(Self { finding, rows, biased })
    }
}

/// A channel that is being judged.
pub(crate) struct CheckedChannel<'a> {
    /// The whole log.
    pub log: &'a Dataset,
    /// Name of the channel.
    pub name: &'a str,
    /// Its cells as they were logged.
    pub values: &'a [f64],
    /// [-] command of the rotor that it is about.
    pub command: Option<&'a [f64]>,
    /// What earlier checks found.
    pub found: Vec<Judgement>,
}

impl<'a> CheckedChannel<'a> {
    /// The channel of this name; `None` where the log has none.
    pub(crate) fn of(log: &'a Dataset, name: &'a str) -> Option<Self> {
        let values = log.column(name)?;
        let command = rotor_of(name).and_then(|number| log.column(&columns::command(number)));
        Some(Self { log, name, values, command, found: Vec::new() })
    }

    pub(crate) fn is_battery(&self) -> bool {
        self.name == BATTERY_VOLTAGE
    }

    pub(crate) fn is_rotor_rate(&self) -> bool {
        columns::is_propeller_rate(self.name)
    }

    /// A finding in this channel.
    pub(crate) fn finding(&self, code: &'static str) -> Finding {
        Finding::new(code, self.name).of(self.log.source_name())
    }

    /// Whether a check found this.
    pub(crate) fn has(&self, code: &str) -> bool {
        self.found.iter().any(|judged| judged.finding.code == code)
    }

    /// The cells without those that earlier checks took for no measurements; biased ones stay.
    pub(crate) fn left(&self) -> Cow<'a, [f64]> {
        self.without(|_| true)
    }

    /// The cells without those of the findings that `counts` says yes to.
    pub(crate) fn without(&self, counts: impl Fn(&str) -> bool) -> Cow<'a, [f64]> {
        let mut left = Cow::Borrowed(self.values);
        let judged = self.found.iter().filter(|judged| counts(judged.finding.code));
        judged.flat_map(|judged| &judged.rows).for_each(|row| left.to_mut()[*row] = f64::NAN);
        left
    }
}
