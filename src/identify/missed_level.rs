//! Levels that the model misses: held commands at which the rates settle elsewhere than it says. A fit over outliers and dropouts, or of
//! too low a degree, may leave an error that looks like noise, and be off at each level.

use std::ops::Range;

use super::steady_rows::settled_levels_of;
use super::thresholds::THRESHOLDS;
use super::validate::Validation;
use crate::estimation::quantile::{MEDIAN_OF_NORMAL, median};
use crate::screening::Finding;
use crate::screening::rotor_data::RotorLog;

/// What was read when a rotor had settled under a held command.
#[derive(Debug, Clone, Copy)]
struct Settled {
    command: f64,
    /// [rad/s] median of what was measured, and of what the model says.
    measured: f64,
    modelled: f64,
    /// [rad/s] standard error of the first.
    error: f64,
}

impl Settled {
    /// Share of the measured rate by which the model says less.
    fn miss(&self) -> f64 {
        1.0 - self.modelled / self.measured
    }

    fn is_missed(&self) -> bool {
        let miss = (self.measured - self.modelled).abs();
        miss > THRESHOLDS.missed_level_share * self.measured.abs()
            && miss > THRESHOLDS.missed_level_errors * self.error
    }
}

/// The command at which the free run `run` of a rotor misses the rates most, where it does so each time that command is held.
pub(crate) fn missed_level(rotor: &RotorLog, run: &Validation) -> Option<Finding> {
    if rotor.rows_are_levels() {
        return None;
    }
    let holds = settled_levels_of(rotor, THRESHOLDS.shortest_held);
    let mut levels: Vec<Settled> = holds.iter().filter_map(|rows| settled(rotor, rows, run)).collect();
    levels.sort_by(|a, b| a.command.total_cmp(&b.command));
    let same = |a: &Settled, b: &Settled| b.command - a.command <= THRESHOLDS.same_level;
    let is_missed = |times: &&[Settled]| {
        let to_one_side = times.iter().all(|it| it.miss() > 0.0) || times.iter().all(|it| it.miss() < 0.0);
        to_one_side && times.iter().all(Settled::is_missed)
    };
    let missed: Vec<&[Settled]> = levels.chunk_by(same).filter(is_missed).collect();
    let worst = missed.iter().flat_map(|times| times.iter());
    let worst = worst.max_by(|a, b| a.miss().abs().total_cmp(&b.miss().abs()))?;
    let found = rotor.finding("levels_missed").with("levels", missed.len()).with("command", worst.command);
    Some(found.with("measured_rad_s", worst.measured).with("modelled_rad_s", worst.modelled))
}

/// What was read in the settled rows of a hold; `None` of too little.
fn settled(rotor: &RotorLog, rows: &Range<usize>, run: &Validation) -> Option<Settled> {
    let (from, to) = (rotor.time[rows.start], rotor.time[rows.end - 1]);
    let place = |time: f64| run.traces.partition_point(|trace| trace.0 < time);
    let traces = run.traces.get(place(from)..place(to))?;
    if traces.len() < THRESHOLDS.fewest_settled {
        return None;
    }
    let measured = median(traces.iter().map(|trace| trace.1))?;
    let modelled = median(traces.iter().map(|trace| trace.2))?;
    let scatter = median(traces.iter().map(|trace| (trace.1 - measured).abs()))? / MEDIAN_OF_NORMAL;
    // Of a median, as if readings of a tenth of a hold were one.
    let error = 1.25 * scatter / (traces.len() as f64).min(THRESHOLDS.independent_settled).sqrt();
    let turns = measured > 0.0 && modelled.is_finite();
    turns.then_some(Settled { command: rotor.command[rows.start], measured, modelled, error })
}
