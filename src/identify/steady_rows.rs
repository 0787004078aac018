//! The rows of slow ramps, or of constant commands, that [LPC16] Eq. (9) is fitted to.

use super::thresholds::THRESHOLDS;
use std::ops::Range;

use crate::screening::excitation::SteadyCommand;
use crate::screening::rotor_data::{RotorLog, bounds};

/// Highest degree tried, as the paper compares several.
pub const HIGHEST_DEGREE: usize = THRESHOLDS.highest_degree;

/// Rows for Eq. (9).
pub(crate) struct SteadyRows {
    /// [-]
    pub command: Vec<f64>,
    /// [rad/s] y_g.
    pub corrected_rate: Vec<f64>,
    /// [V] v_bmax - v_b.
    pub voltage_drop: Vec<f64>,
    /// [1/s] slope of the command.
    pub slope: Vec<f64>,
    /// Whether ramps gave them (else constant levels).
    pub from_ramps: bool,
    /// The logs of the ramps, whose stretches are the ramps; their rates only where all is known.
    pub ramps: Vec<RotorLog>,
    /// [V] v_bmax
    pub full_voltage: f64,
    /// [rad/(s V)] k_V in y_g.
    pub gain: f64,
}

/// Collects steady rows: ramps where they are enough and span a range, else constant levels, else,
/// `with_short`, levels that are held for less long, and rows that are levels each: a stand that steps every few seconds shows a curve
/// by them, where nothing shows how its rotor follows.
pub(crate) fn steady_rows(
    rotors: &[RotorLog],
    gain: f64,
    full_voltage: f64,
    with_short: bool,
) -> Option<SteadyRows> {
    let ramps = collect(rotors, SteadyCommand::Ramp, gain, full_voltage);
    if ramps.command.len() >= THRESHOLDS.fewest_curve_rows
        && spread(&ramps.command) >= THRESHOLDS.narrowest_curve
    {
        return Some(ramps);
    }
    let suffice = |rows: &SteadyRows, fewest: usize| {
        rows.command.len() >= fewest && spread(&rows.command) >= THRESHOLDS.narrowest_curve
    };
    let levels = collect(rotors, SteadyCommand::Constant, gain, full_voltage);
    if suffice(&levels, THRESHOLDS.fewest_curve_rows) {
        return Some(levels);
    }
    let has_points = rotors.iter().any(RotorLog::rows_are_levels);
    let fewest = if has_points { THRESHOLDS.fewest_points } else { THRESHOLDS.fewest_curve_rows };
    with_short.then(|| settled(rotors, gain, full_voltage)).filter(|rows| suffice(rows, fewest))
}

/// Of each held command the rows at which the rotor has settled: two seconds behind its begin, at the latest in its second half.
pub(crate) fn settled_levels(rotor: &RotorLog) -> Vec<Range<usize>> {
    settled_levels_of(rotor, THRESHOLDS.shortest_level)
}

/// The same of commands that are held for `shortest` [s] at least.
pub(crate) fn settled_levels_of(rotor: &RotorLog, shortest: f64) -> Vec<Range<usize>> {
    if rotor.rows_are_levels() {
        return rotor.scored().map(|row| row..row + 1).collect();
    }
    let mut levels = Vec::new();
    for segment in rotor.whole() {
        let mut from = segment.start;
        for held in rotor.command[segment].chunk_by(|a, b| a == b) {
            let rows = from..from + held.len();
            from = rows.end;
            let (begin, end) = (rotor.time[rows.start], rotor.time[rows.end - 1]);
            let settled =
                begin + THRESHOLDS.level_settles.min(THRESHOLDS.level_settles_share * (end - begin));
            if end - begin >= shortest {
                let unsettled = rotor.time[rows.clone()].partition_point(|time| *time < settled);
                levels.push(rows.start + unsettled..rows.end);
            }
        }
    }
    levels
}

/// Settled rows of levels of a few seconds, or of a row. As in Eq. (9) each counts for itself, so that a longer one says more.
fn settled(rotors: &[RotorLog], gain: f64, full_voltage: f64) -> SteadyRows {
    let mut rows = SteadyRows::none(false, gain, full_voltage);
    for rotor in rotors {
        for row in settled_levels(rotor).into_iter().flatten() {
            let voltage = rotor.voltage.as_ref().map_or(full_voltage, |voltage| voltage[row]);
            if rotor.rate[row].is_finite() && voltage.is_finite() {
                rows.push(rotor, row, full_voltage - voltage, 0.0);
            }
        }
    }
    rows
}

