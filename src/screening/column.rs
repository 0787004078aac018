//! Any column of a log as it is read: when values come, between which ends, and what was found in it. For who looks at a log; what is
//! remarked of a column is left in.

use serde::Serialize;

use super::Finding;
use super::channel::Judgement;
use super::thresholds::THRESHOLDS;
use crate::estimation::finite::finite_rows;
use crate::estimation::quantile::{median_step, sorted};
use crate::log::signals::LOG_SIGNALS;
use crate::log::{Cells, Dataset};

/// A stretch of time in one channel.
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Stretch {
    /// [s] when it begins.
    pub start_s: f64,
    /// [s] how long it is.
    pub length_s: f64,
    /// The value held; for a dropout the last one before it.
    pub value: f64,
}

/// What is remarked of a column, and where, if it is of some stretches.
pub(crate) struct Remark {
    /// What, and by which numbers.
    pub finding: Finding,
    /// Where.
    pub stretches: Vec<Stretch>,
}

/// A column that is looked at.
pub(crate) struct CheckedColumn<'a> {
    /// The whole log.
    pub log: &'a Dataset,
    /// Name of the column.
    pub name: &'a str,
    /// Its cells as they were logged.
    pub values: Cells,
    /// What was found in it that is no measurement.
    pub judged: &'a [Judgement],
    /// Rows that hold a value.
    pub present: Vec<usize>,
    /// [s] median time between these.
    pub interval: f64,
    /// The values, ascending.
    pub sorted: Vec<f64>,
}

impl<'a> CheckedColumn<'a> {
    /// The column of this name, of which `judged` was found; `None` where the log has none, or it is empty.
    pub(crate) fn of(log: &'a Dataset, name: &'a str, judged: &'a [Judgement]) -> Option<Self> {
        let values = log.cells(name)?.for_once();
        let present: Vec<usize> = finite_rows(&values, 0..values.len());
        let time = log.time();
        let interval = median_step(present.iter().map(|row| time[*row])).unwrap_or(0.0);
        let sorted = sorted(present.iter().map(|row| values[*row]));
        Some(Self { log, name, values, judged, present, interval, sorted })
    }

    /// Least and greatest value; zeros of none.
    pub(crate) fn range(&self) -> [f64; 2] {
        [self.sorted.first(), self.sorted.last()].map(|end| end.copied().unwrap_or(0.0))
    }

    /// Whether it never changes.
    pub(crate) fn is_constant(&self) -> bool {
        self.present.len() >= THRESHOLDS.constant_fewest && self.range()[0] == self.range()[1]
    }

    /// Whether it is a reading that moves. Commands hold by nature: they neither freeze nor saturate.
    pub(crate) fn is_moving_reading(&self) -> bool {
        let is_signal = LOG_SIGNALS.iter().any(|known| known.name == self.name);
        is_signal && !self.name.contains("command") && !self.is_constant()
    }

    /// What was found under one of these codes.
    pub(crate) fn judgement(&self, codes: &[&str]) -> Option<&'a Judgement> {
        self.judged.iter().find(|judged| codes.contains(&judged.finding.code))
    }

    /// A finding in this column.
    pub(crate) fn finding(&self, code: &'static str) -> Finding {
        Finding::new(code, self.name).of(self.log.source_name())
    }

    /// From one row to another, with the value of the first.
    pub(crate) fn stretch(&self, first: usize, last: usize) -> Stretch {
        let (start_s, end) = (self.log.time()[first], self.log.time()[last]);
        Stretch { start_s, length_s: end - start_s, value: self.values[first] }
    }

    /// Says something of stretches, with the longest of them; nothing of none.
    pub(crate) fn remark(&self, code: &'static str, stretches: Vec<Stretch>) -> Vec<Remark> {
        let longest = stretches.iter().max_by(|a, b| a.length_s.total_cmp(&b.length_s)).copied();
        let Some(longest) = longest else { return Vec::new() };
        let finding = self.finding(code).with("count", stretches.len()).with("longest_s", longest.length_s);
        let finding = finding.with("from_s", longest.start_s).with("value", longest.value);
        vec![Remark { finding, stretches }]
    }
}