impl SteadyRows {
    fn none(from_ramps: bool, gain: f64, full_voltage: f64) -> Self {
        Self {
            command: Vec::new(),
            corrected_rate: Vec::new(),
            voltage_drop: Vec::new(),
            slope: Vec::new(),
            from_ramps,
            ramps: Vec::new(),
            full_voltage,
            gain,
        }
    }

    fn push(&mut self, rotor: &RotorLog, row: usize, voltage_drop: f64, slope: f64) {
        self.slope.push(slope);
        self.command.push(rotor.command[row]);
        self.voltage_drop.push(voltage_drop);
        // Plus: see the head of this file.
        self.corrected_rate.push(rotor.rate[row] + self.gain * voltage_drop);
    }
}

fn spread(values: &[f64]) -> f64 {
    let (low, high) = bounds(values);
    high - low
}

fn collect(rotors: &[RotorLog], wanted: SteadyCommand, gain: f64, full_voltage: f64) -> SteadyRows {
    let mut rows = SteadyRows::none(wanted == SteadyCommand::Ramp, gain, full_voltage);
    for rotor in rotors.iter().filter(|rotor| !rotor.rows_are_levels()) {
        let parts = rotor.steady().into_iter().filter(|(kind, _)| *kind == wanted);
        let parts: Vec<Range<usize>> = parts.map(|(_, part)| part).collect();
        let mut known = vec![f64::NAN; rotor.time.len()];
        for part in &parts {
            // Slope over a quarter of a second: quantized commands stand still between steps.
            let reach = ((THRESHOLDS.slope_reach / rotor.interval).ceil() as usize).max(1);
            for row in part.clone() {
                let voltage = rotor.voltage.as_ref().map_or(full_voltage, |voltage| voltage[row]);
                if !rotor.rate[row].is_finite() || !voltage.is_finite() {
                    continue;
                }
                let (before, after) =
                    (row.saturating_sub(reach).max(part.start), (row + reach).min(part.end - 1));
                let span = (rotor.time[after] - rotor.time[before]).max(f64::MIN_POSITIVE);
                let slope = (rotor.command[after] - rotor.command[before]) / span;
                rows.push(rotor, row, full_voltage - voltage, slope);
                known[row] = rotor.rate[row];
            }
        }
        if rows.from_ramps && !parts.is_empty() {
            rows.ramps.push(RotorLog { rate: known.into(), stretches: parts, ..rotor.clone() });
        }
    }
    rows
}

/// Whether the command rises and falls for at least a fifth of the rows each: only then does the lag of the rotor
/// look different from the curve.
pub(crate) fn goes_both_ways(rows: &SteadyRows) -> bool {
    let share = |way: fn(f64) -> bool| {
        rows.slope.iter().filter(|slope| way(**slope)).count() as f64 / rows.slope.len().max(1) as f64
    };
    let least = THRESHOLDS.both_ways_share;
    share(|slope| slope > 0.0) > least && share(|slope| slope < 0.0) > least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Dataset;
    use crate::screening::ScreenedLog;

    /// Six levels of `seconds` each, at 50 Hz; the rotor needs `slow` seconds of each to get there.
    fn levels(seconds: f64, slow: f64) -> RotorLog {
        let time: Vec<f64> = (0..(300.0 * seconds) as usize).map(|row| 0.02 * row as f64).collect();
        let level = |time: &f64| 0.2 + 0.1 * ((time + 1e-9) / seconds).floor();
        let rate = |time: &f64| {
            let within = (time + 1e-9).rem_euclid(seconds);
            1000.0 * level(time) - if within < slow { 90.0 } else { 0.0 }
        };
        let mut log = Dataset::new("log.csv", "", time.clone()).expect("time rises");
        log.insert("command_1", time.iter().map(level).collect()).expect("fits");
        log.insert("propeller_rate_1_rad_s", time.iter().map(rate).collect()).expect("fits");
        ScreenedLog::from(log).rotor(1).expect("a rotor").data().clone()
    }

    #[test]
    fn levels_of_three_seconds_give_a_curve_where_they_are_asked_for() {
        let rotor = [levels(3.0, 1.4)];
        assert!(steady_rows(&rotor, 0.0, 12.6, false).is_none());
        let rows = steady_rows(&rotor, 0.0, 12.6, true).expect("a curve");
        // Of each level the second half, in which it has settled.
        assert!((6 * 72..=6 * 76).contains(&rows.command.len()), "{}", rows.command.len());
        let pairs = rows.command.iter().zip(&rows.corrected_rate);
        assert!(pairs.clone().all(|(command, rate)| (rate - 1000.0 * command).abs() < 1e-6));
        assert!(!rows.from_ramps);
        assert!(steady_rows(&[levels(1.5, 0.5)], 0.0, 12.6, true).is_none(), "too short to have settled");
    }
}
